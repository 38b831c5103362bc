#pragma once
// Maximum a posteriori solution of a Problem by Levenberg-Marquardt (Ceres), and the linearisation
// at the solution, from which all uncertainties follow.

#include <Eigen/Core>
#include <cstddef>
#include <utility>
#include <vector>

#include "calib/estimate/information.h"
#include "calib/estimate/problem.h"

namespace cellcal::calib {

struct SolveOptions {
  std::vector<bool> use;      ///< per touch; only fit touches may be true
  double cauchy_sigma = 0.0;  ///< scale of Cauchy's robust loss; 0: plain squares
  int max_iterations = 100;
  /// Lower limit of the sigma of touches and lengths. Far from the solution larger weights would
  /// only let the linearisation error dominate the directions that the touches hardly determine.
  double sigma_floor_m = 0.0;
  /// Relative change of the cost at which the solver stops. Convergence is quadratic: after a last
  /// step of 1e-9 the remaining error is below rounding.
  double tolerance = 1e-9;
};

struct SolveResult {
  Eigen::VectorXd u;
  int iterations = 0;
  bool converged = false;  ///< false: stopped at the iteration limit
};

/// Solves the problem from `start` (prior units). Throws IdentifyError on failure of the solver.
SolveResult solve(const Problem& problem, const Eigen::VectorXd& start,
                  const SolveOptions& options);

/// True if the normal equations, which lose half the digits, are too inaccurate: not with touches
/// of 10 um, but with noise-free ones, which have a million times the weight of the priors.
bool needs_all_digits(const Problem& problem, const SolveOptions& options);

/// One Gauss-Newton step from u, whether or not it reduces the cost. Not finite if touches and
/// priors leave an unknown undetermined.
Eigen::VectorXd step_towards(const Problem& problem, const Eigen::VectorXd& u,
                             const SolveOptions& options);

/// Whitened residuals and derivatives at u, without robust loss.
struct Linearisation {
  RowMajor jacobian;         ///< rows of the used touches, then of the lengths; by u
  Eigen::VectorXd residual;  ///< whitened
  std::vector<std::pair<std::size_t, int>> touch_row;  ///< (touch, its first row)
  int length_row = 0;                                  ///< first row of the lengths
};
Linearisation linearise(const Problem& problem, const Eigen::VectorXd& u,
                        const std::vector<bool>& use);
/// Linearises into existing memory.
void linearise(const Problem& problem, const Eigen::VectorXd& u, const std::vector<bool>& use,
               Linearisation& result);
/// Rows of a single touch, without the lengths.
Linearisation linearise_touch(const Problem& problem, const Eigen::VectorXd& u, std::size_t touch);

/// j S j' per row j of derivatives, the variance of the row by the covariance S of the unknowns:
/// the leverage of a row in use.
Eigen::VectorXd leverage_of(const RowMajor& rows, const Eigen::MatrixXd& covariance_u);

/// Silences the solver's log (glog, to standard error): its warnings are handled or reported here.
/// For programs; in a program that embeds the library the decision is the host's.
void quiet_solver();

}  // namespace cellcal::calib
