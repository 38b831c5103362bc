#include "drivers/kuka/rsi/rsi_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "drivers/error.h"
#include "drivers/kuka/moves/move_queue.h"
#include "drivers/kuka/wire/wire_axes.h"
#include "drivers/kuka/wire/xml_values.h"
#include "drivers/units.h"

namespace cellcal::drivers {

namespace {

constexpr int kMinDecimals = 4, kMaxDecimals = 9;
// The record of positions covers 2 s at 4 ms; windows and lag have to fit, at 2 ms as well.
constexpr double kLongestWindowS = 0.5;

// Peers have cycles of at least 2 ms.
constexpr double kShortestCycleS = 0.002;
// An axis amplifies a unit of the TCP's frame by up to fifteen (kMostGain), over six numbers.
constexpr double kUnitsInSpace = 100.0;

void check_name(const char* key, std::string_view name, bool may_be_empty) {
  if (!is_tag(name) && !(may_be_empty && name.empty())) {
    throw ConfigError(fmt::format(
        "rsi: {} = \"{}\" is not a name: 1 to {} letters, digits, '_', '-', '.', a letter first",
        key, name, kLongestTag));
  }
}

void check_sent_tags(const RsiConfig& config) {
  const std::pair<const char*, const std::string*> tags[] = {{"mode_tag", &config.mode_tag},
                                                             {"override_tag", &config.override_tag},
                                                             {"contact_tag", &config.contact_tag}};
  for (const auto& [key, tag] : tags) {
    check_name(key, *tag, true);
    for (const auto& [other_key, other] : tags) {
      if (other == tag) break;
      if (tag->empty() || !wire::same_name(*tag, *other)) continue;
      throw ConfigError(fmt::format("rsi: {} = \"{}\" is {}, too", key, *tag, other_key));
    }
    const std::string_view element = std::string_view(*tag).substr(0, tag->find('.'));
    for (const char* known : {"IPOC", "RIst", "AIPos", "EIPos", "ASPos", "ESPos", "Delay"}) {
      if (wire::same_name(element, known)) {
        throw ConfigError(fmt::format(
            "rsi: {} = \"{}\" names an element that the controller fills itself: choose another "
            "name, as in SEND of the controller's ethernet XML",
            key, *tag));
      }
    }
  }
}

void check_positive(std::string_view what, double value) {
  if (!std::isfinite(value) || value <= 0.0) {
    throw ConfigError(fmt::format("rsi: {} is {}, and must be a positive number", what, value));
  }
}

void check_mode(CorrectionMode mode, bool hold_on) {
  if (mode == CorrectionMode::kAbsolute && !hold_on) {
    throw ConfigError(
        "rsi: mode ABSOLUTE with HOLDON=0: one late reply would move the arm back to where the "
        "session began. Set HOLDON=\"1\" on every correction element of the controller's "
        "ethernet XML");
  }
  if (mode == CorrectionMode::kRelative && hold_on) {
    throw ConfigError(
        "rsi: mode RELATIVE with HOLDON=1: every late reply would repeat the last step. Set "
        "HOLDON=\"0\" on every correction element of the controller's ethernet XML, or use "
        "RSI_ON(#ABSOLUTE) with HOLDON=\"1\"");
  }
}

void check_space(const RsiConfig& config) {
  const SpaceCorrection& space = config.space;
  if (!space.on) return;
  check_name("cart_tag", space.tag, false);
  if (config.mode == CorrectionMode::kRelative) {
    throw ConfigError(
        "rsi: correction = \"space\" with mode RELATIVE: a sum of rotations depends on their "
        "order, and the controller does not report it. Use RSI_ON(#ABSOLUTE) with HOLDON=\"1\"");
  }
  if (config.limits.size() != wire::kAxesPerElement) {
    throw ConfigError(fmt::format(
        "rsi: correction = \"space\" with {} axes: it drives exactly six and no external "
        "ones. Use correction = \"axes\"",
        config.limits.size()));
  }
  if (space.geometry == nullptr) {
    throw ConfigError("rsi: correction = \"space\" without the arm's geometry");
  }
  check_positive("correction_limit_mm", space.limit_mm);
  check_positive("correction_turn_limit_deg", space.turn_limit_deg);
}

}  // namespace

bool is_tag(std::string_view name) {
  const auto is_letter = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_';
  };
  return !name.empty() && name.size() <= kLongestTag && is_letter(name.front()) &&
         std::all_of(name.begin(), name.end(), [&](char c) {
           return is_letter(c) || (c >= '0' && c <= '9') || c == '-' || c == '.';
         });
}

