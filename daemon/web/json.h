#pragma once
// Points, frames and angles as the page takes them: millimetres and degrees, and only finite numbers.

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include "calib/model/joint_vector.h"

namespace cellcal::daemon::web {

/// null where it is not finite.
nlohmann::json number(double value, double factor = 1.0);
nlohmann::json mm(const Eigen::Vector3d& point_m);
/// Three rows of four: the rotation, and where the origin is [mm].
nlohmann::json frame(const Eigen::Isometry3d& frame);
nlohmann::json degrees(const calib::JointVector& joint_rad);

std::string dump(const nlohmann::json& value);

}  // namespace cellcal::daemon::web
