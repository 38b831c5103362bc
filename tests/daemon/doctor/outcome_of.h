#pragma once

#include <gtest/gtest.h>

#include <string>

#include "daemon/doctor/examiner.h"

namespace cellcal::daemon::testing {

/// In English.
struct Said {
  std::string check;
  Outcome outcome = Outcome::kOk;
  std::string found, advice;
};
inline Said said(const Finding& one) {
  return {one.check, one.outcome, words(one.found), words(one.advice)};
}

/// The finding of that name; fails the test if there is none.
inline Said finding_of(const Findings& findings, const std::string& check) {
  for (const Finding& one : findings.all()) {
    if (one.check == check) return said(one);
  }
  ADD_FAILURE() << "nothing was said of " << check;
  return {};
}

inline Outcome outcome_of(const Findings& findings, const std::string& check) {
  return finding_of(findings, check).outcome;
}

/// All failures and warnings state a remedy.
inline void expect_advice(const Findings& findings) {
  for (const Finding& one : findings.all()) {
    EXPECT_FALSE(one.found.empty()) << one.check;
    for (const std::string& language : calib::Language::codes())
      for (const calib::Phrase& phrase : {one.found, one.advice}) {
        const std::string text = words(phrase, *calib::Language::of(language));
        EXPECT_EQ(text.find("say."), std::string::npos) << text;
        EXPECT_EQ(text.find('{'), std::string::npos) << text;
      }
    const bool needs = one.outcome == Outcome::kFailed || one.outcome == Outcome::kWarning;
    EXPECT_EQ(needs, !one.advice.empty()) << one.check;
  }
}

}  // namespace cellcal::daemon::testing
