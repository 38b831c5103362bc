#pragma once
// Touches of one sphere that tell how good a contact is: few places all around it, each visited
// several times, at several speeds. Nothing of the arm's geometry is asked for.

#include <span>
#include <string_view>

#include "calib/plan/reach/planned_touch.h"

namespace cellcal::calib {

/// `places` touches, far apart in direction and posture, each once per speed [m/s] in turn; the arm
/// leaves to the place's clear point in between and comes back on the same line. Other targets are
/// in the way and not touched. `target`: an id; empty: the first that can be planned. Throws PlanError.
Plan make_qualification_plan(const Cell& cell, const PlanOptions& options, std::string_view target,
                             int places, std::span<const double> speeds_m_s);

/// The target that it touches.
std::string qualification_target(const Cell& cell, std::string_view target);

}  // namespace cellcal::calib
