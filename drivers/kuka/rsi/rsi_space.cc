#include "drivers/kuka/rsi/rsi_space.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "drivers/kuka/moves/position_record.h"
#include "drivers/units.h"

namespace cellcal::drivers {

namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
constexpr std::size_t kAxes = 6;

// Sampling step along a line; the region near a singularity excluded by kMostGain is wider.
constexpr double kStepRad = 1.0 * kRadPerDeg;
// Finite difference for the inverse; its relative error of 1e-6 is negligible.
constexpr double kDifferenceRad = 1e-6;

// For smaller cos B only the sum or difference of A and C is determined: assigned to C.
constexpr double kLost = 1e-7;

KukaFrame to_frame(const Vector3d& shift_m, const Matrix3d& turn) {
  const Vector3d mm = shift_m * kMmPerM;
  const double across = std::hypot(turn(0, 0), turn(1, 0));
  const double a = across < kLost ? 0.0 : std::atan2(turn(1, 0), turn(0, 0));
  const double b = std::atan2(-turn(2, 0), across);
  const double c =
      across < kLost ? std::atan2(-turn(1, 2), turn(1, 1)) : std::atan2(turn(2, 1), turn(2, 2));
  return {mm.x(), mm.y(), mm.z(), a * kDegPerRad, b * kDegPerRad, c * kDegPerRad};
}

Matrix3d to_turn(const KukaFrame& frame) {
  return (AngleAxisd(frame[3] * kRadPerDeg, Vector3d::UnitZ()) *
          AngleAxisd(frame[4] * kRadPerDeg, Vector3d::UnitY()) *
          AngleAxisd(frame[5] * kRadPerDeg, Vector3d::UnitX()))
      .toRotationMatrix();
}

Isometry3d tcp_at(const ArmGeometry& arm, const AxisAngles& axis_rad) {
  return arm.tcp({axis_rad.data(), axis_rad.size()});
}

// The axis with the largest rotation per small motion of the TCP, and the ratio [rad per m or rad].
cause::NearSingular gain_at(const ArmGeometry& arm, const AxisAngles& axis_rad) {
  const Isometry3d here = tcp_at(arm, axis_rad);
  Eigen::Matrix<double, 6, 6> jacobian;
  for (std::size_t i = 0; i < kAxes; ++i) {
    AxisAngles beside = axis_rad;
    beside[i] += kDifferenceRad;
    const Isometry3d there = tcp_at(arm, beside);
    const Matrix3d turn = there.linear() * here.linear().transpose();
    const auto column = static_cast<Eigen::Index>(i);
    jacobian.col(column).head<3>() = there.translation() - here.translation();
    jacobian.col(column).tail<3>() << turn(2, 1), turn(0, 2), turn(1, 0);
  }
  jacobian /= kDifferenceRad;
  const Eigen::Matrix<double, 6, 6> inverse = jacobian.partialPivLu().inverse();
  cause::NearSingular most{0, 0.0, kMostGain};
  for (std::size_t i = 0; i < kAxes; ++i) {
    const double gain = inverse.row(static_cast<Eigen::Index>(i)).norm();
    if (gain <= most.gain) continue;  // NaN if the arm is exactly singular
    most.axis = static_cast<std::uint8_t>(i);
    most.gain = std::isfinite(gain) ? gain : HUGE_VAL;
  }
  return most;
}

int steps_of(const AxisAngles& from_rad, const AxisAngles& to_rad) {
  constexpr double kMostSteps = 720.0;  // two revolutions: angles of a damaged packet are arbitrary
  const double steps = std::ceil(farthest_axis(from_rad, to_rad).rad / kStepRad);
  return static_cast<int>(std::clamp(steps, 1.0, kMostSteps));
}

/// `zero` plus the interpolation from `from` to `to`.
AxisAngles between(const AxisAngles& zero_rad, const AxisAngles& from_rad, const AxisAngles& to_rad,
                   double share) {
  AxisAngles axes = zero_rad;
  for (std::size_t i = 0; i < kAxes; ++i)
    axes[i] += from_rad[i] + share * (to_rad[i] - from_rad[i]);
  return axes;
}

double turn_of(const KukaFrame& frame) { return AngleAxisd(to_turn(frame)).angle() * kDegPerRad; }

Isometry3d unpack(const std::array<double, 12>& packed) {
  Isometry3d pose = Isometry3d::Identity();
  pose.matrix().topRows<3>() = Eigen::Map<const Eigen::Matrix<double, 3, 4>>(packed.data());
  return pose;
}

}  // namespace

