#pragma once
// What systemd is told, on a thread of its own: where systemd does not read, nobody else waits for it, least of all who
// stops the arm.

#include <mutex>
#include <string>

#include "daemon/main/reload.h"

namespace cellcal::daemon {

class SystemdNews {
 public:
  SystemdNews() : thread_([this] { send(); }) {}

  // Any thread; for no time.
  /// "STATUS=touching, touch 3 of 8"; of several that wait the newest.
  void tell(std::string status);
  /// The threads that hold the arm are alive.
  void alive();
  void stopping();

 private:
  void send();

  std::mutex mutex_;
  std::string status_;  ///< empty: told
  bool alive_ = false, stopping_ = false;
  OnRequest thread_;
};

}  // namespace cellcal::daemon
