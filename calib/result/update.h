#pragma once
// A calibration that a few touches made out of the one before it: what it stands on, what is taken to have
// changed, and how far the touches bear that out.

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "calib/result/tcp_check.h"

namespace cellcal::calib {

enum class UpdateOutcome {
  kUpdated,         ///< one thing changed, and the arm is known again as it was
  kNothingChanged,  ///< the last calibration holds
  kContradicted,    ///< nothing that changes alone explains the touches
  kNotResolved,     ///< they leave open what changed, or by how much
  kNotFound,        ///< a sphere was not where it could be met
  kTooFewTouches
};

/// As files name it: "not_resolved". Of a name that is none, nothing.
const char* to_string(UpdateOutcome outcome);
std::optional<UpdateOutcome> update_outcome(const std::string& name);

struct UpdateOrigin {
  UpdateOutcome outcome = UpdateOutcome::kTooFewTouches;
  std::string stands_on = {};  ///< the calibration before it: "session 12 of 2026-11-20"
  double months = 0.0;         ///< between the two
  std::size_t touches = 0;     ///< that were made
  std::vector<std::size_t> set_aside = {};     ///< of them, counted from 0: wrong by themselves
  std::vector<std::string> not_found = {};     ///< targets of which a touch met nothing
  std::vector<Explanation> explanations = {};  ///< likeliest first
  /// Of the touches under the likeliest, and the probability that chance makes it as large.
  double chi2 = 0.0, degrees_of_freedom = 0.0, by_chance = 1.0;
  /// That two things changed over that one did and what was set aside is wrong by itself, natural logarithm.
  double log_odds_second = 0.0;
  std::optional<Explanation> second = {};  ///< what that would be
  double before_m = 0.0;   ///< predicted mean error over the workspace, of the calibration before
  double reached_m = 0.0;  ///< the same of this one
};

}  // namespace cellcal::calib
