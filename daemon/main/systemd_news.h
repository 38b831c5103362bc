#pragma once
// What systemd is told: where it does not read, nobody waits for it, least of all who stops the arm. What did not go is tried
// again every so often, the newest of each kind, by a thread of its own that does nothing else.

#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>

#include "daemon/service/status.h"

namespace cellcal::daemon {

class SystemdNews {
 public:
  SystemdNews();

  // Any thread; for no time.
  /// "STATUS=touching, touch 3 of 8"; of several that wait the newest.
  void tell(std::string status);
  /// The threads that hold the arm are alive.
  void alive();
  void stopping();

 private:
  void send(const std::stop_token& stop);

  std::mutex mutex_;
  std::condition_variable_any news_;
  std::string status_;  ///< empty: told
  bool alive_ = false, stopping_ = false;
  std::jthread thread_;
};

/// What systemd shows of a session: one assignment on one line, whatever a device's words hold.
std::string notification_of(const Status& status);

}  // namespace cellcal::daemon
