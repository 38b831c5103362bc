#pragma once
// Surfaces of triangles as CAD writes them: STL, ASCII and binary, in millimetres.

#include <filesystem>
#include <string>
#include <string_view>

#include "calib/model/robot.h"

namespace cellcal::calib {

/// More triangles than this are refused: a cell's furniture needs hundreds.
inline constexpr std::size_t kMostTriangles = 400'000;

/// The triangles of all solids; normals are not read, triangles without an area are left out.
/// Throws FileError that names the line (ASCII) or the byte (binary). `name` stands for the file.
Mesh parse_stl(std::string_view bytes, const std::string& name);
Mesh load_stl(const std::filesystem::path& path);

}  // namespace cellcal::calib
