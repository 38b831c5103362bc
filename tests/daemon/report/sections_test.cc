// What each section says, and what it must not say.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>
#include <vector>

#include "daemon/report/report.h"
#include "tests/daemon/report/fixture.h"
#include "tests/daemon/report/html_checker.h"

namespace cellcal::daemon::report {
namespace {

using testing::made_up_session;
using testing::occurrences;
using testing::section_of;

bool says(const std::string& html, std::string_view words) {
  return html.find(words) != std::string::npos;
}

TEST(Verdict, OfAWorkspaceResultNamesTheCertifiedLength) {
  const std::string html = html_report(made_up_session());
  EXPECT_TRUE(says(html, "Publishable for the workspace"));
  EXPECT_TRUE(says(html, "A certified length was touched"));
  EXPECT_FALSE(says(html, "Not publishable"));
}

TEST(Verdict, WithoutCertifiedLengthClaimsNothingBeyondTheTargets) {
  const std::string html = html_report(made_up_session({.spheres = 1, .certified_lengths = false}));
  EXPECT_TRUE(says(html, "Publishable near the targets"));
  EXPECT_TRUE(says(html, "it claims nothing there"));
  EXPECT_TRUE(says(html, "outside the scope of the verdict"));
  EXPECT_TRUE(says(section_of(html, "meaning"), "it cannot see scale"));
}

TEST(Verdict, ThatRefusesGivesEveryReason) {
  ReportInput input = made_up_session();
  input.calibration.verdict = {false, true, {"chi2 is 6.3", "rank 24 of 25"}};
  const std::string html = html_report(input);
  EXPECT_TRUE(says(html, "Not publishable"));
  EXPECT_TRUE(says(html, "must not be put into service"));
  EXPECT_TRUE(says(html, "<li>chi2 is 6.3</li>"));
  EXPECT_TRUE(says(html, "<li>rank 24 of 25</li>"));
  EXPECT_FALSE(says(html, "Publishable for"));
}

TEST(Verdict, ThatRefusesWithoutReasonSaysSo) {
  ReportInput input = made_up_session();
  input.calibration.verdict = {};
  EXPECT_TRUE(says(html_report(input), "No reason was recorded"));
}

TEST(Summary, HasThreeSentencesWithTheFiguresOfTheHeldOutTouches) {
  ReportInput input = made_up_session();
  input.calibration.check = {20, 0.0000312, 0.0000943, 0.00004};
  input.calibration.check_before = {20, 0.001923, 0.004715, 0.002};
  const std::string html = html_report(input);
  EXPECT_TRUE(says(html,
                   "78 touches on 4 spheres determined this calibration, 20 more were held "
                   "out to test it, and 2 touches were set aside as outliers."));
  EXPECT_TRUE(says(html, "by 1.923 mm on average (4.715 mm at most)"));
  EXPECT_TRUE(says(html, "by 0.031 mm (0.094 mm at most)"));
  EXPECT_TRUE(says(html, "predicted from the covariance"));
}

TEST(Summary, WithoutCheckTouchesAdmitsThatTheFitFlattersItself) {
  const std::string html = html_report(made_up_session({.check = 0}));
  EXPECT_TRUE(says(html, "none was held out to test it"));
  EXPECT_TRUE(says(html, "which flatters it"));
  EXPECT_TRUE(says(section_of(html, "figures"), "No touch was held out"));
  EXPECT_TRUE(says(section_of(html, "meaning"), "not measured: no touch was held out"));
}

TEST(Figures, ShowMeanMaxAndRmsInMillimetres) {
  ReportInput input = made_up_session();
  input.calibration.before = {78, 0.0019231, 0.0047152, 0.0021};
  const std::string figures = section_of(html_report(input), "figures");
  EXPECT_TRUE(says(figures, "<td>78</td><td>1.923</td><td>4.715</td><td>2.100</td>"));
}

TEST(Figures, ThatWereNeverPredictedAreNotShownAsPerfect) {
  ReportInput input = made_up_session();
  input.calibration.predicted_m2_m = 0.0;
  input.calibration.predicted_m3_m = 0.0;
  const std::string html = html_report(input);
  EXPECT_TRUE(says(html, "was not predicted"));
  EXPECT_EQ(occurrences(section_of(html, "meaning"), ">not predicted<"), 2U);
  EXPECT_FALSE(says(section_of(html, "meaning"), "0.000"));
}

TEST(Meaning, SaysThatTheResidualIsNotAccuracyAndThatPredictionsAreNotMeasured) {
  const std::string meaning = section_of(html_report(made_up_session()), "meaning");
  EXPECT_TRUE(says(meaning, "The residual is not the accuracy of the robot."));
  EXPECT_TRUE(says(meaning, "M2 and M3 are not measured."));
  EXPECT_FALSE(says(meaning, "the truth is known"));
}

TEST(Meaning, ShowsTruthOnlyAsThatOfASimulatedCell) {
  ReportInput input = made_up_session();
  input.truth = {{"M3 over 1000 workspace poses", "0.081 mm mean"}};
  const std::string meaning = section_of(html_report(input), "meaning");
  EXPECT_TRUE(says(meaning, "Simulated cell: the truth is known"));
  EXPECT_TRUE(says(meaning, "M3 over 1000 workspace poses"));
}

TEST(ResidualChart, DrawsEveryTouchBeforeAndAfterByKind) {
  const std::string chart = section_of(html_report(made_up_session()), "residuals");
  // One of each kind of mark stands in the legend as well.
  EXPECT_EQ(occurrences(chart, "class=\"fit before\""), 78U);
  EXPECT_EQ(occurrences(chart, "class=\"fit after\""), 78U + 1U);
  EXPECT_EQ(occurrences(chart, "class=\"check after\""), 20U + 1U);
  EXPECT_EQ(occurrences(chart, "class=\"outlier after\""), 2U + 1U);
  EXPECT_TRUE(says(chart, "off scale"));
}

TEST(ResidualChart, CountsInWordsWhatItCannotDraw) {
  ReportInput input = made_up_session();
  input.calibration.residuals[3].after_m = std::numeric_limits<double>::quiet_NaN();
  input.calibration.residuals[4].before_m = std::numeric_limits<double>::infinity();
  input.calibration.residuals[5].touch = 4000;
  const std::string chart = section_of(html_report(input), "residuals");
  EXPECT_TRUE(says(chart, "2 residuals are not finite"));
  EXPECT_TRUE(says(chart, "1 residual belongs to touches that the report was not given"));
}

// The labels of the axes.
std::vector<std::string> ticks(const std::string& html) {
  constexpr std::string_view kTick = "<text class=\"tick\"";
  std::vector<std::string> found;
  for (std::size_t at = html.find(kTick); at != std::string::npos; at = html.find(kTick, at + 1)) {
    const std::size_t from = html.find('>', at) + 1;
    found.push_back(html.substr(from, html.find('<', from) - from));
  }
  return found;
}

TEST(ResidualChart, IsNotSquashedByAnOutlier) {
  ReportInput input = made_up_session();
  const std::string before = section_of(html_report(input), "residuals");
  for (calib::TouchResidual& residual : input.calibration.residuals) {
    if (residual.outlier) residual.after_m = 0.5;
  }
  const std::string after = section_of(html_report(input), "residuals");
  EXPECT_GT(ticks(before).size(), 10U);
  EXPECT_EQ(ticks(before), ticks(after));
}

TEST(Histogram, CountsEachTouchOnceAndNamesThoseBeyondItsReach) {
  ReportInput input = made_up_session({.outliers = 0});
  input.calibration.residuals[0].whitened = 7.5;
  input.calibration.residuals[1].whitened = -4.0;
  const std::string histogram = section_of(html_report(input), "distribution");
  EXPECT_TRUE(says(histogram, "2 touches lie further out than 4&sigma;"));
}

TEST(Histogram, LeavesOutliersOut) {
  ReportInput input = made_up_session({.outliers = 2});
  for (calib::TouchResidual& residual : input.calibration.residuals) {
    residual.whitened = residual.outlier ? 20.0 : 1.0;
  }
  const std::string histogram = section_of(html_report(input), "distribution");
  EXPECT_TRUE(says(histogram, "<td>1.00</td>"));
  EXPECT_FALSE(says(histogram, "further out"));
}

TEST(SphereMaps, PutTheTopInTheMiddleXToTheRightAndYUp) {
  ReportInput input = made_up_session({.spheres = 1, .fit = 4, .check = 0, .outliers = 0});
  auto& residuals = input.calibration.residuals;
  residuals[0].direction = {0.0, 0.0, 1.0};
  residuals[1].direction = {1.0, 0.0, 0.0};
  residuals[2].direction = {0.0, 1.0, 0.0};
  residuals[3].direction = {0.0, 0.0, -1.0};
  const std::string maps = section_of(html_report(input), "directions");
  // Disc of radius 96 px about (116, 116); equal areas put the equator at 96 / sqrt(2) = 67.9.
  EXPECT_TRUE(says(maps, "cx=\"116.0\" cy=\"116.0\" r=\"3.0\""));
  EXPECT_TRUE(says(maps, "cx=\"183.9\" cy=\"116.0\" r=\"3.0\""));
  EXPECT_TRUE(says(maps, "cx=\"116.0\" cy=\"48.1\" r=\"3.0\""));
  EXPECT_TRUE(says(maps, "cx=\"212.0\" cy=\"116.0\" r=\"3.0\""));
  EXPECT_TRUE(says(maps, "4 fitted"));
}

TEST(SphereMaps, NameTargetsThatHaveNoDirections) {
  ReportInput input = made_up_session({.spheres = 2, .fit = 10, .check = 0, .outliers = 0});
  for (calib::TouchResidual& residual : input.calibration.residuals) residual.direction.setZero();
  const std::string maps = section_of(html_report(input), "directions");
  EXPECT_TRUE(says(maps, "Without directions of touch: S1, S2."));
  EXPECT_FALSE(says(maps, "<svg"));
}

TEST(CellPicture, ShowsEveryTargetFromAboveAndFromTheSide) {
  const std::string cell = section_of(html_report(made_up_session({.spheres = 3})), "cell");
  EXPECT_EQ(occurrences(cell, "<svg"), 2U);
  EXPECT_EQ(occurrences(cell, "class=\"ball\""), 6U);
  EXPECT_EQ(occurrences(cell, "class=\"certified\""), 4U);
}

TEST(Targets, ShowEffectiveRadiusAgainstNominalAndTheCertifiedLengths) {
  ReportInput input = made_up_session({.spheres = 2});
  input.calibration.targets[0].centre_m = {1.0, 0.0, 0.0};
  input.calibration.targets[1].centre_m = {1.0, 0.5, 0.0};
  input.calibration.cell.lengths[0].length_m = 0.49999;
  const std::string targets = section_of(html_report(input), "targets");
  EXPECT_TRUE(says(targets, "<td>30.913</td><td>+0.213</td>"));
  EXPECT_TRUE(says(targets,
                   "<td>499.990</td><td>0.005</td><td>500.000</td><td>+0.010</td>"
                   "<td>+2.00</td>"));
}

TEST(Targets, WithoutRadiusShowADash) {
  ReportInput input = made_up_session({.spheres = 1, .certified_lengths = false});
  input.calibration.cell.targets[0].kind = calib::TargetKind::kPoint;
  input.calibration.targets[0].effective_radius_m = 0.0;
  const std::string targets = section_of(html_report(input), "targets");
  EXPECT_TRUE(says(targets, "<td class=\"word\">point</td>"));
  EXPECT_TRUE(says(targets, "<td>\xE2\x80\x93</td><td>\xE2\x80\x93</td>"));
  EXPECT_FALSE(says(targets, "0.000</td><td>\xE2\x80\x93"));
}

TEST(Parameters, AreGroupedByJointInTheUnitsOfTheFiles) {
  ReportInput input = made_up_session();
  auto& first = input.calibration.parameters.front();
  first.nominal = 0.0;
  first.correction = -0.000349065850398866;  // -0.02 deg
  first.sigma = 1.7453292519943295e-5;       // 0.001 deg
  const std::string table = section_of(html_report(input), "parameters");
  EXPECT_EQ(occurrences(table, "colspan=\"7\">Joint A"), 6U);
  EXPECT_TRUE(says(table, ">Tool<"));
  EXPECT_TRUE(says(table, ">Target S4<"));
  EXPECT_FALSE(says(table, ">Other<"));
  EXPECT_TRUE(says(table,
                   "<td>0.0000</td><td>\xE2\x88\x92"
                   "0.0200</td><td>0.0010</td>"
                   "<td class=\"word\">deg</td><td class=\"word\">frame</td>"));
  EXPECT_TRUE(says(table, "1/(N m&sup2;)"));
}

TEST(Parameters, OfNamesNobodyKnowsAreKeptUnderOther) {
  ReportInput input = made_up_session();
  input.calibration.parameters.push_back(
      {"thermal.alpha", "1/K", 1.0, 0.0, 1e-5, 1e-6, calib::DecidedBy::kData});
  const std::string table = section_of(html_report(input), "parameters");
  EXPECT_TRUE(says(table, ">Other<"));
  EXPECT_TRUE(says(table, "thermal.alpha"));
}

TEST(Parameters, OfTargetsWithADotInTheirNameFindTheirTarget) {
  ReportInput input = made_up_session({.spheres = 1, .certified_lengths = false});
  input.calibration.cell.targets[0].id = "bar.left";
  for (calib::ParameterResult& parameter : input.calibration.parameters) {
    if (parameter.name.starts_with("S1.")) parameter.name.replace(0, 2, "bar.left");
  }
  const std::string table = section_of(html_report(input), "parameters");
  EXPECT_TRUE(says(table, ">Target bar.left<"));
  EXPECT_FALSE(says(table, ">Other<"));
}

TEST(Unidentifiable, DirectionsKeepTheirWordsAndTheirStrongestShares) {
  const std::string words = section_of(html_report(made_up_session()), "unidentifiable");
  EXPECT_TRUE(says(words, "The touches do not decide 3 combinations"));
  EXPECT_TRUE(says(words, "A turn of axis A1"));
  EXPECT_TRUE(says(words, "<code>A1.theta</code>&nbsp;+0.99"));
  EXPECT_FALSE(says(words, "S1.x")) << "shares below 0.05 are left out";
  EXPECT_LT(words.find("A6.alpha"), words.find("A6.theta")) << "strongest first";
}

TEST(Outliers, AreListedByTouchLineTargetAndReason) {
  ReportInput input = made_up_session();
  const std::size_t touch = input.calibration.outliers.front().touch;
  input.calibration.outliers.front().residual_m = 0.000494;
  input.calibration.outliers.front().reason = "16.5 sigma from the robust fit";
  const std::string table = section_of(html_report(input), "outliers");
  EXPECT_TRUE(says(
      table, fmt::format("<th scope=\"row\">{}</th><td>{}</td><td class=\"word\">{}</td><td>+0.494"
                         "</td><td class=\"word wide\">16.5 sigma from the robust fit</td>",
                         touch + 1, touch + 2, input.touches[touch].target)));
}

TEST(Correlations, NameThePairThatGoesTogether) {
  const std::string html = section_of(html_report(made_up_session()), "correlations");
  EXPECT_TRUE(says(html, "A2.theta"));
  EXPECT_TRUE(says(html, "A3.theta"));
  EXPECT_TRUE(says(html,
                   "\xE2\x88\x92"
                   "0.940"));
  EXPECT_TRUE(says(html, "frame directions are held fixed"));
}

TEST(Correlations, OfTargetCoordinatesAreCountedNotListed) {
  ReportInput input = made_up_session();
  calib::Calibration& result = input.calibration;
  const auto size = static_cast<Eigen::Index>(result.parameters.size());
  result.covariance = Eigen::MatrixXd::Identity(size, size);
  result.covariance(size - 1, size - 2) = result.covariance(size - 2, size - 1) = 0.95;
  result.frame_basis.resize(0, 0);
  const std::string html = section_of(html_report(input), "correlations");
  EXPECT_FALSE(says(html, "S4."));
  EXPECT_TRUE(says(html, "Left out: 1 pair of target coordinates"));
  EXPECT_TRUE(says(html, "No two parameters of robot, tool and touch"));
  EXPECT_TRUE(says(html, "frame directions are part of these figures"));
}

TEST(Masthead, NeverCallsASessionFinishedThatIsNot) {
  ReportInput input = made_up_session();
  input.finished.clear();
  const std::string html = html_report(input);
  EXPECT_TRUE(says(html, "<span>Started <b>2025-03-14T02:10:00Z</b></span>"));
  EXPECT_FALSE(says(html, "<span>Finished"));
}

TEST(Traceability, HoldsEveryInputHashSoftwareAndNote) {
  const ReportInput input = made_up_session();
  const std::string html = section_of(html_report(input), "traceability");
  for (const calib::InputFile& file : input.calibration.inputs) {
    EXPECT_TRUE(says(html, file.sha256));
    EXPECT_TRUE(says(html, file.name));
  }
  EXPECT_TRUE(says(html, input.software));
  EXPECT_TRUE(says(html, input.session_id));
  EXPECT_TRUE(says(html, input.notes.front()));
  EXPECT_TRUE(says(html, "certified "));
}

TEST(Traceability, WithoutInputFilesIsCalledMissing) {
  ReportInput input = made_up_session();
  input.calibration.inputs.clear();
  input.software.clear();
  const std::string html = section_of(html_report(input), "traceability");
  EXPECT_TRUE(says(html, "cannot be traced"));
  EXPECT_TRUE(says(html, "not stated"));
}

TEST(RawTouches, HoldEveryTouchWithNumbersThatCanBeCopiedIntoACsv) {
  ReportInput input = made_up_session({.joints = 7});
  input.touches[0].joint_rad = {-0.7853981633974483, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0};
  const std::string html = section_of(html_report(input), "traceability");
  const std::string details = html.substr(html.find("<details>"));
  EXPECT_TRUE(says(details, "<td>-45.00000</td>"));
  EXPECT_FALSE(says(details, "\xE2\x88\x92"));
  EXPECT_TRUE(says(details, "A7, deg"));
  EXPECT_EQ(occurrences(details, "<th scope=\"row\">"), input.touches.size());
}

TEST(RawTouches, WithTooFewAnglesShowDashes) {
  ReportInput input = made_up_session();
  input.touches[0].joint_rad.resize(2);
  const std::string html = section_of(html_report(input), "traceability");
  EXPECT_TRUE(says(html,
                   "<td>\xE2\x80\x93</td><td>\xE2\x80\x93</td><td>\xE2\x80\x93</td>"
                   "<td>\xE2\x80\x93</td><td class=\"word\">S1</td>"));
}

}  // namespace
}  // namespace cellcal::daemon::report
