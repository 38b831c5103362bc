#pragma once
// Obstacles of a cell file: [[obstacle]], and the stands of targets.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "calib/files/toml.h"
#include "calib/model/robot.h"

namespace cellcal::calib {

std::vector<Obstacle> read_obstacles(const TomlTable& document, const Robot& robot);
/// `on`: number of the positioner's axes that carry it; 0 without the key. Refuses an axis that the
/// robot lacks.
int read_carrier(const TomlTable& table, const Robot& robot);
/// Empty for the floor.
std::string carrier_to_toml(int carried_by, const Robot& robot);
std::string obstacles_to_toml(const std::vector<Obstacle>& obstacles, const Robot& robot);

/// The keys stand, stand_diameter_mm and stand_height_mm of a target.
void read_stand(const TomlTable& table, Target& target);
std::string stand_to_toml(const Target& target);

// Triangle meshes from CAD: STL, ASCII and binary, in millimetres.

/// Maximum number of triangles: the furniture of a cell needs hundreds.
inline constexpr std::size_t kMostTriangles = 400'000;

/// Triangles of all solids; normals are ignored, triangles without an area are omitted. Throws
/// FileError naming the line (ASCII) or the byte (binary). `name` denotes the file.
Mesh parse_stl(std::string_view bytes, const std::string& name);
Mesh load_stl(const std::filesystem::path& path);

}  // namespace cellcal::calib
