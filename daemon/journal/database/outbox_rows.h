#pragma once
// The outbox's tables. All calls but committed() and rolled_back() that write are within a transaction.

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "daemon/journal/database/records.h"
#include "daemon/journal/store/sqlite.h"
#include "daemon/session/action.h"
#include "daemon/session/evidence.h"

namespace cellcal::daemon {

// What a journal tells others of its facts: rows that wait until somebody has acknowledged them, each written in
// the transaction of the fact that it reports. What stands in them is the reporter's to say.

/// Telemetry may be dropped where there is no room; results never are.
enum class Worth { kResult, kTelemetry };

struct Report {
  std::string kind;
  Worth worth = Worth::kResult;
  /// Empty: composed by Reporter::calibration() when it is read, so that a calibration is not on disk twice.
  std::string body;
};

/// From a fact to what is told of it. Called with the journal's lock held: waits for nobody. What it throws costs
/// the report, never the fact.
class Reporter {
 public:
  virtual ~Reporter() = default;
  /// It began, goes on, was found interrupted, or ended. Without texts.
  virtual std::vector<Report> session(const SessionRecord& session) const = 0;
  /// Of the text in `calibration`; `touches`: the session's.
  virtual Report calibration(const SessionRecord& session,
                             const std::vector<calib::Touch>& touches) const = 0;
  virtual std::vector<Report> touch(const RecordTouch& touch) const = 0;
  virtual std::vector<Report> change(const RecordChange& change) const = 0;
  virtual std::vector<Report> activation(const Activation& activation) const = 0;
  /// So many numbers from `first` to `last` are gone.
  virtual Report dropped(std::int64_t first, std::int64_t last, std::int64_t count) const = 0;
  /// Under which name this journal speaks; empty: none. From another one on numbers begin anew under another source.
  virtual std::string address() const { return {}; }
  /// Whether what was written under that name is told now; what is not waits.
  virtual bool tells_of(const std::string& /*address*/) const { return true; }
  /// Of what waits; beyond that the oldest telemetry goes.
  virtual std::int64_t most_bytes() const = 0;
  /// Something new waits.
  virtual void waits() const {}
};

struct WaitingReport {
  std::int64_t row = 0;     ///< for Journal::acknowledge()
  std::string source;       ///< whose numbers these are
  std::int64_t number = 0;  ///< counts up by one, never used twice under this source
  std::int64_t session = 0;
  std::string time;
  Report report;
};

/// What was found of a touch that is on disk.
struct AssessedTouch {
  std::size_t index = 0;
  double residual_m = 0.0;
};

struct OutboxCount {
  std::string source;       ///< of the next
  std::int64_t newest = 0;  ///< number under that source; 0: none yet
  std::int64_t rows = 0, bytes = 0, telemetry_bytes = 0;
  /// Since the journal was opened: dropped, and not begun because results alone fill it.
  std::int64_t dropped = 0, not_begun = 0;
  std::string oldest;  ///< time of the oldest that waits, ISO 8601 UTC; empty: none
  /// Of what waits: written under another name, which nobody is told of now.
  std::int64_t elsewhere = 0;
  std::string elsewhere_address;  ///< of these the oldest
};

/// From the next fact on numbers count from 1 under a new name: nobody knows whether this file is the only one that
/// goes on from here. What waits keeps its name and number; telemetry that waits is left out.
void begin_source(Database& database);

class OutboxRows {
 public:
  explicit OutboxRows(Database& database);

  void use(std::shared_ptr<const Reporter> reporter) {
    reporter_ = on_disk_reporter_ = std::move(reporter);
  }
  /// Within a transaction: the one before is back where that is rolled back.
  void use_from_commit(std::shared_ptr<const Reporter> reporter) {
    reporter_ = std::move(reporter);
  }
  /// Whether speak_as() has something to write.
  bool is_other(const std::string& address);
  /// From now on; numbers begin anew where the newest ones were reported under another name.
  void speak_as(const std::string& address);
  bool on() const { return reporter_ != nullptr; }
  const Reporter& reporter() const { return *reporter_; }

  /// Nothing where nothing is reported. `time` empty: now.
  void put(std::int64_t session, const std::string& time,
           const std::function<std::vector<Report>(const Reporter&)>& say);
  /// It waits until it is assessed, at the latest for the next one. Whoever gives its tip will say that, too; who does not
  /// has nothing more to say of it.
  void put_touch(std::int64_t session, const RecordTouch& touch);
  void assess(std::int64_t session, const AssessedTouch& touch);
  /// What waits for that waits no longer.
  void close_touch() { open_ = {}; }
  void replace(std::int64_t row, const Report& report);
  /// `record`: with the calibration that is about to be replaced.
  void compose(const SessionRecord& record,
               const std::function<std::vector<calib::Touch>()>& touches);
  /// A session that ended with its daemon, once for each entry of the chain that says it runs.
  bool was_reported_interrupted(std::int64_t entry);
  void mark_reported_interrupted(std::int64_t entry);
  void acknowledge(const std::vector<std::int64_t>& rows);
  /// All telemetry goes, and none is taken until committed() or rolled_back().
  void give_telemetry_up();

  void committed();
  void rolled_back();

  std::vector<WaitingReport> waiting(std::int64_t after, std::size_t most);
  const OutboxCount& count() const { return now_; }
  /// With what only the tables know.
  OutboxCount look();

 private:
  void add(std::int64_t session, const std::string& time, const Report& report);
  void drop(std::int64_t bytes);
  bool make_room(const Report& report, std::int64_t bytes);
  void take_source();
  void rewrite(std::int64_t row, const Report& report);
  /// "first IN (...)" of the sources that are, or are not, reported.
  std::string sources_reported(bool reported);

  /// The newest touch, while nobody has said how far off it is. After a restart nobody will.
  struct OpenTouch {
    std::int64_t row = 0;  ///< 0: none
    std::int64_t session = 0;
    RecordTouch touch;
  };

  Database& database_;
  std::shared_ptr<const Reporter> reporter_, on_disk_reporter_;
  std::int64_t first_ = 1, first_on_disk_ = 1;  ///< row of number 1 of the newest source
  OutboxCount now_, on_disk_;
  OpenTouch open_, open_on_disk_;
  bool only_results_ = false, added_ = false;
};

}  // namespace cellcal::daemon
