#pragma once
// Remaining uncertainty under a set of touches, updated as touches are added and removed.
//
// With S the covariance after the touches in the set, j a candidate's whitened derivatives by all
// unknowns (one row), and W_p the sum of J_p'J_p over the relevant poses (without base motion),
// adding the candidate changes
//   S by -S j' j S / (1 + j S j'),   trace(W_p S) by -j S W_p S j' / (1 + j S j')
// and removing it by the same with 1 - j S j'. The vectors chol(W_p)' S j' and the numbers j S j' of
// all candidates are maintained: a change of the set costs one product of all rows with a vector,
// and one rank-one update of those.

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
  /// unknowns (region.h), which precede all others.
  Design(RowMajor rows, Eigen::MatrixXd covariance_u, const Eigen::MatrixXd& moves_m);

  Eigen::Index size() const { return rows_.rows(); }
  bool has(Eigen::Index candidate) const { return in_[static_cast<std::size_t>(candidate)]; }
  /// Reduction of the sum of position variances by adding a candidate [m^2].
  double gain(Eigen::Index candidate) const;
  /// Increase by removing one.
  double loss(Eigen::Index candidate) const;
  /// gain() of every candidate after removing this one, which is in the set; its own entry is its
  /// current value. The set is unchanged.
  Eigen::VectorXd gains_without(Eigen::Index candidate) const;
  /// Prior variance of the candidate's measurement: j S j', in units of the touch's own variance.
  double unknown(Eigen::Index candidate) const { return h_[candidate]; }

  void take(Eigen::Index candidate);
  void drop(Eigen::Index candidate);
  /// Equivalent to take() of each in turn, up to rounding; more cache-efficient.
  void take_all(const std::vector<std::size_t>& candidates);

  const Eigen::MatrixXd& covariance_u() const { return covariance_; }

 private:
  void change(Eigen::Index candidate, double sign);

  RowMajor rows_;
  Eigen::MatrixXd covariance_;
  Eigen::MatrixXd a_;       ///< chol(W_p)' S j', one column per candidate
  Eigen::VectorXd h_;       ///< j S j'
  Eigen::VectorXd square_;  ///< |a_'s columns|^2
  std::vector<bool> in_;
  /// rows_ S j' of the last candidate of gains_without(), reused by its drop().
  mutable Eigen::VectorXd with_;
  mutable Eigen::Index with_of_ = -1;
};

// Data for choosing touches: information of each candidate, prior knowledge, and the motion of the
// relevant tips. Uses the estimator's own model and priors, so that touches are chosen with the
// model of the verdict.

/// All in prior units (problem.h).
struct DesignProblem {
  RowMajor rows;                 ///< whitened derivatives, candidates x unknowns
  Eigen::MatrixXd covariance_u;  ///< priors and certified lengths
  Eigen::MatrixXd moves_m;       ///< 3 poses x arm's unknowns (region.h), which precede all others
  /// Moves of the tip in the frames of a positioner's targets, aligned; weighed together with moves_m.
  Eigen::MatrixXd on_table_m;
  std::vector<JointVector> postures;    ///< the poses of moves_m
  double ripple_rad;                    ///< predicted, of every joint; 0 if only a tool matters
  Eigen::VectorXd scale;                ///< SI value of one prior unit, per unknown of the arm
  std::shared_ptr<const ArmModel> arm;  ///< with all its unknowns
  std::vector<ParameterKey> keys;       ///< of the unknowns
  Eigen::VectorXd prior_weight;         ///< of the unknowns, 1 / prior sigma; 0: none
};

/// The cell, its joints that state no function with the sizes and reaches of those that the arm's
/// last calibration learnt, by the joints' names.
Cell with_functions_of(const Robot& learnt, Cell cell);

/// `candidates`: not empty, of targets with stated centres. Throws PlanError if the region of
/// interest is out of reach.
DesignProblem design_problem(const Cell& cell, const std::vector<Candidate>& candidates,
                             const AccuracyRegion& region);

}  // namespace cellcal::calib
