// What the cell file states of its artefacts and is not so: a certified length, a diameter, where a
// wire reads zero, where a target stands.

#include <algorithm>
#include <functional>
#include <limits>

#include "calib/consistency/artefact_bias.h"
#include "calib/consistency/certified_lengths.h"
#include "calib/consistency/named_outliers.h"
#include "calib/diagnose/causes.h"
#include "calib/diagnose/jump.h"
#include "calib/diagnose/mistakes.h"
#include "calib/diagnose/trial.h"
#include "calib/model/median.h"

namespace cellcal::calib {

namespace {

/// The calibration, if all makes sense.
std::optional<Calibration> sensible(const Cell& cell, const std::vector<Touch>& touches,
                                    const IdentifyOptions& options) {
  std::optional<Calibration> calibration = tried(cell, touches, options);
  if (!calibration) return {};
  confirm_moves(cell, touches, options, *calibration);
  if (!calibration->moved.empty() || !calibration->verdict.publish) return {};
  return calibration;
}

/// What a bias has to be for everything to make sense, if there is one.
std::optional<ArtefactBias> mended_bias(const Cell& cell, const std::vector<Touch>& touches,
                                        const IdentifyOptions& options, ArtefactBias bias) {
  constexpr int kSteps = 4;  // the first one is with the outliers that the wrong size made
  for (int step = 0; step < kSteps; ++step) {
    const PutRight right = put_right(cell, touches, bias);
    if (is_of_sphere(cell, bias) &&
        right.cell.targets[cell.target_index(bias.target)].diameter_m < 0.0)
      return std::nullopt;
    const auto found = tried(right.cell, right.touches, options);
    if (!found) return std::nullopt;
    const auto own = std::ranges::find(found->artefact_biases, bias.target, &ArtefactBias::target);
    if (own == found->artefact_biases.end()) return std::nullopt;
    bias.off_m += own->off_m;
    bias.sigma_m = own->sigma_m;
    if (contradiction(*own) < 1.0) break;
  }
  const PutRight right = put_right(cell, touches, bias);
  return sensible(right.cell, right.touches, options) ? std::optional(bias) : std::nullopt;
}

/// Of all fit touches of a wire, those that were left out, too.
double median_residual_m(const Calibration& c, const std::vector<Touch>& touches,
                         const std::string& target) {
  std::vector<double> all;
  for (const TouchResidual& r : c.residuals)
    if (touches[r.touch].target == target && touches[r.touch].set == TouchSet::kFit)
      all.push_back(r.after_m);
  return all.empty() ? 0.0 : median(std::move(all));
}

/// Sizes that all else contradicts, most first; and before them, of targets whose touches were left
/// out for the most part and so say nothing, those that let them in again.
std::vector<ArtefactBias> suspected_biases(const Cell& cell, const std::vector<Touch>& touches,
                                           const IdentifyOptions& options,
                                           const Calibration& calibration) {
  constexpr double kAboutAsMuch = 0.7, kAnyDiameterM = 0.02;
  constexpr std::size_t kMost = 3;
  std::vector<ArtefactBias> suspects;
  for (const Target& target : cell.targets) {
    if (suspects.size() == kMost) break;
    const FitTouches own = fit_touches_of(target.id, touches, calibration);
    if (2 * own.left_out <= own.all) continue;
    if (target.kind == TargetKind::kWire)
      suspects.push_back({target.id, median_residual_m(calibration, touches, target.id), 0.0});
    if (target.kind != TargetKind::kSphere) continue;
    Cell loose = cell;
    loose.targets[cell.target_index(target.id)].diameter_sigma_m = kAnyDiameterM;
    const auto found = tried(loose, touches, options);
    const auto radius = target_parameter(ParameterKind::kRadius, cell.target_index(target.id));
    if (const ParameterResult* p = found ? find(*found, radius) : nullptr)
      suspects.push_back({target.id, p->correction, p->sigma});
  }
  if (const ArtefactBias* worst = worst_contradicted(calibration.artefact_biases)) {
    std::vector<ArtefactBias> contradicted = calibration.artefact_biases;
    std::erase_if(contradicted, [&](const ArtefactBias& bias) {
      return contradiction(bias) < kAboutAsMuch * contradiction(*worst) ||
             std::ranges::find(suspects, bias.target, &ArtefactBias::target) != suspects.end();
    });
    std::ranges::stable_sort(contradicted, std::greater<>(),
                             [](const ArtefactBias& one) { return contradiction(one); });
    contradicted.resize(std::min(kMost, contradicted.size()));
    suspects.insert(suspects.end(), contradicted.begin(), contradicted.end());
  }
  return suspects;
}

/// What a size has to be.
FindingPart size_of(const Cell& cell, const ArtefactBias& bias) {
  if (bias.target.empty()) return {{}, {in_mm("longer", bias.off_m, bias.sigma_m)}};
  const Target& target = cell.targets[cell.target_index(bias.target)];
  if (!is_of_sphere(cell, bias))
    return {about_target(target), {in_mm("longer", bias.off_m, bias.sigma_m)}};
  return {about_target(target),
          {in_mm("measured", target.diameter_m + 2.0 * bias.off_m, 2.0 * bias.sigma_m),
           in_mm("stated", target.diameter_m)}};
}

/// Where a diameter or a wire's zero is contradicted: which one it is; several where the touches
/// do not tell. None where none alone mends it.
std::optional<Finding> wrong_size(const Cell& cell, const std::vector<Touch>& touches,
                                  const IdentifyOptions& options, const Calibration& calibration) {
  constexpr double kLikely = 10.0;  // squared sigmas behind the likeliest: e^-5
  struct Mended {
    FindingPart size;
    double misfit;
  };
  std::vector<Mended> all;
  double least = std::numeric_limits<double>::infinity();
  for (const ArtefactBias& bias : suspected_biases(cell, touches, options, calibration)) {
    const auto mended = mended_bias(cell, touches, options, bias);
    if (!mended) continue;
    const PutRight right = put_right(cell, touches, *mended);
    all.push_back({size_of(cell, *mended), fit_hypothesis(right.cell, right.touches).sum});
    least = std::min(least, all.back().misfit);
  }
  Finding finding = likely(LikelyCause::kArtefactSize);
  for (Mended& one : all)
    if (one.misfit < least + kLikely) finding.parts.push_back(std::move(one.size));
  if (finding.parts.empty()) return {};
  if (!cell.lengths.empty()) finding.evidence = {{"lengths", 1.0, ""}};
  return finding;
}

}  // namespace

std::optional<Finding> wrong_measure(const Cell& cell, const std::vector<Touch>& touches,
                                     const IdentifyOptions& options,
                                     const Calibration& calibration) {
  const LengthResult* length = worst_contradicted(calibration.lengths);
  const ArtefactBias* bias = worst_contradicted(calibration.artefact_biases);
  std::optional<Finding> found;
  Asked asked{.cell = cell, .touches = touches, .ask = {}, .contradicted = length};
  asked.ask = [&](const Hypothesis& without) {
    if (found) return;
    if (const auto c = sensible(without.cell, without.touches, options)) found = without.cause(*c);
  };
  const auto ask_for = [&](Mistake mistake) {
    if (!found && length != nullptr) mistake(asked);
  };
  const bool size_first = length && bias && contradiction(*bias) > contradiction(*length);
  if (!size_first) ask_for(mistakes::contradicted_length);
  if (!found) found = wrong_size(cell, touches, options, calibration);
  if (size_first) ask_for(mistakes::contradicted_length);
  // No one alone is to blame.
  ask_for(mistakes::names_by_lengths);
  ask_for(mistakes::stated_centres);
  ask_for(mistakes::lengths_of_an_end);
  ask_for(mistakes::all_lengths);
  if (!found) return {};
  found->evidence.push_back({"mends", 1.0, ""});
  return found;
}

}  // namespace cellcal::calib
