#include "calib/model/inverse.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

namespace cellcal::calib {

namespace {

constexpr int kIterations = 60;
constexpr double kReached = 1e-9;        // m and rad
constexpr double kLargestStepRad = 0.3;  // Newton is trusted about this far
/// Metres that weigh as much as a radian: the lever of a middling arm's wrist.
constexpr double kLeverM = 0.5;
constexpr double kDamping = 1e-6;

}  // namespace

std::optional<JointVector> inverse(const ArmModel& arm, const Eigen::Isometry3d& tcp,
                                   const JointVector& seed, double margin_rad) {
  const auto& joints = arm.robot().joints;
  JointVector q = seed;
  for (int k = 0; k < kIterations; ++k) {
    const Eigen::Isometry3d now = arm.nominal_tcp(q);
    Eigen::Matrix<double, 6, 1> error;
    error.head<3>() = tcp.translation() - now.translation();
    const Eigen::AngleAxisd turn(tcp.linear() * now.linear().transpose());
    error.tail<3>() = turn.angle() * turn.axis();
    if (error.head<3>().norm() < kReached && error.tail<3>().norm() < kReached) {
      for (std::size_t i = 0; i < q.size(); ++i)
        if (q[i] < joints[i].min_rad + margin_rad || q[i] > joints[i].max_rad - margin_rad)
          return std::nullopt;
      return q;
    }
    Eigen::Matrix<double, 6, Eigen::Dynamic> j = arm.nominal_jacobian(q);
    j.bottomRows<3>() *= kLeverM;
    error.tail<3>() *= kLeverM;
    Eigen::Matrix<double, 6, 6> jjt = j * j.transpose();
    // Far off a step along a lost direction must stay small; close by Newton must be exact.
    const double damping = kDamping * std::min(1.0, error.squaredNorm()) + 1e-15;
    jjt.diagonal().array() += damping;
    Eigen::VectorXd step = j.transpose() * jjt.ldlt().solve(error);  // (8)
    const double largest = step.cwiseAbs().maxCoeff();
    if (!std::isfinite(largest)) return std::nullopt;
    if (largest > kLargestStepRad) step *= kLargestStepRad / largest;
    for (std::size_t i = 0; i < q.size(); ++i)
      q[i] = std::clamp(q[i] + step[static_cast<Eigen::Index>(i)], joints[i].min_rad,
                        joints[i].max_rad);
  }
  return std::nullopt;
}

}  // namespace cellcal::calib
