#include "daemon/main/reload.h"

#include <utility>

namespace cellcal::daemon {

namespace {

/// Keeps `was` where the file has another value, and records that.
void keep(const char* key, const std::filesystem::path& was, std::filesystem::path& now,
          std::vector<std::string>& kept) {
  if (now == was) return;
  now = was;
  kept.push_back(std::string(key) + " = \"" + was.string() + "\"");
}

}  // namespace

std::shared_ptr<const DaemonConfig> LiveConfig::now() const {
  const std::lock_guard lock(mutex_);
  return now_;
}

std::vector<std::string> LiveConfig::reload() {
  DaemonConfig next = read_();
  std::vector<std::string> kept;
  const std::shared_ptr<const DaemonConfig> was = now();
  keep("state_dir", was->state_dir, next.state_dir, kept);
  keep("socket", was->socket, next.socket, kept);
  if (next.http != was->http) {
    next.http = was->http;
    kept.push_back(was->http ? "[http] as it was" : "without [http]");
  }
  const std::lock_guard lock(mutex_);
  now_ = std::make_shared<const DaemonConfig>(std::move(next));
  return kept;
}

OnRequest::OnRequest(std::function<void()> act)
    : thread_([this, act = std::move(act)](const std::stop_token& stop) {
        std::unique_lock lock(mutex_);
        while (asked_.wait(lock, stop, [this] { return pending_; })) {
          pending_ = false;
          lock.unlock();
          act();
          lock.lock();
        }
      }) {}

void OnRequest::ask() {
  const std::lock_guard lock(mutex_);
  pending_ = true;
  asked_.notify_all();
}

}  // namespace cellcal::daemon
