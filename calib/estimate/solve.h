#pragma once
// Maximum a posteriori solution of a Problem by Levenberg-Marquardt (Ceres), and its linearisation
// at the solution for everything that is said about uncertainty.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "calib/estimate/information.h"
#include "calib/estimate/problem.h"

namespace cellcal::calib {

struct SolveOptions {
  std::vector<bool> use;      ///< per touch; only fit touches may be true
  double cauchy_sigma = 0.0;  ///< scale of Cauchy's robust loss; 0: plain squares
  int max_iterations = 100;
  /// No touch or length is taken as better than this. Far from the solution more weight would only
  /// drive what the linearisation gets wrong into the directions that the touches hardly see.
  double sigma_floor_m = 0.0;
  /// Relative change of the cost at which it stops. Convergence is quadratic: what a last step of
  /// 1e-9 leaves undone is below rounding.
  double tolerance = 1e-9;
};

struct SolveResult {
  Eigen::VectorXd u;
  int iterations = 0;
  bool converged = false;  ///< false: stopped at the iteration limit
};

/// Throws IdentifyError when the solver reports failure.
SolveResult solve(const Problem& problem, const Eigen::VectorXd& start,
                  const SolveOptions& options);

/// Normal equations lose half the digits. That is nothing where a touch is worth 10 um, and too
/// much for noise-free data, which weigh a million times more against the priors.
bool needs_all_digits(const Problem& problem, const SolveOptions& options);

/// One Gauss-Newton step from u, taken without looking whether it helps: not finite where touches
/// and priors leave an unknown undetermined.
Eigen::VectorXd step_towards(const Problem& problem, const Eigen::VectorXd& u,
                             const SolveOptions& options);

/// Whitened derivative rows at u, without loss.
struct Linearisation {
  RowMajor jacobian;         ///< rows of the used touches, then of the lengths; by u
  Eigen::VectorXd residual;  ///< whitened
  std::vector<std::pair<std::size_t, int>> touch_row;  ///< (touch, its first row)
  int length_row = 0;                                  ///< first row of the lengths
};
Linearisation linearise(const Problem& problem, const Eigen::VectorXd& u,
                        const std::vector<bool>& use);
/// The same into memory that is there already.
void linearise(const Problem& problem, const Eigen::VectorXd& u, const std::vector<bool>& use,
               Linearisation& result);
/// Rows of one touch alone, without the lengths.
Linearisation linearise_touch(const Problem& problem, const Eigen::VectorXd& u, std::size_t touch);

/// Of every row j of derivatives j S j', the variance that the covariance S of the unknowns leaves it:
/// of a row that was used its leverage.
Eigen::VectorXd leverage_of(const RowMajor& rows, const Eigen::MatrixXd& covariance_u);

/// The solver's own log (glog, to standard error) is silent from here on: what it warns of is retried or named here. For
/// programs; of a program that embeds the library it is the host's to decide.
void quiet_solver();

// The rows of least squares: whitened residuals of touches and of certified lengths, and their derivatives
// by the unknowns, (12).

/// Owns its work space: evaluating allocates nothing. `problem` must outlive it.
class WhitenedRows {
 public:
  explicit WhitenedRows(const Problem& problem, double sigma_floor_m = 0.0);

  /// Where the following rows are taken; u in prior units.
  void at(const double* u);

  /// Residuals of a touch, and their derivatives: rows of `width`, of which the problem's size is
  /// written; null where not wanted. Returns the number of rows.
  int touch(std::size_t i, double* r, double* j, std::ptrdiff_t width);

  /// The residual of a certified length, and its derivatives; null where not wanted.
  void length(const Problem::Length& length, double* r, double* j) const;

 private:
  const Problem& problem_;
  double floor_m_;
  std::vector<double> x_;
  Eigen::VectorXd scale_;
  std::vector<double> by_shared_;
  Problem::At at_{};
  double by_target_[Problem::kMostRows * TargetBlock::kMost] = {};
};

}  // namespace cellcal::calib
