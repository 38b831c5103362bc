#include "daemon/service/hand_speed.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "calib/plan/duration.h"

namespace cellcal::daemon {

namespace {

/// Lower bound of the share, also used where the speed of a path is unknown: a slower move outlasts its
/// deadline.
constexpr double kLeastShare = 1e-3;

std::vector<double> angles(const drivers::AxisAngles& from) { return {from.begin(), from.end()}; }

}  // namespace

HandSpeed::HandSpeed(std::shared_ptr<const calib::ArmModel> arm, double speed_fraction, Bound bound)
    : arm_(std::move(arm)), speed_fraction_(speed_fraction), bound_(bound) {}

double HandSpeed::share(const drivers::Move& move, const drivers::RobotState& robot) const {
  using Mode = drivers::OperatingMode;
  const bool applies =
      robot.mode == Mode::kT1 || (bound_.mode_unknown && robot.mode == Mode::kUnknown);
  if (!applies || !(bound_.speed_m_s > 0.0) || move.cruise_s > 0.0) return 1.0;
  std::vector<double> from = angles(robot.commanded_rad);
  double share = 1.0;
  const auto leg_to = [&](const drivers::AxisAngles& at_rad) {
    std::vector<double> to = angles(at_rad);
    const bool known =
        from.size() == to.size() && static_cast<int>(to.size()) == arm_->joint_count();
    share = std::min(share, known ? share_of_leg(from, to) : kLeastShare);
    from = std::move(to);
  };
  for (const drivers::Via& via : move.via) leg_to(via.at_rad);
  leg_to(move.target_rad);
  return std::max(share, kLeastShare);
}

double HandSpeed::share_of_leg(const std::vector<double>& from,
                               const std::vector<double>& to) const {
  double shortest_s = 0.0;  // at the axis limits
  for (std::size_t i = 0; i < to.size(); ++i) {
    const double limit_rad_s = arm_->robot().joints[i].max_speed_rad_s * speed_fraction_;
    if (limit_rad_s > 0.0)
      shortest_s = std::max(shortest_s, std::abs(to[i] - from[i]) / limit_rad_s);
  }
  const double fastest_m = calib::fastest_point_m_s(*arm_, from, to);
  return fastest_m > 0.0 ? std::min(1.0, bound_.speed_m_s * shortest_s / fastest_m) : 1.0;
}

}  // namespace cellcal::daemon
