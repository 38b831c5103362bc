#include "calib/identify/problem.h"

#include <cmath>

#include "calib/files/error.h"

namespace cellcal::calib {

namespace {

using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Without a prior a centre is still expected within a few of these of its linear fit.
constexpr double kCentreScaleM = 0.01;

}  // namespace

Problem::Problem(const Cell& cell, const ArmModel& arm, std::span<const Touch> touches,
                 const std::vector<Eigen::Vector3d>& centres_m, double ripple_rad)
    : cell_(cell), arm_(arm), touches_(touches), scratch_(3, arm.size()) {
  for (const ArmParameter& parameter : arm.parameters())
    unknowns_.push_back(
        {parameter.name, parameter.unit, parameter.to_unit, 0.0, 0.0, parameter.sigma, 0.0, 1.0});
  if (cell.radius_offset_sigma_m > 0.0) {
    rho_ = static_cast<int>(unknowns_.size());
    unknowns_.push_back(
        {"touch.rho", "mm", 1000.0, 0.0, 0.0, cell.radius_offset_sigma_m, 0.0, 1.0, true});
  }
  shared_size_ = static_cast<int>(unknowns_.size());
  if (arm.size() == 0)
    throw IdentifyError(
        "nothing to identify: every tolerance in the robot file is 0; give the joints tolerances");

  std::vector<int> block_of_target(cell.targets.size(), -1);
  std::vector<bool> fitted(cell.targets.size(), false);
  for (const Touch& touch : touches) {
    target_of_.push_back(cell.target_index(touch.target));
    poses_.push_back(arm.prepare(touch.joint_rad));
    if (touch.set == TouchSet::kFit) fitted[target_of_.back()] = true;
  }
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    if (!fitted[t]) continue;
    const Target& target = cell.targets[t];
    block_of_target[t] = static_cast<int>(blocks_.size());
    TargetBlock block{t, static_cast<int>(unknowns_.size()),
                      target.kind == TargetKind::kSphere && target.diameter_sigma_m > 0.0};
    constexpr const char* kAxis[] = {".x", ".y", ".z"};
    for (int k = 0; k < 3; ++k) {
      Unknown unknown{target.id + kAxis[k], "mm", 1000.0, 0.0, centres_m[t][k], kCentreScaleM};
      unknown.nominal = target.has_centre ? target.centre_m[k] : centres_m[t][k];
      if (target.has_centre && target.centre_sigma_m > 0.0) {
        unknown.prior_mean_u = (target.centre_m[k] - centres_m[t][k]) / kCentreScaleM;
        unknown.prior_weight = kCentreScaleM / target.centre_sigma_m;
      }
      unknowns_.push_back(unknown);
    }
    if (block.has_radius)
      unknowns_.push_back({target.id + ".radius", "mm", 1000.0, 0.0, 0.0,
                           target.diameter_sigma_m / 2.0, 0.0, 1.0, true});
    blocks_.push_back(block);
  }
  for (std::size_t i = 0; i < touches.size(); ++i) {
    const Target& target = cell.targets[target_of_[i]];
    const Eigen::Matrix3Xd by_joint = arm.nominal_jacobian(touches[i].joint_rad).topRows<3>();
    const Eigen::Vector3d offset = arm.position(poses_[i], nullptr) - centres_m[target_of_[i]];
    // A point sees all three directions; each gets a third of the square.
    lever_m_.push_back(target.kind == TargetKind::kPoint
                           ? by_joint.norm() / std::sqrt(3.0)
                           : (offset.stableNormalized().transpose() * by_joint).norm());
    own_sigma_m_.push_back(touches[i].sigma_m > 0.0 ? touches[i].sigma_m : cell.touch_sigma_m);
  }
  set_ripple(ripple_rad);
  for (const std::size_t target : target_of_) block_of_.push_back(block_of_target[target]);
  for (const CertifiedLength& length : cell.lengths) {
    const int a = block_of_target[cell.target_index(length.from)];
    const int b = block_of_target[cell.target_index(length.to)];
    if (a >= 0 && b >= 0) lengths_.push_back({a, b, length.length_m, length.sigma_m});
  }
}

void Problem::set_ripple(double ripple_rad) {
  sigma_m_.resize(own_sigma_m_.size());
  for (std::size_t i = 0; i < sigma_m_.size(); ++i)
    sigma_m_[i] = std::hypot(own_sigma_m_[i], ripple_rad * lever_m_[i]);
}

int Problem::rows(std::size_t touch) const {
  return cell_.targets[target_of_[touch]].kind == TargetKind::kPoint ? 3 : 1;
}

double Problem::nominal_radius_m(const Target& target) const {
  return target.kind == TargetKind::kSphere ? target.diameter_m / 2.0 + cell_.tool.tip_radius_m
                                            : 0.0;
}

void Problem::residual_m(std::size_t touch, const double* shared, const double* target,
                         double* residual, double* by_shared, double* by_target,
                         Eigen::Vector3d* direction) const {
  const Target& what = cell_.targets[target_of_[touch]];
  const bool derivatives = by_shared != nullptr || by_target != nullptr;
  const Eigen::Vector3d tip = derivatives ? arm_.position(poses_[touch], shared, scratch_)
                                          : arm_.position(poses_[touch], shared);
  const Eigen::Vector3d offset = tip - Eigen::Map<const Eigen::Vector3d>(target);
  const double distance = offset.norm();
  // At the very centre every direction is as good; the residual is then -R and has no gradient.
  const Eigen::Vector3d normal =
      distance > 0.0 ? Eigen::Vector3d(offset / distance) : Eigen::Vector3d::UnitZ();
  if (direction != nullptr) *direction = normal;
  const bool has_radius = what.kind == TargetKind::kSphere && what.diameter_sigma_m > 0.0;
  const int target_size = has_radius ? 4 : 3;

  if (what.kind == TargetKind::kPoint) {  // p(q) - c
    Eigen::Map<Eigen::Vector3d>{residual} = offset;
    if (by_shared != nullptr) {
      Eigen::Map<RowMajor> j(by_shared, 3, shared_size_);
      j.leftCols(arm_.size()) = scratch_;
      if (rho_ >= 0) j.col(rho_).setZero();
    }
    if (by_target != nullptr) Eigen::Map<RowMajor>(by_target, 3, 3) = -Eigen::Matrix3d::Identity();
    return;
  }
  // sphere: |p - c| - (R + r_tip + rho + dR);  wire: |p - c| - L
  double radius =
      what.kind == TargetKind::kWire ? touches_[touch].radius_m : nominal_radius_m(what);
  const bool takes_rho = what.kind == TargetKind::kSphere && rho_ >= 0;
  if (takes_rho) radius += shared[rho_];
  if (has_radius) radius += target[3];
  *residual = distance - radius;
  if (by_shared != nullptr) {
    Eigen::Map<Eigen::RowVectorXd> j(by_shared, shared_size_);
    j.head(arm_.size()).noalias() = normal.transpose() * scratch_;
    if (rho_ >= 0) j[rho_] = takes_rho ? -1.0 : 0.0;
  }
  if (by_target != nullptr) {
    Eigen::Map<Eigen::RowVectorXd> j(by_target, target_size);
    j.head<3>() = -normal.transpose();
    if (has_radius) j[3] = -1.0;
  }
}

Eigen::VectorXd Problem::to_si(const Eigen::VectorXd& u) const {
  Eigen::VectorXd x(size());
  for (int i = 0; i < size(); ++i) x[i] = unknowns_[i].origin + unknowns_[i].scale * u[i];
  return x;
}

}  // namespace cellcal::calib
