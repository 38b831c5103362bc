#pragma once
// The thread for requests that take time: one after the other, and nobody fills it for the others.
//
// What does something (starting a session) goes before what only looks, and has places of its own. Of
// those places nobody has all: not those who look, and not one token.

#include <deque>
#include <functional>
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

}  // namespace cellcal::daemon
