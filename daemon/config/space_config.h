#pragma once
// Corrections in space as [rsi] has them, and the arm that they are reckoned on.

#include <Eigen/Geometry>
#include <memory>

#include "calib/files/toml.h"
#include "calib/model/robot.h"
#include "daemon/config/config.h"
#include "drivers/kuka/rsi/arm_geometry.h"

namespace cellcal::daemon {

/// correction, cart_tag, correction_frame, correction_limit_mm, correction_turn_limit_deg; after
/// mode and [controller]. Throws calib::FileError.
void read_space(const calib::TomlTable& rsi, DaemonConfig& config);

/// Flange to the TCP that is active at the controller: that of the cell file where [controller]
/// tool names a TOOL_DATA, the flange where it is 0.
Eigen::Isometry3d controller_tcp(const DaemonConfig& config, const calib::Cell& cell);

/// The nominal arm of the robot file with that TCP. Throws drivers::ConfigError unless it has six
/// joints.
std::shared_ptr<const drivers::ArmGeometry> controller_arm(const DaemonConfig& config,
                                                           const calib::Cell& cell);

/// What corrections in space cannot lead the arm through; null where corrections are of axes.
calib::Passable passable_in_space(const drivers::SpaceCorrection& space);

}  // namespace cellcal::daemon
