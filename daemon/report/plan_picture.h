#pragma once
// Drawings to scale, in top and side view: a plan in its cell, for the person who authorises the motion, and the cell.

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/export/svg.h"
#include "calib/model/robot.h"
#include "calib/plan/plan.h"
#include "daemon/report/axes.h"

namespace cellcal::daemon {

/// One SVG document with its own style. Throws std::exception where the robot cannot be drawn or the plan
/// belongs to another one.
std::string plan_svg(const calib::Cell& cell, const calib::Plan& plan);

namespace report {

/// The two views for the page, with their legend. Throws as plan_svg() does.
struct PlanViews {
  std::string above, side;  ///< <svg> elements
  std::string legend;       ///< text
};
PlanViews plan_views(const calib::Cell& cell, const calib::Plan& plan);

}  // namespace report

}  // namespace cellcal::daemon

namespace cellcal::daemon::report {

// Content of a plan's drawing as points in space [mm, base frame]. Computed with the nominal geometry, as the
// plan is. A positioner is at 0, and the touches of what it carries are drawn as seen from there.

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

  /// Heading of the view with this axis upwards.
  std::string heading(int upward) const;
};

bool z_is_up(const calib::Robot& robot);

/// A view to scale: two axes of the base frame, with grid, heading, balls and labels.
class PicturePanel {
 public:
  std::string finish() && { return std::move(svg_).finish(); }

 protected:
  /// `across`, `upward`: axes of the view, from x, y, z.
  PicturePanel(double height, const char* css_class, int across, int upward,
               std::string_view heading);

  /// Pixels inside the frame.
  Eigen::Array2d inner() const;
  /// Sets the scale, with `middle` [mm] in the middle of the frame.
  void draw_grid(const Eigen::Vector2d& middle, double px_per_mm);
  void draw_heading();
  void draw_label(const PlanScene::Ball& ball, double radius, std::string_view words,
                  std::size_t longest);
  double radius(const PlanScene::Ball& ball) const;  ///< px, so that a small one stays visible
  void keep_free(svg::Point centre, double around);
  Eigen::Vector2d seen(const Eigen::Vector3d& mm) const { return {mm[across_], mm[upward_]}; }
  svg::Point at(const Eigen::Vector2d& mm) const { return {x_(mm.x()), y_(mm.y())}; }
  svg::Point at(const Eigen::Vector3d& mm) const { return at(seen(mm)); }

  const int across_, upward_;
  const double height_;
  const std::string heading_;
  double px_per_mm_ = 1.0;
  svg::Svg svg_;
  Scale x_, y_;
  Labels labels_;
};

/// Throws std::exception where the robot has no drawable arm or the plan belongs to another robot.
PlanScene scene_of(const calib::Cell& cell, const calib::Plan& plan);

/// Reach of the tip in a view: outline of its positions within the joint limits, as ordered corners [mm].
/// `across`, `upward`: axes of the view, from x, y, z.
std::vector<Eigen::Vector2d> reach_of(const calib::Cell& cell, int across, int upward);

/// Convex hull of points, counter-clockwise (Andrew's monotone chain).
std::vector<Eigen::Vector2d> outline_of(std::vector<Eigen::Vector2d> points);

}  // namespace cellcal::daemon::report
