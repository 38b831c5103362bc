#pragma once
// Value of a taught point, or the reason why it is not understood.
//
// KUKA's status S and turn T: selection among an arm's postures for a Cartesian point.
//
//   S bit 0: the wrist is beyond axis 1   bit 1: axis 3 beyond the stretched arm   bit 2: A5 < 0
//   T bit i: axis i + 1 is below 0
// The bits of S give the arm's side of its three singularities, relative to the posture A1..A6 = 0,
// -90, 90, 0, 90, 0, which is S 2.

#include <Eigen/Geometry>
#include <optional>
#include <set>

#include "calib/model/inverse.h"
#include "daemon/krl/krl_data.h"

namespace cellcal::daemon::krl {

struct StatusTurn {
  int status = 0, turn = 0;
  bool operator==(const StatusTurn&) const = default;
};

/// For a robot in closed form (calib/model/inverse.h), whose angles are KUKA's; a linear unit has no bits.
StatusTurn status_turn_of(const calib::Configurations& ways, const calib::JointVector& joint_rad);

/// Joint angles that a controller selects for the pose; empty if none within the limits fits. An
/// axis within 0.01 deg of 0 fits either way. `unit_m`: position of the linear unit.
std::optional<calib::JointVector> joints_of(const calib::Configurations& ways,
                                            const calib::Robot& robot, const Eigen::Isometry3d& tcp,
                                            StatusTurn wanted, double unit_m = 0.0);

/// Bits of S and T for the arm's six axes.
inline constexpr int kStatusBits = 7, kTurnBits = 63;
/// Bit of S: the point was taught with the absolutely accurate model.
inline constexpr int kAccurateBit = 16;

/// Requirements: components of its kind only, all numeric; the six required ones, S and T both or
/// none; an external axis that may carry the arm at 0, save those of `understood`.
std::optional<Why> wrong_value(const Point& point, const calib::ExternalAxes& external,
                               const std::set<int>& understood);

/// The target of a motion of external axes alone, {E1 20}, none of which carries the arm: it keeps its axes.
bool leaves_the_arm(const Aggregate& target, const calib::ExternalAxes& external);

/// S and T, if stated.
std::optional<StatusTurn> status_turn(const Point& point);
/// kAccurateBit is set.
bool taught_accurately(const Point& point);

}  // namespace cellcal::daemon::krl
