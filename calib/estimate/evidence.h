#pragma once
// Model levels weighed by their evidence: the probability of the touches under the level with all
// its unknowns integrated out over their priors. A level that explains more but has to be tuned
// finely to do so loses. The estimate is the mean over the levels, so that nothing hangs on a
// choice between two that the touches do not tell apart, and its covariance says how much they
// differ. Exact for the linearised problem; iterated, for the estimate.

#include <Eigen/Core>
#include <memory>
#include <span>
#include <vector>

#include "calib/estimate/solve.h"
#include "calib/result/level.h"

namespace cellcal::calib {

/// The levels that are considered, with or without those that have play.
std::vector<ModelLevel> usual_levels(bool with_play = false);

/// Those of an arm whose joints have functions: of one more size of ripple.
std::vector<ModelLevel> levels_beside_functions(bool with_play);

/// Probability of play beforehand over that of none.
struct PlayBeforehand {
  double odds_at_its_compliance;  ///< among levels of as much compliance
  double odds;                    ///< among all
};
PlayBeforehand play_beforehand();

/// Posterior mean and covariance over all levels, in the unknowns of the fullest.
struct LevelMean {
  Eigen::VectorXd u;
  Eigen::MatrixXd covariance_u;
  double ripple_rad = 0.0;            ///< root of the mean square over the levels
  double transmission = 0.0;          ///< the same
  double compliance = 0.0;            ///< the same
  double play = 0.0;                  ///< the same
  std::vector<LevelEvidence> levels;  ///< best first
};

/// What the touches say about all unknowns near a point, summed for each ripple among the levels;
/// one more touch is a change of rank one.
///
/// `problem` at the fullest level (transmission 1, compliance and play where there is any) and without
/// ripple; `at` its linearisation at `u`, near the solution. One Gauss-Newton step per level.
/// Throws IdentifyError when touches and priors together leave an unknown undetermined.
class LevelSums {
 public:
  LevelSums(const Problem& problem, const Eigen::VectorXd& u, const Linearisation& at,
            std::span<const ModelLevel> levels);
  ~LevelSums();
  LevelSums(LevelSums&&) noexcept;
  LevelSums& operator=(LevelSums&&) noexcept;

  /// `rows` of more touches, linearised at the same u with the problem's ripple.
  void add(const Problem& problem, const Linearisation& rows);
  LevelMean mean() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// The same at once.
LevelMean mean_over_levels(const Problem& problem, const Eigen::VectorXd& u,
                           const Linearisation& at, std::span<const ModelLevel> levels);

}  // namespace cellcal::calib
