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
#include "daemon/journal/database/origin.h"
#include "daemon/journal/database/outbox_rows.h"
#include "daemon/journal/database/records.h"
#include "daemon/journal/store/error.h"
#include "daemon/session/action.h"
#include "daemon/session/evidence.h"
#include "daemon/session/interruption.h"
#include "daemon/session/phase_times.h"

namespace cellcal::daemon {

/// What may be dropped of old sessions: raw events and readings, nothing else. None set: nothing.
struct RetentionLimits {
  std::string ended_before;             ///< ISO 8601 UTC, empty: whatever their age
  std::optional<std::int64_t> bytes{};  ///< the oldest go until what is in use is not more
};
/// What was dropped of a session, or would be.
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

  /// What is to be said of the file though it was taken.
  const std::vector<std::string>& remarks() const;
  /// The file and those that belong to it. None of them is anybody's input.
  std::vector<std::filesystem::path> files() const;
  /// Throws JournalError where the files that are written to are no longer those that others see.
  void check();

  std::int64_t begin(const SessionInputs& inputs, const std::string& utc);
  /// Makes an unfinished session the running one again.
  void resume(std::int64_t session, const std::string& utc);
  void record(std::int64_t session, const RecordPlan& plan);
  void record(std::int64_t session, const RecordReading& reading);
  void record(std::int64_t session, const RecordTouch& touch);
  void record(std::int64_t session, const RecordSearch& search, const std::string& utc);
  /// `also`: what others are told with it, in the same transaction.
  void record(std::int64_t session, const RecordEnd& end, const std::string& utc,
              const std::vector<Report>& also = {});
  void store_calibration(std::int64_t session, const std::string& json,
                         const std::optional<Compared>& compared = {});
  // Written with the next row of this journal. Never wait for the disk.
  void note(std::int64_t session, const std::string& utc, const std::string& words);
  void note(std::int64_t session, const RecordChange& change);
  void note(std::int64_t session, const RecordContact& contact);
  void note(std::int64_t session, const RecordCause& cause);
  /// For those who are told of that touch, where it is the newest: they are told of it with this, or when the next one
  /// or the session's end is recorded.
  void note(std::int64_t session, const AssessedTouch& touch);

  // What is read of one session was compared with its checksums; DamagedError where it is not what
  // was written, JournalError where the disk does not give it now.

  /// All rows of this session are as they were written; found out once, until it is written to.
  bool is_whole(std::int64_t session);
  /// Newest first, without the texts of the inputs and the calibration. Damaged: by the session's own row, and by the others
  /// where is_whole() or a reader has looked at them. Can be called off (calib/model/long_work.h).
  std::vector<SessionRecord> sessions();
  /// Of these so many at most, from the newest whose number is less than `before`; looks at no others.
  std::vector<SessionRecord> sessions(std::int64_t before, std::size_t most);
  /// Of a calibration that is done: whether it was published; nothing of all else. Not compared with its checksums.
  std::optional<bool> was_published(std::int64_t session);
  /// Of a session that is damaged: whether its calibration may have been published, for all that its own row still says.
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

  // Which calibration is used (activations.cc).

  /// On disk when it returns; never changed. What may be activated is not this room's to say.
  void activate(const Activation& activation);
  /// Oldest first, without those that are not as they were written.
  std::vector<Activation> activations();
  /// Place of the last change of a session's own row (its end, where it has ended) among all that was ever
  /// written: tells what was later, whatever the clocks said. 0: there is no such session.
  std::int64_t last_entry(std::int64_t session);

  // What the schedule keeps (activations.cc): daemon/schedule says what.

  /// On disk when it returns.
  void store_schedule(const std::string& state);
  /// As stored last; empty: never. Throws DamagedError where it is not what was stored.
  std::string schedule();

  // Outbox (outbox.cc): what others are told. Nothing is written while nobody is.

  /// From now on; null: nobody. A session that is found interrupted is told of at once, and once. Throws JournalError,
  /// and then the one before is told as before.
  void report_to(std::shared_ptr<const Reporter> reporter);
  /// Nobody from now on, unless another has taken its place.
  void report_no_more_to(const Reporter& reporter);
  /// A fact that no row of this journal stands for. On disk when it returns.
  void report(std::int64_t session, const Report& report);
  /// The oldest behind this row, in small bites; up to a touch that is not assessed yet.
  std::vector<WaitingReport> waiting(std::int64_t after, std::size_t most);
  /// Somebody has them: they are not told again.
  void acknowledge(const std::vector<std::int64_t>& rows);
  /// Nobody will ever take that row: this result is told in its place, under its number.
  void replace(std::int64_t row, const Report& report);
  OutboxCount outbox();

  // Archives and copies.

  /// What tells this journal from all others.
  std::string name();
  /// A session's rows with their checksums, as JSON lines (rows.h). Pending ones first.
  std::string rows(std::int64_t session);
  /// Such rows as a session of this journal; its number, and whether it is new: the same rows come
  /// in once. Throws JournalError, which names `from` and the line, where they are damaged or
  /// altered, are not those that this journal knows of the session, or hold other than the stated touches.
  std::pair<std::int64_t, bool> import(const std::string& rows, const std::string& from,
                                       std::optional<std::size_t> stated_touches = {});
  /// A copy of the whole journal as it is at one moment, looked through before it gets its name.
  /// Sessions go on meanwhile, each of their calls waiting for a few pages at most. Returns what is
  /// to be said. Throws JournalError where the file is there already or cannot be written.
  std::vector<std::string> backup(const std::filesystem::path& file);

  // Retention (retention.cc).

  /// Drops the raw events and readings of old sessions, oldest first, each session's in one transaction; their
  /// entries stay in the chain. Never of the newest, the running or a resumable one. With `dry_run` only says which. Asks
  /// before each whether to go on.
  std::vector<DroppedRows> retain(const RetentionLimits& limits, const std::string& utc,
                                  bool dry_run, const std::function<bool()>& go_on = {});
  /// Of the file's pages, those that hold something.
  std::int64_t bytes_in_use();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::daemon
