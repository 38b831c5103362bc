#pragma once
// What a set of touches would leave unknown, kept up while touches are put in and taken out again.
//
// With S the covariance after the touches in the set, j a candidate's whitened derivatives by all
// unknowns (one row), and W_p the sum of J_p'J_p over the poses that matter (base motion out of it),
// taking the candidate in changes
//   S by -S j' j S / (1 + j S j'),   trace(W_p S) by -j S W_p S j' / (1 + j S j')
// and taking it out again by the same with 1 - j S j'. The vectors chol(W_p)' S j' and the numbers
// j S j' of all candidates are kept: a change of the set is one product of all rows with a vector
// and one multiple of a vector added to each of those.

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "calib/estimate/information.h"
#include "calib/model/kinematics.h"
#include "calib/plan/accuracy_region.h"
#include "calib/plan/candidates.h"

namespace cellcal::calib {

class Design {
 public:
  /// `rows`: candidates x unknowns; `covariance_u`: before any touch; `moves_m`: 3 poses x arm's
  /// unknowns (region.h), the first ones of all.
  Design(RowMajor rows, Eigen::MatrixXd covariance_u, const Eigen::MatrixXd& moves_m);

  Eigen::Index size() const { return rows_.rows(); }
  bool has(Eigen::Index candidate) const { return in_[static_cast<std::size_t>(candidate)]; }
  /// What taking a candidate in would take from the sum of position variances [m^2].
  double gain(Eigen::Index candidate) const;
  /// What taking one out would add to it.
  double loss(Eigen::Index candidate) const;
  /// gain() of every candidate if this one, which is in the set, were taken out; its own is what it
  /// is worth now. The set stays as it is.
  Eigen::VectorXd gains_without(Eigen::Index candidate) const;
  /// How much of what the candidate measures is unknown: j S j', 1 is the touch's own sigma.
  double unknown(Eigen::Index candidate) const { return h_[candidate]; }

  void take(Eigen::Index candidate);
  void drop(Eigen::Index candidate);
  /// take() of each in turn, rounding aside; together they go through the memory once.
  void take_all(const std::vector<std::size_t>& candidates);

  const Eigen::MatrixXd& covariance_u() const { return covariance_; }

 private:
  void change(Eigen::Index candidate, double sign);

  RowMajor rows_;
  Eigen::MatrixXd covariance_;
  Eigen::MatrixXd a_;       ///< chol(W_p)' S j', a column per candidate
  Eigen::VectorXd h_;       ///< j S j'
  Eigen::VectorXd square_;  ///< |a_'s columns|^2
  std::vector<bool> in_;
  /// rows_ S j' of the candidate that gains_without() was asked for: what drop() of it needs next.
  mutable Eigen::VectorXd with_;
  mutable Eigen::Index with_of_ = -1;
};

// What a choice of touches is judged by: what each candidate would tell, what is known before any
// touch, and how the tips that matter move with what is unknown. With the estimator's own model and
// priors, so that touches are chosen for the arm as it will be judged.

/// Everything in prior units (problem.h).
struct DesignProblem {
  RowMajor rows;                 ///< whitened derivatives, candidates x unknowns
  Eigen::MatrixXd covariance_u;  ///< priors and certified lengths
  Eigen::MatrixXd moves_m;       ///< 3 poses x arm's unknowns (region.h), the first ones of all
  std::vector<JointVector> postures;    ///< those poses
  double ripple_rad;                    ///< of every joint, foreseen; 0 where only a tool matters
  Eigen::VectorXd scale;                ///< SI value of each of the arm's unknowns' 1
  std::shared_ptr<const ArmModel> arm;  ///< with all that is unknown of it
};

/// `candidates`: not empty, of targets that state their centres. Throws PlanError where the region
/// of interest is out of reach.
DesignProblem design_problem(const Cell& cell, const std::vector<Candidate>& candidates,
                             const AccuracyRegion& region);

}  // namespace cellcal::calib
