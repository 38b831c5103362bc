#pragma once
// Drawing of a plan in its cell, in top and side view, to scale, for the person who authorises the motion.

#include <string>

#include "calib/model/robot.h"
#include "calib/plan/plan.h"

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
