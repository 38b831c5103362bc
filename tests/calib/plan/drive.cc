#include "tests/calib/plan/drive.h"

#include <gtest/gtest.h>

#include "tests/calib/plan/meet.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib::testing {

PlanOptions without_checks() {
  PlanOptions options;
  options.seed = 3;
  options.check_touches = 0;
  return options;
}

Driven drive(const Cell& cell, const Goal& goal, const std::function<bool(int)>& fails,
             double speed_m_s, const std::vector<Touch>& before) {
  const sim::Truth truth = plain_truth(cell, 4);
  Online online(cell, without_checks(), goal, before);
  Random random(5);
  Driven driven;
  driven.begin = online.progress();
  JointVector at;
  for (int k = 0; const auto planned = online.next(at); ++k) {
    EXPECT_FALSE(planned->transit.empty());
    EXPECT_EQ(planned->transit.back(), planned->standoff);
    driven.touches.push_back(*planned);
    at = planned->clear;
    std::optional<Touch> touch;
    if (!fails || !fails(k))
      if (auto met = meet(cell, truth, *planned, random)) touch = std::move(met->touch);
    if (touch) {
      ++driven.made;
      touch->speed_m_s = speed_m_s;
      driven.measured.push_back(*touch);
      online.touched(*touch);
    } else {
      ++driven.failed;
      online.failed();
    }
    EXPECT_EQ(online.progress().touches, driven.made + static_cast<int>(before.size()));
    EXPECT_LE(driven.touches.size(), 400U);
  }
  driven.end = online.progress();
  return driven;
}

}  // namespace cellcal::calib::testing
