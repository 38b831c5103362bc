#pragma once
// The part of a cell file that says what stands in the way: [[obstacle]], the stands of targets.

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "calib/files/toml.h"
#include "calib/model/robot.h"

namespace cellcal::calib {

std::vector<Obstacle> read_obstacles(const TomlTable& document);
std::string obstacles_to_toml(const std::vector<Obstacle>& obstacles);

/// The keys stand, stand_diameter_mm and stand_height_mm of a target.
void read_stand(const TomlTable& table, Target& target);
std::string stand_to_toml(const Target& target);

// Surfaces of triangles as CAD writes them: STL, ASCII and binary, in millimetres.

/// More triangles than this are refused: a cell's furniture needs hundreds.
inline constexpr std::size_t kMostTriangles = 400'000;

/// The triangles of all solids; normals are not read, triangles without an area are left out.
/// Throws FileError that names the line (ASCII) or the byte (binary). `name` stands for the file.
Mesh parse_stl(std::string_view bytes, const std::string& name);
Mesh load_stl(const std::filesystem::path& path);

}  // namespace cellcal::calib
