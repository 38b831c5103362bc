#pragma once
// The part of a cell file that says what stands in the way: [[obstacle]], the stands of targets.

#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/syntax/toml_table.h"

namespace cellcal::calib {

std::vector<Obstacle> read_obstacles(const TomlTable& document);
std::string obstacles_to_toml(const std::vector<Obstacle>& obstacles);

/// The keys stand, stand_diameter_mm and stand_height_mm of a target.
void read_stand(const TomlTable& table, Target& target);
std::string stand_to_toml(const Target& target);

}  // namespace cellcal::calib
