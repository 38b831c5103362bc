#pragma once
// TCP poses as a CSV for cellcal correct: x_mm,y_mm,z_mm,a_deg,b_deg,c_deg, and optionally the joint
// angles to start from, of all joints or none.

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/joint_vector.h"
#include "calib/model/robot.h"

namespace cellcal::calib {

struct PoseRow {
  Eigen::Isometry3d tcp = Eigen::Isometry3d::Identity();  ///< base frame
  JointVector seed_rad;                                   ///< empty: not in the file
  int line = 0;
};

/// Throw FileError naming line and column.
std::vector<PoseRow> load_poses(const std::filesystem::path& path, const Robot& robot);
std::vector<PoseRow> parse_poses(std::string_view text, const std::string& name,
                                 const Robot& robot);

}  // namespace cellcal::calib
