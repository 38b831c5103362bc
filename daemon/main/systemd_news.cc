#include "daemon/main/systemd_news.h"

#include <systemd/sd-daemon.h>

#include <utility>

namespace cellcal::daemon {

void SystemdNews::tell(std::string status) {
  {
    const std::lock_guard lock(mutex_);
    status_ = std::move(status);
  }
  thread_.ask();
}

void SystemdNews::alive() {
  {
    const std::lock_guard lock(mutex_);
    alive_ = true;
  }
  thread_.ask();
}

void SystemdNews::stopping() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  thread_.ask();
}

void SystemdNews::send() {
  std::unique_lock lock(mutex_);
  const std::string status = std::exchange(status_, "");
  const bool alive = std::exchange(alive_, false), stopping = std::exchange(stopping_, false);
  lock.unlock();
  if (stopping) sd_notify(0, "STOPPING=1");
  if (alive) sd_notify(0, "WATCHDOG=1");
  if (!status.empty()) sd_notify(0, status.c_str());
}

}  // namespace cellcal::daemon
