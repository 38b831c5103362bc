#pragma once
// Configuration of the running daemon, and the changes of the file that take effect.

#include <chrono>
#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "daemon/config/config.h"

namespace cellcal::daemon {

class LiveConfig {
 public:
  LiveConfig(DaemonConfig first, std::function<DaemonConfig()> read)
      : now_(std::make_shared<const DaemonConfig>(std::move(first))), read_(std::move(read)) {}

  /// Configuration for sessions that begin now. Thread-safe.
  std::shared_ptr<const DaemonConfig> now() const;

  /// Reloads the file. Settings that cannot change at run time are kept and returned, as `socket =
  /// "/run/..."`, or "[http] as it was". Throws the errors of loading; nothing has changed then.
  std::vector<std::string> reload();

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const DaemonConfig> now_;
  std::function<DaemonConfig()> read_;
};

/// Thread that runs an action on each request, so that the requester never waits for a disk; with a period also
/// at once and after each period.
class OnRequest {
 public:
  explicit OnRequest(std::function<void()> act, std::optional<std::chrono::seconds> period = {});
  void ask();
  /// Returns when the action is not running and will not run again.
  void stop();

 private:
  std::mutex mutex_;
  std::condition_variable_any asked_;
  bool pending_;
  std::jthread thread_;
};

}  // namespace cellcal::daemon
