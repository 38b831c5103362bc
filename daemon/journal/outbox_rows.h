#pragma once
// Tables of the outbox. Writing functions other than committed() and rolled_back() need a
// transaction.

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <variant>
#include <vector>

#include "daemon/journal/chain.h"
#include "daemon/journal/records.h"
#include "daemon/journal/store/sqlite.h"
#include "daemon/session/action.h"

namespace cellcal::daemon {

// Reports of a journal's facts: rows that wait for acknowledgement, written in the transaction of
// the fact. The reporter defines their content.

/// Telemetry may be dropped for lack of space; results never are.
enum class Worth { kResult, kTelemetry };

struct Report {
  std::string kind;
  Worth worth = Worth::kResult;
  /// Empty: a calibration, composed of the session's on reading, so that it is stored only once.
  std::string body;
};

class Journal;

/// Converts facts to reports. Called with the journal's lock held, so it must not block. An
/// exception discards the report, never the fact.
class Reporter {
 public:
  virtual ~Reporter() = default;
  /// A session began, was resumed, was found interrupted, or ended.
  virtual std::vector<Report> session(const SessionRecord& session) const = 0;
  virtual std::vector<Report> touch(const RecordTouch& touch) const = 0;
  virtual std::vector<Report> change(const RecordChange& change) const = 0;
  virtual std::vector<Report> activation(const Activation& activation) const = 0;
  /// Session whose calibration is in use; 0: none. May read the journal. Throws JournalError.
  virtual std::int64_t in_use(Journal& /*journal*/) const { return 0; }
  /// Name under which this journal reports; empty: none. A changed name starts a new source, numbered from 1, with the
  /// calibration in use and the newest session as its first facts.
  virtual std::string address() const { return {}; }
  /// True if rows written under that name are reported now; other rows wait.
  virtual bool publishes_name(const std::string& /*address*/) const { return true; }
  /// Bound of the waiting rows; above it the oldest telemetry is dropped.
  virtual std::int64_t most_bytes() const = 0;
  /// Called when new reports are waiting.
  virtual void waits() const {}
};

struct WaitingReport {
  std::int64_t row = 0;     ///< for Journal::acknowledge()
  std::string source;       ///< name under which it is numbered
  std::int64_t number = 0;  ///< consecutive, never reused under this source
  std::int64_t session = 0;
  std::string time;
  Report report;
};

/// Residual of a recorded touch.
struct AssessedTouch {
  std::size_t index = 0;
  double residual_m = 0.0;
};

struct OutboxCount {
  std::string source;       ///< of the next report
  std::int64_t newest = 0;  ///< number under that source; 0: none yet
  std::int64_t rows = 0, bytes = 0, telemetry_bytes = 0;
  /// Since the journal was opened: dropped, and not queued because results alone fill the outbox.
  std::int64_t dropped = 0, not_begun = 0;
  std::string oldest;  ///< time of the oldest waiting one, ISO 8601 UTC; empty: none
  /// Waiting rows written under another name, which are not reported now.
  std::int64_t elsewhere = 0;
  std::string elsewhere_address;  ///< the oldest of these names
};

/// Starts a new source, numbered from 1, because another copy of this file may continue as well.
/// Waiting results keep their source and number; waiting telemetry is dropped, and reported so.
void begin_source(Database& database);

class OutboxRows {
 public:
  explicit OutboxRows(Database& database);

  void use(std::shared_ptr<const Reporter> reporter) {
    reporter_ = on_disk_reporter_ = std::move(reporter);
  }
  /// Within a transaction: a rollback restores the previous reporter.
  void use_from_commit(std::shared_ptr<const Reporter> reporter) {
    reporter_ = std::move(reporter);
  }
  /// True if speak_as() would write.
  bool is_other(const std::string& address);
  /// Sets the name for new reports; numbers restart if the newest ones were reported under another.
  void speak_as(const std::string& address);
  bool on() const { return reporter_ != nullptr; }
  const Reporter& reporter() const { return *reporter_; }

  /// Adds the reports of a fact, if there is a reporter. `time` empty: now.
  void put(std::int64_t session, const std::string& time,
           const std::function<std::vector<Report>(const Reporter&)>& say);
  /// Holds the report of a touch with a tip until it is assessed, at the latest until the next
  /// touch. A touch without a tip is reported immediately.
  void put_touch(std::int64_t session, const RecordTouch& touch);
  void assess(std::int64_t session, const AssessedTouch& touch);
  /// Releases a report held by put_touch().
  void close_touch() { open_ = {}; }
  void replace(std::int64_t row, const Report& report);
  /// Interruption of a session, identified by the chain entry of its 'running' row.
  bool was_reported_interrupted(std::int64_t entry);
  void mark_reported_interrupted(std::int64_t entry);
  void acknowledge(const std::vector<std::int64_t>& rows);
  /// Drops all telemetry, and accepts none until committed() or rolled_back().
  void drop_telemetry();

  void committed();
  void rolled_back();

  std::vector<WaitingReport> waiting(std::int64_t after, std::size_t most);
  const OutboxCount& count() const { return now_; }
  /// Counts that require reading the tables.
  OutboxCount read_count();

 private:
  void add(std::int64_t session, const std::string& time, const Report& report);
  void drop(std::int64_t bytes);
  bool make_room(const Report& report, std::int64_t bytes);
  void assign_source();
  void rewrite(std::int64_t row, const Report& report);
  /// "first IN (...)" of the sources that are, or are not, reported.
  std::string sources_reported(bool reported);

  /// The newest touch until it is assessed. Not kept over a restart.
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

// Rows that are written with the next transaction: log, changes of phase, sensor events, and a session's end, which so
// is written as soon as a full disk has room again. Adding one does not wait for the disk.

struct Words {
  std::string utc, words;
};

struct SessionEnd {
  RecordState state = RecordState::kFailed;
  std::string utc, failure;
  std::optional<std::string> outcome, document;  ///< JSON
  std::optional<FailureKind> failed;
  std::vector<Report> also;
};

struct PendingRow {
  std::int64_t session = 0;
  std::variant<Words, RecordChange, RecordContact, RecordCause, AssessedTouch, SessionEnd> what;
};

class PendingRows {
 public:
  void take(PendingRow row) {
    const std::lock_guard lock(mutex_);
    rows_.push_back(std::move(row));
  }
  std::vector<PendingRow> all() const {
    const std::lock_guard lock(mutex_);
    return rows_;
  }
  /// The session's rows of one kind, oldest first.
  template <class Row, class Visit>
  void visit(std::int64_t session, Visit each) const {
    for (const PendingRow& one : all())
      if (const auto* row = std::get_if<Row>(&one.what); row != nullptr && one.session == session)
        each(*row);
  }
  /// The first ones are on disk.
  void written(std::size_t count) {
    const std::lock_guard lock(mutex_);
    rows_.erase(rows_.begin(), rows_.begin() + static_cast<std::ptrdiff_t>(count));
  }

 private:
  mutable std::mutex mutex_;  ///< never held while the disk is waited for
  std::vector<PendingRow> rows_;
};

/// Within a transaction.
void insert(Chain& chain, const PendingRow& row);

}  // namespace cellcal::daemon
