#pragma once
// Robot and cell as TOML documents, both ways, and the same documents as JSON, so that a
// calibration can carry them and one strict reader serves both.

#include <string>
#include <string_view>

#include "calib/files/toml_table.h"
#include "calib/model/robot.h"

namespace cellcal::calib {

Robot read_robot(const TomlTable& document);
Cell read_cell(const TomlTable& document, Robot robot);

std::string robot_to_toml(const Robot& robot);
/// `robot_reference` becomes the key `robot`.
std::string cell_to_toml(const Cell& cell, const std::string& robot_reference);

/// 14 digits: predictions survive to 1e-12 m, and what the conversion of units left in the last two
/// does not show (38.84 deg stays 38.84).
std::string toml_number(double value);
/// Quoted and escaped as a TOML basic string.
std::string toml_string(std::string_view text);

/// Throws FileError when a dotted key (TOML) or a value (JSON) is nested deeper than any of our
/// documents: their libraries walk such trees by recursion, which hostile text could let overflow.
void refuse_deep_toml(std::string_view text, const std::string& name);
void refuse_deep_json(std::string_view text, const std::string& name);

/// TOML text to compact JSON text. Throws FileError.
std::string toml_to_json(std::string_view toml);
/// JSON object text as a table for the strict reader. Throws FileError.
TomlTable table_from_json(std::string_view json, const std::string& name);

}  // namespace cellcal::calib
