#include "calib/diagnose/causes.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "calib/consistency/session_order.h"
#include "calib/diagnose/dimensions.h"
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

/// Whether two are one mistake, found in two ways: nobody could tell their numbers apart.
bool same_mistake(const Finding& a, const Finding& b) {
  constexpr double kSame = 0.05;  // mm, deg
  return a.cause == b.cause && a.about == b.about && a.parts == b.parts &&
         std::equal(a.evidence.begin(), a.evidence.end(), b.evidence.begin(), b.evidence.end(),
                    [](const Quantity& x, const Quantity& y) {
                      return x.name == y.name && std::abs(x.value - y.value) < kSame;
                    });
}

/// All that is asked of one session.
class Search {
 public:
  Search(const Cell& cell, const std::vector<Touch>& touches)
      : share_(share_of(touches, kMostTouches)) {
    for (const std::size_t i : share_) touches_.push_back(touches[i]);
    stated_ = attempt(cell, touches_);
    least_scatter_ = stated_.scatter;
    nominal_off_m_ = nominal_off_m(cell, touches_);
  }

  bool needed() const { return !stated_.makes_sense(); }

  /// What the best explanation leaves, in what was stated as the noise of a touch: an arm that does
  /// what its model lacks scatters by more. None where all as it is stated scatters hardly more.
  std::optional<double> beyond_stated() const {
    constexpr double kAsStated = 1.3, kNoBetter = 1.5;
    if (least_scatter_ < kAsStated || stated_.scatter < kNoBetter * least_scatter_) return {};
    return least_scatter_;
  }

  void ask_for_all(const Cell& cell, const OtherRobots& other_robots) {
    const Asked asked{cell, touches_, share_, other_robots, nominal_off_m_};
    for (const auto& mistakes : {mistakes_of_touches(), mistakes_of_files()})
      for (const Mistake mistake : mistakes)
        mistake(asked, [this](const Hypothesis& hypothesis) { weigh(hypothesis); });
  }

  std::vector<Cause> best() {
    std::stable_sort(causes_.begin(), causes_.end(),
                     [](const Cause& a, const Cause& b) { return a.misfit < b.misfit; });
    std::vector<Cause> named;
    for (const Cause& cause : causes_) {
      // Another one is worth naming where it explains the touches about as well,
      if (named.size() == kNamed || cause.misfit > 1.2 * causes_.front().misfit) break;
      // and is not the same in other words: joints' conventions can be had in several ways.
      const auto same = [&](const Cause& other) {
        return std::abs(other.misfit - cause.misfit) < kSameMisfit;
      };
      if (std::none_of(causes_.begin(), causes_.end(), [&](const Cause& other) {
            return same(other) && other.changes < cause.changes;
          }))
        named.push_back(cause);
    }
    return named;
  }

 private:
  void weigh(const Hypothesis& h) {
    constexpr double kDoubt = 1.5;
    if (h.no_farther && nominal_off_m(h.cell, h.touches) > kDoubt * nominal_off_m_) return;
    const Trial trial = attempt(h.cell, h.touches);
    least_scatter_ = std::min(least_scatter_, trial.scatter);
    if (!trial.makes_sense() || !(trial.excess() < kExplained * stated_.excess()) ||
        !(trial.sum < stated_.sum - kWorthNaming))
      return;
    std::optional<Finding> finding = h.cause(*trial.found);
    if (finding && std::none_of(causes_.begin(), causes_.end(), [&](const Cause& other) {
          return same_mistake(other.finding, *finding);
        }))
      causes_.push_back({trial.misfit(), std::move(*finding), h.moved, h.changes});
  }

  std::vector<std::size_t> share_;  ///< of the touches, those that are asked
  std::vector<Touch> touches_;      ///< these
  Trial stated_;
  double least_scatter_ = 0.0;
  double nominal_off_m_ = 0.0;
  std::vector<Cause> causes_;
};

/// As the noise is stated. `beyond`: what the best explanation leaves, where that is more.
std::vector<Cause> causes_at(const Cell& cell, const std::vector<Touch>& touches,
                             const OtherRobots& other_robots, std::optional<double>& beyond) {
  Search search(cell, touches);
  if (!search.needed()) return {};
  search.ask_for_all(cell, other_robots);
  beyond = search.beyond_stated();
  return search.best();
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
    beyond.reset();
    causes = causes_at(noisier, same, other_robots, beyond);
  }
  return causes;
}

}  // namespace cellcal::calib
