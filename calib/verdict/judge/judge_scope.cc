#include "calib/verdict/judge/judge_scope.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "calib/consistency/certified_lengths.h"
#include "calib/verdict/judge/tolerances.h"

namespace cellcal::calib {

namespace {

/// Certified lengths hold the scale where sigma over length of all together is no more than this.
constexpr double kLengthScaleSigma = 5e-4;

/// Each of the lengths once, the most certain of those between the same two ends; where the touches
/// do not hold both ends a length says nothing of the arm.
std::vector<Problem::Length> different_lengths(const Problem& problem,
                                               const std::vector<int>& loose) {
  const auto is_loose = [&](int block) {
    return std::find(loose.begin(), loose.end(), block) != loose.end();
  };
  std::vector<Problem::Length> different;
  for (const Problem::Length& length : problem.lengths()) {
    if (is_loose(length.block_a) || is_loose(length.block_b)) continue;
    const auto known =
        std::find_if(different.begin(), different.end(), [&](const Problem::Length& other) {
          return std::minmax(length.block_a, length.block_b) ==
                 std::minmax(other.block_a, other.block_b);
        });
    if (known == different.end())
      different.push_back(length);
    else if (length.sigma_m < known->sigma_m)
      *known = length;
  }
  return different;
}

bool hold_scale(const std::vector<Problem::Length>& lengths) {
  double information = 0.0;
  for (const Problem::Length& length : lengths)
    information += std::pow(length.length_m / length.sigma_m, 2);  // (54)
  return information * kLengthScaleSigma * kLengthScaleSigma >= 1.0;
}

/// Others than its certificate say how long it is, so well that they would hold the scale
/// themselves; or it was measured twice. A certificate that is written down twice does not count.
bool is_checked(const Calibration& c, const LengthResult& length) {
  return length.sigma_m < kLengthScaleSigma * length.certified_m ||
         std::any_of(c.lengths.begin(), c.lengths.end(), [&](const LengthResult& other) {
           return same_ends(length, other) && other.certified_m != length.certified_m;
         });
}

/// Where all hangs on one certificate, or the touches check none by the others.
std::optional<Finding> unchecked_lengths(const Calibration& c, std::size_t holding) {
  if (c.lengths.empty() || std::any_of(c.lengths.begin(), c.lengths.end(),
                                       [&](const LengthResult& l) { return is_checked(c, l); }))
    return std::nullopt;
  const LengthResult& best = *std::min_element(
      c.lengths.begin(), c.lengths.end(), [](const LengthResult& a, const LengthResult& b) {
        return least_seen_error_m(a) < least_seen_error_m(b);
      });
  return Finding{holding > 1 ? FindingKind::kUncheckedLengths : FindingKind::kUncheckedLength,
                 Severity::kWarns,
                 about_length(best.from, best.to),
                 {in_mm("unseen", least_seen_error_m(best)),
                  in_mm("certified", best.certified_m, best.certified_sigma_m),
                  {"lengths", static_cast<double>(holding), ""}}};
}

/// Why the result claims nothing away from the targets, and what would hold the scale.
Finding near_targets(const Problem& problem, const HeldPlaces& places, const Scale& scale) {
  const auto any = [&](const auto& is) {
    return std::any_of(problem.blocks().begin(), problem.blocks().end(),
                       [&](const TargetBlock& block) {
                         return is(problem.cell().targets[block.target].kind);
                       })
               ? 1.0
               : 0.0;
  };
  return {FindingKind::kScaleByNothing,
          Severity::kInforms,
          {},
          {{"lengths", static_cast<double>(problem.lengths().size()), ""},
           {"lengths_with_held_ends", static_cast<double>(scale.lengths.size()), ""},
           {"loose_targets", static_cast<double>(places.loose.size()), ""},
           {"spheres", any([](TargetKind kind) { return kind == TargetKind::kSphere; }), ""},
           {"centres", any(has_a_centre), ""}}};
}

}  // namespace

Scale scale_of(const Problem& problem, const HeldPlaces& places) {
  Scale scale;
  scale.lengths = different_lengths(problem, places.loose);
  scale.by_lengths = hold_scale(scale.lengths);
  scale.by_readings = places.rule != nullptr;
  return scale;
}

void note_scope(const Problem& problem, const Calibration& c, const HeldPlaces& places,
                const Scale& scale, std::vector<Finding>& findings) {
  const ArmScale arm = arm_scale(problem, c);
  if (scale.by_readings)
    findings.push_back(
        {FindingKind::kScaleByReadings, Severity::kInforms, about_target(*places.rule)});
  // Wires are of one instrument, and have their scale in common.
  const bool alone = scale.by_readings && !scale.by_lengths && places.trackers <= 1 &&
                     (places.trackers == 0 || places.wires == 0);
  if (alone && arm.sigma > 0.0)
    findings.push_back({FindingKind::kUncheckedReadings,
                        Severity::kWarns,
                        {},
                        {{"unseen", 100.0 * arm.unseen(), "%"}}});
  if (scale.by_lengths) {
    Finding finding{FindingKind::kScaleByLengths,
                    Severity::kInforms,
                    {},
                    {{"lengths", static_cast<double>(scale.lengths.size()), ""}}};
    // What all certificates have in common only the arm's tolerances contradict.
    if (scale.lengths.size() > 1 && !scale.by_readings && arm.sigma > 0.0)
      finding.evidence.push_back({"unseen", 100.0 * arm.unseen(), "%"});
    findings.push_back(std::move(finding));
    if (auto unchecked = unchecked_lengths(c, scale.lengths.size()))
      findings.push_back(std::move(*unchecked));
  }
  if (!scale.held()) findings.push_back(near_targets(problem, places, scale));
}

}  // namespace cellcal::calib
