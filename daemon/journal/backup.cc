// A copy of the whole journal while it is written to.

#include <fmt/format.h>

#include <thread>

#include "daemon/journal/database/database_copy.h"
#include "daemon/journal/journal_impl.h"

namespace cellcal::daemon {

namespace {

/// A quarter of a megabyte: half a millisecond.
constexpr int kPagesAtOnce = 64;
/// For the calls that wait; a lock that is taken again at once gives them no turn.
constexpr std::chrono::milliseconds kPause{1};

}  // namespace

std::vector<std::string> Journal::backup(const std::filesystem::path& file) {
  const std::lock_guard one(impl_->one_backup);  // two of one name would write into each other
  std::unique_lock lock(impl_->mutex);
  DatabaseCopy copy(impl_->database, file);
  Head end = impl_->chain.end();
  while (copy.step(kPagesAtOnce)) {
    lock.unlock();
    std::this_thread::sleep_for(kPause);
    lock.lock();
    end = impl_->chain.end();
  }
  lock.unlock();
  copy.speak_as_another();
  std::vector<std::string> remarks;
  for (const std::int64_t session : copy.look_through(end)) {
    remarks.push_back(
        fmt::format("session {} is damaged in the journal, and so it is in the copy", session));
  }
  copy.publish();
  return remarks;
}

}  // namespace cellcal::daemon
