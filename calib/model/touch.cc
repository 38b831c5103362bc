#include "calib/model/touch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "calib/model/kinematics.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

/// Coarsest last digit for which agreement is no chance, and finest that a double holds, in deg or mm.
constexpr double kCoarsest = 1e-2, kFinest = 1e-8;

bool is_rounded(std::span<const double> values, double step) {
  return std::all_of(values.begin(), values.end(), [&](double value) {
    const double steps = value / step;
    return std::abs(steps - std::round(steps)) < 1e-4;
  });
}

/// `unit`: a degree or millimetre in the values' own unit.
bool same_numbers(std::span<const double> a, std::span<const double> b, double unit) {
  double apart = 0.0;
  if (a.size() != b.size()) return false;
  for (std::size_t k = 0; k < a.size() && apart < kCoarsest * unit; ++k)
    apart = std::max(apart, std::abs(a[k] - b[k]));
  if (apart <= kFinest / 2.0 * unit) return true;
  // The last digit of which half is at least this difference.
  const double step = std::pow(10.0, std::ceil(std::log10(2.0 * apart / unit) - 1e-6));
  return step <= kCoarsest && (is_rounded(a, step * unit) || is_rounded(b, step * unit));
}

constexpr double kMm = 1.0 / kMmPerM;

}  // namespace

bool is_rounded(const Touch& touch, double step_deg) {
  return is_rounded(std::span(touch.joint_rad), step_deg * kRadPerDeg);
}

bool same_reading(const Touch& a, const Touch& b) {
  const auto& turn = a.tracker_abc_rad;
  const auto& other_turn = b.tracker_abc_rad;
  return same_numbers(a.joint_rad, b.joint_rad, kRadPerDeg) &&
         (same_numbers(a.positioner_rad, b.positioner_rad, kRadPerDeg) ||
          same_numbers(a.positioner_rad, b.positioner_rad, kMm)) &&  // a linear unit
         same_numbers({&a.radius_m, 1}, {&b.radius_m, 1}, kMm) &&
         same_numbers(a.tracker_m, b.tracker_m, kMm) &&
         turn.has_value() == other_turn.has_value() &&
         (!turn || same_numbers(*turn, *other_turn, kRadPerDeg));
}

std::span<const double> carrier_rad(const Touch& touch, const Target& target) {
  const auto axes = static_cast<std::size_t>(target.carried_by);
  if (touch.positioner_rad.size() < axes)
    throw std::invalid_argument("touch of " + touch.target +
                                ": the positioner's angles are missing");
  return std::span(touch.positioner_rad).first(axes);
}

std::span<const double> outer_rad(const Touch& touch, const Target& target) {
  return std::span(touch.positioner_rad).subspan(carrier_rad(touch, target).size());
}

PreparedPose pose_of(const ArmModel& arm, const Touch& touch, const Target& target) {
  return arm.prepare(touch.joint_rad, arm.tool_index(touch.tool), arm.load(touch.load),
                     carrier_rad(touch, target), outer_rad(touch, target));
}

std::string touch_words(std::size_t index, const Touch& touch) {
  return fmt::format("touch {}{}", index + 1,
                     touch.line > 0 ? fmt::format(" (line {})", touch.line) : "");
}

}  // namespace cellcal::calib
