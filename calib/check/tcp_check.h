#pragma once
// Check of a calibration by six to eight touches: does it still hold, and if not, what changed?
//
// With res the residuals of the touches, V their covariance in an unchanged cell (foresight.h), and G the effect
// of a single change on them (Alarm), each explanation has the likelihood of res under V + size^2 G G', over the
// sizes considered. The change reported is the most likely one; whether anything changed is decided by the sum
// over all (Alarm).
//
// Assumption: a single change. Failure case: with two changes the most likely single one is reported, which is
// wrong.

#include <Eigen/Core>
#include <string>
#include <vector>

#include "calib/check/foresight.h"
#include "calib/model/linear.h"
#include "calib/result/tcp_check.h"

namespace cellcal::calib {

// Alarm threshold of a check. The residuals of an unchanged cell are Gaussian with the covariance foreseen
// by the calibration, so the distribution of any statistic of them can be sampled, and the threshold set
// for one false alarm in a thousand.
//
// Possible changes since a calibration, one at a time, and their effect on a touch.

struct PossibleChange {
  ChangeKind kind = ChangeKind::kTool;
  std::string name;  ///< as in Explanation
  /// Index of the touch, or of the joint, a positioner's axes after the arm's.
  std::size_t index = 0;
  int size = 3;         ///< components
  double weight = 1.0;  ///< prior probability, among all changes
  /// Sizes considered, equally likely: 1 sigma of each component, SI.
  std::vector<double> usual = {};
};

/// All changes that these touches can show. The last joint is omitted: its zero moves the tip on the
/// flange as a shift of the tool does, so the tool represents both.
std::vector<PossibleChange> possible_changes(const Calibration& calibration,
                                             const std::vector<ForeseenContact>& contacts);

/// Residuals of the touches after a change by `size`, and their derivatives by its components.
struct Changed {
  Eigen::VectorXd off_m;
  Eigen::MatrixXd by_size;
};
Changed changed(const PossibleChange& change, const Eigen::VectorXd& size,
                const std::vector<ForeseenContact>& contacts);
/// Derivatives at size zero.
Eigen::MatrixXd columns_of(const PossibleChange& change,
                           const std::vector<ForeseenContact>& contacts);

/// Share of checks of an unchanged cell that report 'does not hold'.
inline constexpr double kFalseAlarms = 1e-3;

class Alarm {
 public:
  /// `covariance_m2`: covariance of the contacts' residuals in an unchanged cell.
  Alarm(const std::vector<PossibleChange>& changes, const std::vector<ForeseenContact>& contacts,
        const Eigen::MatrixXd& covariance_m2);

  const Cholesky& covariance() const { return covariance_; }
  /// Natural logarithm of the odds of any change against none, for whitened residuals of small changes.
  double log_odds(const Eigen::VectorXd& whitened) const;
  double threshold() const { return threshold_; }
  /// Share of tool shifts of this size, in uniformly random directions, that raise the alarm.
  double found(double shift_m) const;

 private:
  struct Part {  ///< one change
    Eigen::Index first, size;
    double weight;
    std::vector<double> usual;
  };
  Eigen::VectorXd log_odds_of(const Eigen::MatrixXd& whitened) const;

  Cholesky covariance_;
  Eigen::MatrixXd directions_;  ///< orthonormal within each change, one column each
  Eigen::VectorXd square_;      ///< squared norm of the whitened residuals per SI unit
  std::vector<Part> parts_;
  Eigen::MatrixXd by_tool_;  ///< derivative of the whitened residuals by the tool's shift
  double threshold_ = 0.0;
};

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
