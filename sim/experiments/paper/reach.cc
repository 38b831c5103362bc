#include "sim/experiments/paper/reach.h"

#include <Eigen/Dense>
#include <numbers>

namespace cellcal::sim::paper {

namespace {

constexpr int kStarts = 12;
constexpr int kSteps = 40;
constexpr double kLargestStep = 0.4;      // rad; keeps Newton's method on its initial branch
constexpr double kNominalAgrees = 1e-7;   // m and rad: reach_exactly refines it
constexpr double kExactlyAgrees = 1e-13;  // m; rounding of doubles at 2 m is about 4e-16
constexpr double kLimitMargin = 0.02;     // rad, so that small errors stay inside

using Angles = std::vector<double>;

/// Into (-pi, pi], the range of every revolute axis of the arms used here.
double wrapped(double angle) { return std::remainder(angle, 2.0 * std::numbers::pi); }

bool inside_limits(const calib::Robot& robot, const Angles& joint_rad, double margin) {
  for (std::size_t i = 0; i < joint_rad.size(); ++i)
    if (joint_rad[i] < robot.joints[i].min_rad + margin ||
        joint_rad[i] > robot.joints[i].max_rad - margin)
      return false;
  return true;
}

Angles random_start(const calib::Robot& robot, std::mt19937_64& random) {
  Angles start;
  for (const calib::Joint& joint : robot.joints) {
    const double low = std::max(joint.min_rad, -std::numbers::pi);
    const double high = std::min(joint.max_rad, std::numbers::pi);
    start.push_back(std::uniform_real_distribution<double>(low, high)(random));
  }
  return start;
}

void add(Angles& joint_rad, Eigen::VectorXd step) {
  if (const double largest = step.cwiseAbs().maxCoeff(); largest > kLargestStep)
    step *= kLargestStep / largest;
  for (std::size_t i = 0; i < joint_rad.size(); ++i)
    joint_rad[i] += step[static_cast<Eigen::Index>(i)];
}

}  // namespace

std::optional<Angles> reach_nominal(const calib::ArmModel& model, const Eigen::Matrix3d& flange,
                                    const Eigen::Vector3d& tip_m, std::mt19937_64& random) {
  const Eigen::Matrix3d tool = flange * model.tool().tcp.linear();
  for (int start = 0; start < kStarts; ++start) {
    Angles joint_rad = random_start(model.robot(), random);
    for (int step = 0; step < kSteps; ++step) {
      const Eigen::Isometry3d tcp = model.nominal_tcp(joint_rad);
      const Eigen::AngleAxisd turn(tool * tcp.linear().transpose());
      Eigen::Matrix<double, 6, 1> error;
      error << tip_m - tcp.translation(), turn.angle() * turn.axis();
      if (error.norm() < kNominalAgrees) {
        for (double& angle : joint_rad) angle = wrapped(angle);
        if (inside_limits(model.robot(), joint_rad, kLimitMargin)) return joint_rad;
        break;
      }
      add(joint_rad,
          model.nominal_jacobian(joint_rad).completeOrthogonalDecomposition().solve(error));
    }
  }
  return std::nullopt;
}

std::optional<Angles> reach_exactly(const calib::ArmModel& model, const double* x,
                                    const Eigen::Vector3d& tip_m, Angles joint_rad) {
  for (int step = 0; step < kSteps; ++step) {
    const Eigen::Vector3d error = tip_m - model.position(model.prepare(joint_rad), x);
    if (error.norm() < kExactlyAgrees)
      return inside_limits(model.robot(), joint_rad, 0.0) ? std::optional(joint_rad) : std::nullopt;
    const Eigen::Matrix3Xd jacobian = model.nominal_jacobian(joint_rad).topRows<3>();
    add(joint_rad, jacobian.completeOrthogonalDecomposition().solve(error));
  }
  return std::nullopt;
}

}  // namespace cellcal::sim::paper
