#include "daemon/unattended/schedule_thread.h"

#include <spdlog/spdlog.h>

#include <exception>

namespace cellcal::daemon {

namespace {

constexpr std::chrono::seconds kPeriod{5};

}  // namespace

ScheduleThread::ScheduleThread(Schedule& schedule)
    : thread_([this, &schedule](const std::stop_token& stop) {
        while (!stop.stop_requested()) {
          try {
            schedule.look();
          } catch (const std::exception& failed) {
            spdlog::error("schedule: {}", failed.what());
          }
          std::unique_lock lock(mutex_);
          asked_.wait_for(lock, stop, kPeriod, [this] { return pending_; });
          pending_ = false;
        }
      }) {}

void ScheduleThread::poke() {
  const std::lock_guard lock(mutex_);
  pending_ = true;
  asked_.notify_all();
}

void ScheduleThread::stop() {
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

}  // namespace cellcal::daemon
