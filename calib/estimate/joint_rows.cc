#include "calib/estimate/joint_rows.h"

namespace cellcal::calib {

std::vector<RowsOfJoint> rows_by_joint(const Problem& problem, const Estimate& e) {
  const Robot& robot = problem.arm().robot();
  const Linearisation& linear = e.posterior.linear;
  std::vector<RowsOfJoint> all;
  for (std::size_t j = robot.first_turning(); j < robot.joints.size(); ++j)
    all.push_back(
        {j, Eigen::VectorXd::Zero(linear.length_row), Eigen::VectorXd::Zero(linear.length_row)});
  const Eigen::VectorXd x = problem.to_si(e.u);
  const Problem::At at = problem.at(x.data());
  ArmChain chain;
  for (const auto& [touch, row] : linear.touch_row) {
    problem.arm().walk(problem.pose(touch), at.arm, chain);
    Eigen::Matrix3d along = Eigen::Matrix3d::Identity();
    const int count = problem.place_rows(touch);
    if (count == 1) {
      double residual_m = 0.0;
      Eigen::Vector3d direction;
      problem.residual_m(touch, at, &residual_m, nullptr, nullptr, &direction);
      along.col(0) = direction;
    }
    for (RowsOfJoint& one : all) {
      const ArmChain::Link& link = chain.link[one.joint];
      const Eigen::Vector3d moves = link.z.cross(chain.tip - link.z_origin);
      one.lever.segment(row, count) =
          along.leftCols(count).transpose() * moves / problem.sigma_m(touch);
      one.angle_rad.segment(row, problem.rows(touch))
          .setConstant(problem.touches()[touch].joint_rad[one.joint]);
    }
  }
  return all;
}

Eigen::MatrixXd waves_of(const RowsOfJoint& rows, int lowest, int highest) {
  const Eigen::ArrayXd lever = rows.lever.array(), angle = rows.angle_rad.array();
  const Eigen::ArrayXd once_c = angle.cos(), once_s = angle.sin();
  Eigen::MatrixXd waves(lever.size(), 2 * (highest - lowest + 1));
  Eigen::ArrayXd c = lever * (lowest * angle).cos(), s = lever * (lowest * angle).sin();
  for (Eigen::Index k = 0; k < waves.cols(); k += 2) {
    waves.col(k) = c;
    waves.col(k + 1) = s;
    const Eigen::ArrayXd next = c * once_c - s * once_s;
    s = s * once_c + c * once_s;
    c = next;
  }
  return waves;
}

}  // namespace cellcal::calib
