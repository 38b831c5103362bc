#pragma once
// Poses of the TCP, as a CSV for cellcal correct: x_mm,y_mm,z_mm,a_deg,b_deg,c_deg, and joint angles
// to begin from where there are any, of all joints or none.

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
  JointVector seed_rad;                                   ///< empty: the file has none
  int line = 0;
};

/// Throw FileError, which names line and column.
std::vector<PoseRow> load_poses(const std::filesystem::path& path, const Robot& robot);
std::vector<PoseRow> parse_poses(std::string_view text, const std::string& name,
                                 const Robot& robot);

}  // namespace cellcal::calib
