#pragma once
// Result of the checks of the calibration in use as one number for robot programs: CELLCAL_ADVICE.

#include "calib/result/drift_chart.h"

namespace cellcal::daemon {

enum class Advice : int {
  kUnknown = 0,  ///< no calibration, no check of it, or too few checks and none for two weeks
  kHolds = 1,    ///< the newest check passed, and the control chart raises no objection
  kCheckAgain = 2,
  kLetItWarmUp = 3,
  kRemeasureTcp = 4,
  kRecalibrate = 5,
};
const char* to_string(Advice advice);

struct PublishedAdvice {
  Advice advice = Advice::kUnknown;
  int until_day = 0;  ///< kHolds: last day of publication, day_number(); otherwise 0
  bool operator==(const PublishedAdvice&) const = default;
};

/// YEAR*372+MONTH*31+DAY in UTC: increases from day to day, and a robot program computes it from $DATE.
/// `utc_s`: seconds since 1970.
int day_number(double utc_s);

/// From an aged chart (calib/check, age()). `now_s`: seconds since 1970, UTC.
PublishedAdvice advice_of(const calib::DriftChart& chart, double now_s);

}  // namespace cellcal::daemon
