#pragma once
// Thread for slow requests: one after the other, with bounded queues per caller.
//
// Acting requests (such as starting a session) precede reading ones and have slots of their own, which
// neither readers nor a single token can exhaust.

#include <atomic>
#include <cstddef>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <string>

#include "daemon/api/http/message.h"
#include "daemon/runner/worker.h"

namespace cellcal::daemon {

/// Thread-safe. Destruction waits for the current job and drops the others.
class Clerk {
 public:
  // Limits of the waiting requests.
  static constexpr std::size_t kMostLooking = 48, kMostLookingOfOne = 24;
  static constexpr std::size_t kMostActing = 16, kMostActingOfOne = 8;

  /// False: queue full.
  bool post(const Request& request, std::function<void()> job);

 private:
  struct Waiting {
    std::string name;
    std::function<void()> job;
  };
  void do_next();

  std::mutex mutex_;
  std::deque<Waiting> acting_, looking_;
  /// Declared last, destroyed first: it uses the other members.
  ThreadWorker worker_{ThreadWorker::Priority::kNormal};
};

// Memory bound for answers that are complete but not yet read by their clients.
//
// Sixty slow readers of the largest export would hold it sixty times. Small answers are always permitted: the
// number of connections is limited, which bounds them too.

/// Thread-safe.
class AnswerBytes {
 public:
  static constexpr std::size_t kSmall = std::size_t{1} << 20;

  explicit AnswerBytes(std::size_t most) : most_(most) {}

  /// Reserves that many bytes until the result is released. Null: no memory left. An answer larger than the
  /// whole budget is permitted alone.
  std::shared_ptr<void> hold(std::size_t bytes) {
    const std::size_t counted = bytes <= kSmall ? 0 : bytes;
    std::size_t before = *held_;
    do {
      if (counted > 0 && before > 0 && before + counted > most_) return nullptr;
    } while (!held_->compare_exchange_weak(before, before + counted));
    return {held_.get(), [held = held_, counted](void*) { *held -= counted; }};
  }

 private:
  std::size_t most_;
  /// Shared: a connection may outlive its server
  std::shared_ptr<std::atomic<std::size_t>> held_ = std::make_shared<std::atomic<std::size_t>>(0);
};

}  // namespace cellcal::daemon
