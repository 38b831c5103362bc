#pragma once
// The cell of positioner_cell.h with a random arm and positioner, a session of touches, and possible changes
// afterwards.

#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "calib/estimate/predict.h"
#include "calib/identify/identify.h"
#include "calib/model/linear.h"
#include "calib/plan/plan.h"
#include "tests/calib/positioner_cell.h"

namespace cellcal::calib::testing {

/// Share of the search line in which a contact is sought.
struct SearchedShare {
  double from = 0.0, to = 1.0;
};
/// A planned search, lengthened by the positioner's prior, ends near the centre of the sphere.
inline constexpr SearchedShare kBeyondTheLine{-0.8, 1.1};

/// The cell as built, with the errors of arm and positioner.
struct StandingCell {
  Cell cell;
  Eigen::VectorXd x;

  /// Contact of the true tip with the sphere on the planned search line; `out_m`: noise.
  std::optional<Touch> contact(const PlannedTouch& planned, SearchedShare within = {},
                               double out_m = 0.0) const {
    const ArmModel arm(cell);
    const Target& target = cell.targets[cell.target_index(planned.target)];
    Touch made;
    made.target = planned.target;
    made.set = planned.set;
    made.positioner_rad = planned.positioner_rad;
    const auto at = [&](double s) {
      JointVector q = planned.standoff;
      for (std::size_t i = 0; i < q.size(); ++i) q[i] += s * (planned.end[i] - planned.standoff[i]);
      return q;
    };
    const auto gap = [&](double s) {
      return distance_m(at(s), made.positioner_rad, target) - target.diameter_m / 2.0 - out_m;
    };
    double out = within.from, in = within.to;
    if (gap(out) < 0.0 || gap(in) > 0.0) return std::nullopt;
    for (int k = 0; k < 60; ++k) (gap((out + in) / 2.0) > 0.0 ? out : in) = (out + in) / 2.0;
    made.joint_rad = at(out);
    return made;
  }
  /// Distance of the true tip from the target's true centre.
  double distance_m(const JointVector& q, const std::vector<double>& positioner_rad,
                    const Target& target) const {
    const ArmModel arm(cell);
    const std::span<const double> angles(positioner_rad);
    const auto carriers = static_cast<std::size_t>(target.carried_by);
    const PreparedPose pose =
        arm.prepare(q, 0, nullptr, angles.first(carriers), angles.subspan(carriers));
    return (arm.position(pose, x.data()) - target.centre_m).norm();
  }
};

/// Rigid, exact gears, so that only geometry remains.
inline Cell rigid_positioner_cell(const char* robot_file, double load_kg = 0.0) {
  Cell cell = positioner_cell(robot_file);
  cell.robot.positioner.back().mass_kg = load_kg;
  cell.robot.positioner.back().com_m = Eigen::Vector3d(0.12, 0.05, 0.2);
  for (Joint& joint : cell.robot.joints) {
    joint.compliance_sigma_rad_per_nm = 0.0;
    joint.mass_kg = 0.0;
  }
  return cell;
}

struct PositionerSession {
  Cell cell;
  ArmModel arm{cell};
  Eigen::VectorXd x = Eigen::VectorXd::Zero(arm.size());
  std::vector<Touch> touches;

  /// `noise_m`: of each touch; `load_kg`: on the table, off its axis.
  explicit PositionerSession(const char* robot_file, double noise_m = 0.0, double load_kg = 0.0)
      : cell(rigid_positioner_cell(robot_file, load_kg)) {
    Random random(3);
    for (int p = 0; p < arm.size(); ++p) {
      const ArmParameter& parameter = arm.parameters()[static_cast<std::size_t>(p)];
      // A tenth of the arm's tolerances, so that the positioner's errors are the large ones.
      const double share = parameter.kind == ParameterKind::kPositioner ? 1.0 : 0.1;
      x[p] = share * parameter.sigma * random.normal();
      if (is_positioner_compliance(parameter)) x[p] = std::abs(x[p]);
    }
    PlanOptions options;
    options.fit_touches = 70;
    options.check_touches = 15;
    for (const PlannedTouch& planned : make_plan(cell, options).touches)
      if (auto one = standing().contact(planned, kBeyondTheLine,
                                        noise_m > 0.0 ? noise_m * random.normal() : 0.0))
        touches.push_back(std::move(*one));
  }
  StandingCell standing() const { return {cell, x}; }
};

// Changes.

inline StandingCell with_knocked_tool(StandingCell now, const Eigen::Vector3d& by_m) {
  now.cell.tool.tcp.translation() += by_m;
  return now;
}
inline StandingCell with_moved_sphere(StandingCell now, const std::string& id,
                                      const Eigen::Vector3d& by_m) {
  now.cell.targets[now.cell.target_index(id)].centre_m += by_m;
  return now;
}
/// Shift and rotation of the first axis, base frame.
inline StandingCell with_moved_positioner(StandingCell now, const Eigen::Vector3d& by_m,
                                          const Eigen::Vector3d& turn_rad) {
  Eigen::Isometry3d& frame = now.cell.robot.positioner[0].frame;
  frame.linear() = Eigen::AngleAxisd(turn_rad.norm(), turn_rad.normalized()) * frame.linear();
  frame.translation() += by_m;
  return now;
}
/// The axis is ahead of its controller's reading by this angle.
inline StandingCell with_zero_off(StandingCell now, std::size_t axis, double by_rad) {
  PositionerAxis& turned = now.cell.robot.positioner[axis];
  turned.frame.rotate(Eigen::AngleAxisd(turned.sign * by_rad, Eigen::Vector3d::UnitZ()));
  return now;
}

/// Mean error of the distance between tip and carried spheres at these postures and angles.
inline double off_carried_m(const Calibration& c, const StandingCell& now,
                            const std::vector<Touch>& at) {
  const Predictor on_table(c, 2);
  double sum = 0.0;
  int count = 0;
  for (const Touch& touch : at) {
    const Target& target = now.cell.targets[now.cell.target_index(touch.target)];
    if (target.carried_by != 2) continue;
    const auto known = std::ranges::find(c.targets, touch.target, &TargetResult::id);
    const Eigen::Vector3d tip =
        on_table.calibrated(touch.joint_rad, touch.positioner_rad).tcp.translation();
    sum += std::abs((tip - known->centre_m).norm() -
                    now.distance_m(touch.joint_rad, touch.positioner_rad, target));
    ++count;
  }
  return sum / count;
}

}  // namespace cellcal::calib::testing
