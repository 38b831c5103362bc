#pragma once
// Executes touches to a goal with a true arm and true spheres.

#include <functional>
#include <vector>

#include "calib/plan/online.h"

namespace cellcal::calib::testing {

/// Without check touches.
PlanOptions without_checks();

struct Driven {
  int made = 0, failed = 0;
  Progress begin, end;
  std::vector<PlannedTouch> touches;  ///< that were offered
  std::vector<Touch> measured;
};

/// `fails(k)`: whether the k-th offer fails. `speed_m_s`: stated by the touches. `before`: touches
/// of a resumed session.
Driven drive(const Cell& cell, const Goal& goal, const std::function<bool(int)>& fails = nullptr,
             double speed_m_s = 0.0, const std::vector<Touch>& before = {});

}  // namespace cellcal::calib::testing
