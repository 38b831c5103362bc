#pragma once
// Uncertainty budget of a TCP position (GUM, JCGM 100:2008, 8). Near the solution the estimate is
// linear in its inputs: a source with the information I_s contributes S I_s S to the covariance S of
// the unknowns, and the contributions of all sources add up to S.

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "calib/estimate/estimate.h"
#include "calib/estimate/problem.h"
#include "calib/model/joint_vector.h"
#include "calib/model/parameter_key.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {

/// Source of the prior of an unknown.
UncertaintySource source_of(const ParameterKey& key);

/// In units of the scale, rms over the levels; none without a prior.
std::optional<double> prior_sigma_u(const Unknown& unknown, const LevelMean& levels);

/// Keeps references to `problem` and `e`.
class UncertaintyBudget {
 public:
  /// `inflation` of the estimate's covariance. Of `c`: touch noise, ripple and discrepancy.
  UncertaintyBudget(const Problem& problem, const Estimate& e, double inflation,
                    const Calibration& c);

  /// Sources with their sigmas, without contributions.
  std::vector<UncertaintyLine> lines() const;

  /// Contribution of each line [m] to `standard_m`, the standard uncertainty of a TCP position, mean
  /// over poses; `moves`: of aligned_moves() there. The shares are those at a sample of the poses, and
  /// for the covariance, a mean over model levels, those of the likeliest level.
  std::vector<double> contributions_m(const std::vector<JointVector>& poses,
                                      const Eigen::MatrixXd& moves, double standard_m) const;

 private:
  /// Unknowns with a prior from one source.
  struct Priors {
    UncertaintyLine line;
    std::vector<std::pair<int, double>> sigma_u;  ///< index of the unknown
  };

  const Problem& problem_;
  const Estimate& estimate_;
  double inflation_, touch_noise_m_, ripple_rad_, field_m_;
  std::vector<Priors> priors_;
};

}  // namespace cellcal::calib
