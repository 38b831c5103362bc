#include "calib/identify/causes.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <variant>

#include "calib/estimate/problem.h"
#include "calib/estimate/target.h"
#include "calib/identify/identify_once.h"
#include "calib/identify/mistakes.h"
#include "calib/model/kinematics.h"
#include "calib/model/linear.h"
#include "calib/result/level.h"
#include "calib/verdict/artefacts.h"
#include "calib/verdict/session_order.h"

namespace cellcal::calib {

namespace {

/// Least improvement by a cause, squared sigmas; chance and a few more unknowns give less.
constexpr double kWorthNaming = 25.0;
/// Largest part of the misfit that a cause may leave.
constexpr double kExplained = 0.5;
constexpr std::size_t kNamed = 3;
constexpr double kSameMisfit = 0.02;
/// Number of touches that suffices to show a set-up mistake.
constexpr std::size_t kMostTouches = 1000;
/// Limit of the misfit of a single tolerance or certified length, squared sigmas, which many
/// touches would hide.
constexpr double kFarStated = 36.0;

/// Causes of equal misfit are reported in this order.
constexpr Mistake kMistakes[] = {mistakes::radians,      mistakes::axis_signs,
                                 mistakes::mastering,    mistakes::exchanged_columns,
                                 mistakes::target_names, mistakes::readings,
                                 mistakes::moved,        mistakes::tool_unit,
                                 mistakes::tool_tip,     mistakes::dimensions,
                                 mistakes::other_robot,  mistakes::axis_convention,
                                 mistakes::diameters,    mistakes::certified_lengths,
                                 mistakes::gravity,      mistakes::stated_centres};

/// True if both are the same mistake found in two ways, with indistinguishable values.
bool same_mistake(const Finding& a, const Finding& b) {
  constexpr double kSame = 0.05;  // mm, deg
  return a.cause == b.cause && a.about == b.about && a.parts == b.parts &&
         std::equal(a.evidence.begin(), a.evidence.end(), b.evidence.begin(), b.evidence.end(),
                    [](const Quantity& x, const Quantity& y) {
                      return x.name == y.name && std::abs(x.value - y.value) < kSame;
                    });
}

/// Likeliest of the causes that explain the touches.
std::vector<Cause> best_of(std::vector<Cause> causes) {
  std::ranges::stable_sort(causes, {}, &Cause::misfit);
  std::vector<Cause> named;
  for (const Cause& cause : causes) {
    // Other causes are reported if they explain the touches about as well
    if (named.size() == kNamed || cause.misfit > 1.2 * causes.front().misfit) break;
    // and are not an equivalent with more changes: joint conventions have several equivalents.
    if (std::ranges::none_of(causes, [&](const Cause& other) {
          return std::abs(other.misfit - cause.misfit) < kSameMisfit &&
                 other.changes < cause.changes;
        }))
      named.push_back(cause);
  }
  return named;
}

/// Causes with the stated noise. `beyond`: scatter that the best explanation leaves, relative to
/// the stated touch noise, since an arm with unmodelled errors scatters more; unset if the session
/// as stated, within tolerances, hardly scatters more.
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
  Asked asked{cell, touches, {}, share, all, other_robots, nominal_off_m(cell, touches)};
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
  // An arm far outside its tolerances follows the touches, whatever is wrong.
  const bool as_stated = stated.worst < kFarStated && stated.scatter < kNoBetter * least_scatter;
  if (!(least_scatter < kAsStatedScatter || as_stated)) beyond = least_scatter;
  return best_of(std::move(causes));
}

/// Limit of the misfit, squared sigmas per row of touches and tolerances together: 1, and at most
/// one more for each unknown, some of which the touches do not reach.
constexpr double kSense = 2.5;
/// Residual, in sigmas, at which a touch is truncated: up to a tenth of them may be gross errors,
/// as in a published result, with the others consistent.
constexpr double kMostSigmas = 3.5;

/// Stated sigma of a parameter [SI]; 0 if none is stated.
double stated_sigma(const ArmModel& arm, const Cell& cell, const ParameterKey& key) {
  if (key.kind == ParameterKind::kEffectiveRadius) return cell.radius_offset_sigma_m;
  if (key.kind == ParameterKind::kLatchDelay) return cell.latch_delay_sigma_s;
  if (key.kind == ParameterKind::kRadius)
    return cell.targets[static_cast<std::size_t>(key.target)].diameter_sigma_m / 2.0;
  for (const ArmParameter& parameter : arm.parameters())
    if (parameter == key) return parameter.sigma;
  return 0.0;
}

/// True if a drawing or certificate states the parameter. Compliance of joints, gears and tool and
/// the latch delay are only estimates beforehand.
bool is_drawn(ParameterKind kind) {
  return !is_compliance(kind) && !is_transmission(kind) && !is_by_evidence(kind) &&
         kind != ParameterKind::kPlay && kind != ParameterKind::kDeflection &&
         kind != ParameterKind::kLatchDelay;
}

}  // namespace

