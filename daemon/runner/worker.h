#pragma once
// Where the thinking is done: planning, identification, report; and where the disk is waited for.
// Both take up to seconds, and the session's thread must go on watching the arm meanwhile.

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>

namespace cellcal::daemon {

class Worker {
 public:
  virtual ~Worker() = default;
  /// Jobs are done one after the other, in order. A job must not throw.
  virtual void post(std::function<void()> job) = 0;
};

/// On virtual time: the job is done before post() returns.
class InlineWorker final : public Worker {
 public:
  void post(std::function<void()> job) override { job(); }
};

/// On the machine's clock: one thread. Destruction waits for the job in hand and drops the others.
class ThreadWorker final : public Worker {
 public:
  /// Of low priority, solving takes the core from nobody who answers in time, and gets on beside others.
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
