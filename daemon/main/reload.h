#pragma once
// The configuration while the daemon runs: what of a changed file comes into force, and when.

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
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

  /// What a session that begins now begins with. Any thread.
  std::shared_ptr<const DaemonConfig> now() const;

  /// Reads again. What cannot change under a running daemon stays as it is, and is returned, as
  /// `socket = "/run/..."`, or "[http] as it was". Throws what the reading throws, and then nothing has changed.
  std::vector<std::string> reload();

 private:
  mutable std::mutex mutex_;
  std::shared_ptr<const DaemonConfig> now_;
  std::function<DaemonConfig()> read_;
};

/// A thread that acts each time it is asked: whoever asks waits for no disk.
class OnRequest {
 public:
  explicit OnRequest(std::function<void()> act);
  void ask();

 private:
  std::mutex mutex_;
  std::condition_variable_any asked_;
  bool pending_ = false;
  std::jthread thread_;
};

}  // namespace cellcal::daemon
