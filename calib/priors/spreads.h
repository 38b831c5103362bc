#pragma once
// The spreads of a model's errors, by the marginal likelihood of what its arms' touches say.

#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace cellcal::calib {

/// rows * (errors in drawn sigmas) + N(0, 1) = values.
struct ArmRows {
  Eigen::MatrixXd rows;
  Eigen::VectorXd values;
};

/// Errors fall into groups of one spread each, groups into kinds.
struct Groups {
  std::vector<Eigen::Index> of_error;  ///< group of each error
  std::vector<int> kind;               ///< of each group

  Eigen::Index errors() const { return static_cast<Eigen::Index>(of_error.size()); }
  Eigen::Index size() const { return static_cast<Eigen::Index>(kind.size()); }
};

/// Logarithm of each group's spread over the drawn one.
using LogSpreads = Eigen::VectorXd;

/// How one arm fits into these spreads.
struct ArmFit {
  double chi2 = 0.0;          ///< of as many degrees of freedom as rows
  double log_evidence = 0.0;  ///< (88)
};
ArmFit fit_of(const ArmRows& arm, const Groups& groups, const LogSpreads& spreads);

/// Likeliest errors of an arm, in drawn sigmas.
Eigen::VectorXd likely_errors(const ArmRows& arm, const Groups& groups, const LogSpreads& spreads);

/// By how many standard deviations that chi^2 is more than expected; normal, by Wilson and Hilferty.
double deviate(double chi2, Eigen::Index degrees_of_freedom);

struct SpreadFit {
  LogSpreads mode, sigma;
  Eigen::VectorXd arms;  ///< of each group: that tell as much, were their errors seen perfectly
};
/// Mode of the spreads and its uncertainty, of those of the arms that are in use.
SpreadFit fit_spreads(const std::vector<ArmRows>& arms, const std::vector<bool>& use,
                      const Groups& groups, const LogSpreads& start);

// Which arms are one population: each once, without those that are too far off, or too near the nominal geometry.

struct Population {
  SpreadFit spreads;
  std::vector<bool> use;
  std::vector<double> chi2, far;  ///< of all arms by the spreads of most, and as a normal deviate
  std::vector<std::size_t> same_as;  ///< the arm that it is; its own index: it counts itself
};

Population population_of(const std::vector<ArmRows>& arms, const Groups& groups);

}  // namespace cellcal::calib
