#pragma once
// The control limits. Worked out by 'tests/experiments/drift --limits': the charts over checks in which nothing but
// their scatter is another, 20 000 times; both charts alarm as often as each other.

#include "calib/result/drift_chart.h"

namespace cellcal::calib {

inline constexpr ControlLimits kWarnLimits{.ewma = 3.456, .cusum = 4.059, .run_length = 200.0};
inline constexpr ControlLimits kAlarmLimits{.ewma = 3.984, .cusum = 5.091, .run_length = 1000.0};

/// Checks before anything is said: five share their centre's error by four.
inline constexpr std::size_t kLeastChecks = 5;

/// Days without a check that decided something, behind which 'in control' says nothing of now: in two weeks a creep of
/// 0.1 mm/month is what a check sees.
inline constexpr double kMostDays = 14.0;

}  // namespace cellcal::calib
