#include "calib/diagnose/causes.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "calib/consistency/session_order.h"
#include "calib/diagnose/mistakes.h"
#include "calib/diagnose/trial.h"

namespace cellcal::calib {

namespace {

/// What a cause takes away at least, squared sigmas; chance and a few more unknowns take less.
constexpr double kWorthNaming = 25.0;
/// A cause has to explain all but this part of the misfit.
constexpr double kExplained = 0.5;
constexpr std::size_t kNamed = 3;
constexpr double kSameMisfit = 0.02;
/// A mistake of set-up shows in so many touches; more would only take longer.
constexpr std::size_t kMostTouches = 1000;

/// In this order are those named that explain as much.
constexpr Mistake kMistakes[] = {mistakes::radians,      mistakes::axis_signs,
                                 mistakes::mastering,    mistakes::exchanged_columns,
                                 mistakes::target_names, mistakes::readings,
                                 mistakes::moved,        mistakes::tool_unit,
                                 mistakes::tool_tip,     mistakes::dimensions,
                                 mistakes::other_robot,  mistakes::axis_convention,
                                 mistakes::diameters,    mistakes::certified_lengths,
                                 mistakes::gravity,      mistakes::stated_centres};

/// Whether two are one mistake, found in two ways: nobody could tell their numbers apart.
bool same_mistake(const Finding& a, const Finding& b) {
  constexpr double kSame = 0.05;  // mm, deg
  return a.cause == b.cause && a.about == b.about && a.parts == b.parts &&
         std::equal(a.evidence.begin(), a.evidence.end(), b.evidence.begin(), b.evidence.end(),
                    [](const Quantity& x, const Quantity& y) {
                      return x.name == y.name && std::abs(x.value - y.value) < kSame;
                    });
}

/// The likeliest of all that explain the touches.
std::vector<Cause> best_of(std::vector<Cause> causes) {
  std::ranges::stable_sort(causes, {}, &Cause::misfit);
  std::vector<Cause> named;
  for (const Cause& cause : causes) {
    // Another one is worth naming where it explains the touches about as well,
    if (named.size() == kNamed || cause.misfit > 1.2 * causes.front().misfit) break;
    // and is not the same in other words: joints' conventions can be had in several ways.
    if (std::ranges::none_of(causes, [&](const Cause& other) {
          return std::abs(other.misfit - cause.misfit) < kSameMisfit &&
                 other.changes < cause.changes;
        }))
      named.push_back(cause);
  }
  return named;
}

/// As the noise is stated. `beyond`: what the best explanation leaves, in what was stated as the
/// noise of a touch: an arm that does what its model lacks scatters by more. None where all as it
/// is stated scatters hardly more.
std::vector<Cause> causes_at(const Cell& cell, const std::vector<Touch>& all,
                             const OtherRobots& other_robots, std::optional<double>& beyond) {
  constexpr double kDoubt = 1.5, kAsStatedScatter = 1.3, kNoBetter = 1.5;
  const std::vector<std::size_t> share = share_of(all, kMostTouches);
  std::vector<Touch> touches;
  for (const std::size_t i : share) touches.push_back(all[i]);
  const Trial stated = fit_hypothesis(cell, touches);
  beyond.reset();
  if (stated.makes_sense()) return {};
  double least_scatter = stated.scatter;
  std::vector<Cause> causes;
  Asked asked{cell, touches, {}, share, other_robots, nominal_off_m(cell, touches)};
  asked.ask = [&](const Hypothesis& h) {
    if (h.no_farther && nominal_off_m(h.cell, h.touches) > kDoubt * asked.nominal_off_m) return;
    const Trial trial = fit_hypothesis(h.cell, h.touches);
    least_scatter = std::min(least_scatter, trial.scatter);
    if (!trial.makes_sense() || !(trial.excess() < kExplained * stated.excess()) ||
        !(trial.sum < stated.sum - kWorthNaming))
      return;
    std::optional<Finding> finding = h.cause(*trial.found);
    if (finding && std::ranges::none_of(causes, [&](const Cause& other) {
          return same_mistake(other.finding, *finding);
        }))
      causes.push_back({trial.misfit(), std::move(*finding), h.moved, h.changes});
  };
  for (const Mistake mistake : kMistakes) mistake(asked);
  if (!(least_scatter < kAsStatedScatter || stated.scatter < kNoBetter * least_scatter))
    beyond = least_scatter;
  return best_of(std::move(causes));
}

}  // namespace

std::vector<Cause> causes_of(const Cell& cell, const std::vector<Touch>& touches,
                             const OtherRobots& other_robots) {
  /// Of more, no arm would be left to speak of.
  constexpr double kMostScatterM = 1e-3;
  // Twice: a fit that is weighed by too small a noise leaves less than there is.
  constexpr int kMostRepeats = 2;
  std::optional<double> beyond;
  std::vector<Cause> causes = causes_at(cell, touches, other_robots, beyond);
  Cell noisier = cell;
  std::vector<Touch> same = touches;
  for (int k = 0; k < kMostRepeats && causes.empty() && beyond; ++k) {
    // With a noise as large as what the best explanation leaves.
    noisier.touch_sigma_m *= *beyond;
    if (noisier.touch_sigma_m > kMostScatterM) break;
    noisier.turn_sigma_rad *= *beyond;
    for (Touch& touch : same) {
      touch.sigma_m *= *beyond;
      touch.turn_sigma_rad *= *beyond;
    }
    causes = causes_at(noisier, same, other_robots, beyond);
  }
  return causes;
}

}  // namespace cellcal::calib
