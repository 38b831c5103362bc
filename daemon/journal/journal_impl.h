#pragma once
// What a journal is made of. For the .cc files of this room that do its work.

#include <atomic>
#include <functional>
#include <mutex>

#include "daemon/journal/database/chain.h"
#include "daemon/journal/database/outbox_rows.h"
#include "daemon/journal/journal.h"
#include "daemon/journal/pending_rows.h"
#include "daemon/journal/store/head_file.h"
#include "daemon/journal/store/lock_file.h"
#include "daemon/journal/store/sqlite.h"

namespace cellcal::daemon {

struct Journal::Impl {
  explicit Impl(const std::filesystem::path& path);

  static std::vector<std::filesystem::path> all(const std::filesystem::path& path);

  /// One transaction: what is pending, then what `act` writes. On disk, in the files that others
  /// see, when it returns.
  void write(const std::function<void()>& act);
  void write_once(const std::vector<PendingRow>& waiting, const std::function<void()>& act);
  /// Within a transaction: what is to be told of this session as it stands there now.
  void report_session(std::int64_t session, const std::string& utc,
                      std::optional<FailureKind> failed = {});
  std::vector<calib::Touch> touches(std::int64_t session);
  /// As Journal::sessions().
  std::vector<SessionRecord> sessions();
  /// As sessions(), from the newest below `before` on, until one is enough (`visit` says true): no other one is looked at.
  void look_for(std::int64_t before, const std::function<bool(SessionRecord)>& visit);
  /// The row as it stands, not judged; none without one.
  std::optional<SessionRecord> as_stored(std::int64_t session, bool with_texts);
  /// The newest that was not imported.
  std::optional<SessionRecord> newest_own();
  /// The row that was inserted last.
  void added(std::int64_t session, const char* table) {
    chain.add(session, table, database.last_row_id());
  }
  void changed(std::int64_t session) { chain.add(session, "session", session); }
  void set_state(std::int64_t session, RecordState state, std::string_view ended,
                 std::string_view failure);
  /// What the state means now: a session that nobody runs any more does not run, whether or not
  /// its end could be recorded.
  void judge(SessionRecord& record);

  std::mutex mutex;  ///< held while the disk is waited for
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
