#pragma once
// Content of a plan's drawing as points in space [mm, base frame]. Computed with the nominal geometry, as the
// plan is. A positioner is at 0, and the touches of what it carries are drawn as seen from there.

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "calib/plan/plan.h"

namespace cellcal::daemon::report {

struct PlanScene {
  /// Link or part of the tool: all points within a radius of a line segment.
  struct Rod {
    Eigen::Vector3d a, b;
    double radius;
    bool tool;
  };
  /// Drawn as the convex hull of its corners.
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
  /// Approach of the tip to `contact` along `normal`.
  struct Approach {
    Eigen::Vector3d contact, normal;
    bool check;
    std::size_t number;  ///< of the touch, from 1
  };
  /// A positioner's axis.
  struct Axle {
    std::string id;
    Eigen::Vector3d a, b;
  };
  std::vector<Rod> arm;  ///< in the plan's start posture
  std::vector<Axle> axles;
  std::vector<Solid> solids;
  std::vector<Ball> balls;
  std::vector<Approach> approaches;
  std::optional<double> floor_z;  ///< horizontal floor, where z points up
  bool z_is_up = true;
};

/// Throws std::exception where the robot has no drawable arm or the plan belongs to another robot.
PlanScene scene_of(const calib::Cell& cell, const calib::Plan& plan);

/// Reach of the tip in a view: outline of its positions within the joint limits, as ordered corners [mm].
/// `across`, `upward`: axes of the view, from x, y, z.
std::vector<Eigen::Vector2d> reach_of(const calib::Cell& cell, int across, int upward);

/// Convex hull of points, counter-clockwise (Andrew's monotone chain).
std::vector<Eigen::Vector2d> outline_of(std::vector<Eigen::Vector2d> points);

}  // namespace cellcal::daemon::report
