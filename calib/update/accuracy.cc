#include "calib/update/accuracy.h"

#include "calib/model/kinematics.h"
#include "calib/result/arm_values.h"
#include "calib/uncertainty/region.h"

namespace cellcal::calib {

namespace {

constexpr unsigned kSeed = 20240924;  // as the calibration's own figures have it
constexpr double kLocalHalfM = 0.150;
constexpr std::size_t kFewestPoses = 3;

ArmModel arm_of(const Calibration& c) { return ArmModel(at_level(c.cell, c.level)); }

Eigen::MatrixXd moves_at(const ArmModel& arm, const Eigen::VectorXd& x,
                         const std::vector<JointVector>& poses) {
  return aligned_moves(arm, poses, x.data(), Eigen::VectorXd::Ones(arm.size()));
}

Eigen::VectorXd stays_m2(const ArmModel& arm, const Calibration& c,
                         const std::vector<JointVector>& poses) {
  const double field_m2 = 3.0 * c.discrepancy.sigma_m * c.discrepancy.sigma_m;
  return ripple_variance_m2(arm, poses, c.level.ripple_rad).array() + field_m2;
}

}  // namespace

double foreseen_error_m(const Calibration& c, const std::vector<JointVector>& poses) {
  if (poses.size() < kFewestPoses) return 0.0;
  const ArmModel arm = arm_of(c);
  const Eigen::VectorXd x = arm_values(arm, c);
  return predicted_mean_error_m(moves_at(arm, x, poses), arm_covariance(arm, c),
                                stays_m2(arm, c, poses));
}

NominalError nominal_error_of(const Calibration& c, const std::vector<JointVector>& poses) {
  if (poses.size() < kFewestPoses) return {};
  const ArmModel arm = arm_of(c);
  const Eigen::VectorXd x = arm_values(arm, c);
  return nominal_error(arm, poses, x.data(), moves_at(arm, x, poses), arm_covariance(arm, c),
                       stays_m2(arm, c, poses));
}

std::vector<JointVector> stated_workspace(const Calibration& c, int count) {
  return workspace_poses(arm_of(c), count, kSeed);
}

std::vector<JointVector> stated_near_targets(const Calibration& c,
                                             const std::vector<JointVector>& around, int count) {
  std::vector<Eigen::Vector3d> centres;
  for (const TargetResult& target : c.targets) centres.push_back(target.centre_m);
  return local_poses(arm_of(c), around, centres, kLocalHalfM, count, kSeed);
}

}  // namespace cellcal::calib
