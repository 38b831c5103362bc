#pragma once
// The plan in its cell, from above and from the side, to scale: what the robot is about to do, for
// someone who stands before it and has to let it.

#include <string>

#include "calib/model/robot.h"
#include "calib/plan/plan.h"

namespace cellcal::daemon {

/// One SVG document with its own style. Throws std::exception where the robot cannot be drawn or
/// the plan is of another one.
std::string plan_svg(const calib::Cell& cell, const calib::Plan& plan);

namespace report {

/// The two views for the page, and what stands below them. Throws as plan_svg() does.
struct PlanViews {
  std::string above, side;  ///< <svg> elements
  std::string legend;       ///< text
};
PlanViews plan_views(const calib::Cell& cell, const calib::Plan& plan);

/// CSS of what only this picture has; colours are the page's variables.
const char* plan_style();

}  // namespace report

}  // namespace cellcal::daemon
