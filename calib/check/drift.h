#pragma once
// Control chart of all checks of one calibration.

#include <optional>
#include <vector>

#include "calib/result/drift_chart.h"

namespace cellcal::calib {

/// The single evaluation of all checks, used by session, metrics, page, controller and plant. Never better than the
/// newest check: an alarm if that does not hold, unknown instead of in control if it is undecided. `checks`: in
/// chronological order, of the same touches unless left out. Causes of the trend and the advice that depends on them
/// are set by advise().
DriftChart drift_chart(const std::vector<CheckMeasurement>& checks);

/// Downgrades a state that is out of date: if `now_s` (since 1970, UTC) is long after the newest decided check, 'in
/// control' becomes kUnknown with the advice to check again. Warnings and alarms remain.
void age(DriftChart& chart, double now_s);

/// Sets the advice from state, trend, causes and newest check.
void advise(DriftChart& chart);

/// temp_0: the first known temperature of the checks that count.
std::optional<double> reference_temperature_c(const std::vector<CheckMeasurement>& checks);

/// The single decision whether a calibration holds at `now_s`, by its checks; without a decided one the calibration of
/// `calibrated_s` is its own evidence (both since 1970, UTC). Evidence counts for kMostDays.
Standing standing_of(const DriftChart& chart, double calibrated_s, double now_s);

// Onset and rate of the TCP's shift: the step or linear creep, from any check on, with the smallest remaining
// residuals.

/// `checks`: chronological; the first is never part of the trend. Empty for fewer than two checks. `noise`: scatter of
/// the checks relative to the stated one. `reference_c`: as for the charts.
std::optional<DriftTrend> trend_of(const std::vector<CheckMeasurement>& checks, double noise,
                                   std::optional<double> reference_c);

}  // namespace cellcal::calib
