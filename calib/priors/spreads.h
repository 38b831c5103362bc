#pragma once
// Spreads of a model's errors by the marginal likelihood of its arms' touches.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace cellcal::calib {

/// rows * (errors in drawn sigmas) + N(0, 1) = values.
struct ArmRows {
  Eigen::MatrixXd rows;
  Eigen::VectorXd values;
};

/// Errors are grouped by common spread, groups by kind.
struct Groups {
  std::vector<Eigen::Index> of_error;  ///< group of each error
  std::vector<int> kind;               ///< kind of each group

  Eigen::Index errors() const { return static_cast<Eigen::Index>(of_error.size()); }
  Eigen::Index size() const { return static_cast<Eigen::Index>(kind.size()); }
};

/// Logarithm of each group's spread relative to the stated one.
using LogSpreads = Eigen::VectorXd;

/// Consistency of one arm with the spreads.
struct ArmFit {
  double chi2 = 0.0;          ///< degrees of freedom: number of rows
  double log_evidence = 0.0;  ///< (88)
};
ArmFit fit_of(const ArmRows& arm, const Groups& groups, const LogSpreads& spreads);

/// Most likely errors of an arm, in stated sigmas.
Eigen::VectorXd likely_errors(const ArmRows& arm, const Groups& groups, const LogSpreads& spreads);

/// Deviation of chi^2 from its expectation as a standard normal variable, by Wilson and Hilferty.
double deviate(double chi2, Eigen::Index degrees_of_freedom);

struct SpreadFit {
  LogSpreads mode, sigma;
  Eigen::VectorXd arms;  ///< per group: equivalent number of perfectly known arms
};
/// Mode of the spreads and its uncertainty, from the arms in use.
SpreadFit fit_spreads(const std::vector<ArmRows>& arms, const std::vector<bool>& use,
                      const Groups& groups, const LogSpreads& start);

// Selects the arms of one population: each once, without those too far from or too near to the nominal geometry.

struct Population {
  SpreadFit spreads;
  std::vector<bool> use;
  std::vector<double> chi2, far;     ///< per arm under the majority's spreads; far: normal deviate
  std::vector<std::size_t> same_as;  ///< index of the same arm's calibration that counts
};

Population population_of(const std::vector<ArmRows>& arms, const Groups& groups);

}  // namespace cellcal::calib
