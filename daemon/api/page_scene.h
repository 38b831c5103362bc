#pragma once
// What a picture of the cell needs, so that the page moves the arm by its joint angles alone.
//
//   base . T_1 ... T_n . flange . tool,   T_i = Rz(sign_i q_i + offset_i) . behind_i
//
// Frames are three rows of four, row by row: the rotation, and the origin in mm. The nominal model.

#include <Eigen/Geometry>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "calib/model/joint_vector.h"
#include "calib/model/robot.h"
#include "calib/plan/planned_touch.h"

namespace cellcal::daemon::web {

/// Meshes with more triangles than this go as the box around them.
inline constexpr std::size_t kMostTrianglesDrawn = 20'000;

/// `cell` has its meshes, as far as they could be read.
std::string scene_to_json(std::int64_t session, const calib::Cell& cell);

// The touches that are to be made.

/// `first`: number of the plan's first touch in its session. The tip is where the contact is
/// expected, the joints are those of the stand-off.
std::string plan_to_json(std::int64_t session, std::size_t first, const calib::Plan& plan,
                         const calib::Cell& cell);

// Points, frames and angles as the page takes them: millimetres and degrees, and only finite numbers.

/// null where it is not finite.
nlohmann::json number(double value, double factor = 1.0);
nlohmann::json mm(const Eigen::Vector3d& point_m);
/// Three rows of four: the rotation, and where the origin is [mm].
nlohmann::json frame(const Eigen::Isometry3d& frame);
nlohmann::json degrees(const calib::JointVector& joint_rad);

std::string dump(const nlohmann::json& value);

}  // namespace cellcal::daemon::web
