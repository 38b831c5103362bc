#include "tests/calib/simulate.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "calib/files/files.h"
#include "calib/model/inverse.h"
#include "calib/model/linear.h"
#include "sim/cell/truth.h"
#include "tests/experiments/constraints/stage.h"

namespace cellcal::calib::testing {

namespace {

using Eigen::Vector3d;

/// Touches from further below would collide with the post.
constexpr double kLowestElevationRad = -0.35;
constexpr double kLimitMarginRad = 0.01;

/// Speed of the i-th touch with this many targets.
double speed_of(const Making& making, int i, std::size_t targets) {
  constexpr int kSlowEvery = 8;
  const bool slow =
      making.slow_speed_m_s > 0.0 && i % kSlowEvery == i / kSlowEvery % static_cast<int>(targets);
  return slow ? making.slow_speed_m_s : making.speed_m_s;
}

Vector3d random_normal(Random& random, double widest_rad) {
  while (true) {
    const double z = random.uniform(-1.0, 1.0);
    const double turn = random.uniform(-std::numbers::pi, std::numbers::pi);
    const double r = std::sqrt(1.0 - z * z);
    if (std::asin(z) < kLowestElevationRad || std::acos(z) > widest_rad) continue;
    return {r * std::cos(turn), r * std::sin(turn), z};
  }
}

/// Moves the true tip to `point`: Newton's method with the nominal Jacobian, accurate to parts in a
/// thousand, so that each step gains three digits. Empty if outside the limits or not convergent.
JointVector bring_true_tip(const Cell& cell, const sim::Truth& truth, JointVector q,
                           const Vector3d& point) {
  constexpr double kThere = 1e-13;  // far below any noise, above the rounding of metres
  for (int k = 0; k < 12; ++k) {
    const Vector3d off = point - truth.arm.position(truth.arm.prepare(q), truth.errors.data());
    if (off.norm() < kThere) {
      for (std::size_t i = 0; i < q.size(); ++i)
        if (q[i] < cell.robot.joints[i].min_rad || q[i] > cell.robot.joints[i].max_rad) return {};
      return q;
    }
    const Eigen::Matrix3Xd j = truth.arm.nominal_jacobian(q).topRows<3>();
    const Eigen::VectorXd step = j.transpose() * (j * j.transpose()).inverse() * off;
    for (std::size_t i = 0; i < q.size(); ++i) q[i] += step[static_cast<Eigen::Index>(i)];
  }
  return {};
}

JointVector reach(const Cell& cell, const sim::Truth& truth, Random& random, const Vector3d& point,
                  const Vector3d& normal, double cone_rad) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = point;
  pose.linear() = sim::constraints::random_orientation(cell.tool, random, normal, cone_rad);
  const auto q =
      inverse(truth.arm, pose, sim::constraints::random_posture(cell.robot, random, point),
              kLimitMarginRad);
  return q ? bring_true_tip(cell, truth, *q, point) : JointVector{};
}

}  // namespace

const Cell& demo_cell() {
  static const Cell cell = load_cell(CELLCAL_DEMO_CELL);
  return cell;
}

Cell tracker_cell(double sigma_m) {
  Cell cell = demo_cell();
  cell.targets.assign(1, Target{});
  cell.targets[0].id = "T1";
  cell.targets[0].kind = TargetKind::kTracker;
  cell.lengths.clear();
  cell.touch_sigma_m = sigma_m;
  return cell;
}

const Cell& one_sphere_cell() {
  static const Cell cell = [] {
    Cell one = demo_cell();
    one.targets.resize(1);
    one.lengths.clear();
    return one;
  }();
  return cell;
}

sim::Truth plain_truth(const Cell& cell, std::uint64_t seed) {
  sim::TruthOptions options;
  options.seed = seed;
  return sim::draw_truth(cell, options);
}

double true_value(const sim::Truth& truth, const ParameterKey& key) {
  for (int p = 0; p < truth.arm.size(); ++p)
    if (truth.arm.parameters()[static_cast<std::size_t>(p)] == key) return truth.errors[p];
  return 0.0;
}

Made make_touches(const Cell& cell, const sim::Truth& truth, const Plan& plan,
                  const Making& making) {
  Random random(making.seed);
  Made made;
  for (const PlannedTouch& planned : plan.touches) {
    const std::size_t t = cell.target_index(planned.target);
    if (cell.targets[t].kind != TargetKind::kSphere)
      throw std::runtime_error("target " + planned.target + " is no sphere");
    Touch touch;
    touch.target = planned.target;
    touch.set = planned.set;
    double off = making.noise_m * random.normal();
    if (touch.set == TouchSet::kFit && random.uniform() < making.outlier_share) {
      off = random.uniform(0.5e-3, 20e-3) * (random.uniform() < 0.5 ? -1.0 : 1.0);
      made.outliers.push_back(made.touches.size());
    }
    touch.joint_rad = bring_true_tip(
        cell, truth, planned.standoff,
        truth.centre_m[t] + (truth.radius_m[t] + making.rho_m + off) * planned.normal);
    if (touch.joint_rad.empty())
      throw std::runtime_error("a planned touch of " + planned.target + " is out of reach");
    made.touches.push_back(std::move(touch));
  }
  return made;
}

Made make_touches(const Cell& cell, const sim::Truth& truth, const Making& making) {
  Random random(making.seed);
  Made made;
  const int total = making.fit + making.check;
  for (int i = 0; i < total; ++i) {
    const std::size_t t = static_cast<std::size_t>(i) % cell.targets.size();
    const Target& target = cell.targets[t];
    Touch touch;
    touch.target = target.id;
    // Check touches are distributed evenly among each target's.
    const auto checks_before = [&](std::size_t k) {
      return static_cast<int>(k) * making.check / total;
    };
    const std::size_t visit = static_cast<std::size_t>(i) / cell.targets.size();
    touch.set = checks_before(visit + 1) > checks_before(visit) ? TouchSet::kCheck : TouchSet::kFit;
    touch.speed_m_s = speed_of(making, i, cell.targets.size());
    double off = making.noise_m * random.normal();
    if (touch.set == TouchSet::kFit && random.uniform() < making.outlier_share) {
      off = random.uniform(0.5e-3, 20e-3) * (random.uniform() < 0.5 ? -1.0 : 1.0);
      made.outliers.push_back(made.touches.size());
    }
    for (int attempt = 0; touch.joint_rad.empty(); ++attempt) {
      if (attempt == 2000)
        throw std::runtime_error("no touch of target " + target.id + " is within reach");
      const Vector3d normal = random_normal(random, making.widest_rad);
      Vector3d point = truth.centre_m[t];
      if (target.kind == TargetKind::kSphere)
        point +=
            (truth.radius_m[t] + making.rho_m + off - touch.speed_m_s * making.delay_s) * normal;
      else if (target.kind == TargetKind::kWire)
        point += random.uniform(0.15, 0.5) * normal;
      else
        for (int k = 0; k < 3; ++k) point[k] += k == 0 ? off : making.noise_m * random.normal();
      touch.joint_rad = reach(cell, truth, random, point, normal, making.cone_rad);
      if (target.kind == TargetKind::kWire)
        touch.radius_m = (point - truth.centre_m[t]).norm() + off;
    }
    made.touches.push_back(std::move(touch));
  }
  return made;
}

}  // namespace cellcal::calib::testing
