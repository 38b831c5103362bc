#pragma once
// Touches explained by the last calibration as a prior and one change of unknown size.

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "calib/check/explain.h"
#include "calib/check/tcp_check.h"
#include "calib/model/linear.h"
#include "calib/result/calibration.h"
#include "calib/result/tcp_check.h"

namespace cellcal::calib {

/// Touches as equations of a calibration's parameters.
class TouchEquations {
 public:
  /// `prior`: result of with_drift(). Throws IdentifyError as foresee() does.
  TouchEquations(const Calibration& prior, const std::vector<Touch>& touches);

  const std::vector<ForeseenContact>& contacts() const { return contacts_; }
  /// Prior values: the calibration's parameters, then further unknowns of the touches.
  const Eigen::VectorXd& x() const { return x_; }
  const Eigen::MatrixXd& covariance() const { return covariance_; }
  /// Covariance of the touches beyond all parameters [m^2].
  const Eigen::MatrixXd& noise_m2() const { return noise_m2_; }
  /// Its square root per touch [m], also of those excluded.
  const Eigen::VectorXd& sigma_m() const { return sigma_m_; }
  Eigen::Index parameters() const { return parameters_; }
  /// Excludes a touch from now on.
  void set_aside(std::size_t touch);

  Eigen::VectorXd off_m(const Eigen::VectorXd& x) const;
  Eigen::MatrixXd rows(const Eigen::VectorXd& x) const;

 private:
  Eigen::VectorXd in_problem(const Eigen::VectorXd& x) const;

  KnownTouches known_;
  std::vector<Eigen::Index> place_;  ///< per unknown of the problem; -1: held
  Eigen::Index parameters_;
  std::vector<ForeseenContact> contacts_;
  Eigen::VectorXd x_;
  Eigen::MatrixXd covariance_, noise_m2_;
  Eigen::VectorXd sigma_m_;
};

/// One explanation with one size: resulting parameters and likelihood of the touches.
struct Explained {
  Eigen::VectorXd x;
  /// Prior covariance of the parameters with the residuals.
  Eigen::MatrixXd across_m;
  Cholesky foreseen;      ///< covariance of the residuals [m^2]
  Eigen::VectorXd off_m;  ///< residuals of the touches, linearised at the last step
  Eigen::MatrixXd rows;   ///< at x
  Eigen::VectorXd size;   ///< of the change
  Eigen::MatrixXd size_covariance;
  double log_evidence = 0.0;
  double chi2() const { return foreseen.whitened(off_m).squaredNorm(); }
  /// Posterior covariance of the parameters; `beforehand`: prior covariance.
  Eigen::MatrixXd covariance(const Eigen::MatrixXd& beforehand) const;
};

/// `moves`: as moved_by(), for all parameters of `touches`. `usual`: 1 sigma of each component.
Explained explained(const TouchEquations& touches, const PossibleChange& change,
                    const Eigen::MatrixXd& moves, double usual);

// All explanations of the touches with their probabilities, and a test of whether the likeliest is
// sufficient.

struct Weighed {
  PossibleChange change;
  Eigen::MatrixXd moves;  ///< as for explained()
  double usual = 0.0;     ///< prior sigma of the size
  Explained how;
  double probability = 0.0;  ///< among all explanations and sizes
};

/// Explanations by the last calibration and the touches since. Changes without parameters are
/// omitted.
std::vector<Weighed> weighed(const Calibration& prior, const TouchEquations& touches);

/// Explanations for the report: summed over sizes, likeliest first.
std::vector<Explanation> explanations(const std::vector<Weighed>& all);
/// The likeliest explanation at its likeliest size.
const Weighed& likeliest(const std::vector<Weighed>& all);

/// Test of whether an explanation alone is consistent with the touches.
struct Sufficient {
  double chi2 = 0.0, degrees_of_freedom = 0.0;
  double by_chance = 1.0;      ///< probability of so large a chi^2
  double log_odds_more = 0.0;  ///< of a further change against none
  std::optional<Explanation> second = {};
};
Sufficient sufficient(const Weighed& one, const std::vector<Weighed>& all,
                      std::size_t touches_set_aside);

/// Sums over explanations of all touches in use, natural logarithms on one scale.
struct OneOrTwo {
  double log_one = 0.0;  ///< one change, no change, or an erroneous touch in place of a change
  double log_one_and_touch = 0.0;  ///< one change, and one erroneous touch
  double log_two = 0.0;            ///< two changes
};
OneOrTwo one_or_two(const std::vector<Weighed>& all);
/// Log odds that a touch is erroneous with its residual given the others: prior odds times density.
double log_wrong(const std::vector<Weighed>& all, std::size_t touch);

/// Touch among `may_be` whose exclusion leaves the others best explained by one change; nullopt if
/// none is eligible.
std::optional<std::size_t> doubtful_touch(const std::vector<Weighed>& all,
                                          const std::vector<bool>& may_be);

// Prediction by the last calibration before any new touch, and the effect of a single change on its
// parameters.

/// The last calibration with the tool's tip among its parameters, even if the cell file states it
/// as known, and with the drift added to its covariance. Throws IdentifyError if `last` has no
/// covariance.
Calibration with_drift(const Calibration& last, double months);

/// Derivatives of the parameters by each component of the change, SI, a column each. nullopt if the
/// calibration lacks a parameter for it, whose tolerance is then 0.
std::optional<Eigen::MatrixXd> moved_by(const PossibleChange& change, const Calibration& c);

}  // namespace cellcal::calib
