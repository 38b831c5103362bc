#pragma once
// Control chart of all checks of one calibration.

#include <optional>
#include <vector>

#include "calib/check/foresight.h"
#include "calib/check/tcp_check.h"
#include "calib/model/linear.h"
#include "calib/result/drift_chart.h"

namespace cellcal::calib {

/// The single evaluation of all checks, used by session, metrics, page, controller and plant. Never better than the
/// newest check: an alarm if that does not hold, unknown instead of in control if it is undecided. `checks`: in
/// chronological order, of the same touches unless left out. Causes of the trend and the advice that depends on them
/// are set by advise().
DriftChart drift_chart(const std::vector<CheckMeasurement>& checks);

/// True if evidence of that time counts at `now_s` (since 1970, UTC): it is not older than kMostDays, nor, as under a
/// clock that was ahead and has been set back, more than a day in the future.
bool is_current(double evidence_s, double now_s);

/// Downgrades a state that is out of date: if `now_s` (since 1970, UTC) is long after the newest decided check, 'in
/// control' becomes kUnknown with the advice to check again. Warnings and alarms remain.
void age(DriftChart& chart, double now_s);

/// Sets the advice from state, trend, causes and newest check.
void advise(DriftChart& chart);

/// The single decision whether a calibration holds at `now_s`, by its checks; without a decided one the calibration of
/// `calibrated_s` is its own evidence (both since 1970, UTC). Evidence counts for kMostDays.
Standing standing_of(const DriftChart& chart, double calibrated_s, double now_s);

// A check as a repeatable measurement of the TCP. Errors of the calibration are common to all checks by the same
// touches: they remain in the shift as a constant, and its covariance covers the independent part only. Assumption:
// the tool shifted. Failure case: any other change appears as the tool shift that resembles it.

class ShiftGauge {
 public:
  /// `expected`: touches near those of all checks. Throws IdentifyError as foresee() does.
  ShiftGauge(const Calibration& calibration, const std::vector<Touch>& expected);

  struct Shift {
    Eigen::Vector3d shift_m;  ///< flange frame
    Eigen::Matrix3d covariance_m2;
    Eigen::VectorXd off_m;  ///< of each touch
  };
  /// `made`: one touch for each expected one, in the same order.
  Shift measure(const std::vector<Touch>& made) const;

  /// Explanations of a difference `off_m` between the mean residuals of two groups of checks.
  /// `scatter`: variance of that difference over the variance of one check. Most likely first.
  std::vector<Explanation> causes(const Eigen::VectorXd& off_m, double scatter) const;

  std::size_t touches() const { return foresight_.contacts.size(); }

 private:
  Calibration calibration_;
  Foresight foresight_;
  std::vector<PossibleChange> changes_;
  Cholesky passing_;
};

}  // namespace cellcal::calib
