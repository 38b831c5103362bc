#pragma once
// Threads for computations (planning, identification, report) and for disk access. Both take up to seconds,
// while the session's thread has to monitor the arm.

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace cellcal::daemon {

class Worker {
 public:
  virtual ~Worker() = default;
  /// Runs jobs one after the other, in order. A job must not throw.
  virtual void post(std::function<void()> job) = 0;
};

/// On virtual time: the job is completed before post() returns.
class InlineWorker final : public Worker {
 public:
  void post(std::function<void()> job) override { job(); }
};

/// On the machine's clock: one thread. Destruction waits for the current job and drops the others.
class ThreadWorker final : public Worker {
 public:
  /// At low priority, computations yield to threads with deadlines but still progress under load.
  enum class Priority { kLow, kNormal };
  explicit ThreadWorker(Priority priority = Priority::kLow);
  ~ThreadWorker() override;
  ThreadWorker(const ThreadWorker&) = delete;
  ThreadWorker& operator=(const ThreadWorker&) = delete;

  void post(std::function<void()> job) override;

 private:
  void run();

  std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<std::function<void()>> jobs_;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace cellcal::daemon
