#pragma once
// The few touches that decide fastest and most reliably whether a calibration still holds, and what
// changed otherwise.

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "calib/plan/planned_touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

struct CheckPlanOptions {
  int most_touches = 8, least_touches = 6;
  double most_s = 20.0;  ///< robot time, from the start and back; limits the number of touches
  /// Search lines with the calibrated arm: distance before and after the contact.
  double before_m = 0.004, behind_m = 0.012;
  TouchSet set = TouchSet::kCheck;  ///< purpose of the touches
  /// Joints whose zeros are sought; empty: a shift of the tool is.
  std::vector<std::string> joints = {};
  /// Angles of a positioner; empty: at the first setting that lets most spheres be touched.
  std::vector<double> positioner_rad = {};
};

/// Touches of the calibration's spheres, at their calibrated places; all at one setting of a positioner. Only
/// the margins of PlanOptions are used, not the numbers. `from`: current position; empty: the resting posture,
/// or where the arm waits while a positioner turns. Throws PlanError.
Plan make_check_plan(const Calibration& calibration, const PlanOptions& options,
                     const CheckPlanOptions& how = {}, const JointVector& from = {});

/// The plan's touch `next`, with spheres at their calibrated places, and a path from any position and from
/// any angles of a positioner; as resume_plan(). Throws PlanError.
PlannedTouch check_touch_from(const Calibration& calibration, const Plan& plan, std::size_t next,
                              const JointVector& from, bool in_contact,
                              const std::vector<double>& positioner_rad = {});

/// Four to six touches with most information on the zeros of these joints, in at most 20 s of robot time.
CheckPlanOptions mastered_touches(const std::vector<std::string>& joints);

// Touches of an update: first those of a check, then those that resolve the ambiguities found.

/// Longer search lines than a check's: a sphere may have moved by 5 mm.
CheckPlanOptions first_update_touches();
/// Options after so many touches and so much robot time; no touches are left if `most_touches` is
/// below 1.
CheckPlanOptions further_update_touches(int touches_made, double seconds);

/// Further touches around the currently estimated spheres and tip, chosen by the remaining uncertainty.
/// `from`: current position. Throws PlanError.
Plan make_update_plan(const Calibration& posterior, const PlanOptions& options,
                      const CheckPlanOptions& how, const JointVector& from);

// Touches of one sphere that assess the quality of contacts: few places around it, each visited
// several times, at several speeds. Independent of the arm's geometry.

/// `places` touches, far apart in direction and posture, each once per speed [m/s] in turn; in between,
/// the arm retreats to the place's clear point and returns on the same line. Other targets are
/// obstacles. `target`: an id; empty: the first that can be planned. Throws PlanError.
Plan make_qualification_plan(const Cell& cell, const PlanOptions& options, std::string_view target,
                             int places, std::span<const double> speeds_m_s);

/// The target that is touched.
std::string qualification_target(const Cell& cell, std::string_view target);

}  // namespace cellcal::calib
