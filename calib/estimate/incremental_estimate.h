#pragma once
// An estimate that goes along while touches come in, one by one: what the next touch is chosen
// from, and what is shown meanwhile. The same mathematics as identify(), near the point where all
// touches were last linearised: there a touch is a change of rank one of what is known, and the
// mean over the model levels follows from that. Where the estimate has moved too far from the
// point, after every tenth touch or so, and after one that repeats another (repeats.h), all touches
// are linearised and judged anew.
//
// At the end identify() says what holds; it starts from nothing and agrees to a small part of the
// uncertainty.

#include <memory>
#include <vector>

#include "calib/estimate/options.h"
#include "calib/estimate/problem.h"

namespace cellcal::calib {

class IncrementalEstimate {
 public:
  /// From the touches so far. Throws IdentifyError where they cannot determine anything.
  IncrementalEstimate(Cell cell, std::vector<Touch> touches, IdentifyOptions options = {});
  ~IncrementalEstimate();
  IncrementalEstimate(IncrementalEstimate&&) noexcept;
  IncrementalEstimate& operator=(IncrementalEstimate&&) noexcept;

  struct Taken {
    bool outlier = false;    ///< kept, and judged again later, but not believed
    double off_sigma = 0.0;  ///< how far it is from what was expected of it
    bool anew = false;       ///< all touches were linearised again
  };
  /// A check touch says nothing. Throws IdentifyError, as identify() does; then the touch is not
  /// taken.
  Taken add(const Touch& touch);

  /// The cell at the fullest model level without play, and its unknowns in order.
  const Problem& problem() const;
  /// Means and covariance of the unknowns, SI; frame directions included, scatter beyond the stated
  /// noise not.
  Eigen::VectorXd x_si() const;
  Eigen::MatrixXd covariance_si() const;
  /// The same in prior units, as problem() counts.
  const Eigen::VectorXd& u() const;
  const Eigen::MatrixXd& covariance_u() const;
  /// Joint noise that gears add to every pose, as the levels weigh it.
  double ripple_rad() const;
  /// The fastest at which its touches met a surface, as the next ones will: with it they have the
  /// same unknowns. 0 where none states a speed.
  double search_speed_m_s() const;
  const std::vector<Touch>& touches() const;
  /// Per touch: whether the estimate rests on it.
  const std::vector<bool>& in_use() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::calib
