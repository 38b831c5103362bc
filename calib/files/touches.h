#pragma once
// Columns of a table of touches other than the joints'.

#include <Eigen/Geometry>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "calib/files/csv.h"
#include "calib/model/joint_vector.h"
#include "calib/model/robot.h"
#include "calib/model/units.h"

namespace cellcal::calib {

inline constexpr std::string_view kTouchColumns[] = {
    "target",     "sigma_mm",   "radius_mm",  "x_mm",           "y_mm",
    "z_mm",       "a_deg",      "b_deg",      "c_deg",          "set",
    "time",       "tool",       "load",       "turn_sigma_deg", "temperature_c",
    "speed_mm_s", "approach_x", "approach_y", "approach_z",     "qw",
    "qx",         "qy",         "qz"};

// Joint columns of a table, named as in the robot file.

/// Plausibility limits: prediction, starting and settled poses accept any angle, and any position of
/// a linear unit.
inline constexpr double kAnyAngleRad = 3600.0 * kRadPerDeg, kAnyPositionM = 100.0;

/// A joint's position [rad, m] from that in files [deg, mm].
double joint_si(const Joint& joint, double in_files);
/// Of a linear unit also with its unit: E1 and E1_mm.
std::vector<std::string> joint_names(const Robot& robot);
/// Takes columns J1, q1, "Joint 1" and the like for the turning joints (CsvTable::take_for_joints).
void take_for_joints(CsvTable& table, const Robot& robot);
/// Index of each joint's column. Throws FileError naming the first that is missing.
std::vector<int> joint_columns(const CsvTable& table, const Robot& robot);
/// Angles of the current row [rad], positions of linear units [m]. Throws FileError for values that
/// cannot be degrees or millimetres.
std::vector<double> read_joints(const CsvTable& table, const Robot& robot,
                                const std::vector<int>& columns);

// TCP poses as a CSV for cellcal correct: x_mm,y_mm,z_mm,a_deg,b_deg,c_deg or qw,qx,qy,qz, and optionally the joint
// angles to start from, of all joints or none, and those of a positioner, likewise.

struct PoseRow {
  Eigen::Isometry3d tcp = Eigen::Isometry3d::Identity();  ///< base frame, or that of --on
  JointVector seed_rad;                                   ///< empty: not in the file
  std::vector<double> positioner_rad;                     ///< likewise
  int line = 0;
};

/// Throw FileError naming line and column.
std::vector<PoseRow> load_poses(const std::filesystem::path& path, const Robot& robot);
std::vector<PoseRow> parse_poses(std::string_view text, const std::string& name,
                                 const Robot& robot);

}  // namespace cellcal::calib
