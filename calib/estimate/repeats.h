#pragma once
// Repeated touches of one place: their differences are the touch noise alone. The errors of the arm
// are the same for all of them and cancel, as do ripple and wobble of the gears; therefore their
// mean still includes one ripple. Readings of several tools at one posture (reflectors of a tracker)
// share it likewise.

#include <Eigen/Core>
#include <span>
#include <vector>

#include "calib/estimate/problem.h"
#include "calib/estimate/solve.h"

namespace cellcal::calib {

/// If repeats of three degrees of freedom or more scatter less than this share of the stated noise, the
/// stated value is no noise figure and is ignored. It is usually the residual of a fit, with the
/// errors that the touches of one posture share: every level of the model has ripple then.
constexpr double kNoFigureShare = 0.25;

struct Repeats {
  /// Per touch: fit touches at its posture, whatever the tool, load and target; itself included.
  std::vector<int> times;
  std::vector<std::size_t>
      first;               ///< per touch: the first fit touch of its place; itself without repeats
  int touches = 0;         ///< number of repeats
  double scatter_m = 0.0;  ///< 1 sigma of one of them about its group's mean, pooled
  double degrees_of_freedom = 0.0;  ///< of the scatter; 0: not measured
  double used_m = 0.0;              ///< noise of a touch that states none: stated and measured
  double used_degrees = 0.0;        ///< of the scatter that used_m contains; 0: as stated
};

/// Repeats among the fit touches. Identical rows are copies and not evaluated; touches that state their own sigma keep it.
Repeats find_repeats(const Problem& problem);
/// A linearisation with one row of each place for those of its repeats: their mean, times the root of
/// their number. The mean has the ripple of one touch, the differences have none, (24a).
struct MeanRows {
  Linearisation linear;
  std::vector<int> times;  ///< per touch of `linear`: repeats of its place in use, itself included
  double differences =
      0.0;  ///< of the repeats, from their means, whitened by the noise alone: sum of squares
};
/// `at` as it is under a discrepancy, which correlates its rows.
MeanRows mean_rows(const Problem& problem, const Linearisation& at);
/// Sets the weights of `problem` by find_repeats() and returns its result.
Repeats weigh_repeats(Problem& problem);
/// Touches without those that share a posture with one of another tool, load or target. They share its errors,
/// whatever causes them: what the arm has beyond its geometry is not to be concluded from both.
std::vector<Touch> of_one_tool_per_posture(const std::vector<Touch>& touches);
/// True if the last touch was made at the posture of an earlier one.
bool repeats_another(std::span<const Touch> touches);

}  // namespace cellcal::calib
