#pragma once
// Journal of all sessions: inputs, touches, readings, events, outcomes.

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
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

/// Limits beyond which raw events and readings of old sessions are deleted; without any, none are.
struct RetentionLimits {
  std::string ended_before;             ///< ISO 8601 UTC; empty: any age
  std::optional<std::int64_t> bytes{};  ///< maximum size in use; the oldest rows are deleted first
};
/// Deleted rows of a session, or rows that would be deleted.
struct DroppedRows {
  std::int64_t session = 0, rows = 0;
  std::int64_t bytes = 0;  ///< approximate
};

/// State of the schedule as last stored.
struct StoredSchedule {
  std::string state;    ///< empty: none
  bool newest = false;  ///< false: a later state may exist, or have existed
};

/// Search in progress, and its session.
struct LeftSearch {
  std::int64_t session = 0;
  calib::SearchUnderWay search;
};

class Journal {
 public:
  /// Opens or creates the file. Throws JournalError if another process uses it, or if it is
  /// damaged, no journal, or of another schema version.
  explicit Journal(const std::filesystem::path& path);
  ~Journal();
  Journal(const Journal&) = delete;
  Journal& operator=(const Journal&) = delete;

  /// Warnings from opening the file.
  const std::vector<std::string>& remarks() const { return remarks_; }
  /// The database and its companion files. They are refused as input of a session.
  std::vector<std::filesystem::path> files() const { return file_names(database_.name()); }
  /// Throws JournalError if the open files were removed, replaced or truncated.
  void check();

  std::int64_t begin(const SessionInputs& inputs, const std::string& utc);
  /// Sets an unfinished session to running again.
  void resume(std::int64_t session, const std::string& utc);
  void record(std::int64_t session, const RecordPlan& plan);
  void record(std::int64_t session, const RecordReading& reading);
  void record(std::int64_t session, const RecordTouch& touch);
  void record(std::int64_t session, const RecordSearch& search, const std::string& utc);
  /// `also`: further reports, written in the same transaction. A session that is done stays so.
  void record(std::int64_t session, const RecordEnd& end, const std::string& utc,
              const std::vector<Report>& also = {});
  /// Throws JournalError if the session is not running.
  void store_calibration(std::int64_t session, const std::string& json,
                         const std::optional<Compared>& compared = {});
  // Written with the next row of this journal; never wait for the disk.
  void note(std::int64_t session, const std::string& utc, const std::string& words);
  /// An assessment completes the report of the newest touch, which otherwise waits for the next touch or the
  /// session's end.
  void note(std::int64_t session,
            const std::variant<RecordChange, RecordContact, RecordCause, AssessedTouch>& row);

  // Reading one session verifies its checksums: throws DamagedError if rows were changed,
  // JournalError if the disk cannot be read.

  /// True if no row of this session was changed; the result is cached until it is written to.
  bool is_whole(std::int64_t session);
  /// Newest first, without the texts of the inputs and the calibration. Damage is reported by the
  /// session's own row, and by the others if is_whole() or a reader has verified them. Cancellable
  /// (calib/model/long_work.h).
  std::vector<SessionRecord> sessions();
  /// At most `most` sessions with a number below `before`, newest first, without reading others.
  std::vector<SessionRecord> sessions(std::int64_t before, std::size_t most);
  /// True if the session is done and published a calibration; nullopt if it has no calibration.
  /// Does not verify checksums.
  std::optional<bool> was_published(std::int64_t session);
  /// False only if a damaged session certainly published no calibration.
  bool may_be_published(std::int64_t session);
  std::optional<SessionRecord> session(std::int64_t id);
  /// The first of sessions() that was not imported, without reading later ones.
  std::optional<SessionRecord> newest_own();
  std::optional<SessionRecord> newest_resumable();
  std::vector<calib::Touch> touches(std::int64_t session);
  std::vector<std::string> events(std::int64_t session);
  /// In chronological order; empty after deletion by retention.
  std::vector<TimedChange> changes(std::int64_t session);
  /// By cause; empty after deletion by retention.
  InterruptionCounts interruptions(std::int64_t session);
  /// In chronological order.
  std::vector<RecordReading> readings(std::int64_t session);
  std::optional<Compared> compared(std::int64_t session);
  /// The newest search recorded here; nullopt if a later session has touched since. Throws
  /// DamagedError.
  std::optional<LeftSearch> search_left();

  // Calibration in use.

  /// On disk on return; never changed. The caller checks that the session may be activated.
  void activate(const Activation& activation);
  /// Oldest first, without altered ones.
  std::vector<Activation> activations();
  /// Chain entry of the last change of a session's own row (its end, if it has ended): orders events
  /// independently of clocks. 0: no such session.
  std::int64_t last_entry(std::int64_t session);