void RsiConfig::validate() const {
  check_name("sentype", sentype, false);
  check_name("axis_tag", axis_tag, false);
  if (wire::same_name(axis_tag, "RKorr")) {
    throw ConfigError(
        "rsi: axis_tag = \"RKorr\" names corrections in space (POSCORR): set correction = "
        "\"space\" for them, or wire AXISCORR in the context and name its RECEIVE tag (\"AK\")");
  }
  check_name("external_axis_tag", external_axis_tag, false);
  check_name("stop_tag", stop_tag, true);
  check_sent_tags(*this);
  if (decimals < kMinDecimals || decimals > kMaxDecimals) {
    throw ConfigError(
        fmt::format("rsi: decimals = {} is outside {}..{}", decimals, kMinDecimals, kMaxDecimals));
  }
  if (silence_cycles < 2 || silence_cycles > kMostSilenceCycles) {
    throw ConfigError(fmt::format("rsi: silence_cycles = {} is outside 2..{}", silence_cycles,
                                  kMostSilenceCycles));
  }
  if (late_replies_limit < 1) {
    throw ConfigError(
        fmt::format("rsi: late_replies_limit = {} is not at least 1", late_replies_limit));
  }
  check_mode(mode, hold_on);
  if (limits.empty() || limits.size() > kMaxAxes) {
    throw ConfigError(
        fmt::format("rsi: {} axis limits; 1 to {} axes can be driven", limits.size(), kMaxAxes));
  }
  if (correction_limit_deg.size() != limits.size()) {
    throw ConfigError(fmt::format("rsi: {} correction limits for {} axes",
                                  correction_limit_deg.size(), limits.size()));
  }
  if (!full_speed_rad_s.empty() && full_speed_rad_s.size() != limits.size()) {
    throw ConfigError(
        fmt::format("rsi: {} full speeds for {} axes", full_speed_rad_s.size(), limits.size()));
  }
  for (const double speed : full_speed_rad_s) check_positive("an axis' full speed", speed);
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const AxisLimit& limit = limits[i];
    if (!std::isfinite(limit.min_rad) || !std::isfinite(limit.max_rad) ||
        limit.min_rad >= limit.max_rad) {
      throw ConfigError(fmt::format("rsi: axis {}: limits {} to {} rad are not a range", i + 1,
                                    limit.min_rad, limit.max_rad));
    }
    check_positive(fmt::format("axis {}: speed limit", i + 1), limit.max_speed_rad_s);
    check_positive(fmt::format("axis {}: acceleration limit", i + 1),
                   limit.max_acceleration_rad_s2);
    check_positive(fmt::format("axis {}: jerk limit", i + 1), limit.max_jerk_rad_s3);
    check_positive(fmt::format("axis {}: correction limit", i + 1), correction_limit_deg[i]);
  }
  check_linear_unit("rsi", limits);
  check_space(*this);
  check_positive("follow_tolerance_deg", follow_tolerance_deg);
  check_positive("follow_window_s", follow_window_s);
  check_positive("longest_lag_s", longest_lag_s);
  if (follow_window_s > kLongestWindowS || longest_lag_s > kLongestWindowS) {
    throw ConfigError(fmt::format("rsi: follow_window_s = {} or longest_lag_s = {} is above {} s",
                                  follow_window_s, longest_lag_s, kLongestWindowS));
  }
}

std::vector<AxisLimit> limits_within_wire(const RsiConfig& config) {
  // Both set-points of a step are rounded, by half a unit each; one more unit allows for double
  // rounding.
  const double units = config.space.on ? kUnitsInSpace : 2.0;
  const WireAxes axes(config.limits);
  std::vector<AxisLimit> limits = config.limits;
  for (std::size_t i = 0; i < limits.size(); ++i) {
    const double add_rad_s =
        axes.inside(i, units * std::pow(10.0, -config.decimals)) / kShortestCycleS;
    double& speed = limits[i].max_speed_rad_s;
    const double full = config.full_speed_rad_s.empty() ? speed : config.full_speed_rad_s[i];
    speed = std::min(speed, std::max(full - add_rad_s, full / 2));
  }
  return limits;
}

}  // namespace cellcal::drivers
