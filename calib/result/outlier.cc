#include "calib/result/outlier.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

constexpr std::array kNames = {
    std::pair{OutlierKind::kOffItsTarget, "off_its_target"},
    std::pair{OutlierKind::kOnAnotherTarget, "on_another_target"},
    std::pair{OutlierKind::kHoldsItself, "holds_itself"},
    std::pair{OutlierKind::kRecorded, "recorded"},
};

/// Hint on how the touch may have been made.
const char* hint(TargetKind kind, double residual_m) {
  if (!std::isfinite(residual_m)) return "";
  const bool outside = residual_m > 0.0;
  switch (kind) {
    case TargetKind::kSphere:
    case TargetKind::kPlane:
      return outside ? ": contact detected before the surface" : ": contact detected too late";
    case TargetKind::kWire:
      return outside ? ": wire reads too short. Check its zero, and that it was taut"
                     : ": wire reads too long. Check that nothing held or bent it";
    case TargetKind::kPoint:
      return ". Check that the tip was seated";
    case TargetKind::kTracker:
      return ". Check the line of sight and the reflector";
  }
  return "";
}

/// "+0.123 mm off S1 (4 sigma)"; a distance of three components has no sign.
std::string off_words(const Outlier& o) {
  const bool sideless =
      o.target_kind == TargetKind::kPoint || o.target_kind == TargetKind::kTracker;
  const double mm = (sideless ? std::abs(o.residual_m) : o.residual_m) * kMmPerM;
  std::string text;
  if (std::isfinite(mm))
    text = sideless ? fmt::format("{:.3f} mm ", mm) : fmt::format("{:+.3f} mm ", mm);
  text += "off " + o.target;
  if (std::isfinite(o.sigmas)) text += fmt::format(" ({:.0f} sigma)", o.sigmas);
  return text;
}

}  // namespace

const char* to_string(OutlierKind kind) {
  for (const auto& [one, name] : kNames)
    if (one == kind) return name;
  return "";
}

std::optional<OutlierKind> outlier_kind(const std::string& name) {
  for (const auto& [kind, its] : kNames)
    if (name == its) return kind;
  return std::nullopt;
}

std::string words(const Outlier& o) {
  if (o.kind == OutlierKind::kRecorded) return o.text;
  if (o.kind == OutlierKind::kOnAnotherTarget)
    return fmt::format("{}: it lies on {}. Correct its target", off_words(o), o.lies_on);
  std::string text = off_words(o) + hint(o.target_kind, o.residual_m);
  if (o.kind == OutlierKind::kHoldsItself && std::isfinite(o.leverage))
    text += fmt::format(
        ". Leverage {:.0f} %: hardly any other touch determines this place. {}", 100.0 * o.leverage,
        o.target_kind == TargetKind::kTracker ? "Measure there again" : "Touch there again");
  return text;
}

}  // namespace cellcal::calib
