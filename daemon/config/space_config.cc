#include "daemon/config/space_config.h"

#include <string>

#include "calib/model/nominal_arm.h"
#include "daemon/config/config_values.h"
#include "drivers/error.h"
#include "drivers/kuka/rsi/rsi_space.h"

namespace cellcal::daemon {
namespace {

using drivers::CorrectionFrame;

/// Range of an arm of 1.4 m, with rotations well below half a turn. The emulated controller accepts the
/// maximum.
constexpr double kUsualMm = 500.0, kDefaultTurnDeg = 90.0, kAnyMm = 5000.0, kAnyTurnDeg = 180.0;

class NominalGeometry final : public drivers::ArmGeometry {
 public:
  NominalGeometry(const calib::Robot& robot, const Eigen::Isometry3d& tcp) : arm_(robot, tcp) {}
  Eigen::Isometry3d tcp(std::span<const double> axis_rad) const noexcept override {
    return arm_.tcp(axis_rad);
  }

 private:
  calib::NominalArm arm_;
};

}  // namespace

void read_space(const calib::TomlTable& rsi, DaemonConfig& config) {
  drivers::SpaceCorrection& space = config.rsi.space;
  space.on = rsi.has("correction") && rsi.word("correction", {"axes", "space"}) == "space";
  if (space.on && config.rsi.mode == drivers::CorrectionMode::kRelative) {
    rsi.fail("correction",
             "must be \"axes\" with mode = \"relative\": a sum of rotations depends on their "
             "order, and the controller does not report it");
  }
  space.tag = read_name(rsi, "cart_tag", space.tag);
  if (rsi.has("correction_frame")) {
    const std::string frame = rsi.word("correction_frame", {"base", "robroot", "tool"});
    space.frame = frame == "base"      ? CorrectionFrame::kBase
                  : frame == "robroot" ? CorrectionFrame::kRobRoot
                                       : CorrectionFrame::kTool;
  }
  const bool mock = config.backend == BackendKind::kMock;
  space.limit_mm = rsi.number_or("correction_limit_mm", mock ? kAnyMm : kUsualMm, {1.0, kAnyMm});
  space.turn_limit_deg = rsi.number_or("correction_turn_limit_deg",
                                       mock ? kAnyTurnDeg : kDefaultTurnDeg, {0.1, kAnyTurnDeg});
  space.compare_tcp = config.controller.base == 0;
  if (space.on && space.frame == CorrectionFrame::kBase && config.controller.base != 0) {
    rsi.fail("correction_frame",
             "must be \"robroot\" or \"tool\" (RefCorrSys alike) if [controller] base is not "
             "0: the rotation of BASE_DATA is not known here");
  }
}

Eigen::Isometry3d controller_tcp(const DaemonConfig& config, const calib::Cell& cell) {
  return config.controller.tool == 0 ? Eigen::Isometry3d::Identity() : cell.tool.tcp;
}

std::shared_ptr<const drivers::ArmGeometry> controller_arm(const DaemonConfig& config,
                                                           const calib::Cell& cell) {
  constexpr std::size_t kAxes = 6;
  if (cell.robot.joints.size() != kAxes) {
    throw drivers::ConfigError("robot file of " + cell.robot.name + ": " +
                               std::to_string(cell.robot.joints.size()) +
                               " joints, but [rsi] correction = \"space\" drives exactly six: "
                               "use correction = \"axes\"");
  }
  return std::make_shared<NominalGeometry>(cell.robot, controller_tcp(config, cell));
}

calib::Passable passable_in_space(const drivers::SpaceCorrection& space) {
  if (!space.on) return {};
  return [arm = space.geometry](const calib::JointVector& from, const calib::JointVector& to) {
    return drivers::clear_of_singularities(*arm, {from.begin(), from.end()},
                                           {to.begin(), to.end()});
  };
}

}  // namespace cellcal::daemon
