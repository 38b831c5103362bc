#pragma once
// Every explanation of the touches beside every other, each with its probability; and whether the likeliest
// is enough.

#include <optional>
#include <vector>

#include "calib/result/tcp_check.h"
#include "calib/update/explained.h"

namespace cellcal::calib {

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

}  // namespace cellcal::calib
