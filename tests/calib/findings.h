#pragma once
// Findings of a calibration for tests: by kind; sentences appear in failure messages only.

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>

#include "calib/result/calibration.h"
#include "calib/result/finding.h"

namespace cellcal::calib::testing {

inline std::string words_of(const Calibration& c) {
  return fmt::format("{}", fmt::join(words(c.verdict.findings), "\n"));
}

inline bool found(const Calibration& c, FindingKind kind) { return has(c.verdict.findings, kind); }

/// The first finding of that kind; empty if there is none.
inline Finding the(const Calibration& c, FindingKind kind) {
  const Finding* one = first(c.verdict.findings, kind);
  return one == nullptr ? Finding{} : *one;
}

/// The finding with that likely cause; empty if there is none.
inline Finding cause(const Calibration& c, LikelyCause which) {
  for (const Finding& one : c.verdict.findings)
    if (one.cause == which) return one;
  return {};
}

inline double the(const Calibration& c, FindingKind kind, const std::string& quantity) {
  return value(the(c, kind).evidence, quantity);
}

}  // namespace cellcal::calib::testing
