#pragma once
// Cartesian corrections of [rsi], and the arm model they are computed with.

#include <Eigen/Geometry>
#include <memory>

#include "calib/files/toml.h"
#include "calib/model/robot.h"
#include "daemon/config/config.h"
#include "drivers/kuka/rsi/rsi_space.h"

namespace cellcal::daemon {

/// correction, cart_tag, correction_frame, correction_limit_mm, correction_turn_limit_deg; to be called after
/// mode and [controller] are read. Throws calib::FileError.
void read_space(const calib::TomlTable& rsi, DaemonConfig& config);

/// Flange to the active TCP of the controller: that of the cell file where [controller] tool names a
/// TOOL_DATA, the flange for 0.
Eigen::Isometry3d controller_tcp(const DaemonConfig& config, const calib::Cell& cell);

/// Nominal arm of the robot file with that TCP. Throws drivers::ConfigError unless it has six joints.
std::shared_ptr<const drivers::ArmGeometry> controller_arm(const DaemonConfig& config,
                                                           const calib::Cell& cell);

/// Postures that Cartesian corrections can pass; null for corrections of axes.
calib::Passable passable_in_space(const drivers::SpaceCorrection& space);

}  // namespace cellcal::daemon
