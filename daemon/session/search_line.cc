#include "daemon/session/search_line.h"

#include <algorithm>
#include <cmath>

namespace cellcal::daemon {

namespace {

/// A nearer stand-off that saves less is not worth a move.
constexpr double kShortestApproachM = 0.0005;

calib::JointVector mean(const drivers::AxisAngles& a, const drivers::AxisAngles& b) {
  calib::JointVector result;
  for (std::size_t i = 0; i < a.size() && i < b.size(); ++i) {
    result.push_back(0.5 * (a[i] + b[i]));
  }
  return result;
}

}  // namespace

drivers::AxisAngles axis_angles(const calib::JointVector& joint_rad) {
  return {joint_rad.begin(), joint_rad.end()};
}

calib::JointVector joint_vector(const drivers::AxisAngles& axes_rad) {
  return {axes_rad.begin(), axes_rad.end()};
}

double travel_m(const calib::PlannedTouch& planned, const drivers::AxisAngles& axes_rad) {
  double along = 0.0, length = 0.0;
  for (std::size_t i = 0; i < planned.standoff.size() && i < axes_rad.size(); ++i) {
    const double step = planned.end[i] - planned.standoff[i];
    along += (axes_rad[i] - planned.standoff[i]) * step;
    length += step * step;
  }
  return length > 0.0 ? along / length * planned.search_m : 0.0;
}

drivers::AxisAngles at_travel(const calib::PlannedTouch& planned, double travel_m) {
  const double fraction = travel_m / planned.search_m;
  drivers::AxisAngles result;
  for (std::size_t i = 0; i < planned.standoff.size(); ++i) {
    result.push_back(planned.standoff[i] + fraction * (planned.end[i] - planned.standoff[i]));
  }
  return result;
}

double approach_m(const calib::PlannedTouch& planned, const calib::ExpectedContact& expected,
                  const TouchPolicy& policy) {
  if (!(expected.sigma_m > 0.0) || planned.may_miss) return 0.0;
  const double before =
      std::max(policy.approach_least_m,
               policy.approach_sigmas * expected.sigma_m + policy.approach_margin_m);
  const double begin =
      std::min(expected.travel_m, planned.expected_m + policy.behind_nominal_m) - before;
  return begin >= kShortestApproachM ? begin : 0.0;  // 0 also for NaN
}

bool is_surprising(const Reading& reading, const calib::ExpectedContact& expected,
                   const TouchPolicy& policy) {
  const double off_m = std::abs(reading.along_m - expected.travel_m);
  const bool off = expected.sigma_m > 0.0 && !(off_m <= policy.surprise_sigmas * expected.sigma_m);
  const bool stamped = reading.time_sigma_s * policy.fast_m_s <= policy.most_stamp_m;
  return off || !stamped || reading.bounces > policy.most_bounces;
}

std::optional<Agreement> find_agreement(std::vector<Reading> readings, const TouchPolicy& policy) {
  const auto needed = static_cast<std::size_t>(policy.readings);
  std::erase_if(readings, [](const Reading& reading) { return !std::isfinite(reading.along_m); });
  if (needed == 0 || readings.size() < needed) return std::nullopt;
  std::stable_sort(readings.begin(), readings.end(),
                   [](const Reading& a, const Reading& b) { return a.along_m < b.along_m; });
  std::size_t best = 0;
  auto spread = [&](std::size_t from) {
    return readings[from + needed - 1].along_m - readings[from].along_m;
  };
  for (std::size_t from = 1; from + needed <= readings.size(); ++from) {
    if (spread(from) < spread(best)) best = from;
  }
  if (spread(best) > policy.tolerance_m) return std::nullopt;
  Agreement result;
  result.spread_m = spread(best);
  const auto first = readings.begin() + static_cast<std::ptrdiff_t>(best);
  result.readings.assign(first, first + static_cast<std::ptrdiff_t>(needed));
  return result;
}

calib::Touch touch_of(const calib::PlannedTouch& planned, const Agreement& agreement,
                      double speed_m_s) {
  const auto& readings = agreement.readings;
  const Reading& low = readings[(readings.size() - 1) / 2];
  const Reading& high = readings[readings.size() / 2];
  calib::Touch touch;
  touch.joint_rad = mean(low.contact_rad, high.contact_rad);
  touch.settled_joint_rad = mean(low.settled_rad, high.settled_rad);
  touch.target = planned.target;
  touch.set = planned.set;
  touch.readings = static_cast<int>(readings.size());
  touch.spread_m = agreement.spread_m;
  touch.speed_m_s = speed_m_s;
  for (const Reading& reading : readings) touch.time = std::max(touch.time, reading.utc);
  return touch;
}

}  // namespace cellcal::daemon
