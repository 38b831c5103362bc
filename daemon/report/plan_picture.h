#pragma once
// Drawing of a plan in its cell, in top and side view, to scale, for the person who authorises the motion.

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
#include "daemon/report/say.h"

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

/// CSS specific to this picture; colours are variables of the page.
const char* plan_style();

}  // namespace report

}  // namespace cellcal::daemon

namespace cellcal::daemon::report {

// Placement of labels in a drawing without covering marks.

class Labels {
 public:
  /// Bounds of the panel.
  Labels(double left, double top, double right) : left_(left), top_(top), right_(right) {}

  void keep_free(svg::Point corner, double width, double height);
  /// Start of the base line for a text of `letters` next to a mark of this radius: the first of four
  /// positions that covers nothing, otherwise the first. The area is reserved afterwards.
  svg::Point beside(svg::Point centre, double radius, std::size_t letters);

 private:
  struct Box {
    double left, top, right, bottom;
    bool overlaps(const Box& other) const {
      return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
    }
  };
  double left_, top_, right_;
  std::vector<Box> taken_;
};

// Mapping of values to pixels, and round axis ticks.

/// Linear map of [from, to] onto [at_from, at_to].
struct Scale {
  double from = 0.0, to = 1.0;
  double at_from = 0.0, at_to = 1.0;

  double operator()(double value) const;
  /// The same, with the value clamped to [from, to].
  double clamped(double value) const;
  bool holds(double value) const;
};

/// Multiples of 1, 2 or 5 times a power of ten inside [from, to], about `wanted` and at most twice that.
/// Empty where the range is empty or not finite.
std::vector<double> round_ticks(double from, double to, int wanted);

/// Tick labels with the fewest decimals that distinguish neighbours.
std::vector<std::string> tick_labels(const std::vector<double>& ticks);

/// Grid lines and labels of an upward axis, the labels `gap` pixels to its left.
void draw_value_axis(svg::Svg& svg, const Scale& across, const Scale& up, int wanted, double gap);
/// The smallest of 1, 1.5, 2, 3, 4, 5, 6, 8 times a power of ten that is not below `value`; `fallback` where
/// the value is not finite or not positive.
double round_up(double value, double fallback);

// Formatting of texts and numbers for HTML, independent of the locale, with the document's decimal mark.

using svg::escape, svg::shorten;

/// In place of a number that is not known.
inline constexpr const char* kDash = "\xE2\x80\x93";

/// Fixed decimals, typographic minus sign, never "-0.000"; an en dash for non-finite values; scientific from
/// 1e9 on.
std::string fixed(double value, int decimals);
/// The same with an explicit plus sign.
std::string signed_fixed(double value, int decimals);
/// As fixed(), with an ASCII minus and a decimal point, for values copied into files.
std::string ascii_fixed(double value, int decimals);
/// Shortest text with this many significant digits, e.g. "0.00036", "2.1e-06".
std::string significant(double value, int digits);

/// Metres as millimetres; three decimals resolve 1 um, a thirtieth of the noise of one touch.
inline constexpr int kMmDecimals = 3;
std::string mm(double metres, int decimals = kMmDecimals);
std::string signed_mm(double metres, int decimals = kMmDecimals);

/// For values that are positive when known: an en dash for zero, negative and non-finite values, so that "not
/// computed" never reads as a perfect 0.000.
std::string positive_mm(double metres, int decimals = kMmDecimals);

/// "0.031 mm" with a non-breaking space; unescaped text.
std::string mm_words(double metres);

/// "2025-03-14 02:10:00 UTC" for ISO 8601 in UTC; other texts unchanged. Not escaped.
std::string readable_time(std::string_view iso);

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
