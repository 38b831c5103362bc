#include "daemon/main/systemd_notifier.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string_view>
#include <utility>

#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

constexpr std::chrono::milliseconds kAgain{100};

/// As sd_notify(3), but non-blocking. False: the receiver's queue is full.
bool notify(std::string_view words) {
  const char* path = std::getenv("NOTIFY_SOCKET");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path == nullptr || (path[0] != '/' && path[0] != '@') ||
      std::strlen(path) >= sizeof address.sun_path)
    return true;
  std::memcpy(address.sun_path, path, std::strlen(path));
  if (path[0] == '@') address.sun_path[0] = '\0';
  const int descriptor = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  if (descriptor < 0) return false;
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + std::strlen(path));
  const ssize_t sent = ::sendto(descriptor, words.data(), words.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                                reinterpret_cast<const sockaddr*>(&address), size);
  const bool full = sent < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == ENOBUFS);
  ::close(descriptor);
  return !full;
}

}  // namespace

SystemdNotifier::SystemdNotifier() : thread_([this](const std::stop_token& stop) { send(stop); }) {}

void SystemdNotifier::report(std::string status) {
  const std::lock_guard lock(mutex_);
  status_ = std::move(status);
  news_.notify_all();
}

void SystemdNotifier::alive() {
  const std::lock_guard lock(mutex_);
  alive_ = true;
  news_.notify_all();
}

void SystemdNotifier::stopping() {
  const std::lock_guard lock(mutex_);
  stopping_ = true;
  news_.notify_all();
}

void SystemdNotifier::send(const std::stop_token& stop) {
  std::unique_lock lock(mutex_);
  const auto waits = [this] { return stopping_ || alive_ || !status_.empty(); };
  while (news_.wait(lock, stop, waits)) {
    if (stopping_ && notify("STOPPING=1")) stopping_ = false;
    if (alive_ && notify("WATCHDOG=1")) alive_ = false;
    if (!status_.empty() && notify(status_)) status_.clear();
    if (!waits()) continue;
    news_.wait_for(lock, stop, kAgain, [] { return false; });
    if (stop.stop_requested()) return;
  }
}

std::string notification_of(const Status& status) {
  std::string words = to_string(status.phase);
  if (status.total > 0) {
    words += ", touch " + std::to_string(status.done) + " of " + std::to_string(status.total);
  }
  if (status.failure) words += ", " + describe(*status.failure);
  return "STATUS=" + printable(words);
}

}  // namespace cellcal::daemon
