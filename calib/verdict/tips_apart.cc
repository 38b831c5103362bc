#include "calib/verdict/tips_apart.h"

#include <algorithm>
#include <cmath>

#include "calib/linear/orthogonal.h"
#include "calib/model/kinematics.h"
#include "calib/uncertainty/predict.h"
#include "calib/uncertainty/region.h"

namespace cellcal::calib {

namespace {

constexpr unsigned kSeed = 20241120;
constexpr std::size_t kLeastPosesOfTips = 20;

}  // namespace

bool same_nominal(const Cell& a, const Cell& b) {
  constexpr double kRounding = 1e-9;
  const auto near = [](double x, double y) { return std::abs(x - y) <= kRounding; };
  return a.robot.joints.size() == b.robot.joints.size() &&
         a.tool.tcp.isApprox(b.tool.tcp, kRounding) &&
         a.robot.flange_fixed.isApprox(b.robot.flange_fixed, kRounding) &&
         std::equal(a.robot.joints.begin(), a.robot.joints.end(), b.robot.joints.begin(),
                    [&](const Joint& x, const Joint& y) {
                      return x.sign == y.sign && near(x.offset_rad, y.offset_rad) &&
                             near(x.d_m, y.d_m) && near(x.a_m, y.a_m) &&
                             near(x.alpha_rad, y.alpha_rad) && near(x.beta_rad, y.beta_rad);
                    });
}

std::vector<JointVector> poses_in_scope(const Cell& cell, std::span<const Touch> touches,
                                        bool workspace, int count) {
  const ArmModel arm(cell);
  if (workspace) return workspace_poses(arm, count, kSeed);
  constexpr double kNearM = 0.150;
  std::vector<JointVector> around;
  std::vector<Eigen::Vector3d> touched_m;
  for (const Touch& touch : touches) {
    around.push_back(touch.joint_rad);
    touched_m.push_back(arm.nominal_tip_m(touch.joint_rad, arm.tool_index(touch.tool)));
  }
  return local_poses(arm, around, touched_m, kNearM, count, kSeed);
}

Eigen::VectorXd tips_apart_m(const TipOf& one, const TipOf& other,
                             const std::vector<JointVector>& poses) {
  const auto n = static_cast<Eigen::Index>(poses.size());
  Eigen::VectorXd apart(3 * n);
  Eigen::Matrix<double, Eigen::Dynamic, 6> base(3 * n, 6);
  for (Eigen::Index i = 0; i < n; ++i) {
    const JointVector& q = poses[static_cast<std::size_t>(i)];
    const Eigen::Vector3d tip = other(q);
    apart.segment<3>(3 * i) = tip - one(q);
    base.middleRows<3>(3 * i) = base_motion(tip);
  }
  apart -= base * least_squares(base, apart);
  Eigen::VectorXd distances(n);
  for (Eigen::Index i = 0; i < n; ++i) distances[i] = apart.segment<3>(3 * i).norm();
  return distances;
}

std::optional<InScope> apart_in_scope(const Calibration* earlier, const Calibration& now,
                                      std::span<const Touch> touches, bool workspace) {
  if (earlier != nullptr && !same_nominal(earlier->cell, now.cell)) return {};
  const auto poses = poses_in_scope(now.cell, touches, workspace, kScopePoses);
  if (poses.size() < kLeastPosesOfTips) return {};
  const Predictor after(now), before(earlier != nullptr ? *earlier : now);
  const Eigen::VectorXd apart = tips_apart_m(
      [&](const JointVector& q) -> Eigen::Vector3d {
        return (earlier != nullptr ? before.calibrated(q).tcp : after.nominal(q)).translation();
      },
      [&](const JointVector& q) -> Eigen::Vector3d {
        return after.calibrated(q).tcp.translation();
      },
      poses);
  InScope in{workspace, static_cast<int>(poses.size()), apart.mean(), apart.maxCoeff()};
  for (const JointVector& q : poses) {
    const double u95_m = after.calibrated(q).u95_m;
    in.mean_u95_m += u95_m / in.poses;
    in.max_u95_m = std::max(in.max_u95_m, u95_m);
  }
  return in;
}

}  // namespace cellcal::calib
