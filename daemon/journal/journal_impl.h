#pragma once
// Private implementation of Journal.

#include <atomic>
#include <functional>
#include <mutex>

#include "daemon/journal/chain.h"
#include "daemon/journal/journal.h"
#include "daemon/journal/outbox_rows.h"
#include "daemon/journal/store/sqlite.h"
#include "daemon/journal/store/store_files.h"

namespace cellcal::daemon {

struct Journal::Impl {
  explicit Impl(const std::filesystem::path& path);

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
  void report(const Activation& activation) {
    outbox.put(activation.session, activation.time,
               [&](const Reporter& to) { return to.activation(activation); });
  }
  void report_calibration(std::int64_t session, const std::string& utc);
  /// Reports the newest own session, as interrupted where it is.
  void report_newest();
  /// Reports what a new source begins with, in the order of the chain.
  void report_state(Journal& journal);

  /// As Journal::sessions().
  std::vector<SessionRecord> sessions();
  /// Verifies the session, and visits the rows of a statement whose parameter it is.
  void read(std::int64_t session, const char* sql, const std::function<void(Statement&)>& each_row);
  /// Visits sessions with a number below `before`, newest first, until `visit` returns true.
  void visit_sessions(std::int64_t before, const std::function<bool(SessionRecord)>& visit);
  /// The stored row; nullopt if missing.
  std::optional<SessionRecord> as_stored(std::int64_t session, bool with_texts);
  /// The newest session that was not imported.
  std::optional<SessionRecord> newest_own();
  void changed(std::int64_t session) { chain.add(session, "session", session); }
  void set_state(std::int64_t session, RecordState state, std::string_view ended,
                 std::string_view failure);
  /// Sets kInterrupted if the session is not running in this process, and kDamaged if its row was
  /// changed.
  void judge(SessionRecord& record);

  /// Held during disk access; a Reporter may read the journal meanwhile.
  std::recursive_mutex mutex;
  std::mutex one_backup;
  LockFile lock;
  HeadFile head;
  Database database;
  Chain chain;
  std::vector<std::string> remarks;
  OutboxRows outbox;
  FileWatch files;
  PendingRows pending;
  std::atomic<std::int64_t> running{0};
};

}  // namespace cellcal::daemon
