#pragma once
// Model levels weighted by their evidence: the probability of the touches under the level, all its
// unknowns integrated out over their priors. A level that explains more but needs fine tuning to do
// so loses. The estimate is the mean over the levels, so that it does not depend on a choice
// between two levels that the touches do not distinguish; its covariance includes their difference.
// Exact for the linearised problem; iterated, for the estimate.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calib/estimate/level_family.h"
#include "calib/estimate/solve.h"
#include "calib/result/level.h"

namespace cellcal::calib {

/// Levels considered, with or without those that have play.
std::vector<ModelLevel> usual_levels(bool with_play = false);

/// Levels of an arm whose joints have functions: one more size of ripple.
std::vector<ModelLevel> levels_beside_functions(bool with_play);

/// Prior odds of play against no play.
struct PlayBeforehand {
  double odds_at_its_compliance;  ///< among levels of as much compliance
  double odds;                    ///< among all levels
};
PlayBeforehand play_beforehand();

/// Posterior mean and covariance over all levels, in the unknowns of the fullest.
struct LevelMean {
  Eigen::VectorXd u;
  Eigen::MatrixXd covariance_u;
  double ripple_rad = 0.0;            ///< root of the mean square over the likeliest levels
  double transmission = 0.0;          ///< the same
  double compliance = 0.0;            ///< the same
  double play = 0.0;                  ///< the same
  std::vector<LevelEvidence> levels;  ///< best first
};

/// Information of the touches on all unknowns near a point, summed per ripple of the levels; a
/// further touch is a change of rank one.
///
/// `problem` is at the fullest level (transmission 1, compliance and play if any) and without
/// ripple; `at` is its linearisation at `u`, near the solution. One Gauss-Newton step per level.
/// Throws IdentifyError if touches and priors together leave an unknown undetermined.
class LevelSums {
 public:
  LevelSums(const Problem& problem, const Eigen::VectorXd& u, const Linearisation& at,
            std::span<const ModelLevel> levels);

  /// Adds the rows of further touches, linearised at the same u with the problem's ripple.
  void add(const Problem& problem, const Linearisation& rows);
  LevelMean mean() const;
  /// Log evidence of all levels together; without their mean and covariance.
  double log_evidence() const;

 private:
  struct Solutions;
  Groups groups_;
  Eigen::VectorXd start_;  ///< in the groups' order
  std::vector<ModelLevel> levels_;
  std::vector<Gathered> gathered_;  ///< per ripple
};

/// Log evidence of these levels together.
double log_evidence(std::span<const LevelEvidence> levels);

/// Mean over `levels` in one call.
LevelMean mean_over_levels(const Problem& problem, const Eigen::VectorXd& u,
                           const Linearisation& at, std::span<const ModelLevel> levels);

}  // namespace cellcal::calib
