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

OnRequest::OnRequest(std::function<void()> act, std::optional<std::chrono::seconds> period)
    : pending_(period.has_value()),
      thread_([this, period, act = std::move(act)](const std::stop_token& stop) {
        const auto asked = [this] { return pending_; };
        for (std::unique_lock lock(mutex_);; lock.lock()) {
          if (period)
            asked_.wait_for(lock, stop, *period, asked);
          else
            asked_.wait(lock, stop, asked);
          if (stop.stop_requested()) return;
          pending_ = false;
          lock.unlock();
          act();
        }
      }) {}

void OnRequest::ask() {
  const std::lock_guard lock(mutex_);
  pending_ = true;
  asked_.notify_all();
}

void OnRequest::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

}  // namespace cellcal::daemon
