#pragma once
// Check of a calibration by six to eight touches: does it still hold, and if not, what changed?
//
// With res the residuals of the touches, V their covariance in an unchanged cell (foresight.h), and G the effect
// of a single change on them (alarm.h), each explanation has the likelihood of res under V + size^2 G G', over the
// sizes considered. The change reported is the most likely one; whether anything changed is decided by the sum
// over all (alarm.h).
//
// Assumption: a single change. Failure case: with two changes the most likely single one is reported, which is
// wrong.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/check/alarm.h"
#include "calib/check/foresight.h"
#include "calib/result/tcp_check.h"

namespace cellcal::calib {

/// Maximum number of reference checks: the first ones after a calibration, so that a creep does not become
/// part of the reference.
inline constexpr std::size_t kMostReferences = 4;

/// Fewer touches cannot detect a shift in every direction.
inline constexpr std::size_t kLeastCheckTouches = 4;

/// Prior sigma of a shift without prior knowledge.
inline constexpr double kAnyShiftM = 0.05;

/// A planned touch without contact, with the axis angles at the end of its search.
struct MissedTouch {
  std::size_t planned = 0;
  Touch at_end;
};

/// Precomputes what does not depend on the measured touches; serves every check by the same planned
/// touches.
class TcpChecker {
 public:
  /// `expected`: touches near those to be made (within some millimetres). `references`: checks by the same
  /// touches that held, chronological, after the calibration; their residuals are expected again. Throws
  /// IdentifyError as foresee() does, and for fewer than kLeastCheckTouches.
  TcpChecker(const Calibration& calibration, const std::vector<Touch>& expected,
             const std::vector<std::vector<Touch>>& references = {});

  /// `made`: one touch for each expected one, in the same order; throws IdentifyError otherwise.
  TcpCheck judge(const std::vector<Touch>& made) const;
  /// As above with missed touches; `planned`: index of the planned touch for each made one.
  TcpCheck judge(const std::vector<Touch>& made, const std::vector<std::size_t>& planned,
                 const std::vector<MissedTouch>& missed) const;

  const Alarm& alarm() const { return alarm_; }
  /// Covariance of a tool shift estimated from such touches [m^2], flange frame.
  Eigen::Matrix3d shift_covariance_m2() const;

 private:
  Calibration calibration_;
  Foresight foresight_;
  std::vector<PossibleChange> changes_;
  Alarm alarm_;
  double found_;  ///< share of usual shifts that are found
};

/// Constructs a checker and judges. `planned`: as for judge().
TcpCheck check_tcp(const Calibration& calibration, const std::vector<Touch>& made,
                   const std::vector<std::size_t>& planned, const std::vector<MissedTouch>& missed,
                   const std::vector<std::vector<Touch>>& references = {});

}  // namespace cellcal::calib
