#include "daemon/krl/point_value.h"

#include <cmath>
#include <set>

namespace cellcal::daemon::krl {

namespace {

constexpr double kExternalAtZero = 1e-6;
constexpr double kLargestNumber = 1e6;

/// The six components required for a point of this kind.
const std::set<std::string>& needed(PointKind kind) {
  static const std::set<std::string> pose = {"X", "Y", "Z", "A", "B", "C"},
                                     axes = {"A1", "A2", "A3", "A4", "A5", "A6"};
  return kind == PointKind::kAxes ? axes : pose;
}

std::optional<Why> wrong_number(const std::string& name, double value, PointKind kind,
                                const calib::ExternalAxes& external, const std::set<int>& understood) {
  const int axis = calib::external_axis(name);
  const bool ours = understood.count(axis) > 0;
  if (axis > 0 && !ours && external.leave_the_arm(axis))
    return std::isfinite(value) ? std::nullopt : std::optional(Why::kNotANumber);
  if (!(std::abs(value) <= kLargestNumber)) return Why::kNotANumber;
  if (ours) return std::nullopt;
  if (axis > 0)
    return std::abs(value) > kExternalAtZero ? std::optional(Why::kExternalAxes) : std::nullopt;
  if (needed(kind).count(name) > 0) return std::nullopt;
  const bool bits = kind == PointKind::kCartesian && (name == "S" || name == "T") && value >= 0.0 &&
                    value == std::floor(value);
  return bits ? std::nullopt : std::optional(Why::kNotANumber);
}

}  // namespace

std::optional<Why> wrong_value(const Point& point, const calib::ExternalAxes& external,
                               const std::set<int>& understood) {
  const auto& numbers = point.value.numbers;
  if (!point.value.words.empty()) return Why::kNotANumber;
  for (const auto& [name, number] : numbers)
    if (const auto wrong = wrong_number(name, number.value, point.kind, external, understood))
      return wrong;
  for (const std::string& name : needed(point.kind))
    if (numbers.count(name) == 0) return Why::kPartial;
  if (numbers.count("S") != numbers.count("T")) return Why::kPartial;
  return std::nullopt;
}

std::optional<StatusTurn> status_turn(const Point& point) {
  const auto s = point.value.numbers.find("S"), t = point.value.numbers.find("T");
  if (s == point.value.numbers.end() || t == point.value.numbers.end()) return std::nullopt;
  return StatusTurn{static_cast<int>(s->second.value) & kStatusBits,
                    static_cast<int>(t->second.value) & kTurnBits};
}

bool taught_accurately(const Point& point) {
  const auto s = point.value.numbers.find("S");
  return s != point.value.numbers.end() && (static_cast<int>(s->second.value) & kAccurateBit) != 0;
}

}  // namespace cellcal::daemon::krl
