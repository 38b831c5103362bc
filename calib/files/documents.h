#pragma once
// Robot and cell as TOML documents, both ways. A calibration carries the same documents as JSON.

#include <string>
#include <string_view>

#include "calib/model/robot.h"
#include "calib/syntax/toml_table.h"

namespace cellcal::calib {

Robot read_robot(const TomlTable& document);
Cell read_cell(const TomlTable& document, Robot robot);

std::string robot_to_toml(const Robot& robot);
/// `robot_reference` becomes the key `robot`.
std::string cell_to_toml(const Cell& cell, const std::string& robot_reference);

}  // namespace cellcal::calib
