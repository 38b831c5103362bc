#pragma once
// Algebra of the mean over levels (evidence.h): all levels share one linearisation; the unknowns
// whose priors differ between levels are eliminated last. Prior units, unknowns in the groups'
// order.

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "calib/estimate/problem.h"
#include "calib/estimate/repeats.h"
#include "calib/estimate/solve.h"
#include "calib/model/linear.h"
#include "calib/result/level.h"

namespace cellcal::calib {

/// Precision of unknowns without a prior: small, so that every level remains solvable, and equal in
/// all levels, so that it cancels.
inline constexpr double kFlatPrecision = 1e-8;

/// Order of the unknowns in four groups: those with the same prior in every level; compliance;
/// play, which no level has without compliance; transmission. The unknowns that a level omits or
/// scales thus form a block.
struct Groups {
  explicit Groups(const Problem& problem);

  std::vector<int> order;  ///< index into the problem, per unknown
  Eigen::Index plain = 0, compliance = 0, play = 0, transmission = 0;
  Eigen::VectorXd precision, mean;  ///< priors, in this order
};

/// Common to all levels of one ripple: J'WJ, gradient of the touches at u, and misfit.
struct Gathered {
  double ripple_rad = 0.0;
  Eigen::MatrixXd gram;
  Eigen::VectorXd gradient;
  double square = 0.0, log_weight = 0.0;
};

/// Adds the rows of `mean`, reweighted from the problem's ripple to that of `g`.
void gather(const Problem& problem, const MeanRows& mean, const Groups& groups, Gathered& g);

/// One level's Gauss-Newton step from u and its evidence. `bearing`: compliance and play, where the
/// level has them.
struct Step {
  ModelLevel level;
  bool solved = false;
  double log_evidence = 0.0;
  Eigen::VectorXd plain, bearing;  ///< L^-1 times right side, transmission eliminated
  Eigen::VectorXd transmission;    ///< step; empty where the level has none
  /// Information on transmission, the other unknowns integrated out; none without transmission.
  std::optional<Cholesky> reduced;
};

/// Plain unknowns eliminated (Schur complement), common to all levels of one ripple.
struct Eliminated {
  Eliminated(const Groups& groups, const Gathered& gathered);

  /// Adds the covariance of levels of total weight `weight`, with `others` the sum of their weights
  /// times the covariance of the other unknowns.
  void add_covariance(double weight, const Eigen::MatrixXd& others,
                      Eigen::MatrixXd& covariance) const;

  const Gathered& g;
  Cholesky factor;           ///< L L' of the plain unknowns' information
  Eigen::MatrixXd root;      ///< L^-1
  Eigen::MatrixXd coupling;  ///< L^-1 times the block of plain by others
  Eigen::MatrixXd reduced;   ///< other unknowns' block, plain integrated out, no prior
};

/// Levels of one ripple, one compliance and one play: they differ in the prior of the transmission
/// alone, so that all other unknowns are eliminated once: the plain ones in Eliminated, compliance
/// and play here.
class Family {
 public:
  /// Keeps references to `groups`, `plain` and `u`. `compliance` and `play` scale the priors; 0:
  /// the level has none.
  Family(const Groups& groups, const Eliminated& plain, const Eigen::VectorXd& u, double compliance,
         double play);

  /// Step and evidence of the level, without the prior of the level.
  Step solve(const ModelLevel& level);

  /// Solution of the level; 0 for unknowns that it lacks.
  Eigen::VectorXd solution(const Step& s) const;

  /// Adds the levels' covariances of all but the plain unknowns, each times its weight.
  void add_covariance(const std::vector<std::pair<const Step*, double>>& steps,
                      Eigen::MatrixXd& others) const;

  const Eliminated& plain() const { return plain_; }
  double ripple_rad() const { return plain_.g.ripple_rad; }
  double compliance() const { return compliance_; }
  double play() const { return play_; }

 private:
  /// Right side at the start of the step. Unknowns that the level lacks are moved to 0 first,
  /// outside the step.
  struct Right {
    bool known = false;
    double square = 0.0;
    Eigen::VectorXd plain, bearing;  ///< L^-1 times right side
    Eigen::VectorXd transmission;    ///< of the touches, the other unknowns eliminated
  };

  const Right& right(Right& r, Eigen::Index transmission);

  const Groups& groups_;
  const Eliminated& plain_;
  const Eigen::VectorXd& u_;
  double compliance_, play_;
  Eigen::Index bearing_ = 0;   ///< number of unknowns of compliance and play
  Eigen::VectorXd precision_;  ///< of the plain unknowns and these
  bool solvable_ = false;
  Cholesky factor_;           ///< L L' of the information on these, the plain ones integrated out
  Eigen::MatrixXd coupling_;  ///< L^-1 times the block of these by transmission
  Eigen::MatrixXd reduced_;   ///< transmission's block, other unknowns integrated out, no prior
  double log_det_ = 0.0;
  Right with_, without_;
};

}  // namespace cellcal::calib
