#include "calib/consistency/duplicates.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

/// Fewer are a slip of the pen.
constexpr std::size_t kLeast = 3;
constexpr double kShare = 0.05;
/// Angles of no more digits may agree by chance where a place is touched again: at a metre's reach
/// one step of the last is 0.02 mm.
constexpr double kStepDeg = 1e-3;

bool is_rounded(const Touch& touch) {
  constexpr double kStepsPerRad = kDegPerRad / kStepDeg;
  return std::all_of(touch.joint_rad.begin(), touch.joint_rad.end(), [](double angle) {
    const double steps = angle * kStepsPerRad;
    return std::abs(steps - std::round(steps)) < 1e-4;
  });
}

/// Of each touch the one before it that it is a copy of.
std::vector<std::optional<std::size_t>> originals(std::span<const Touch> touches) {
  std::vector<std::size_t> order(touches.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  const auto key = [&](std::size_t i) {
    return std::tuple_cat(reading(touches[i]), std::tie(touches[i].target, touches[i].tool));
  };
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return key(a) < key(b); });
  std::vector<std::optional<std::size_t>> result(touches.size());
  for (std::size_t k = 1; k < order.size(); ++k)
    if (key(order[k - 1]) == key(order[k])) result[order[k]] = order[k - 1];
  return result;
}

}  // namespace

std::optional<Finding> duplicate_touches(std::span<const Touch> touches) {
  const auto original = originals(touches);
  // Whole stretches in the same order again, or digits that agree by no chance.
  std::size_t all = 0, in_order = 0, fine = 0, first = touches.size();
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (!original[i]) continue;
    first = std::min(first, i);
    ++all;
    fine += is_rounded(touches[i]) ? 0 : 1;
    in_order += i > 0 && original[i - 1] && *original[i] == *original[i - 1] + 1 ? 1 : 0;
  }
  if (all < kLeast || static_cast<double>(all) <= kShare * static_cast<double>(touches.size()) ||
      2 * std::max(in_order, fine) < all)
    return std::nullopt;
  return Finding{FindingKind::kDuplicateTouches,
                 Severity::kWithholds,
                 {},
                 {{"duplicates", static_cast<double>(all), ""},
                  {"touches", static_cast<double>(touches.size()), ""}},
                 {{about_touch(first, touches[first]), {}},
                  {about_touch(*original[first], touches[*original[first]]), {}}}};
}

}  // namespace cellcal::calib
