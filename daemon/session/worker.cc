#include "daemon/session/worker.h"

#include <pthread.h>
#include <sched.h>

#include <utility>

namespace cellcal::daemon {

namespace {

void stand_back() {
  // Linux never refuses SCHED_IDLE to a thread of normal priority; elsewhere the job is done at
  // normal priority, which is slower for others and wrong for nobody.
  sched_param lowest{};
  pthread_setschedparam(pthread_self(), SCHED_IDLE, &lowest);
}

}  // namespace

ThreadWorker::ThreadWorker(Priority priority)
    : thread_([this, priority] {
        if (priority == Priority::kLowest) stand_back();
        run();
      }) {}

ThreadWorker::~ThreadWorker() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void ThreadWorker::post(std::function<void()> job) {
  {
    const std::lock_guard lock(mutex_);
    jobs_.push_back(std::move(job));
  }
  wake_.notify_one();
}

void ThreadWorker::run() {
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [this] { return ending_ || !jobs_.empty(); });
    if (ending_) return;
    const std::function<void()> job = std::move(jobs_.front());
    jobs_.pop_front();
    lock.unlock();
    job();
    lock.lock();
  }
}

}  // namespace cellcal::daemon
