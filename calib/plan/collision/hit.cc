#include "calib/plan/collision/hit.h"

#include <fmt/format.h>

#include <cmath>

#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

std::string near_words(const Hit& hit) {
  constexpr double kTouching = 1e-6, kRoundingMm = 1e-3;
  if (hit.gap_m < kTouching) return fmt::format("{} runs into {}", hit.body, hit.other);
  return fmt::format("{} comes within {:.0f} mm of {}", hit.body,
                     std::ceil(hit.gap_m * kMmPerM - kRoundingMm), hit.other);
}

}  // namespace

std::string words(const Hit& hit) {
  switch (hit.kind) {
    case Hit::Kind::kTooNear:
      return near_words(hit);
    case Hit::Kind::kBelowTargets:
      return fmt::format(
          "{} comes more than {:.0f} mm below the lowest target (no floor_mm in the cell file)",
          hit.body, kBelowTargetsM * kMmPerM);
    case Hit::Kind::kImpassable:
      return "the way leads near a singularity, or an axis beyond its correction limit";
  }
  return {};
}

std::string words_or(const std::optional<Hit>& hit, const char* otherwise) {
  return hit ? words(*hit) : otherwise;
}

}  // namespace cellcal::calib
