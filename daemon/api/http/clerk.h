#pragma once
// The thread for requests that take time: one after the other, and nobody fills it for the others.
//
// What does something (starting a session) goes before what only looks, and has places of its own. Of
// those places nobody has all: not those who look, and not one token.

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

/// Any thread. Destruction waits for the job in hand and drops the others.
class Clerk {
 public:
  // Of those that wait.
  static constexpr std::size_t kMostLooking = 48, kMostLookingOfOne = 24;
  static constexpr std::size_t kMostActing = 16, kMostActingOfOne = 8;

  /// False: no place.
  bool post(const Request& request, std::function<void()> job);

 private:
  struct Waiting {
    std::string name;
    std::function<void()> job;
  };
  void do_next();

  std::mutex mutex_;
  std::deque<Waiting> acting_, looking_;
  ThreadWorker worker_{ThreadWorker::Priority::kNormal};  ///< goes first: it uses the others
};

// How much memory answers may take that are made and not yet taken by their readers.
//
// Sixty slow readers of the largest export would hold it sixty times. Small answers are always given:
// connections are few, and so what these hold together is bounded too.

/// From any thread.
class AnswerBytes {
 public:
  static constexpr std::size_t kSmall = std::size_t{1} << 20;

  explicit AnswerBytes(std::size_t most) : most_(most) {}

  /// What an answer of so many bytes holds, until it is let go of. Null: there is no room for it. One
  /// that is larger than all there is room for is given alone.
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
  /// A connection may outlive its server.
  std::shared_ptr<std::atomic<std::size_t>> held_ = std::make_shared<std::atomic<std::size_t>>(0);
};

}  // namespace cellcal::daemon
