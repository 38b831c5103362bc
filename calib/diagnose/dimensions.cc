#include "calib/diagnose/dimensions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "calib/model/kinematics.h"
#include "calib/model/median.h"
#include "calib/problem/problem.h"
#include "calib/problem/target_place.h"

namespace cellcal::calib {

namespace {

constexpr double kFarthestM = 0.32;
constexpr double kCoarseM = 40e-3;  // about a sphere's radius: the next one sees where it lies
constexpr double kFineM = 5e-3;     // the nominal arm is wrong by millimetres itself

}  // namespace

double nominal_off_m(const Cell& cell, const std::vector<Touch>& touches) {
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  const ArmModel arm(cell);
  const auto places = seen_places(cell, arm, touches);
  if (!places || arm.size() == 0)
    return kNowhere;  // without a tolerance nothing is to be identified
  const Problem problem(cell, arm, touches, *places);
  const Eigen::VectorXd x = problem.to_si(Eigen::VectorXd::Zero(problem.size()));
  const Problem::At at = problem.at(x.data());
  std::vector<double> off_m;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (touches[i].set != TouchSet::kFit) continue;
    double r[Problem::kMostRows] = {};
    problem.residual_m(i, at, r, nullptr, nullptr);
    const double off = Eigen::Map<Eigen::VectorXd>(r, problem.place_rows(i)).norm();
    if (std::isfinite(off)) off_m.push_back(off);
  }
  return off_m.empty() ? kNowhere : median(std::move(off_m));
}

double& Dimension::in(Cell& cell) const {
  switch (of) {
    case Of::kD:
      return cell.robot.joints[joint].d_m;
    case Of::kA:
      return cell.robot.joints[joint].a_m;
    case Of::kToolX:
      return cell.tool.tcp.translation().x();
    case Of::kToolY:
      return cell.tool.tcp.translation().y();
    case Of::kToolZ:
      break;
  }
  return cell.tool.tcp.translation().z();
}

std::vector<Dimension> dimensions_of(const Robot& robot) {
  std::vector<Dimension> result;
  for (std::size_t i = 0; i < robot.joints.size(); ++i)
    for (const JointError error : robot.joints[i].errors) {
      if (error == JointError::kD) result.push_back({Dimension::Of::kD, i});
      if (error == JointError::kA) result.push_back({Dimension::Of::kA, i});
    }
  return result;
}

Nearest nearest(const Cell& cell, const std::vector<Touch>& touches, const Dimension& dimension) {
  Cell changed = cell;
  double& value = dimension.in(changed);
  const double stated = value;
  Nearest best{0.0, nominal_off_m(cell, touches)};
  const auto look_at = [&](double add_m) {
    value = stated + add_m;
    if (const double off_m = nominal_off_m(changed, touches); off_m < best.off_m)
      best = {add_m, off_m};
  };
  for (double add_m = -kFarthestM; add_m <= kFarthestM; add_m += kCoarseM) look_at(add_m);
  for (double step_m = kCoarseM / 2.0; step_m >= kFineM; step_m /= 2.0) {
    const double middle_m = best.add_m;
    look_at(middle_m - step_m);
    look_at(middle_m + step_m);
  }
  return best;
}

double bring_tool_nearest(Cell& cell, const std::vector<Touch>& touches) {
  constexpr int kRounds = 4;
  double off_m = nominal_off_m(cell, touches);
  for (int round = 0; round < kRounds; ++round) {
    const double before_m = off_m;
    for (const auto axis : {Dimension::Of::kToolZ, Dimension::Of::kToolX, Dimension::Of::kToolY}) {
      const Dimension dimension{axis};
      const Nearest best = nearest(cell, touches, dimension);
      dimension.in(cell) += best.add_m;
      off_m = best.off_m;
    }
    if (!(off_m < before_m)) break;
  }
  return off_m;
}

std::vector<OtherArm> other_arms(const Cell& cell, const std::vector<Touch>& touches,
                                 const OtherRobots& other_robots) {
  std::vector<OtherArm> arms;
  if (!other_robots) return arms;
  for (NamedRobot& other : other_robots()) {
    if (other.robot.joints.size() != cell.robot.joints.size()) continue;
    OtherArm arm{other.file, cell};
    other.robot.gravity_m_s2 = cell.robot.gravity_m_s2;
    other.robot.base_fixed = cell.robot.base_fixed;
    other.robot.flange_fixed = cell.robot.flange_fixed;
    arm.cell.robot = std::move(other.robot);
    arm.off_m = nominal_off_m(arm.cell, touches);
    arms.push_back(std::move(arm));
  }
  std::sort(arms.begin(), arms.end(), [](const OtherArm& a, const OtherArm& b) {
    return a.off_m < b.off_m || (a.off_m == b.off_m && a.file < b.file);
  });
  return arms;
}

}  // namespace cellcal::calib
