#pragma once
// A fit touch that was left out, and its sentence.

#include <cstddef>
#include <string>

#include "calib/model/enum_table.h"
#include "calib/model/robot.h"

namespace cellcal::calib {

/// Classification of an outlier beyond its residual.
enum class OutlierKind {
  kOffItsTarget,     ///< no further information
  kOnAnotherTarget,  ///< it carries the wrong name
  kHoldsItself,      ///< hardly any other touch determines its place
  kRecorded          ///< text of a file without kinds
};

/// Name in files: "on_another_target".
constexpr const char* to_string(OutlierKind kind) { return own_name(kind); }

struct Outlier {
  std::size_t touch = 0;
  double residual_m = 0.0;
  /// Leverage of the touch on its own place, 0 to 1: near 1 nothing else determines it, and its
  /// residual may be caused by the others as well.
  double leverage = 0.0;
  OutlierKind kind = OutlierKind::kRecorded;
  std::string target = {};  ///< as named by the touch
  TargetKind target_kind = TargetKind::kSphere;
  double sigmas = 0.0;       ///< residual over its sigma
  std::string lies_on = {};  ///< kOnAnotherTarget: the actual target
  std::string text = {};     ///< kRecorded

  bool operator==(const Outlier&) const = default;
};

/// "+0.500 mm off S1 (12 sigma): contact detected before the surface"
std::string words(const Outlier& outlier);

}  // namespace cellcal::calib