  // State of daemon/unattended/schedule.

  /// On disk on return.
  void store_schedule(const std::string& state);
  /// Not the newest in a new journal, nor in one opened without its head until the state is stored again. Throws
  /// DamagedError if it was altered.
  StoredSchedule schedule();

  // Outbox: reports to the plant. Empty without a reporter.

  /// Sets the reporter; null: none. Reports an interrupted session immediately, and once. Throws
  /// JournalError, keeping the previous reporter.
  void report_to(std::shared_ptr<const Reporter> reporter);
  /// Removes the reporter unless it was replaced.
  void report_no_more_to(const Reporter& reporter);
  /// Reports a fact without a row in this journal. On disk on return.
  void report(std::int64_t session, const Report& report);
  /// The oldest rows after `after`, limited in bytes, up to a touch that is not assessed yet.
  std::vector<WaitingReport> waiting(std::int64_t after, std::size_t most);
  /// Removes delivered rows.
  void acknowledge(const std::vector<std::int64_t>& rows);
  /// Replaces an undeliverable row by this result, with the same number.
  void replace(std::int64_t row, const Report& report);
  OutboxCount outbox();

  // Archives and copies.

  /// Unique name of this journal.
  std::string name();
  /// Rows of a session with their checksums, as JSON lines (rows.h), after writing pending rows.
  std::string rows(std::int64_t session);
  /// Imports such rows as a session. Returns its number, and true if it is new: rows are imported
  /// only once. Throws JournalError naming `from` and the line if they are damaged or altered,
  /// contradict the journal's knowledge of the session, or have another number of touches than
  /// stated.
  std::pair<std::int64_t, bool> import(const std::string& rows, const std::string& from,
                                       std::optional<std::size_t> stated_touches = {});
  /// Copies the whole journal at one instant, and verifies the copy before it receives its name.
  /// Sessions continue; each of their calls waits for a few pages at most. Returns warnings. Throws
  /// JournalError if the file exists or cannot be written.
  std::vector<std::string> backup(const std::filesystem::path& file);

  // Retention (retention.cc).

  /// Deletes raw events and readings of old sessions, oldest first, in one transaction per session;
  /// their entries remain in the chain. Excludes the newest, running and damaged sessions. With
  /// `dry_run` deletes nothing. Calls `go_on` before each session.
  std::vector<DroppedRows> retain(const RetentionLimits& limits, const std::string& utc,
                                  bool dry_run, const std::function<bool()>& go_on = {});
  /// Size of the file's used pages.
  std::int64_t bytes_in_use();

 private:
  static std::vector<std::filesystem::path> file_names(const std::filesystem::path& path);

  /// Writes pending rows and then `act` in one transaction. On disk on return; throws if the files
  /// were replaced.
  void write(const std::function<void()>& act);
  void write_once(const std::function<void()>& first, const std::vector<PendingRow>& waiting,
                  const std::function<void()>& act);
  void write_end(std::int64_t session, const SessionEnd& end);
  // Within a transaction.

  /// Reports the session's current row.
  void report_session(std::int64_t session, const std::string& utc,
                      std::optional<FailureKind> failed = {});
  void report(const SessionRecord& record, const std::string& utc);
  void report(const Activation& activation);
  void report_calibration(std::int64_t session, const std::string& utc);
  /// Reports the newest own session, as interrupted where it is.
  void report_newest();
  /// Reports what a new source begins with, in the order of the chain.
  void report_state();

  /// Verifies the session, and visits the rows of a statement whose parameter it is.
  void read(std::int64_t session, const char* sql, const std::function<void(Statement&)>& each_row);
  /// Visits sessions with a number below `before`, newest first, until `visit` returns true.
  void visit_sessions(std::int64_t before, const std::function<bool(SessionRecord)>& visit);
  /// The stored row; nullopt if missing.
  std::optional<SessionRecord> as_stored(std::int64_t session, bool with_texts);
  void changed(std::int64_t session) { chain_.add(session, "session", session); }
  void set_state(std::int64_t session, RecordState state, std::string_view ended,
                 std::string_view failure);
  /// Sets kInterrupted if the session is not running in this process, and kDamaged if its row was
  /// changed.
  void judge(SessionRecord& record);

  /// Held during disk access; a Reporter may read the journal meanwhile.
  std::recursive_mutex mutex_;
  std::mutex one_backup_;
  LockFile lock_;
  HeadFile head_;
  Database database_;
  Chain chain_;
  std::vector<std::string> remarks_;
  OutboxRows outbox_;
  FileWatch files_;
  PendingRows pending_;
  std::atomic<std::int64_t> running_{0};
};

}  // namespace cellcal::daemon
