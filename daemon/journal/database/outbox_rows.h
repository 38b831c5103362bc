#pragma once
// The outbox's tables. All calls but committed() and rolled_back() that write are within a transaction.

#include <functional>
#include <memory>

#include "daemon/journal/database/outbox.h"
#include "daemon/journal/store/sqlite.h"

namespace cellcal::daemon {

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
