#pragma once
// A KR 16 on a linear unit of 3 m with four spheres along it.

#include <fmt/format.h>

#include "calib/files/files.h"
#include "calib/model/robot.h"

namespace cellcal::calib::testing {

inline Cell track_cell(const char* robot_file) {
  Cell cell;
  cell.robot = load_robot(robot_file);
  cell.tool.tcp.translation() = Eigen::Vector3d(0.06, 0.05, 0.41);
  cell.tool.length_m = cell.tool.tcp.translation().norm();
  cell.touch_sigma_m = 3e-5;
  cell.radius_offset_sigma_m = 1e-9;
  constexpr double kPlaces[][3] = {
      {1.2, 0.3, 0.3}, {1.0, 1.1, 0.8}, {1.3, 2.0, 0.25}, {1.1, 2.7, 0.7}};
  for (const auto& place : kPlaces) {
    Target sphere;
    sphere.id = fmt::format("S{}", cell.targets.size() + 1);
    sphere.diameter_m = 0.06;
    sphere.diameter_sigma_m = 1e-6;
    sphere.has_centre = true;
    sphere.centre_m = Eigen::Vector3d(place[0], place[1], place[2]);
    sphere.centre_sigma_m = 0.01;
    cell.targets.push_back(sphere);
  }
  for (std::size_t k = 1; k < cell.targets.size(); ++k)
    cell.lengths.push_back({cell.targets[k - 1].id, cell.targets[k].id,
                            (cell.targets[k].centre_m - cell.targets[k - 1].centre_m).norm(),
                            5e-6});
  return cell;
}

}  // namespace cellcal::calib::testing
