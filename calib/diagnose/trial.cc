#include "calib/diagnose/trial.h"

#include <algorithm>
#include <cmath>
#include <utility>
#include <variant>

#include "calib/consistency/certified_lengths.h"
#include "calib/model/kinematics.h"
#include "calib/model/median.h"
#include "calib/problem/problem.h"
#include "calib/problem/target_place.h"
#include "calib/result/level.h"
#include "calib/verdict/identify_as_stated.h"

namespace cellcal::calib {

namespace {

/// Squared sigmas per row, of touches and tolerances together, below which all makes sense: 1 and
/// at most one more for each of the unknowns, some of which the touches do not reach.
constexpr double kSense = 2.5;
/// Nor is a tolerance or a certified length off by more, squared sigmas: among many touches one
/// would not show.
constexpr double kFarStated = 36.0;
/// A touch is wrong by no more than this, however far it is off: a tenth of all may be, as in a
/// result that is let through, and the others make sense.
constexpr double kMostSigmas = 3.5;

/// How far the files let a parameter be off, 1 sigma; 0 where they say nothing.
double stated_sigma(const ArmModel& arm, const Cell& cell, const ParameterKey& key) {
  if (key.kind == ParameterKind::kEffectiveRadius) return cell.radius_offset_sigma_m;
  if (key.kind == ParameterKind::kLatchDelay) return cell.latch_delay_sigma_s;
  if (key.kind == ParameterKind::kRadius)
    return cell.targets[static_cast<std::size_t>(key.target)].diameter_sigma_m / 2.0;
  for (const ArmParameter& parameter : arm.parameters())
    if (parameter == key) return parameter.sigma;
  return 0.0;
}

/// By a drawing or certificate. How soft joints, gears and tool are, and how late a latch is, is
/// only guessed beforehand.
bool is_drawn(ParameterKind kind) {
  return !is_compliance(kind) && !is_transmission(kind) && kind != ParameterKind::kPlay &&
         kind != ParameterKind::kDeflection && kind != ParameterKind::kLatchDelay;
}

}  // namespace

bool Trial::makes_sense() const { return misfit() < kSense && worst < kFarStated; }

std::optional<Calibration> tried(const Cell& cell, const std::vector<Touch>& touches,
                                 const IdentifyOptions& options) {
  auto found = identified_or_why_not(cell, touches, options);
  auto* calibration = std::get_if<Calibration>(&found);
  return calibration ? std::optional(std::move(*calibration)) : std::nullopt;
}

Trial fit_hypothesis(const Cell& cell, const std::vector<Touch>& touches) {
  Trial trial;
  const Cell levelled = at_level(cell, ModelLevel{}, touches);
  const ArmModel arm(levelled);
  IdentifyOptions options;
  options.level = ModelLevel{};  // the fullest without play; which one it is does not matter here
  trial.found = tried(cell, touches, options);
  if (!trial.found) return trial;
  trial.sum = 0.0;
  trial.rows = 0;
  std::vector<double> off;
  for (const TouchResidual& r : trial.found->residuals) {
    const Touch& touch = touches[r.touch];
    if (touch.set != TouchSet::kFit) continue;
    const double sigma = touch.sigma_m > 0.0 ? touch.sigma_m : cell.touch_sigma_m;
    const TargetKind kind = cell.targets[cell.target_index(touch.target)].kind;
    const int rows = kind == TargetKind::kPoint || kind == TargetKind::kTracker ? 3 : 1;
    off.push_back(std::abs(r.after_m) / sigma);
    trial.sum += std::min(off.back() * off.back(), kMostSigmas * kMostSigmas);  // (63)
    trial.rows += rows;
  }
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
    return kNowhere;  // without a tolerance nothing is to be identified
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