void SpaceCorrector::begin(const AxisAngles& start_rad) {
  if (!config_.on) return;
  start_rad_ = start_rad;
  Eigen::Map<Eigen::Matrix<double, 3, 4>>(start_.data()) =
      tcp_at(*config_.geometry, start_rad).matrix().topRows<3>();
}

KukaFrame SpaceCorrector::frame_at(const AxisAngles& axis_rad) const {
  const Isometry3d from = unpack(start_), to = tcp_at(*config_.geometry, axis_rad);
  const Vector3d shift = to.translation() - from.translation();
  if (config_.frame == CorrectionFrame::kTool) {
    return to_frame(from.linear().transpose() * shift, from.linear().transpose() * to.linear());
  }
  return to_frame(shift, to.linear() * from.linear().transpose());
}

std::optional<KukaFrame> SpaceCorrector::rkorr(std::span<const double> correction_deg) const {
  if (correction_deg.size() != kAxes || start_rad_.size() != kAxes) return std::nullopt;
  AxisAngles axes = start_rad_;
  for (std::size_t i = 0; i < kAxes; ++i) axes[i] += correction_deg[i] * kRadPerDeg;
  const KukaFrame frame = frame_at(axes);
  for (const double value : frame) {
    if (!std::isfinite(value)) return std::nullopt;
  }
  return frame;
}

std::optional<Cause> SpaceCorrector::object_to(const AxisAngles& from_rad,
                                               const AxisAngles& to_rad) const {
  if (!config_.on) return std::nullopt;
  const int steps = steps_of(from_rad, to_rad);
  for (int step = 1; step <= steps; ++step) {
    const AxisAngles axes =
        between(start_rad_, from_rad, to_rad, static_cast<double>(step) / steps);
    const KukaFrame frame = frame_at(axes);
    const double shift = std::hypot(frame[0], frame[1], frame[2]), turn = turn_of(frame);
    if (!(shift <= config_.limit_mm)) return cause::ShiftLimit{shift, config_.limit_mm};
    if (!(turn <= config_.turn_limit_deg)) return cause::TurnLimit{turn, config_.turn_limit_deg};
    const cause::NearSingular most = gain_at(*config_.geometry, axes);
    if (most.gain > kMostGain) return most;
  }
  return std::nullopt;
}

bool clear_of_singularities(const ArmGeometry& arm, const AxisAngles& from_rad,
                            const AxisAngles& to_rad) {
  const AxisAngles zero(kAxes, 0.0);
  const int steps = steps_of(from_rad, to_rad);
  for (int step = 1; step <= steps; ++step) {
    const double share = static_cast<double>(step) / steps;
    if (gain_at(arm, between(zero, from_rad, to_rad, share)).gain > kMostGain) return false;
  }
  return true;
}

TcpApart SpaceCorrector::apart(const RobFrame& frame, const AxisAngles& actual_rad) const {
  if (!config_.on || !config_.compare_tcp || !frame.tcp || actual_rad.size() != kAxes) return {};
  const KukaFrame& said = *frame.tcp;
  // Peers without a geometry send zeros.
  if (std::all_of(said.begin(), said.end(), [](double v) { return v == 0.0; })) return {};
  const Isometry3d here = tcp_at(*config_.geometry, actual_rad);
  const Vector3d there = Vector3d(said[0], said[1], said[2]) / kMmPerM;
  const Matrix3d turn = here.linear().transpose() * to_turn(said);
  return {(there - here.translation()).norm() * kMmPerM, AngleAxisd(turn).angle() * kDegPerRad};
}

}  // namespace cellcal::drivers
