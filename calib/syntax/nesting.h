#pragma once

#include <string>
#include <string_view>

namespace cellcal::calib {

/// Throws FileError when a dotted key (TOML) or a value (JSON) is nested deeper than any of our
/// documents: their libraries walk such trees by recursion, which hostile text could let overflow.
void refuse_deep_toml(std::string_view text, const std::string& name);
void refuse_deep_json(std::string_view text, const std::string& name);

}  // namespace cellcal::calib
