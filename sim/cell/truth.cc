#include "sim/cell/truth.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "calib/model/inverse.h"
#include "calib/model/random.h"

namespace cellcal::sim {

namespace {

constexpr double kRadPerArcsec = std::numbers::pi / 180.0 / 3600.0;
/// Tolerances are drawn within this: nobody ships an arm that is five sigma off its drawing.
constexpr double kLargestSigma = 2.5;

double bounded_normal(calib::Random& random) {
  return std::clamp(random.normal(), -kLargestSigma, kLargestSigma);
}

calib::ArmModel true_arm(const calib::Cell& cell, const TruthOptions& options) {
  calib::Robot robot = cell.robot;
  if (options.gear_arcsec > 0.0) {
    for (calib::Joint& joint : robot.joints) {
      joint.gear_ratio = 1.0;
      joint.harmonics = {1, 2};
      joint.harmonic_sigma_rad = options.gear_arcsec * kRadPerArcsec;
    }
  }
  calib::Tool tool = cell.tool;
  if (options.deflection > 0.0) tool.deflection_sigma = options.deflection;
  return {robot, tool};
}

/// Those that stand somewhere in the cell: a tracker looks on from anywhere.
std::vector<const calib::Target*> placed_targets(const calib::Cell& cell) {
  std::vector<const calib::Target*> placed;
  for (const calib::Target& target : cell.targets)
    if (target.kind != calib::TargetKind::kTracker) placed.push_back(&target);
  return placed;
}

/// Where the real arm's tip is when the nominal arm would be at the centres; the mean over a few
/// ways of holding the tool, as someone who teaches takes more than one look.
Eigen::Matrix3Xd taught_places(const Truth& truth, const calib::Cell& cell) {
  const calib::JointVector home = [&] {
    calib::JointVector q(cell.robot.joints.size(), 0.0);
    if (q.size() >= 5) q[1] = -1.2, q[2] = 1.6, q[4] = 1.0;
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = std::clamp(q[i], cell.robot.joints[i].min_rad, cell.robot.joints[i].max_rad);
    return q;
  }();
  const auto targets = placed_targets(cell);
  Eigen::Matrix3Xd places(3, static_cast<Eigen::Index>(targets.size()));
  for (std::size_t t = 0; t < targets.size(); ++t) {
    const Eigen::Vector3d& centre = targets[t]->centre_m;
    calib::JointVector seed = home;
    seed[0] = std::clamp(cell.robot.joints[0].sign * std::atan2(centre.y(), centre.x()),
                         cell.robot.joints[0].min_rad, cell.robot.joints[0].max_rad);
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    int reached = 0;
    constexpr int kLooks = 6;
    for (int look = 0; look < kLooks; ++look) {
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.translation() = centre;
      pose.linear() =
          (Eigen::AngleAxisd(look * 2.0 * std::numbers::pi / kLooks, Eigen::Vector3d::UnitZ()) *
           Eigen::AngleAxisd(std::numbers::pi, Eigen::Vector3d::UnitX()))
              .toRotationMatrix();
      const auto q = calib::inverse(truth.arm, pose, seed, 0.0);
      if (!q) continue;
      sum += truth.arm.position(truth.arm.prepare(*q), truth.errors.data());
      ++reached;
    }
    if (reached == 0)
      throw std::runtime_error("the emulated arm does not reach target " + targets[t]->id +
                               " with its tool pointing down; move it");
    places.col(static_cast<Eigen::Index>(t)) = sum / reached;
  }
  return places;
}

/// Spheres that are only known to be in a box stand somewhere in it.
calib::Cell with_all_places(calib::Cell cell, std::uint64_t seed) {
  calib::Random random(seed + 7919);  // none of the draws of the arm
  for (calib::Target& target : cell.targets) {
    if (target.has_centre || !target.has_box) continue;
    for (int k = 0; k < 3; ++k)
      target.centre_m[k] = random.uniform(target.low_m[k], target.high_m[k]);
  }
  return cell;
}

}  // namespace

Truth draw_truth(const calib::Cell& stated, const TruthOptions& options) {
  const calib::Cell cell = with_all_places(stated, options.seed);
  Truth truth{true_arm(cell, options), {}, {}, {}, {}};
  calib::Random random(options.seed);
  truth.errors.resize(truth.arm.size());
  for (int i = 0; i < truth.arm.size(); ++i) {
    const calib::ArmParameter& parameter = truth.arm.parameters()[i];
    const double draw = bounded_normal(random);
    switch (parameter.kind) {
      case calib::ParameterKind::kDeflection:
        truth.errors[i] =
            options.deflection >= 0.0 ? options.deflection : parameter.sigma * std::abs(draw);
        break;
      case calib::ParameterKind::kCompliance:
        truth.errors[i] = parameter.sigma * std::abs(draw);
        break;
      case calib::ParameterKind::kCosine:
      case calib::ParameterKind::kSine:
      case calib::ParameterKind::kPlay:
      case calib::ParameterKind::kTcp:
        truth.errors[i] = parameter.sigma * draw;
        break;
      default:
        truth.errors[i] = options.geometry_scale * parameter.sigma * draw;
    }
  }
  const Eigen::Matrix3Xd taught = taught_places(truth, cell);
  Eigen::Matrix3Xd nominal(3, taught.cols());
  for (Eigen::Index i = 0; i < nominal.cols(); ++i)
    nominal.col(i) = placed_targets(cell)[static_cast<std::size_t>(i)]->centre_m;
  const Eigen::Vector3d middle =
      taught.cols() > 0 ? taught.rowwise().mean() : Eigen::Vector3d::Zero().eval();
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  if (nominal.cols() >= 3)  // three points hold a rigid body
    place = Eigen::Isometry3d(Eigen::umeyama(nominal, taught, false));
  else if (nominal.cols() > 0)
    place.translation() = middle - nominal.rowwise().mean();
  Eigen::Vector3d shift, turn;
  for (int k = 0; k < 3; ++k) shift[k] = options.placement_m * bounded_normal(random);
  for (int k = 0; k < 3; ++k) turn[k] = options.placement_rad * bounded_normal(random);
  if (turn.norm() > 0.0)
    place = Eigen::Translation3d(middle) * Eigen::AngleAxisd(turn.norm(), turn.normalized()) *
            Eigen::Translation3d(-middle) * place;
  place.pretranslate(shift);
  for (const calib::Target& target : cell.targets) {
    truth.centre_m.push_back(place * target.centre_m);
    const double draw = bounded_normal(random);
    truth.radius_m.push_back(target.kind == calib::TargetKind::kSphere
                                 ? (target.diameter_m + target.diameter_sigma_m * draw) / 2.0 +
                                       cell.tool.tip_radius_m
                                 : 0.0);
    if (target.kind == calib::TargetKind::kPlane && target.extent_m > 0.0)
      truth.faces.push_back({truth.centre_m.back(), place.linear() * target.normal,
                             target.extent_m / 2.0, cell.tool.tip_radius_m});
  }
  return truth;
}

}  // namespace cellcal::sim
