#pragma once
// Notifications to systemd that never block, in particular not the thread that stops the arm. Undelivered
// ones are repeated periodically, the newest of each kind, by a thread of their own.

#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "daemon/service/status.h"

namespace cellcal::daemon {

class SystemdNotifier {
 public:
  SystemdNotifier();

  // Thread-safe; do not block.
  /// "STATUS=touching, touch 3 of 8"; replaces a pending one.
  void report(std::string status);
  /// Watchdog: the threads that hold the arm are alive.
  void alive();
  void stopping();

 private:
  void send(const std::stop_token& stop);

  std::mutex mutex_;
  std::condition_variable_any news_;
  std::string status_;  ///< empty: delivered
  bool alive_ = false, stopping_ = false;
  std::jthread thread_;
};

/// Status of a session for systemd: one assignment on one line, whatever text a device supplies.
std::string notification_of(const Status& status);

}  // namespace cellcal::daemon
