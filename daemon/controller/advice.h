#pragma once
// What the checks of the calibration in use say, as one number that a robot program reads: CELLCAL_ADVICE.

#include "calib/result/drift_chart.h"

namespace cellcal::daemon {

enum class Advice : int {
  kUnknown = 0,  ///< no calibration, no check of it, or too few of them and none for two weeks
  kHolds = 1,    ///< the newest check held, and the control chart has nothing against it
  kCheckAgain = 2,
  kLetItWarmUp = 3,
  kRemeasureTcp = 4,
  kRecalibrate = 5,
};
const char* to_string(Advice advice);

struct PublishedAdvice {
  Advice advice = Advice::kUnknown;
  int until_day = 0;  ///< kHolds: the last day on which it is published, day_number(); else 0
  bool operator==(const PublishedAdvice&) const = default;
};

/// YEAR*372+MONTH*31+DAY in UTC: grows from day to day, and a robot program makes it of $DATE. `utc_s`: since 1970.
int day_number(double utc_s);

/// Of an aged chart (calib/check, age()). `now_s`: since 1970, UTC.
PublishedAdvice advice_of(const calib::DriftChart& chart, double now_s);

}  // namespace cellcal::daemon
