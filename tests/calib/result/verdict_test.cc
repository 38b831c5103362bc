// Publication as a consequence of judgement and findings, and the order of findings.

#include <gtest/gtest.h>

#include "calib/result/calibration.h"

namespace cellcal::calib {
namespace {

Finding of(FindingKind kind, Severity severity) { return {kind, severity}; }

TEST(Verdict, PublishesOnlyWhatWasJudgedAndNoFindingWithholds) {
  Verdict verdict;
  EXPECT_FALSE(verdict.publish()) << "not judged";
  verdict.judged = true;
  EXPECT_TRUE(verdict.publish());
  verdict.add(of(FindingKind::kGain, Severity::kInforms));
  verdict.add(of(FindingKind::kTemperature, Severity::kWarns));
  EXPECT_TRUE(verdict.publish());
  verdict.add(of(FindingKind::kRank, Severity::kWithholds));
  EXPECT_FALSE(verdict.publish());
}

TEST(Verdict, ListsWithholdingFindingsFirstInTheOrderTheyWereAddedAndACauseBeforeThem) {
  using enum FindingKind;
  Verdict verdict{.judged = true};
  verdict.add(of(kGain, Severity::kInforms));
  verdict.add(of(kRank, Severity::kWithholds));
  verdict.add(of(kTemperature, Severity::kWarns));
  verdict.add(of(kRequired, Severity::kWithholds));
  verdict.add_first(of(kJumped, Severity::kWithholds));
  verdict.add_first(of(kModelError, Severity::kWarns));
  std::vector<FindingKind> order;
  for (const Finding& one : verdict.findings) order.push_back(one.kind);
  EXPECT_EQ(order, (std::vector{kJumped, kRank, kRequired, kModelError, kGain, kTemperature}));
}

TEST(Verdict, HasTooFewTouchesOnlyWhereNothingElseWithholds) {
  Verdict verdict{.judged = true};
  EXPECT_FALSE(verdict.too_few());
  verdict.add(of(FindingKind::kNotTouched, Severity::kWarns));
  EXPECT_FALSE(verdict.too_few());
  verdict.add(of(FindingKind::kTooFewTouches, Severity::kWithholds));
  EXPECT_TRUE(verdict.too_few());
  verdict.add(of(FindingKind::kChanged, Severity::kWithholds));
  EXPECT_FALSE(verdict.too_few());
}

}  // namespace
}  // namespace cellcal::calib