std::vector<Cause> causes_of(const Cell& cell, const std::vector<Touch>& touches,
                             const OtherRobots& other_robots) {
  /// Beyond this scatter no arm can be assessed.
  constexpr double kMostScatterM = 1e-3;
  // Twice, since a fit with too small a noise underestimates the scatter.
  constexpr int kMostRepeats = 2;
  std::optional<double> beyond;
  std::vector<Cause> causes = causes_at(cell, touches, other_robots, beyond);
  Cell noisier = cell;
  std::vector<Touch> same = touches;
  for (int k = 0; k < kMostRepeats && causes.empty() && beyond; ++k) {
    // With the noise that the best explanation leaves.
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

bool Trial::makes_sense() const { return misfit() < kSense && worst < kFarStated && !torn; }

std::optional<Calibration> tried(const Cell& cell, const std::vector<Touch>& touches,
                                 const IdentifyOptions& options, bool richer) {
  auto found = identified_or_why_not(cell, touches, options, richer);
  auto* calibration = std::get_if<Calibration>(&found);
  return calibration ? std::optional(std::move(*calibration)) : std::nullopt;
}

Trial fit_hypothesis(const Cell& cell, const std::vector<Touch>& touches) {
  Trial trial;
  const Cell levelled = at_level(cell, ModelLevel{}, touches);
  const ArmModel arm(levelled);
  IdentifyOptions options;
  options.level = ModelLevel{};  // the fullest without play; the choice does not matter
  trial.found = tried(cell, touches, options);
  if (!trial.found) return trial;
  trial.sum = 0.0;
  trial.rows = 0;
  std::vector<double> off;
  std::map<std::string, int> far;  // far ones less the others, per target
  for (const TouchResidual& r : trial.found->residuals) {
    const Touch& touch = touches[r.touch];
    if (touch.set != TouchSet::kFit) continue;
    const double sigma = touch.sigma_m > 0.0 ? touch.sigma_m : cell.touch_sigma_m;
    const TargetKind kind = cell.targets[cell.target_index(touch.target)].kind;
    const int rows = kind == TargetKind::kPoint || kind == TargetKind::kTracker ? 3 : 1;
    off.push_back(std::abs(r.after_m) / sigma);
    far[touch.target] += off.back() > kMostSigmas ? 1 : -1;
    trial.sum += std::min(off.back() * off.back(), kMostSigmas * kMostSigmas);  // (63)
    trial.rows += rows;
  }
  trial.torn = std::ranges::any_of(far, [](const auto& target) { return target.second > 0; });
  trial.scatter = median(std::move(off)) / kNormalMedian;
  const auto add_stated = [&](double sigmas) {
    trial.sum += sigmas * sigmas;
    trial.worst = std::max(trial.worst, sigmas * sigmas);
  };
  for (const ParameterResult& p : trial.found->parameters) {
    const double sigma = stated_sigma(arm, cell, p.key);
    if (!(sigma > 0.0)) continue;
    if (is_drawn(p.key.kind))
      add_stated(p.correction / sigma);
    else
      trial.sum += std::pow(p.correction / sigma, 2);
  }
  for (const LengthResult& length : trial.found->lengths) add_stated(contradiction(length));
  return trial;
}

double nominal_off_m(const Cell& cell, const std::vector<Touch>& touches) {
  constexpr double kNowhere = std::numeric_limits<double>::infinity();
  const ArmModel arm(cell);
  const auto places = seen_places(cell, arm, touches);
  if (!places || arm.size() == 0)
    return kNowhere;  // without a tolerance there is nothing to identify
  const Problem problem(cell, arm, touches, *places);
  const Eigen::VectorXd x = problem.to_si(Eigen::VectorXd::Zero(problem.size()));
  const Problem::At at = problem.at(x.data());
  std::vector<double> off_m;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (touches[i].set != TouchSet::kFit) continue;
    double r[Problem::kMostRows] = {};
    problem.residual_m(i, at, r, nullptr, nullptr);
    const double off = Eigen::Map<Eigen::VectorXd>(r, problem.place_rows(i)).norm();
    if (std::isfinite(off)) off_m.push_back(off);
  }
  return off_m.empty() ? kNowhere : median(std::move(off_m));
}

}  // namespace cellcal::calib
