#pragma once
// Determines whether the controller's session continues after a silence. Only a short one excludes
// another session: a program that ended cannot be restarted manually within half a second.

#include <cmath>
#include <cstdint>
#include <optional>

#include "drivers/time.h"

namespace cellcal::drivers {

class PauseWatch {
 public:
  /// Packets stopped after this one.
  void begin(std::uint32_t ipoc, double seconds_per_ipoc, std::optional<std::uint32_t> delay,
             TimePoint t_rx) {
    left_ = Left{ipoc, seconds_per_ipoc, delay, t_rx};
  }
  void forget() { left_.reset(); }

  /// First packet after the silence: true if IPOC is consistent with the clock, and Delay has not
  /// restarted.
  bool is_over(std::uint32_t ipoc, std::optional<std::uint32_t> delay, TimePoint t_rx) const {
    if (!left_ || left_->seconds_per_ipoc <= 0.0) return false;
    const double elapsed_s = std::chrono::duration<double>(t_rx - left_->t_rx).count();
    const double by_ipoc_s =
        static_cast<std::int32_t>(ipoc - left_->ipoc) * left_->seconds_per_ipoc;
    const bool goes_on = elapsed_s <= kLongestS && std::abs(by_ipoc_s - elapsed_s) <= kContinuityS;
    return goes_on && delay.has_value() == left_->delay.has_value() &&
           delay.value_or(0) >= left_->delay.value_or(0);
  }

 private:
  static constexpr double kLongestS = 0.5;
  /// Tolerance for queued packets, and two quartzes.
  static constexpr double kContinuityS = 0.05;

  struct Left {
    std::uint32_t ipoc = 0;
    double seconds_per_ipoc = 0.0;
    std::optional<std::uint32_t> delay;
    TimePoint t_rx{};
  };
  std::optional<Left> left_;
};

}  // namespace cellcal::drivers
