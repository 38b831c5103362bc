#pragma once
// Uncertainty budget of a TCP position (GUM, JCGM 100:2008, 8). Near the solution the estimate is
// linear in its inputs: a source with the information I_s contributes S I_s S to the covariance S of
// the unknowns, and the contributions of all sources add up to S.

#include <Eigen/Core>
#include <vector>

#include "calib/estimate/estimate.h"
#include "calib/estimate/problem.h"
#include "calib/model/joint_vector.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

class UncertaintyBudget {
 public:
  /// `inflation` of the estimate's covariance. Of `c`: touch noise, ripple and discrepancy.
  UncertaintyBudget(const Problem& problem, const Estimate& e, double inflation,
                    const Calibration& c);

  /// Sources with their sigmas, without contributions.
  std::vector<UncertaintyLine> lines() const;

  /// Contribution of each line [m] to the standard uncertainty of a TCP position, mean over
  /// `poses`; `moves`: of aligned_moves() there. The covariance is a mean over model levels, the
  /// shares are those of the likeliest level.
  std::vector<double> contributions_m(const std::vector<JointVector>& poses,
                                      const Eigen::MatrixXd& moves) const;

 private:
  struct Part {
    UncertaintyLine line;
    Eigen::MatrixXd covariance_u;  ///< of the arm's parameters
  };
  void add_touches(const Linearisation& linear, const Eigen::MatrixXd& reach, double sigma_m);
  void add_lengths(const Problem& problem, const Linearisation& linear,
                   const Eigen::MatrixXd& reach);
  void add_priors(const Problem& problem, const Eigen::MatrixXd& reach);

  const ArmModel& arm_;
  Eigen::MatrixXd covariance_u_;
  std::vector<Part> parts_;
  double ripple_rad_, field_m_;
};

}  // namespace cellcal::calib
