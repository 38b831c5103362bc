#pragma once
// Thread that evaluates the schedule every few seconds, and immediately after events.

#include <condition_variable>
#include <mutex>
#include <stop_token>
#include <thread>

#include "daemon/unattended/schedule.h"

namespace cellcal::daemon {

class ScheduleThread {
 public:
  explicit ScheduleThread(Schedule& schedule);
  /// Signals an event. Does not block.
  void poke();
  /// Returns when no pass is in progress and none will follow.
  void stop();

 private:
  std::mutex mutex_;
  std::condition_variable_any asked_;
  bool pending_ = false;
  std::jthread thread_;
};

}  // namespace cellcal::daemon
