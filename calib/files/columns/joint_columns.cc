#include "calib/files/columns/joint_columns.h"

#include <fmt/format.h>

#include <cmath>

#include "calib/model/units.h"
#include "calib/syntax/shown.h"

namespace cellcal::calib {

std::vector<int> joint_columns(const CsvTable& table, const Robot& robot, const std::string& name) {
  std::vector<int> columns;
  for (const Joint& joint : robot.joints) {
    columns.push_back(table.find(joint.name));
    if (columns.back() < 0)
      throw FileError(name, ":" + std::to_string(table.header_line()) + ": no column \"" +
                                joint.name +
                                "\"; one column per joint is needed, named as in the robot file");
  }
  return columns;
}

std::vector<double> read_joints(const CsvTable& table, const std::vector<int>& columns) {
  std::vector<double> angles(columns.size());
  for (std::size_t i = 0; i < columns.size(); ++i) {
    angles[i] = table.number(columns[i]) * kRadPerDeg;
    if (std::abs(angles[i]) > kAnyAngleRad)
      table.fail(columns[i], fmt::format("{} deg is out of range; angles are in degrees",
                                         shown(table.text(columns[i]))));
  }
  return angles;
}

std::vector<std::string> joint_names(const Robot& robot) {
  std::vector<std::string> names;
  for (const Joint& joint : robot.joints) names.push_back(joint.name);
  return names;
}

}  // namespace cellcal::calib
