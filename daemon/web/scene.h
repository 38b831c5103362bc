#pragma once
// What a picture of the cell needs, so that the page moves the arm by its joint angles alone.
//
//   base . T_1 ... T_n . flange . tool,   T_i = Rz(sign_i q_i + offset_i) . behind_i
//
// Frames are three rows of four, row by row: the rotation, and the origin in mm. The nominal model.

#include <cstdint>
#include <string>

#include "calib/model/robot.h"

namespace cellcal::daemon::web {

/// Meshes with more triangles than this go as the box around them.
inline constexpr std::size_t kMostTrianglesDrawn = 20'000;

/// `cell` has its meshes, as far as they could be read.
std::string scene_to_json(std::int64_t session, const calib::Cell& cell);

}  // namespace cellcal::daemon::web
