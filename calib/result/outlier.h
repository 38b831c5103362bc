#pragma once
// A fit touch that was left out, and its sentence.

#include <cstddef>
#include <optional>
#include <string>

#include "calib/model/robot.h"

namespace cellcal::calib {

/// What is known of it beside how far it is off.
enum class OutlierKind {
  kOffItsTarget,     ///< nothing more
  kOnAnotherTarget,  ///< it carries the wrong name
  kHoldsItself,      ///< hardly any other touch determines its place
  kRecorded          ///< in the words of a file that holds no more
};

/// As files name it: "on_another_target". Of a name that is none, nothing.
const char* to_string(OutlierKind kind);
std::optional<OutlierKind> outlier_kind(const std::string& name);

struct Outlier {
  std::size_t touch = 0;
  double residual_m = 0.0;
  /// How far it would have held its own place, 0 to 1: near 1 nothing else determines it, and that
  /// it was left out says as much about the others as about it.
  double leverage = 0.0;
  OutlierKind kind = OutlierKind::kRecorded;
  std::string target = {};  ///< that it is said to be of
  TargetKind target_kind = TargetKind::kSphere;
  double sigmas = 0.0;       ///< residual over the sigma that it was weighed by
  std::string lies_on = {};  ///< kOnAnotherTarget: that one
  std::string text = {};     ///< kRecorded

  bool operator==(const Outlier&) const = default;
};

/// "+0.500 mm off S1 (12 sigma): contact detected before the surface"
std::string words(const Outlier& outlier);

}  // namespace cellcal::calib
