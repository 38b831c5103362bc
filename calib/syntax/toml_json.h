#pragma once
// TOML documents as JSON and back, so that one strict reader serves both.

#include <string>
#include <string_view>

#include "calib/syntax/toml_table.h"

namespace cellcal::calib {

/// 14 digits: predictions survive to 1e-12 m, and what the conversion of units left in the last two
/// does not show (38.84 deg stays 38.84).
std::string toml_number(double value);
/// Quoted and escaped as a TOML basic string.
std::string toml_string(std::string_view text);

/// TOML text to compact JSON text. Throws FileError.
std::string toml_to_json(std::string_view toml);
/// JSON object text as TOML text, keys in alphabetical order. Throws FileError.
std::string json_to_toml(std::string_view json);
/// JSON object text as a table for the strict reader. Throws FileError.
TomlTable table_from_json(std::string_view json, const std::string& name);

}  // namespace cellcal::calib
