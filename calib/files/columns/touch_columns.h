#pragma once
// The columns of a table of touches beside those of the joints.

#include <string_view>

namespace cellcal::calib {

inline constexpr std::string_view kTouchColumns[] = {
    "target",         "sigma_mm",      "radius_mm",  "x_mm",       "y_mm",       "z_mm",
    "a_deg",          "b_deg",         "c_deg",      "set",        "time",       "tool",
    "turn_sigma_deg", "temperature_c", "speed_mm_s", "approach_x", "approach_y", "approach_z"};

}  // namespace cellcal::calib
