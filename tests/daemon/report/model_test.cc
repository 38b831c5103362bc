// The fitted model, the method, and the reason for its choice.

#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "daemon/report/report.h"
#include "tests/daemon/report/fixture.h"
#include "tests/daemon/report/html_checker.h"

namespace cellcal::daemon::report {
namespace {

using testing::complaints;
using testing::made_up_session;
using testing::occurrences;
using testing::says;
using testing::section_of;

TEST(Model, NamesTheLevelTheReasonAndTheMethod) {
  const std::string model = section_of(html_report(made_up_session()), "model");
  EXPECT_TRUE(says(model, ">Geometry, tool bending, transmission 10 arcsec, ripple 5 arcsec<"));
  EXPECT_TRUE(says(model, "<p>Mean over 3 levels, weighted by evidence."));
  EXPECT_TRUE(says(model, "Method: maximum a posteriori estimate."));
}

TEST(Model, LevelsStandInOrderWithTheirProbabilityAndEvidenceRelativeToTheBest) {
  const std::string model = section_of(html_report(made_up_session()), "model");
  // exp(0), exp(-0.3) and exp(-4.2) divided by their sum.
  const std::size_t best = model.find("<td>57&nbsp;%</td><td>0.0</td>");
  const std::size_t second = model.find(
      "<td>42&nbsp;%</td><td>\xE2\x88\x92"
      "0.3</td>");
  const std::size_t third = model.find(
      "<td>1&nbsp;%</td><td>\xE2\x88\x92"
      "4.2</td>");
  ASSERT_NE(third, std::string::npos);
  EXPECT_LT(best, second);
  EXPECT_LT(second, third);
}

TEST(Model, LevelsWithoutASayAreNotRoundedToNothing) {
  ReportInput input = made_up_session();
  input.calibration.levels[2].log_evidence -= 20.0;
  EXPECT_TRUE(says(section_of(html_report(input), "model"), "<td>&lt;&nbsp;1&nbsp;%</td>"));
}

TEST(Model, LevelsBeyondTheBestSixAreCountedTogether) {
  ReportInput input = made_up_session();
  auto& levels = input.calibration.levels;
  levels.assign(30, levels.front());  // all alike
  const std::string model = section_of(html_report(input), "model");
  EXPECT_EQ(occurrences(model, "<td>3&nbsp;%</td>"), 6U);
  EXPECT_TRUE(says(model, "24 more, each less likely</th><td>80&nbsp;%</td>"));
}

TEST(Model, OfAMethodWithoutLevelsClaimsNone) {
  ReportInput input = made_up_session();
  input.calibration.method = "paper";
  input.calibration.level = {};
  input.calibration.level_reason = {};
  input.calibration.levels.clear();
  const std::string html = html_report(input);
  EXPECT_TRUE(says(section_of(html, "model"), "reference method, for comparison only"));
  EXPECT_FALSE(says(section_of(html, "model"), "arcsec"));
  EXPECT_FALSE(says(section_of(html, "traceability"), "Model level"));
}

TEST(Model, ReasonInTheWordsOfAFileIsKeptWhole) {
  ReportInput input = made_up_session();
  input.calibration.level_reason = {calib::LevelChoice::kRecorded, "geometry <only>; as requested"};
  EXPECT_TRUE(
      says(section_of(html_report(input), "model"), "<p>Geometry &lt;only&gt;; as requested.</p>"));
}

TEST(Model, MethodNobodyKnowsIsShownAsText) {
  ReportInput input = made_up_session();
  input.calibration.method = "<b>mine</b>";
  EXPECT_TRUE(says(section_of(html_report(input), "model"), "Method: &lt;b&gt;mine&lt;/b&gt;."));
  input.calibration.method.clear();
  EXPECT_TRUE(says(section_of(html_report(input), "model"), "<em>not stated</em>"));
}

TEST(Model, EvidenceThatIsNotFiniteIsADash) {
  ReportInput input = made_up_session();
  input.calibration.levels[1].log_evidence = std::numeric_limits<double>::quiet_NaN();
  const std::string html = html_report(input);
  EXPECT_TRUE(complaints(html).empty());
  EXPECT_TRUE(says(section_of(html, "model"), "<td>\xE2\x80\x93</td>"));
}

TEST(Model, StandsInTheTraceabilityAsWell) {
  const std::string html = section_of(html_report(made_up_session()), "traceability");
  EXPECT_TRUE(says(html, "Geometry, tool bending, transmission 10 arcsec, ripple 5 arcsec"));
  EXPECT_TRUE(says(html, "maximum a posteriori estimate"));
}

}  // namespace
}  // namespace cellcal::daemon::report
