#pragma once
// A KR 16 with a positioner that tilts and turns: three spheres on its table, two next to it.

#include <fmt/format.h>

#include "calib/files/files.h"
#include "calib/model/robot.h"

namespace cellcal::calib::testing {

inline Cell positioner_cell(const char* robot_file) {
  Cell cell;
  cell.robot = load_robot(robot_file);
  cell.tool.tcp.translation() = Eigen::Vector3d(0.06, 0.05, 0.41);
  cell.tool.length_m = cell.tool.tcp.translation().norm();
  cell.touch_sigma_m = 3e-5;
  cell.radius_offset_sigma_m = 1e-9;
  constexpr double kPlaces[][3] = {{0.22, 0.0, 0.10},
                                   {-0.12, 0.20, 0.16},
                                   {-0.10, -0.20, 0.08},
                                   {0.95, -0.75, 0.35},
                                   {0.95, 0.75, 0.65}};
  for (const auto& place : kPlaces) {
    Target sphere;
    sphere.carried_by = cell.targets.size() < 3 ? 2 : 0;
    sphere.id = fmt::format("{}{}", sphere.carried_by > 0 ? "T" : "S", cell.targets.size() + 1);
    sphere.diameter_m = 0.04;
    sphere.diameter_sigma_m = 1e-6;
    sphere.has_centre = true;
    sphere.centre_m = Eigen::Vector3d(place[0], place[1], place[2]);
    sphere.centre_sigma_m = 0.01;
    cell.targets.push_back(sphere);
  }
  for (const auto& [a, b] : {std::pair(0, 1), std::pair(1, 2), std::pair(3, 4)})
    cell.lengths.push_back({cell.targets[a].id, cell.targets[b].id,
                            (cell.targets[b].centre_m - cell.targets[a].centre_m).norm(), 5e-6});
  return cell;
}

}  // namespace cellcal::calib::testing
