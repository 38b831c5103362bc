#pragma once
// The journal of all sessions: inputs, touches, readings, what happened, how it ended.

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/touch.h"
#include "daemon/journal/chain.h"
#include "daemon/journal/outbox_rows.h"
#include "daemon/journal/records.h"
#include "daemon/journal/store/sqlite.h"
#include "daemon/session/action.h"
#include "daemon/session/interruption.h"
#include "daemon/session/phase.h"

namespace cellcal::daemon {

/// Limits above which raw events and readings of old sessions are dropped. None set: nothing is dropped.
struct RetentionLimits {
  std::string ended_before;             ///< ISO 8601 UTC, empty: whatever their age
  std::optional<std::int64_t> bytes{};  ///< the oldest go until what is in use is not more
};
/// Rows of a session that were, or would be, dropped.
struct DroppedRows {
  std::int64_t session = 0, rows = 0;
  std::int64_t bytes = 0;  ///< about
};

/// A search, and the session that made it.
struct LeftSearch {
  std::int64_t session = 0;
  calib::SearchUnderWay search;
};

class Journal {
 public:
  /// Opens or creates the file. Throws JournalError where another process has it, and where it is damaged, no journal or
  /// of another schema version.
  explicit Journal(const std::filesystem::path& path);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Warnings from opening the file.
  const std::vector<std::string>& remarks() const;
  /// The database and its companion files. They are refused as input of a session.
  std::vector<std::filesystem::path> files() const;
  /// Throws JournalError if the open files were removed, replaced or truncated.
  void check();

  std::int64_t begin(const SessionInputs& inputs, const std::string& utc);
  /// Makes an unfinished session the running one again.
  void resume(std::int64_t session, const std::string& utc);
  void record(std::int64_t session, const RecordPlan& plan);
  void record(std::int64_t session, const RecordReading& reading);
  void record(std::int64_t session, const RecordTouch& touch);
  void record(std::int64_t session, const RecordSearch& search, const std::string& utc);
  /// `also`: further reports, written in the same transaction.
  void record(std::int64_t session, const RecordEnd& end, const std::string& utc,
              const std::vector<Report>& also = {});
  void store_calibration(std::int64_t session, const std::string& json,
                         const std::optional<Compared>& compared = {});
  // Written with the next row of this journal. Never wait for the disk.
  void note(std::int64_t session, const std::string& utc, const std::string& words);
  void note(std::int64_t session, const RecordChange& change);
  void note(std::int64_t session, const RecordContact& contact);
  void note(std::int64_t session, const RecordCause& cause);
  /// Completes the report of the newest touch, which otherwise waits for the next touch or the session's
  /// end.
  void note(std::int64_t session, const AssessedTouch& touch);

  // Reading one session verifies its checksums: throws DamagedError if rows were changed,
  // JournalError if the disk cannot be read.

  /// True if no row of this session was changed; the result is cached until it is written to.
  bool is_whole(std::int64_t session);
  /// Newest first, without the texts of the inputs and the calibration. Damaged: by the session's own row, and by the others
  /// where is_whole() or a reader has looked at them. Can be called off (calib/model/long_work.h).
  std::vector<SessionRecord> sessions();
  /// At most `most` sessions with a number below `before`, newest first; reads no others.
  std::vector<SessionRecord> sessions(std::int64_t before, std::size_t most);
  /// True if the session is done and published a calibration; none if it has no calibration. Does not verify checksums.
  std::optional<bool> was_published(std::int64_t session);
  /// False only if a damaged session certainly published no calibration.
  bool may_be_published(std::int64_t session);
  std::optional<SessionRecord> session(std::int64_t id);
  /// As the first of sessions() that was not imported; looks at no later one.
  std::optional<SessionRecord> newest_own();
  std::optional<SessionRecord> newest_resumable();
  std::vector<calib::Touch> touches(std::int64_t session);
  std::vector<std::string> events(std::int64_t session);
  /// In the order in which they happened; none once retention has dropped them.
  std::vector<TimedChange> changes(std::int64_t session);
  int reading_count(std::int64_t session);
  /// By their cause; none once retention has dropped them.
  InterruptionCounts interruptions(std::int64_t session);
  /// In the order in which they were made.
  std::vector<RecordReading> readings(std::int64_t session);
  std::optional<Compared> compared(std::int64_t session);
  /// The newest search of all that was recorded here; empty where a later session has touched since.
  /// Throws DamagedError.
  std::optional<LeftSearch> search_left();

  // Calibration in use.

  /// On disk when it returns; never changed. The caller checks that the session may be activated.
  void activate(const Activation& activation);
  /// Oldest first, without those that are not as they were written.
  std::vector<Activation> activations();
  /// Chain entry of the last change of a session's own row (its end, if it has ended): orders events
  /// independently of clocks. 0: no such session.
  std::int64_t last_entry(std::int64_t session);

  // State of daemon/schedule.

  /// On disk when it returns.
  void store_schedule(const std::string& state);
  /// As stored last; empty: never. Throws DamagedError where it is not what was stored.
  std::string schedule();

  // Outbox: reports to the plant. Empty without a reporter.

  /// Sets the reporter; null: none. An interrupted session is reported at once, and once. Throws JournalError,
  /// keeping the previous reporter.
  void report_to(std::shared_ptr<const Reporter> reporter);
  /// Removes the reporter unless it was replaced.
  void report_no_more_to(const Reporter& reporter);
  /// Reports a fact without a row in this journal. On disk when it returns.
  void report(std::int64_t session, const Report& report);
  /// The oldest rows after this one, limited in bytes; up to a touch that is not assessed yet.
  std::vector<WaitingReport> waiting(std::int64_t after, std::size_t most);
  /// Removes delivered rows.
  void acknowledge(const std::vector<std::int64_t>& rows);
  /// Replaces an undeliverable row by this result, with the same number.
  void replace(std::int64_t row, const Report& report);
  OutboxCount outbox();

  // Archives and copies.

  /// Unique name of this journal.
  std::string name();
  /// A session's rows with their checksums, as JSON lines (rows.h). Pending ones first.
  std::string rows(std::int64_t session);
  /// Such rows as a session of this journal; its number, and whether it is new: the same rows come
  /// in once. Throws JournalError, which names `from` and the line, where they are damaged or
  /// altered, are not those that this journal knows of the session, or hold other than the stated touches.
  std::pair<std::int64_t, bool> import(const std::string& rows, const std::string& from,
                                       std::optional<std::size_t> stated_touches = {});
  /// Copies the whole journal at one moment and verifies the copy before it gets its name. Sessions
  /// continue; each of their calls waits for a few pages at most. Returns warnings. Throws
  /// JournalError if the file exists or cannot be written.
  std::vector<std::string> backup(const std::filesystem::path& file);

  // Retention (retention.cc).

  /// Drops the raw events and readings of old sessions, oldest first, each session's in one transaction; their
  /// entries stay in the chain. Never of the newest, a running or a damaged one. With `dry_run` drops nothing. Calls
  /// `go_on` before each session.
  std::vector<DroppedRows> retain(const RetentionLimits& limits, const std::string& utc,
                                  bool dry_run, const std::function<bool()>& go_on = {});
  /// Size of the file's used pages.
  std::int64_t bytes_in_use();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon
