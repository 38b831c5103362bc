#include <algorithm>
#include <cmath>
#include <string>

#include "calib/estimate/start.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/result/calibration.h"
#include "calib/result/level.h"
#include "calib/verdict/residuals.h"
#include "calib/verdict/verdict.h"

namespace cellcal::calib {

namespace {

struct Seen {
  Eigen::Vector3d tip_m;
  double radius_m;  ///< sum of sphere and tip, as stated
  std::size_t sphere;
  bool fit;
};

/// Centres of all spheres, followed by the radius offset.
struct Places {
  std::vector<Eigen::Vector3d> centre_m;
  double offset_m = 0.0;

  double residual_m(const Seen& one) const {
    return (one.tip_m - centre_m[one.sphere]).norm() - one.radius_m - offset_m;
  }
};

std::optional<std::vector<Seen>> seen_by(const Calibration& earlier, std::span<const Touch> touches,
                                         const std::vector<bool>& outlier) {
  const Cell levelled = at_level(earlier.cell, earlier.level);
  const ArmModel arm(levelled);
  const Eigen::VectorXd x = arm_values(arm, earlier);
  const auto joints = static_cast<std::size_t>(arm.joint_count());
  std::vector<Seen> seen;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const auto target = std::ranges::find(earlier.cell.targets, touches[i].target, &Target::id);
    if (target == earlier.cell.targets.end()) return {};
    if (target->kind != TargetKind::kSphere || outlier[i]) continue;
    const Touch& touch = touches[i];
    const bool known_load =
        touch.load.empty() ||
        std::ranges::find(levelled.loads, touch.load, &Load::id) != levelled.loads.end();
    if (!arm.has_tool(touch.tool) || !known_load || touch.joint_rad.size() != joints ||
        touch.positioner_rad.size() != levelled.robot.positioner.size())
      return {};
    seen.push_back({arm.position(pose_of(arm, touch, *target), x.data()),
                    target->diameter_m / 2.0 + arm.tool(arm.tool_index(touch.tool)).tip_radius_m,
                    static_cast<std::size_t>(target - earlier.cell.targets.begin()),
                    touches[i].set == TouchSet::kFit});
  }
  // Without fit touches the place of a sphere is unknown.
  std::erase_if(seen, [&](const Seen& one) {
    return std::ranges::none_of(
        seen, [&](const Seen& other) { return other.fit && other.sphere == one.sphere; });
  });
  if (seen.empty()) return {};
  return seen;
}

Places start_of(const Cell& cell, const std::vector<Seen>& seen) {
  Places places;
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    std::vector<Eigen::Vector3d> points_m;
    std::vector<double> radii_m;
    for (const Seen& one : seen)
      if (one.sphere == t && one.fit) {
        points_m.push_back(one.tip_m);
        radii_m.push_back(one.radius_m);
      }
    const Target& target = cell.targets[t];
    const CentreHints hints{target.has_centre ? &target.centre_m : nullptr, target.centre_sigma_m};
    places.centre_m.push_back(points_m.empty() ? target.centre_m
                                               : fit_centre(points_m, radii_m, hints).centre_m);
  }
  return places;
}

/// One Gauss-Newton iteration; a touch of the arm as found has a sigma of a millimetre. False:
/// converged.
bool improve(Places& places, const std::vector<Seen>& seen, double offset_sigma_m) {
  constexpr double kWorthM = 1e-3, kFlat = 1e-9, kSettledM = 1e-9;
  const auto size = static_cast<Eigen::Index>(3 * places.centre_m.size()) + 1;
  Eigen::MatrixXd information = kFlat * Eigen::MatrixXd::Identity(size, size);
  Eigen::VectorXd pull = Eigen::VectorXd::Zero(size);
  for (const Seen& one : seen) {
    if (!one.fit) continue;
    Eigen::VectorXd row = Eigen::VectorXd::Zero(size);
    row.segment<3>(static_cast<Eigen::Index>(3 * one.sphere)) =
        (places.centre_m[one.sphere] - one.tip_m).normalized();
    row[size - 1] = -1.0;
    information += row * row.transpose() / (kWorthM * kWorthM);
    pull += row * places.residual_m(one) / (kWorthM * kWorthM);
  }
  const double precision = 1.0 / std::pow(std::max(offset_sigma_m, 1e-9), 2);
  information(size - 1, size - 1) += precision;
  pull[size - 1] += precision * places.offset_m;
  const Eigen::VectorXd step = pivoted_solve(information, pull);
  if (!step.allFinite()) return false;
  for (std::size_t t = 0; t < places.centre_m.size(); ++t)
    places.centre_m[t] -= step.segment<3>(static_cast<Eigen::Index>(3 * t));
  places.offset_m -= step[size - 1];
  return step.lpNorm<Eigen::Infinity>() > kSettledM;
}

ResidualSummary summary(const Places& places, const std::vector<Seen>& seen, bool fit) {
  std::vector<double> residuals_m;
  for (const Seen& one : seen)
    if (one.fit == fit) residuals_m.push_back(places.residual_m(one));
  return summary_of(residuals_m);
}

}  // namespace

std::optional<FoundResiduals> found_residuals(const Calibration& earlier,
                                              std::span<const Touch> touches,
                                              const std::vector<bool>& outlier) {
  const auto seen = seen_by(earlier, touches, outlier);
  if (!seen) return {};
  Places places = start_of(earlier.cell, *seen);
  constexpr int kRounds = 20;
  for (int round = 0; round < kRounds; ++round)
    if (!improve(places, *seen, earlier.cell.radius_offset_sigma_m)) break;
  return FoundResiduals{summary(places, *seen, true), summary(places, *seen, false)};
}

}  // namespace cellcal::calib
