// The current touch as guards and effects see it.

#include <algorithm>

#include "daemon/session/interruption.h"
#include "daemon/session/rules.h"

namespace cellcal::daemon::rules {

Reading reading_of(const State& state, const Event& event, bool slow) {
  Reading reading;
  reading.slow = slow;
  reading.utc = event.utc;
  const auto& latch = event.move().latch;
  if (!latch) return reading;
  reading.contact_rad = latch->contact_rad;
  reading.settled_rad = latch->settled_rad;
  reading.along_m = travel_m(state.planned(), latch->contact_rad);
  reading.time_sigma_s = latch->time_sigma_s;
  reading.reaction_s = latch->reaction_s;
  reading.bounces = latch->bounces;
  return reading;
}

std::vector<Reading> with_new(const State& state, const Event& event) {
  std::vector<Reading> readings = state.slow;
  readings.push_back(reading_of(state, event, true));
  return readings;
}

calib::ExpectedContact expected_contact(const State& state) {
  const calib::PlannedTouch& planned = state.planned();
  if (!state.one_by_one && state.expected && state.done < state.expected->size())
    return (*state.expected)[state.done];
  return {planned.expected_m, planned.expected_sigma_m};
}

bool was_met(const State& state) {
  return std::ranges::find(state.met, state.planned().target) != state.met.end();
}

double fast_m_s(const State& state) {
  const double own = state.planned().search_m_s;
  return own > 0.0 ? own : state.policy.fast_m_s;
}

double armed_speed_m_s(const State& state) {
  return state.phase == Phase::kArmingFast ? fast_m_s(state) : state.policy.slow_m_s;
}

double pace(const State& state) {
  constexpr int kFull = 100;
  const Links& links = state.links;
  const int percent = links.override_slows ? links.override_percent.value_or(kFull) : kFull;
  return std::max(1, percent) / double{kFull};
}

NextSearch next_search(const State& state, double speed_m_s) {
  NextSearch next;
  next.end_m = state.planned().search_m;
  if (state.first)
    next.end_m = std::min(next.end_m, state.first->along_m + state.policy.beyond_first_m);
  next.length_m = std::max(0.0, next.end_m - state.search_from_m);
  next.full_speed_s = next.length_m / speed_m_s;
  next.pace = pace(state);
  return next;
}

}  // namespace cellcal::daemon::rules
