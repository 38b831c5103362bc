#include "daemon/krl/point_value.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "calib/model/units.h"

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
                                const calib::ExternalAxes& external,
                                const std::set<int>& understood) {
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

using calib::kRadPerDeg;
using calib::kRadPerTurn;

constexpr double kZeroRad = 0.01 * kRadPerDeg;
constexpr std::size_t kArmAxes = 6;

/// `before`: joints before A1.
calib::Posture reference(const calib::Configurations& ways, std::size_t before) {
  calib::JointVector q(before, 0.0);
  for (const double deg : {0.0, -90.0, 90.0, 0.0, 90.0, 0.0}) q.push_back(deg * kRadPerDeg);
  return ways.posture_of(q);
}

/// The whole turn on that side of 0 within the limits.
std::optional<double> on_side(double angle, bool below, const calib::Joint& joint) {
  std::optional<double> by_rounding;
  for (const double one : {angle, angle - kRadPerTurn, angle + kRadPerTurn}) {
    if (one < joint.min_rad || one > joint.max_rad) continue;
    if ((one < 0.0) == below) return one;
    if (std::abs(one) < kZeroRad) by_rounding = one;
  }
  return by_rounding;
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

bool leaves_the_arm(const Aggregate& target, const calib::ExternalAxes& external) {
  const auto apart = [&](const auto& one) {
    const int axis = calib::external_axis(one.first);
    return axis > 0 && external.leave_the_arm(axis);
  };
  return target.numbers.size() + target.words.size() > 0 &&
         std::ranges::all_of(target.numbers, apart) && std::ranges::all_of(target.words, apart);
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

StatusTurn status_turn_of(const calib::Configurations& ways, const calib::JointVector& q) {
  const std::size_t first = q.size() - kArmAxes;
  const calib::Posture home = reference(ways, first), at = ways.posture_of(q);
  StatusTurn result;
  result.status = (at.shoulder != home.shoulder ? 1 : 0) | (at.elbow == home.elbow ? 2 : 0) |
                  (at.wrist != home.wrist ? 4 : 0);
  for (std::size_t i = 0; i < kArmAxes; ++i)
    if (q[first + i] < 0.0) result.turn |= 1 << i;
  return result;
}

std::optional<calib::JointVector> joints_of(const calib::Configurations& ways,
                                            const calib::Robot& robot, const Eigen::Isometry3d& tcp,
                                            StatusTurn wanted, double unit_m) {
  const std::size_t first = robot.first_turning();
  const calib::Posture home = reference(ways, first);
  const calib::Posture posture{(wanted.status & 1) != 0 ? !home.shoulder : home.shoulder,
                               (wanted.status & 2) != 0 ? home.elbow : !home.elbow,
                               (wanted.status & 4) != 0 ? !home.wrist : home.wrist};
  auto q = ways.in_posture(tcp, posture, unit_m);
  if (!q) return std::nullopt;
  for (std::size_t i = first; i < q->size(); ++i) {
    const auto angle = on_side((*q)[i], (wanted.turn >> (i - first) & 1) != 0, robot.joints[i]);
    if (!angle) return std::nullopt;
    (*q)[i] = *angle;
  }
  return q;
}

}  // namespace cellcal::daemon::krl
