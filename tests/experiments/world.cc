#include "tests/experiments/world.h"

#include <fmt/format.h>

#include <cmath>

namespace cellcal::experiments {

namespace {

/// Search along the planned line until the true tip is `reading_m` outside of the surface.
std::optional<calib::JointVector> meet(const TrueArm& arm, const calib::PlannedTouch& plan,
                                       const Eigen::Vector3d& centre, double radius_m, double warm,
                                       double beyond) {
  const auto at = [&](double s) {
    calib::JointVector q(plan.standoff.size());
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = plan.standoff[i] + s * (plan.end[i] - plan.standoff[i]);
    return q;
  };
  const auto gap = [&](double s) { return (arm.tip(at(s), warm) - centre).norm() - radius_m; };
  double out = -beyond, in = 1.0 + beyond;
  if (gap(out) < 0.0 || gap(in) > 0.0) return std::nullopt;
  for (int k = 0; k < 50; ++k) {
    const double middle = (out + in) / 2.0;
    (gap(middle) > 0.0 ? out : in) = middle;
  }
  return at(out);
}

/// From a place in front of the arm to one next to the track, at this share of it.
Eigen::Vector3d along_the_track(const calib::Joint& track, double share,
                                const Eigen::Vector3d& place) {
  const Eigen::Vector3d& along = track.guide->along;
  return (track.min_rad + share * (track.max_rad - track.min_rad) - 0.8 * along.dot(place)) * along;
}

}  // namespace

calib::Cell make_cell(const calib::Robot& robot, const Stage& stage, calib::Random& random) {
  calib::Cell cell;
  cell.robot = robot;
  cell.tool.tcp.translation() = Eigen::Vector3d(0.0599, 0.0505, 0.4103);
  cell.tool.mass_kg = 1.535 * std::pow(stage.size, 3);
  cell.tool.com_m = cell.tool.tcp.translation() / 2.0;
  cell.tool.length_m = cell.tool.tcp.translation().norm();
  cell.tool.deflection_sigma = 0.003;
  cell.touch_sigma_m = stage.touch_sigma_m;
  cell.radius_offset_sigma_m = stage.rho_sigma_m > 0.0 ? stage.rho_sigma_m : 1e-9;
  // Distributed around the front of the arm, low and high; each cell slightly different.
  constexpr double kPlaces[][3] = {{1.05, 0.24, 0.35},  {0.85, -0.55, 0.15}, {0.80, 0.45, 0.70},
                                   {0.95, -0.35, 0.75}, {0.65, 0.75, 0.30},  {0.70, -0.75, 0.55}};
  for (int i = 0; i < stage.spheres; ++i) {
    calib::Target t;
    t.id = fmt::format("S{}", i + 1);
    t.diameter_m = 0.0614;
    t.diameter_sigma_m = 2e-6;
    t.has_centre = true;
    t.centre_sigma_m = 0.02;
    for (int k = 0; k < 3; ++k)
      t.centre_m[k] = stage.size * kPlaces[i][k] + random.uniform(-0.05, 0.05);
    if (robot.first_turning() > 0)
      t.centre_m += along_the_track(robot.joints[0], (i + 0.5) / stage.spheres, t.centre_m);
    cell.targets.push_back(t);
  }
  // The plan must know which lengths are certified, but not their values.
  constexpr double kLengthSigmaM = 5e-6;
  for (std::size_t a = 0; stage.lengths && a < cell.targets.size(); ++a)
    for (std::size_t b = a + 1; b < cell.targets.size(); ++b) {
      if ((cell.targets[a].centre_m - cell.targets[b].centre_m).norm() > stage.longest_m) continue;
      cell.lengths.push_back({cell.targets[a].id, cell.targets[b].id,
                              (cell.targets[a].centre_m - cell.targets[b].centre_m).norm(),
                              kLengthSigmaM});
    }
  return cell;
}

calib::Cell as_filed(calib::Cell cell, const Stage& stage) {
  for (calib::Joint& joint : cell.robot.joints)
    if (!stage.heavy_stated) joint.counterbalance_sigma_rad = joint.stiffening_sigma_rad = 0.0;
  if (stage.masses_stated) return cell;
  for (calib::Joint& joint : cell.robot.joints) {
    joint.mass_kg = 0.0;
    joint.com_m.setZero();
    joint.compliance_sigma_rad_per_nm = 0.0;
  }
  return cell;
}

World::World(const calib::Cell& nominal, const Stage& stage, calib::Random& random)
    : cell(as_filed(nominal, stage)), arm(nominal, stage.truth, random), stage_(stage) {
  const Eigen::Vector3d shift(random.normal() * 1e-3, random.normal() * 1e-3,
                              random.normal() * 1e-3);
  for (const calib::Target& t : nominal.targets) centre_m.push_back(t.centre_m + shift);
  for (calib::CertifiedLength& length : cell.lengths)
    length.length_m =
        (centre_m[cell.target_index(length.from)] - centre_m[cell.target_index(length.to)]).norm() +
        length.sigma_m * random.normal();
  rho_m = stage.rho_sigma_m * random.normal();
}

std::optional<calib::Touch> World::touch(const calib::PlannedTouch& planned, double warm,
                                         double beyond, calib::Random& random,
                                         const Eigen::Vector3d& moved_m) const {
  const std::size_t target = cell.target_index(planned.target);
  calib::Touch t;
  t.target = planned.target;
  t.set = planned.set;
  double radius = cell.targets[target].diameter_m / 2.0 + rho_m;
  radius += stage_.noise_m * random.normal();
  if (t.set == calib::TouchSet::kFit && random.uniform() < stage_.outlier_share) {
    radius += (random.uniform() < 0.7 ? 1.0 : -1.0) * random.uniform(0.2e-3, 3e-3);
    if (stage_.outliers_dropped) return std::nullopt;
  }
  const auto q = meet(arm, planned, centre_m[target] + moved_m, radius, warm, beyond);
  if (!q) return std::nullopt;
  t.joint_rad = *q;
  return t;
}

}  // namespace cellcal::experiments
