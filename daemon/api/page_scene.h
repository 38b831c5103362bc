#pragma once
// Data of a 3D view of the cell, which lets the page move the arm by its joint angles.
//
//   base . T_1 ... T_n . flange . tool,   T_i = Rz(sign_i q_i + offset_i) . behind_i
//
// Frames are 3x4, row-major: rotation, and origin in mm. Nominal model.

#include <Eigen/Geometry>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "calib/model/joint_vector.h"
#include "calib/model/robot.h"
#include "calib/plan/planned_touch.h"

namespace cellcal::daemon::web {

/// Meshes with more triangles are replaced by their bounding box.
inline constexpr std::size_t kMostTrianglesDrawn = 20'000;

/// `cell`: with the meshes that could be read.
std::string scene_to_json(std::int64_t session, const calib::Cell& cell);

// Planned touches.

/// `first`: number of the plan's first touch in its session. The tip is at the expected contact, the joints
/// are those of the stand-off.
std::string plan_to_json(std::int64_t session, std::size_t first, const calib::Plan& plan,
                         const calib::Cell& cell);

// Points, frames and angles for the page: millimetres and degrees, finite numbers only.

/// null for a non-finite value.
nlohmann::json number(double value, double factor = 1.0);
nlohmann::json mm(const Eigen::Vector3d& point_m);
/// 3x4, row-major: rotation, and origin [mm].
nlohmann::json frame(const Eigen::Isometry3d& frame);
nlohmann::json degrees(const calib::JointVector& joint_rad);

std::string dump(const nlohmann::json& value);

}  // namespace cellcal::daemon::web
