#pragma once

#include <gtest/gtest.h>

#include <string>

#include "daemon/doctor/examiner.h"

namespace cellcal::daemon::testing {

/// The finding of that name; a failure of the test where there is none.
inline Finding finding_of(const Findings& findings, const std::string& check) {
  for (const Finding& one : findings.all()) {
    if (one.check == check) return one;
  }
  ADD_FAILURE() << "nothing was said of " << check;
  return {};
}

inline Outcome outcome_of(const Findings& findings, const std::string& check) {
  return finding_of(findings, check).outcome;
}

/// All failures and warnings come with what to do.
inline void expect_advice(const Findings& findings) {
  for (const Finding& one : findings.all()) {
    EXPECT_FALSE(one.found.empty()) << one.check;
    const bool needs = one.outcome == Outcome::kFailed || one.outcome == Outcome::kWarning;
    EXPECT_EQ(needs, !one.advice.empty()) << one.check;
  }
}

}  // namespace cellcal::daemon::testing
