#pragma once
// A thread that looks every few seconds, and at once where something has happened.

#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>

#include "daemon/unattended/schedule.h"

namespace cellcal::daemon {

class ScheduleThread {
 public:
  explicit ScheduleThread(Schedule& schedule);
  /// Something has happened. Waits for nothing.
  void poke();
  /// Returns when no look is under way and none will be.
  void stop();

 private:
  std::mutex mutex_;
  std::condition_variable_any asked_;
  bool pending_ = false;
  std::jthread thread_;
};

}  // namespace cellcal::daemon
