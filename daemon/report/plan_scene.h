#pragma once
// What a picture of a plan shows, as points in space [mm, base frame]. Computed on the nominal
// geometry, as the plan is.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/plan/plan.h"

namespace cellcal::daemon::report {

struct PlanScene {
  /// A link or part of the tool: everything within the radius of a straight line.
  struct Rod {
    Eigen::Vector3d a, b;
    double radius;
    bool tool;
  };
  /// Drawn as the outline of its corners: for what is convex the very outline, else around it.
  struct Solid {
    std::string id;  ///< empty: a stand
    std::vector<Eigen::Vector3d> corners;
  };
  struct Ball {
    std::string id;
    Eigen::Vector3d centre;
    double radius;
    std::size_t fit = 0, check = 0;
  };
  /// The tip comes from `contact` + any length of `normal`.
  struct Approach {
    Eigen::Vector3d contact, normal;
    bool check;
    std::size_t number;  ///< of the touch, from 1
  };
  std::vector<Rod> arm;  ///< in the posture that the plan begins in
  std::vector<Solid> solids;
  std::vector<Ball> balls;
  std::vector<Approach> approaches;
  std::optional<double> floor_z;  ///< where z points up
  bool z_is_up = true;
};

/// Throws std::exception where the robot has no arm to draw or the plan is of another robot.
PlanScene scene_of(const calib::Cell& cell, const calib::Plan& plan);

/// How far the tip can reach, seen in a view: the outline around all of its places inside the joint
/// limits, as corners [mm] in order. `across`, `upward`: which of x, y, z the view shows.
std::vector<Eigen::Vector2d> reach_of(const calib::Cell& cell, int across, int upward);

/// The outline around points, counter-clockwise (Andrew's monotone chain).
std::vector<Eigen::Vector2d> outline_of(std::vector<Eigen::Vector2d> points);

}  // namespace cellcal::daemon::report
