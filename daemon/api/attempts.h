#pragma once
// How often an address has tried a token that is none, and how long it has to wait for the answer.

#include <chrono>
#include <functional>
#include <map>
#include <string>

namespace cellcal::daemon {

/// On one thread.
class FailedAttempts {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;
  explicit FailedAttempts(Clock clock = std::chrono::steady_clock::now)
      : clock_(std::move(clock)) {}

  struct Count {
    int so_far = 0;
    std::chrono::milliseconds wait{0};  ///< twice as long each time, up to 5 s
  };
  /// One more. What lies ten minutes back is forgotten.
  Count add(const std::string& address);

 private:
  struct Of {
    int count = 0;
    std::chrono::steady_clock::time_point last;
  };
  Clock clock_;
  std::map<std::string, Of> of_;  ///< by address; of IPv6 by its network, which one host has all of
};

}  // namespace cellcal::daemon
