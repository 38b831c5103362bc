#include "daemon/runner/worker.h"

#include <sys/resource.h>
#include <unistd.h>

#include <utility>

namespace cellcal::daemon {

namespace {

void stand_back() {
  // A third of a usual thread's share. With SCHED_IDLE, three busy loops on the computer extended a plan of
  // two seconds to minutes. Linux permits this to every process, per thread.
  constexpr int kNice = 5;
  ::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kNice);
}

}  // namespace

ThreadWorker::ThreadWorker(Priority priority)
    : thread_([this, priority] {
        if (priority == Priority::kLow) stand_back();
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
