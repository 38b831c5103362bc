#include "calib/diagnose/wrong_measure.h"

#include <algorithm>
#include <array>
#include <functional>
#include <limits>

#include "calib/consistency/artefact_bias.h"
#include "calib/consistency/lengths.h"
#include "calib/consistency/outliers.h"
#include "calib/diagnose/data_association.h"
#include "calib/diagnose/jump.h"
#include "calib/diagnose/trial.h"
#include "calib/model/median.h"
#include "calib/problem/target_place.h"

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

/// The calibration without these lengths, if all makes sense then.
std::optional<Calibration> sensible_without(
    const Cell& cell, const std::vector<Touch>& touches, const IdentifyOptions& options,
    const std::function<bool(const CertifiedLength&)>& which) {
  return sensible(silenced(cell, which), touches, options);
}

/// The stated centre that is wrong, if all makes sense where it is no more than where to begin.
std::optional<Finding> held_centre(const Cell& cell, const std::vector<Touch>& touches,
                                   const IdentifyOptions& options) {
  constexpr std::size_t kMostTargets = 12;
  Cell none = cell;
  std::size_t held = 0;
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const Target& target = cell.targets[t];
    if (!centre_is_held(target)) continue;
    none.targets[t].centre_sigma_m = 0.0;
    if (++held > kMostTargets) continue;
    Cell changed = cell;
    changed.targets[t].centre_sigma_m = 0.0;
    if (sensible(changed, touches, options))
      return likely(LikelyCause::kStatedCentre, about_target(target));
  }
  if (held > 1 && sensible(none, touches, options)) return likely(LikelyCause::kAllCentres);
  return {};
}

/// The certified length that all else contradicts most, where all makes sense without it.
std::optional<Finding> wrong_length(const Cell& cell, const std::vector<Touch>& touches,
                                    const IdentifyOptions& options,
                                    const Calibration& calibration) {
  const LengthResult* worst = worst_contradicted(calibration.lengths);
  if (worst == nullptr) return {};
  for (const CertifiedLength& wrong : cell.lengths) {
    if (!is_of(*worst, wrong)) continue;
    const auto which = [&](const CertifiedLength& l) { return same_ends(l, wrong); };
    if (const auto without = sensible_without(cell, touches, options, which))
      return without_length(wrong, *without);
    break;
  }
  return {};
}

/// Where certified lengths are contradicted, and no one alone is to blame: which targets stand
/// elsewhere than when they were measured. None where that does not mend it either.
std::optional<Finding> wrong_places(const Cell& cell, const std::vector<Touch>& touches,
                                    const IdentifyOptions& options,
                                    const Calibration& calibration) {
  const LengthResult* worst = worst_contradicted(calibration.lengths);
  if (worst == nullptr) return {};
  if (const auto names = better_names(cell, touches))
    if (sensible(cell, names->given_to(cell, touches), options)) return names->cause(cell);
  if (const auto centre = held_centre(cell, touches, options)) return centre;
  for (const std::string& end : {worst->from, worst->to}) {
    const auto of_end = [&](const CertifiedLength& l) { return l.from == end || l.to == end; };
    const auto own = std::count_if(cell.lengths.begin(), cell.lengths.end(), of_end);
    // With none left anything would make sense.
    if (own < 2 || own == static_cast<std::ptrdiff_t>(cell.lengths.size())) continue;
    if (sensible_without(cell, touches, options, of_end))
      return likely(LikelyCause::kLengthsOfTarget,
                    about_target(cell.targets[cell.target_index(end)]),
                    {{"lengths", static_cast<double>(own), ""}});
  }
  if (sensible_without(cell, touches, options, [](const CertifiedLength&) { return true; }))
    return likely(LikelyCause::kAllLengths);
  return {};
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
    const auto own =
        std::find_if(found->artefact_biases.begin(), found->artefact_biases.end(),
                     [&](const ArtefactBias& other) { return other.target == bias.target; });
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
             std::any_of(suspects.begin(), suspects.end(),
                         [&](const ArtefactBias& one) { return one.target == bias.target; });
    });
    std::stable_sort(contradicted.begin(), contradicted.end(),
                     [](const ArtefactBias& x, const ArtefactBias& y) {
                       return contradiction(x) > contradiction(y);
                     });
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
    all.push_back({size_of(cell, *mended), attempt(right.cell, right.touches).sum});
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

Finding without_length(const CertifiedLength& wrong, const Calibration& found) {
  Finding finding = likely(LikelyCause::kCertifiedLength, about_length(wrong.from, wrong.to),
                           {in_mm("stated", wrong.length_m)});
  const auto its = std::find_if(found.lengths.begin(), found.lengths.end(),
                                [&](const LengthResult& l) { return is_of(l, wrong); });
  if (its != found.lengths.end())
    finding.evidence.push_back(in_mm("measured", its->by_others_m, its->sigma_m));
  return finding;
}

std::optional<Finding> wrong_measure(const Cell& cell, const std::vector<Touch>& touches,
                                     const IdentifyOptions& options,
                                     const Calibration& calibration) {
  const LengthResult* length = worst_contradicted(calibration.lengths);
  const ArtefactBias* bias = worst_contradicted(calibration.artefact_biases);
  std::array in_turn{wrong_length, wrong_size, wrong_places};
  if (length != nullptr && bias != nullptr && contradiction(*bias) > contradiction(*length))
    std::swap(in_turn[0], in_turn[1]);
  for (const auto& wrong : in_turn)
    if (auto finding = wrong(cell, touches, options, calibration)) {
      finding->evidence.push_back({"mends", 1.0, ""});
      return finding;
    }
  return {};
}

}  // namespace cellcal::calib
