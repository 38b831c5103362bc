#include "calib/result/outlier.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <utility>

namespace cellcal::calib {

namespace {

constexpr std::array kNames = {
    std::pair{OutlierKind::kOffItsTarget, "off_its_target"},
    std::pair{OutlierKind::kOnAnotherTarget, "on_another_target"},
    std::pair{OutlierKind::kHoldsItself, "holds_itself"},
    std::pair{OutlierKind::kRecorded, "recorded"},
};

/// What a touch that is off says of how it was made.
const char* side_words(TargetKind kind, double residual_m) {
  if (!std::isfinite(residual_m)) return "";
  const bool outside = residual_m > 0.0;
  switch (kind) {
    case TargetKind::kSphere:
    case TargetKind::kPlane:
      return outside ? " (tip outside: contact seen before the surface)"
                     : " (tip inside: contact seen too late)";
    case TargetKind::kWire:
      return outside ? " (the wire reads too short: check its zero and that it was taut)"
                     : " (the wire reads too long: check that nothing held or bent it)";
    case TargetKind::kPoint:
      return " (the tip was not where the others put it: check that it was seated)";
    case TargetKind::kTracker:
      return " (check the line of sight and the reflector)";
  }
  return "";
}

/// "+0.123 mm off S1"; a distance of three components is to no side.
std::string off_words(const Outlier& o) {
  const bool sideless =
      o.target_kind == TargetKind::kPoint || o.target_kind == TargetKind::kTracker;
  if (!std::isfinite(o.residual_m)) return "off " + o.target;
  return sideless ? fmt::format("{:.3f} mm off {}", std::abs(o.residual_m) * 1e3, o.target)
                  : fmt::format("{:+.3f} mm off {}", o.residual_m * 1e3, o.target);
}

std::string kind_words(const Outlier& o) {
  switch (o.kind) {
    case OutlierKind::kOnAnotherTarget:
      return fmt::format("; it lies on {}: correct its target", o.lies_on);
    case OutlierKind::kHoldsItself:
      if (!std::isfinite(o.leverage)) return {};
      return fmt::format(
          "; it would have held its own place at {:.0f} %: hardly anything else tells about it, "
          "{}",
          100.0 * o.leverage,
          o.target_kind == TargetKind::kTracker ? "measure there again" : "touch there again");
    case OutlierKind::kOffItsTarget:
    case OutlierKind::kRecorded:
      break;
  }
  return {};
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
  const std::string times =
      std::isfinite(o.sigmas)
          ? fmt::format(", {:.0f} times {}", o.sigmas,
                        o.target_kind == TargetKind::kTracker ? "its sigma" : "the touch noise")
          : "";
  return off_words(o) + times + side_words(o.target_kind, o.residual_m) + kind_words(o);
}

}  // namespace cellcal::calib
