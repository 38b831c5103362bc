#pragma once
// Does a calibration still hold, and if not, what changed? Answered by six to eight touches.
//
// With res how far the touches are off, V what they may be off by were nothing changed (foresight.h), and G
// what one thing that changed does to them (alarm.h), each explanation has the likelihood of res under
// V + size^2 G G', size the one that is looked for. What changed is the likeliest; whether anything did is decided
// by the sum of all (alarm.h).
// Assumption: one thing changed. Failure case: two did; then the likeliest single one is named, and is wrong.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/check/alarm.h"
#include "calib/check/foresight.h"
#include "calib/result/tcp_check.h"

namespace cellcal::calib {

/// More references than this are not taken: the first behind a calibration, so that what creeps is not taken
/// for what always was.
inline constexpr std::size_t kMostReferences = 4;

/// Fewer say nothing of a shift in any direction.
inline constexpr std::size_t kLeastCheckTouches = 4;

/// A shift that nothing is known of beforehand.
inline constexpr double kAnyShiftM = 0.05;

/// A touch that met nothing: planned, with the axis angles of the end of its search.
struct MissedTouch {
  std::size_t planned = 0;
  Touch at_end;
};

/// What can be worked out before the touches are made: serves every check of the same touches.
class TcpChecker {
 public:
  /// `expected`: touches about where they will be made (some millimetres off do not matter). `references`:
  /// checks by the same touches in their order, behind the calibration, which held; what was off in them is
  /// expected again. Throws IdentifyError as foresee() does, and of fewer than kLeastCheckTouches.
  TcpChecker(const Calibration& calibration, const std::vector<Touch>& expected,
             const std::vector<std::vector<Touch>>& references = {});

  /// `made`: one for each that was expected, in their order. Throws IdentifyError of others.
  TcpCheck judge(const std::vector<Touch>& made) const;
  /// The same with what met nothing; `planned`: which of the planned touches each of the made ones is.
  TcpCheck judge(const std::vector<Touch>& made, const std::vector<std::size_t>& planned,
                 const std::vector<MissedTouch>& missed) const;

  const Alarm& alarm() const { return alarm_; }
  /// Of a tool's shift worked out of such touches [m^2], flange frame.
  Eigen::Matrix3d shift_covariance_m2() const;

 private:
  Calibration calibration_;
  Foresight foresight_;
  std::vector<PossibleChange> changes_;
  Alarm alarm_;
  double found_;  ///< share of usual shifts
};

/// The same at once. `planned`: as of judge().
TcpCheck check_tcp(const Calibration& calibration, const std::vector<Touch>& made,
                   const std::vector<std::size_t>& planned, const std::vector<MissedTouch>& missed,
                   const std::vector<std::vector<Touch>>& references = {});

}  // namespace cellcal::calib
