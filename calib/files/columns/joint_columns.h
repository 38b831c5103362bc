#pragma once
// The joints' columns of a table, named as in the robot file.

#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/model/units.h"
#include "calib/syntax/csv.h"

namespace cellcal::calib {

/// Any angle will do to predict, to begin or to settle from; this only catches nonsense.
inline constexpr double kAnyAngleRad = 3600.0 * kRadPerDeg;

std::vector<std::string> joint_names(const Robot& robot);
/// Index of each joint's column. Throws FileError naming the first that is missing.
std::vector<int> joint_columns(const CsvTable& table, const Robot& robot, const std::string& name);
/// Of this row [rad]. Throws FileError for what can be no angle in degrees.
std::vector<double> read_joints(const CsvTable& table, const std::vector<int>& columns);

}  // namespace cellcal::calib
