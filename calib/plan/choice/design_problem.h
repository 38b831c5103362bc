#pragma once
// What a choice of touches is judged by: what each candidate would tell, what is known before any
// touch, and how the tips that matter move with what is unknown. With the estimator's own model and
// priors, so that touches are chosen for the arm as it will be judged.

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "calib/model/kinematics.h"
#include "calib/plan/reach/accuracy_region.h"
#include "calib/plan/reach/candidates.h"
#include "calib/problem/information.h"

namespace cellcal::calib {

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
