#pragma once
// Rate limit for log messages that a peer can provoke: one a minute, with the number of occurrences.

#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

namespace cellcal::daemon {

class Seldom {
 public:
  /// Counts one occurrence. Returns the occurrences since the last message if one is due now.
  std::optional<std::uint64_t> count(std::chrono::steady_clock::time_point now) {
    ++times_;
    if (said_ && now - *said_ < kPause) return std::nullopt;
    said_ = now;
    return std::exchange(times_, 0);
  }

 private:
  static constexpr std::chrono::minutes kPause{1};
  std::optional<std::chrono::steady_clock::time_point> said_;
  std::uint64_t times_ = 0;
};

}  // namespace cellcal::daemon
