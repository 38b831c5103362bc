#include "drivers/kuka/eki/eki_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>

#include "drivers/error.h"
#include "drivers/kuka/moves/move_queue.h"
#include "drivers/kuka/wire/wire_axes.h"
#include "drivers/units.h"

namespace cellcal::drivers {
namespace {

constexpr int kMostUnconfirmed = 8;
// Below the minimum, a beat retransmitted by TCP would count as lost; above the maximum, a dead
// controller is detected too late.
constexpr double kShortestSilence = 0.1, kLongestSilence = 2.0;
// The controller's dead man must receive at least three beats per period.
constexpr double kShortestBeat = 0.01, kLongestBeat = 0.08;
constexpr double kLongestDelay = 0.2;

void check_range(std::string_view key, double value, double low, double high) {
  if (!(value >= low && value <= high)) {
    throw ConfigError(fmt::format("eki: {} = {} is outside {}..{}", key, value, low, high));
  }
}

void check_axis(std::size_t i, const AxisLimit& limit, double full_speed) {
  if (!std::isfinite(limit.min_rad) || !std::isfinite(limit.max_rad) ||
      limit.min_rad >= limit.max_rad) {
    throw ConfigError(fmt::format("eki: axis {}: limits {} to {} rad are not a range", i + 1,
                                  limit.min_rad, limit.max_rad));
  }
  if (!std::isfinite(limit.max_speed_rad_s) || limit.max_speed_rad_s <= 0.0) {
    throw ConfigError(fmt::format("eki: axis {}: speed limit is {}, and must be a positive number",
                                  i + 1, limit.max_speed_rad_s));
  }
  if (!std::isfinite(full_speed) || full_speed <= 0.0) {
    throw ConfigError(fmt::format("eki: axis {}: full speed is {}, and must be a positive number",
                                  i + 1, full_speed));
  }
  if (limit.max_speed_rad_s < full_speed / 100.0) {
    throw ConfigError(fmt::format(
        "eki: axis {}: speed limit {} rad/s is below 1 percent of its full speed, the slowest PTP "
        "of a KUKA: raise speed_percent",
        i + 1, limit.max_speed_rad_s));
  }
}

}  // namespace

std::size_t EkiConfig::wire_axes() const {
  const std::size_t external = static_cast<std::size_t>(std::max(external_axes, 0));
  return external == 0 ? limits.size() : std::max(limits.size(), kArmAxes + external);
}

int EkiConfig::transit_percent(const AxisAngles& from_rad, const AxisAngles& to_rad) const {
  // Less is what the controller's program leaves an axis at.
  constexpr double kTravelRad = 0.1 * kRadPerDeg;
  double share = 1.0;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const bool stands = i >= kArmAxes && i < std::min(from_rad.size(), to_rad.size()) &&
                        std::abs(to_rad[i] - from_rad[i]) <= kTravelRad;
    if (!stands) share = std::min(share, limits[i].max_speed_rad_s / full_speed_rad_s[i]);
  }
  // Prevents rounding of a share of 0.2 down to 19 percent.
  constexpr double kRounding = 1e-9;
  return std::clamp(static_cast<int>(std::floor(share * 100.0 + kRounding)), 1, 100);
}

void EkiConfig::validate() const {
  if (address.empty()) throw ConfigError("eki: address is empty. Set the controller's IP address");
  check_range("silence_s", silence_s, kShortestSilence, kLongestSilence);
  check_range("beat_s", beat_s, kShortestBeat, kLongestBeat);
  check_range("window", window, 2, kMostUnconfirmed);
  check_range("latch_delay_s", latch_delay_s, -kLongestDelay, kLongestDelay);
  check_range("latch_jitter_s", latch_jitter_s, 0.0, kLongestDelay);
  check_range("flag_sigma_s", flag_sigma_s, 0.0, kLongestDelay);
  check_range("flag_search_limit_deg_s", flag_search_limit_deg_s, 0.01, 10.0);
  check_range("follow_tolerance_deg", follow_tolerance_deg, 0.001, 5.0);
  if (limits.empty() || limits.size() > kMaxAxes) {
    throw ConfigError(
        fmt::format("eki: {} axis limits; 1 to {} axes can be driven", limits.size(), kMaxAxes));
  }
  if (full_speed_rad_s.size() != limits.size()) {
    throw ConfigError(
        fmt::format("eki: {} full speeds for {} axes", full_speed_rad_s.size(), limits.size()));
  }
  check_range("external_axes", external_axes, 0, static_cast<double>(kMaxAxes - kArmAxes));
  if (external_axes > 0 && limits.size() < kArmAxes) {
    throw ConfigError(fmt::format("eki: {} external axes with an arm of {} axes: six are needed",
                                  external_axes, limits.size()));
  }
  check_linear_unit("eki", limits);
  for (std::size_t i = 0; i < limits.size(); ++i) check_axis(i, limits[i], full_speed_rad_s[i]);
}

}  // namespace cellcal::drivers
