#pragma once
// Poses in the frame that an axis of the positioner carries: --on E2.

#include <filesystem>
#include <string>
#include <vector>

#include "calib/result/calibration.h"

namespace cellcal::daemon {

/// Number of the axes that carry the frame of this one; 0, the base frame, for an empty name. Throws
/// std::runtime_error naming the axes that there are.
int carriers_of(const calib::Robot& robot, const std::string& axis);

/// Angles of the first `carriers` axes in each row. Throws calib::FileError for a table without them.
std::vector<std::vector<double>> carrier_angles(std::vector<std::vector<double>> positioner_rad,
                                                int carriers, const std::filesystem::path& table,
                                                const calib::Robot& robot);

/// Warns of poses outside the calibration's scope, on standard error: far from its targets, and at
/// angles that nothing was touched at. `tcps_m`: in the base frame, or that of the axes with
/// `carrier_rad`, a row each.
void warn_outside_scope(const calib::Calibration& calibration,
                        const std::vector<Eigen::Vector3d>& tcps_m,
                        const std::vector<std::vector<double>>& carrier_rad = {});

}  // namespace cellcal::daemon
