#pragma once
// The algebra of the levels' mean (evidence.h): all levels share one linearisation, and what they
// differ in, prior by prior, is eliminated last. In prior units, unknowns in the groups' order.

#include <Eigen/Core>
#include <optional>
#include <utility>
#include <vector>

#include "calib/estimate/problem.h"
#include "calib/estimate/solve.h"
#include "calib/model/linear.h"
#include "calib/result/level.h"

namespace cellcal::calib {

/// Precision of unknowns without a prior: a hair, so that every level stays solvable, and the same
/// in every level, so that it cancels.
inline constexpr double kFlatPrecision = 1e-8;

/// The unknowns in four groups, one behind the other: those that every level has with the same
/// prior; compliance; play, which no level has without compliance; transmission. What a level leaves
/// out or scales is then a block.
struct Groups {
  explicit Groups(const Problem& problem);

  std::vector<int> order;  ///< the problem's index of each
  Eigen::Index plain = 0, compliance = 0, play = 0, transmission = 0;
  Eigen::VectorXd precision, mean;  ///< priors, in this order
};

/// What all levels of one ripple share: J'WJ, the gradient of the touches at u, and the misfit.
struct Gathered {
  double ripple_rad = 0.0;
  Eigen::MatrixXd gram;
  Eigen::VectorXd gradient;
  double square = 0.0, log_weight = 0.0;
};

/// Adds the rows of `at`, reweighted from the problem's ripple to that of `g`.
void gather(const Problem& problem, const Linearisation& at, const Groups& groups, Gathered& g);

/// One level's Gauss-Newton step from u and its evidence. `rest`: the plain unknowns and, where the
/// level has them, compliance and play.
struct Step {
  ModelLevel level;
  bool solved = false;
  double log_evidence = 0.0;
  Eigen::VectorXd rest;          ///< L^-1 of the right side, transmission taken out
  Eigen::VectorXd transmission;  ///< step; empty where the level has none
  /// Information on transmission, the rest integrated out; none without transmission.
  std::optional<Cholesky> reduced;
};

/// What all levels of one ripple share beyond that: the plain unknowns eliminated (Schur
/// complement).
struct Eliminated {
  Eliminated(const Groups& groups, const Gathered& gathered);

  const Gathered& g;
  Cholesky factor;           ///< L L' of the plain unknowns' information
  Eigen::MatrixXd coupling;  ///< L^-1 times the block of plain by others
  Eigen::MatrixXd reduced;   ///< others' block, plain integrated out, no prior
};

/// The levels of one ripple, one compliance and one play: they differ in the prior of the transmission
/// alone, so that all other unknowns are eliminated once; compliance and play here, the plain ones
/// before.
class Family {
 public:
  /// Keeps references to all but compliance and play, the priors' factors; 0: stiff joints, none.
  Family(const Groups& groups, const Eliminated& plain, const Eigen::VectorXd& u, double compliance,
         double play);

  /// The evidence without what is known of the level beforehand.
  Step solve(const ModelLevel& level);

  /// The level's solution; 0 for unknowns that it has not.
  Eigen::VectorXd solution(const Step& s) const;

  /// Adds the mean of the levels' covariances, each times its weight.
  void add_covariance(const std::vector<std::pair<const Step*, double>>& steps,
                      Eigen::MatrixXd& covariance) const;

  double ripple_rad() const { return g_.ripple_rad; }
  double compliance() const { return compliance_; }
  double play() const { return play_; }

 private:
  /// Right side at the point that the step starts from: an unknown that the level has not goes to
  /// 0 first, which is not the level's to choose.
  struct Right {
    bool known = false;
    double square = 0.0;
    Eigen::VectorXd rest;          ///< L^-1 of the right side
    Eigen::VectorXd transmission;  ///< of the touches, rest taken out
  };

  const Right& right_with() { return right(with_, groups_.transmission); }
  const Right& right_without() { return right(without_, 0); }

  const Right& right(Right& r, Eigen::Index transmission);

  const Groups& groups_;
  const Gathered& g_;
  const Eigen::VectorXd& u_;
  double compliance_, play_;
  Eigen::Index size_ = 0;
  Eigen::VectorXd precision_;
  bool solvable_ = false;
  Eigen::MatrixXd lower_;     ///< L, with L L' the rest's information
  Eigen::MatrixXd coupling_;  ///< L^-1 times the block of rest by transmission
  Eigen::MatrixXd reduced_;   ///< transmission's block, rest integrated out, no prior
  double log_det_ = 0.0;
  Right with_, without_;
};

}  // namespace cellcal::calib
