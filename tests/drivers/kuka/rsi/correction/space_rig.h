#pragma once
// The adapter with corrections in space and an emulated controller with the arm's geometry.

#include <memory>

#include "calib/model/nominal_arm.h"
#include "drivers/kuka/rsi/rsi_space.h"
#include "tests/drivers/kuka/rsi/rig.h"
#include "tests/sim/krc/arm_cell.h"

namespace cellcal::drivers {

class NominalGeometry final : public ArmGeometry {
 public:
  explicit NominalGeometry(const calib::Cell& cell) : arm_(cell.robot, cell.tool.tcp) {}
  Eigen::Isometry3d tcp(std::span<const double> axis_rad) const noexcept override {
    return arm_.tcp(axis_rad);
  }

 private:
  calib::NominalArm arm_;
};

/// A torch: its tip 0.4 m in front of the flange, and rotated.
inline calib::Cell torch_cell() {
  calib::Cell cell = sim::arm_cell();
  cell.tool.tcp.translation() = Eigen::Vector3d(0.06, 0.05, 0.41);
  cell.tool.tcp.linear() = (Eigen::AngleAxisd(39 * kDeg, Eigen::Vector3d::UnitZ()) *
                            Eigen::AngleAxisd(-25 * kDeg, Eigen::Vector3d::UnitY()))
                               .toRotationMatrix();
  return cell;
}

inline RsiConfig space_config(CorrectionFrame frame = CorrectionFrame::kBase) {
  RsiConfig config = rig_config();
  config.space.on = true;
  config.space.frame = frame;
  config.space.limit_mm = 1500.0;
  config.space.geometry = std::make_shared<NominalGeometry>(torch_cell());
  return config;
}

inline sim::ControllerConfig space_krc(sim::CorrectionFrame frame = sim::CorrectionFrame::kBase) {
  sim::ControllerConfig config;
  config.arm = sim::make_cartesian_arm(torch_cell());
  config.cartesian_system = frame;
  config.clamp_mm = config.monitor_mm = 1500.0;
  return config;
}

/// Content of a reply before its IPOC.
inline std::string said(const std::string& reply) { return reply.substr(0, reply.find("<IPOC>")); }

}  // namespace cellcal::drivers
