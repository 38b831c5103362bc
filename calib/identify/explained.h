#pragma once
// Touches under one explanation: the last calibration beforehand, one thing changed by an unknown size.

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
  /// `prior`: as with_drift() has it. Throws IdentifyError as foresee() does.
  TouchEquations(const Calibration& prior, const std::vector<Touch>& touches);

  const std::vector<ForeseenContact>& contacts() const { return contacts_; }
  /// By the prior; behind the calibration's parameters what else the touches ask for.
  const Eigen::VectorXd& x() const { return x_; }
  const Eigen::MatrixXd& covariance() const { return covariance_; }
  /// Of the touches beside all parameters [m^2].
  const Eigen::MatrixXd& noise_m2() const { return noise_m2_; }
  Eigen::Index parameters() const { return parameters_; }
  /// From now on the touch says nothing.
  void set_aside(std::size_t touch);

  Eigen::VectorXd off_m(const Eigen::VectorXd& x) const;
  Eigen::MatrixXd rows(const Eigen::VectorXd& x) const;

 private:
  Eigen::VectorXd in_problem(const Eigen::VectorXd& x) const;

  KnownTouches known_;
  std::vector<Eigen::Index> place_;  ///< of each unknown of the problem; -1: held
  Eigen::Index parameters_;
  std::vector<ForeseenContact> contacts_;
  Eigen::VectorXd x_;
  Eigen::MatrixXd covariance_, noise_m2_;
};

/// One explanation and size: where its parameters come to lie, and how likely the touches are.
struct Explained {
  Eigen::VectorXd x;
  /// Covariance of the parameters beforehand with what the touches are off by.
  Eigen::MatrixXd across_m;
  Cholesky foreseen;      ///< covariance of that [m^2]
  Eigen::VectorXd off_m;  ///< what they are off by, as the last step has it
  Eigen::MatrixXd rows;   ///< at x
  Eigen::VectorXd size;   ///< of the change
  Eigen::MatrixXd size_covariance;
  double log_evidence = 0.0;
  double chi2() const { return foreseen.whitened(off_m).squaredNorm(); }
  /// Of the parameters, with the touches; `beforehand` without them.
  Eigen::MatrixXd covariance(const Eigen::MatrixXd& beforehand) const;
};

/// `moves`: as moved_by(), of all the equations' parameters. `usual`: 1 sigma of each component.
Explained explained(const TouchEquations& touches, const PossibleChange& change,
                    const Eigen::MatrixXd& moves, double usual);

// Every explanation of the touches beside every other, each with its probability; and whether the likeliest
// is enough.

struct Weighed {
  PossibleChange change;
  Eigen::MatrixXd moves;  ///< as explained() takes it
  double usual = 0.0;     ///< the size that is looked for
  Explained how;
  double probability = 0.0;  ///< among all explanations and sizes
};

/// Of the last calibration and touches since. What it has no parameters for is no explanation.
std::vector<Weighed> weighed(const Calibration& prior, const TouchEquations& touches);

/// The same explanations in words' terms: sizes summed over, likeliest first.
std::vector<Explanation> explanations(const std::vector<Weighed>& all);
/// The likeliest explanation at its likeliest size.
const Weighed& likeliest(const std::vector<Weighed>& all);

/// Whether the touches are as they should be were that explanation all.
struct Sufficient {
  double chi2 = 0.0, degrees_of_freedom = 0.0;
  double by_chance = 1.0;      ///< probability of so large a chi^2
  double log_odds_more = 0.0;  ///< that something else is the matter as well, over that nothing is
  std::optional<Explanation> second = {};
};
Sufficient sufficient(const Weighed& one, const std::vector<Weighed>& all,
                      std::size_t touches_set_aside);

/// Sums over explanations of all touches that count, natural logarithms on one scale.
struct OneOrTwo {
  double log_one = 0.0;  ///< one thing changed, or nothing, or one touch is wrong by itself
  double log_one_and_touch = 0.0;  ///< one thing changed, and one touch is wrong by itself
  double log_two = 0.0;            ///< two things changed
};
OneOrTwo one_or_two(const std::vector<Weighed>& all);
/// That this touch is wrong by itself and off by what it is, given the others: density times how often that happens.
double log_wrong(const std::vector<Weighed>& all, std::size_t touch);

/// Of those that may be, the touch that, wrong by itself, leaves the others best explained by one change.
std::optional<std::size_t> doubtful_touch(const std::vector<Weighed>& all,
                                          const std::vector<bool>& may_be);

// What the last calibration says before any new touch is made, and how a change of one thing moves its
// parameters.

/// What creeps in a month without anybody doing anything, 1 sigma; it grows with the root of the time.
struct DriftPerMonth {
  double zero_rad = 5e-6;   ///< of each joint: belts, bearings
  double tip_m = 10e-6;     ///< of each component of the tool's tip: wear, its seat
  double centre_m = 10e-6;  ///< of each component of a sphere's centre: stands, glue
};

/// The last calibration with the tool's tip among its parameters, which the cell file may have taken for known,
/// and with that drift in its covariance. Throws IdentifyError where it states none.
Calibration with_drift(const Calibration& last, double months, const DriftPerMonth& drift = {});

/// What one SI unit of each component of the change does to the parameters, a column each. Empty where the
/// calibration has no parameter for it: its tolerance is 0.
std::optional<Eigen::MatrixXd> moved_by(const PossibleChange& change, const Calibration& c);

}  // namespace cellcal::calib
