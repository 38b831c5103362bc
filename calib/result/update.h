#pragma once
// A calibration updated from the one before it by a few touches: its origin, the assumed change, and how
// well the touches support it.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/enum_table.h"
#include "calib/result/tcp_check.h"

namespace cellcal::calib {

enum class UpdateOutcome {
  kUpdated,         ///< a single change, and accuracy is restored
  kNothingChanged,  ///< the last calibration holds
  kContradicted,    ///< no single change explains the touches
  kNotResolved,     ///< the change or its size is ambiguous
  kNotFound,        ///< a sphere was missed
  kTooFewTouches
};

/// Name in files: "not_resolved".
constexpr const char* to_string(UpdateOutcome outcome) { return own_name(outcome); }

struct UpdateOrigin {
  UpdateOutcome outcome = UpdateOutcome::kTooFewTouches;
  std::string stands_on = {};  ///< the calibration before it: "session 12 of 2026-11-20"
  double months = 0.0;         ///< between the two
  std::size_t touches = 0;     ///< number made
  std::vector<std::size_t> set_aside = {};     ///< indices of touches that are wrong individually
  std::vector<std::string> not_found = {};     ///< targets with a touch without contact
  std::vector<Explanation> explanations = {};  ///< most likely first
  /// Fit of the touches under the most likely explanation, and the probability of exceeding it by
  /// chance.
  double chi2 = 0.0, degrees_of_freedom = 0.0, by_chance = 1.0;
  /// Log odds of two changes against one change and individually wrong touches, natural logarithm.
  double log_odds_second = 0.0;
  std::optional<Explanation> second = {};  ///< the second change
  double before_m = 0.0;   ///< predicted mean error over the workspace, of the calibration before
  double reached_m = 0.0;  ///< the same of this one
  /// Both are of the tip in the frame that a positioner carries: known well enough over the workspace, not there.
  bool on_positioner = false;
};

}  // namespace cellcal::calib
