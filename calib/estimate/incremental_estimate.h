#pragma once
// Estimate updated touch by touch during a session, for the choice of the next touch and for the
// display. It uses the equations of identify() near the point at which all touches were last
// linearised: there a touch is a change of rank one of the information, from which the mean over
// the model levels follows. All touches are linearised again and outliers selected anew when the
// estimate has moved too far from that point, after every tenth touch or so, and after a repeat of
// an earlier touch (repeats.h).
//
// The final result is that of identify(), which starts from nothing and agrees with this estimate
// to a small fraction of the uncertainty.

#include <vector>

#include "calib/estimate/evidence.h"
#include "calib/estimate/problem.h"
#include "calib/model/hidden.h"

namespace cellcal::calib {

class IncrementalEstimate {
 public:
  /// Estimate from `touches`. Throws IdentifyError if they determine nothing.
  IncrementalEstimate(Cell cell, std::vector<Touch> touches);

  struct Taken {
    bool outlier = false;    ///< excluded from the estimate; tested again later
    double off_sigma = 0.0;  ///< deviation from the predicted residual, studentised
    bool anew = false;       ///< all touches were linearised again
  };
  /// Adds a touch; a check touch does not change the estimate. Throws IdentifyError, as identify()
  /// does; the touch is then not added.
  Taken add(const Touch& touch);

  /// The cell at the fullest model level without play, and its unknowns in order.
  const Problem& problem() const;
  /// Means and covariance of the unknowns, SI; including frame directions, excluding scatter beyond
  /// the stated noise.
  Eigen::VectorXd x_si() const;
  Eigen::MatrixXd covariance_si() const;
  /// Means and covariance in prior units, in the order of problem().
  const Eigen::VectorXd& u() const;
  const Eigen::MatrixXd& covariance_u() const;
  const LevelMean& levels() const;
  /// Largest contact speed of the touches on a surface, assumed for the next touches so that they
  /// have the same unknowns. 0 if none states a speed.
  double search_speed_m_s() const;
  const std::vector<Touch>& touches() const;
  /// True for each touch that the estimate uses.
  const std::vector<bool>& in_use() const;

 private:
  struct Impl;
  Hidden<Impl> impl_;
};

}  // namespace cellcal::calib
