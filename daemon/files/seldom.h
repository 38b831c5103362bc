#pragma once
// What others can cause as often as they like is in the log once a minute, with how often it was.

#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

namespace cellcal::daemon {

class Seldom {
 public:
  /// It is so once more. A number: it is said now, and stands for so many.
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
