#pragma once
// Counts invalid tokens per address and derives the delay of the answer.

#include <chrono>
#include <functional>
#include <map>
#include <string>

namespace cellcal::daemon {

/// Not thread-safe.
class FailedAttempts {
 public:
  using Clock = std::function<std::chrono::steady_clock::time_point()>;
  explicit FailedAttempts(Clock clock = std::chrono::steady_clock::now)
      : clock_(std::move(clock)) {}

  struct Count {
    int so_far = 0;
    std::chrono::milliseconds wait{0};  ///< doubles each time, up to 5 s
  };
  /// Counts one more attempt. Attempts older than ten minutes are dropped.
  Count add(const std::string& address);

 private:
  struct Of {
    int count = 0;
    std::chrono::steady_clock::time_point last;
  };
  Clock clock_;
  std::map<std::string, Of> of_;  ///< by address; IPv6 by network, all of which one host may use
};

}  // namespace cellcal::daemon
