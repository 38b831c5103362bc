// Content of each section, and what it must not claim.

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
using testing::says;
using testing::section_of;

TEST(Verdict, OfAWorkspaceResultNamesTheCertifiedLength) {
  const std::string html = html_report(made_up_session());
  EXPECT_TRUE(says(html, "Publishable for the workspace"));
  EXPECT_TRUE(says(html, "A certified length was touched"));
  EXPECT_FALSE(says(html, "Not publishable"));
}

TEST(Verdict, WithoutCertifiedLengthClaimsNothingBeyondTheTargets) {
  const std::string html = html_report(made_up_session({.spheres = 1, .certified_lengths = false}));
  EXPECT_TRUE(says(html, "Publishable near the targets"));
  EXPECT_TRUE(says(html, "Elsewhere it only predicts"));
  EXPECT_TRUE(says(html, "outside the scope of the verdict"));
  EXPECT_TRUE(says(section_of(html, "meaning"), "A wrong scale does not show either"));
}

TEST(Verdict, OfAFirstSessionSaysThatTheCellWorksAndNotWhatSoFewTouchesLack) {
  ReportInput input = made_up_session();
  input.calibration.verdict = {};
  calib::Finding begun{calib::FindingKind::kTooFewTouches};
  begun.evidence = {{"touches", 4.0, ""},
                    {"met", 4.0, ""},
                    {"farthest", 1.0, "mm"},
                    {"usual_touches", 40.0, ""},
                    {"usual_checks", 10.0, ""}};
  input.calibration.verdict.findings = {begun};
  input.calibration.unidentifiable = {{calib::UnidentifiableKind::kScale}};
  const std::string html = html_report(input);
  EXPECT_TRUE(says(html, "The cell works; too few touches to calibrate"));
  EXPECT_TRUE(says(html, "4 of 4 touches within 1.0 mm"));
  EXPECT_TRUE(says(html, "do not put the figures below into service"));
  EXPECT_FALSE(says(html, "Not publishable"));
  EXPECT_FALSE(says(html, "all lengths in common"));
}

TEST(Verdict, OfAnUpdateThatFindsNothingSaysSoAndThatTheCalibrationInUseStays) {
  ReportInput input = made_up_session();
  input.calibration.update.emplace().outcome = calib::UpdateOutcome::kNothingChanged;
  calib::Finding not_needed{calib::FindingKind::kUpdateNotNeeded, calib::Severity::kWithholds};
  not_needed.text = "session 12";
  input.calibration.verdict.findings = {not_needed};
  const std::string html = html_report(input);
  EXPECT_TRUE(says(html, "Nothing changed: the last calibration holds"));
  EXPECT_TRUE(says(html, "The calibration in use stays."));
  EXPECT_TRUE(says(html, "session 12 holds"));
  for (const char* of_a_withheld_one :
       {"Not publishable", "Do not put this result into service", "Why not", "verdict no"})
    EXPECT_FALSE(says(html, of_a_withheld_one)) << of_a_withheld_one;
}

TEST(Verdict, ThatRefusesGivesEveryReason) {
  ReportInput input = made_up_session();
  input.calibration.verdict = {};
  input.calibration.verdict.workspace = true;
  for (const char* words : {"chi2 is 6.3", "rank 24 of 25"}) {
    calib::Finding recorded{calib::FindingKind::kRecorded};
    recorded.text = words;
    input.calibration.verdict.findings.push_back(recorded);
  }
  const std::string html = html_report(input);
  EXPECT_TRUE(says(html, "Not publishable"));
  EXPECT_TRUE(says(html, "Do not put this result into service"));
  EXPECT_TRUE(says(html, "<li>chi2 is 6.3</li>"));
  EXPECT_TRUE(says(html, "<li>rank 24 of 25</li>"));
  EXPECT_FALSE(says(html, "Publishable for"));
}

TEST(Verdict, ThatRefusesWithoutReasonSaysSo) {
  ReportInput input = made_up_session();
  input.calibration.verdict = {};
  EXPECT_TRUE(says(html_report(input), "No reason was recorded"));
}

TEST(Verdict, TellsItsScopeOnceInTheWordsOfTheResult) {
  ReportInput input = made_up_session();
  input.calibration.verdict.findings = {
      {calib::FindingKind::kScaleByLengths, calib::Severity::kInforms, {}, {{"lengths", 3.0, ""}}}};
  const std::string html = html_report(input);
  EXPECT_TRUE(
      says(html, "whole workspace. 3 certified lengths hold the scale, touched at both ends."));
  EXPECT_EQ(occurrences(html, "3 certified lengths hold"), 1U);
  EXPECT_FALSE(says(html, "Before using it"));
}

TEST(Verdict, ThatRefusesKeepsWhatIsNoReasonApart) {
  ReportInput input = made_up_session();
  calib::Finding length{calib::FindingKind::kScaleByLengths, calib::Severity::kInforms};
  length.evidence = {{"lengths", 1.0, ""}};
  input.calibration.verdict = {};
  input.calibration.verdict.workspace = true;
  input.calibration.verdict.findings = {
      calib::Finding{calib::FindingKind::kAllLeftOut}, length,
      calib::Finding{calib::FindingKind::kNoCheckTouches, calib::Severity::kWarns}};
  const std::string html = html_report(input);
  const std::size_t why = html.find("Why not");
  const std::size_t besides = html.find("Other findings");
  ASSERT_NE(besides, std::string::npos);
  EXPECT_LT(why, html.find("<li>too few directions: "));
  EXPECT_LT(html.find("<li>too few directions: "), besides);
  EXPECT_LT(besides, html.find("<li>no check touches: "));
  EXPECT_TRUE(says(html, "Scale: 1 certified length holds the scale, touched at both ends."));
}

TEST(Summary, HasThreeSentencesWithTheFiguresOfTheHeldOutTouches) {
  ReportInput input = made_up_session();
  input.calibration.check = {20, 0.0000312, 0.0000943, 0.00004};
  input.calibration.check_before = {20, 0.001923, 0.004715, 0.002};
  const std::string html = html_report(input);
  EXPECT_TRUE(says(html,
                   "78 touches on 4 spheres determined this calibration, 20 more were held "
                   "out to check it, and 2 touches were left out as outliers."));
  EXPECT_TRUE(says(html, "residual 1.923\xC2\xA0mm (max. 4.715\xC2\xA0mm) with the nominal robot"));
  EXPECT_TRUE(says(html, "0.031\xC2\xA0mm (max. 0.094\xC2\xA0mm) with this calibration"));
  EXPECT_TRUE(says(html, "(from the covariance)"));
}

TEST(Summary, WithoutCheckTouchesAdmitsThatTheFitFlattersItself) {
  const std::string html = html_report(made_up_session({.check = 0}));
  EXPECT_TRUE(says(html, "none was held out to check it"));
  EXPECT_TRUE(says(html, "where it is smaller than elsewhere"));
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
  input.calibration.predicted_near_targets_m = 0.0;
  input.calibration.predicted_workspace_m = 0.0;
  const std::string html = html_report(input);
  EXPECT_TRUE(says(html, "was not predicted"));
  EXPECT_EQ(occurrences(section_of(html, "meaning"), ">not predicted<"), 2U);
  EXPECT_FALSE(says(section_of(html, "meaning"), "0.000"));
  EXPECT_TRUE(says(section_of(html, "meaning"), "No 3-D error was predicted."));
}

TEST(Meaning, SaysThatTheResidualIsNotAccuracyAndThatPredictionsAreNotMeasured) {
  const std::string meaning = section_of(html_report(made_up_session()), "meaning");
  EXPECT_TRUE(says(meaning, "The residual is not the accuracy of the robot."));
  EXPECT_TRUE(says(meaning, "Predicted is not measured."));
  EXPECT_FALSE(says(meaning, "the truth is known"));
}

TEST(Meaning, CountsOnlyCertifiedLengthsOfWhichBothEndsWereTouched) {
  ReportInput input = made_up_session({.spheres = 3});
  ASSERT_EQ(input.calibration.cell.lengths.size(), 2U);
  input.calibration.targets.pop_back();
  EXPECT_TRUE(
      says(section_of(html_report(input), "meaning"), "is determined here by 1 certified length "));
  input.calibration.targets.pop_back();
  EXPECT_TRUE(
      says(section_of(html_report(input), "meaning"), "A wrong scale does not show either"));
}

TEST(Meaning, CountsTheLengthsThatHoldTheScaleAsTheVerdictDoes) {
  ReportInput input = made_up_session({.spheres = 3});
  input.calibration.verdict.findings = {
      {calib::FindingKind::kScaleByLengths, calib::Severity::kInforms, {}, {{"lengths", 1.0, ""}}}};
  EXPECT_TRUE(
      says(section_of(html_report(input), "meaning"), "is determined here by 1 certified length "))
      << "an end of the other had too few touches";
}

TEST(Meaning, SaysWhatTheVerdictFoundToHoldTheScale) {
  ReportInput input = made_up_session({.spheres = 3});
  const auto found = [&](calib::FindingKind kind) {
    input.calibration.verdict.findings = {{kind, calib::Severity::kInforms}};
    return section_of(html_report(input), "meaning");
  };
  EXPECT_TRUE(says(found(calib::FindingKind::kScaleByLengths), "here by 2 certified lengths"));
  EXPECT_TRUE(says(found(calib::FindingKind::kScaleByReadings), "the readings of an instrument"));
  EXPECT_TRUE(says(found(calib::FindingKind::kScaleByNothing), "A wrong scale does not show"))
      << "of lengths that are too uncertain";
  for (calib::CertifiedLength& length : input.calibration.cell.lengths) length.is_check = true;
  EXPECT_FALSE(says(found(calib::FindingKind::kScaleByLengths), "certified lengths"))
      << "lengths that are not fitted hold nothing";
}

TEST(Update, IsComparedWithTheLastCalibrationAndWidensNothing) {
  ReportInput input = made_up_session();
  input.calibration.chi2_per_dof = 1.8;
  input.calibration.touch_noise_m = 3e-5;
  EXPECT_TRUE(says(html_report(input), "is widened accordingly"));
  input.calibration.update.emplace();
  const std::string html = html_report(input);
  EXPECT_TRUE(says(html, "before: last calibration"));
  EXPECT_TRUE(says(html, "By the last calibration, mm"));
  for (const char* of_a_full_session :
       {"with the nominal robot,", "before: nominal robot", "Nominal robot, mm",
        "is widened accordingly", "Repeated touches scatter", "No touch was held out"})
    EXPECT_FALSE(says(html, of_a_full_session)) << of_a_full_session;
  EXPECT_EQ(testing::joined(testing::complaints(html)), "");
}

TEST(Meaning, SaysThatThePredictionHoldsRipple) {
  ReportInput input = made_up_session();
  input.calibration.level.ripple_rad = 2e-5;
  EXPECT_TRUE(
      says(section_of(html_report(input), "meaning"), "gear ripple is, as noise of every joint"));
  input.calibration.level.ripple_rad = 0.0;
  EXPECT_FALSE(says(section_of(html_report(input), "meaning"), "ripple"));
}

TEST(Figures, SayHowManyDegreesOfFreedomTheirScatterRestsOn) {
  ReportInput input = made_up_session({.fit = 40, .check = 0, .outliers = 0});
  input.calibration.chi2_per_dof = 2.0;
  input.calibration.degrees_of_freedom = 5.2;
  const std::string few = section_of(html_report(input), "figures");
  EXPECT_TRUE(says(few, "It rests on about 5 degrees of freedom: a rough figure."));
  EXPECT_TRUE(says(few, "is widened accordingly"));
  input.calibration.chi2_per_dof = 0.5;
  input.calibration.degrees_of_freedom = 19.8;
  const std::string enough = section_of(html_report(input), "figures");
  EXPECT_TRUE(says(enough, "It rests on about 20 degrees of freedom."));
  EXPECT_FALSE(says(enough, "widened"));
}

TEST(Figures, StateTheScatterOfRepeatedTouchesWhereThereAreAny) {
  ReportInput input = made_up_session();
  EXPECT_FALSE(says(section_of(html_report(input), "figures"), "Repeated touches"));
  input.calibration.repeats = {30, 1.2e-5, 20.0, 1.7e-5};
  const std::string figures = section_of(html_report(input), "figures");
  EXPECT_TRUE(
      says(figures, "scatter by 0.012 mm (20 degrees of freedom); 0.017 mm is used in the fit."));
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
  // Each kind of mark also appears once in the legend.
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

TEST(ResidualChart, SaysWhatCrossesAtTheEdgeMean) {
  ReportInput input = made_up_session({.outliers = 1});
  EXPECT_TRUE(says(section_of(html_report(input), "residuals"),
                   "Crosses at the edge lie beyond the scale"));
  for (calib::TouchResidual& residual : input.calibration.residuals) {
    if (residual.outlier) residual.after_m = 1e-5;
  }
  EXPECT_FALSE(says(section_of(html_report(input), "residuals"), "Crosses at the edge"));
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

TEST(CellPicture, IsFromAboveOnlyWhereZIsUp) {
  ReportInput input = made_up_session();
  EXPECT_TRUE(says(section_of(html_report(input), "cell"), "From above"));
  input.calibration.cell.robot.gravity_m_s2 = {0.0, 0.0, 9.81};
  const std::string hung = section_of(html_report(input), "cell");
  EXPECT_FALSE(says(hung, "From above"));
  EXPECT_TRUE(says(hung, "Along z"));
}

TEST(Targets, ShowEffectiveRadiusAgainstNominalAndTheCertifiedLengths) {
  ReportInput input = made_up_session({.spheres = 2});
  input.calibration.cell.lengths[0].length_m = 0.49999;
  input.calibration.lengths[0].certified_m = 0.49999;
  input.calibration.lengths[0].by_others_m = 0.50003;
  input.calibration.lengths[0].sigma_m = 1.2e-5;
  const std::string targets = section_of(html_report(input), "targets");
  EXPECT_TRUE(says(targets, "<td>30.913</td><td>+0.213</td>"));
  EXPECT_TRUE(says(targets,
                   "<td>499.990</td><td>0.005</td><td>500.030</td><td>0.012</td><td>+0.040</td>"
                   "<td>3.08</td>"));
  input.calibration.lengths.clear();  // written before they existed
  EXPECT_TRUE(says(section_of(html_report(input), "targets"),
                   "<td>499.990</td><td>0.005</td><td>\xE2\x80\x93</td>"));
}

TEST(Targets, CountTheTipAsPartOfTheNominalRadius) {
  ReportInput input = made_up_session({.spheres = 1, .certified_lengths = false});
  input.calibration.cell.tool.tip_radius_m = 0.0002;
  EXPECT_TRUE(says(section_of(html_report(input), "targets"), "<td>30.913</td><td>+0.013</td>"));
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

TEST(Masthead, NeverCallsASessionFinishedThatIsNot) {
  ReportInput input = made_up_session();
  input.finished.clear();
  const std::string html = html_report(input);
  EXPECT_TRUE(says(html, "<span>Started <b>2025-03-14 02:10:00 UTC</b></span>"));
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
  EXPECT_TRUE(says(html, input.notes.front().id()));
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

TEST(RawTouches, ShowToolAndTemperatureWhereAnyTouchStatesThem) {
  ReportInput input = made_up_session();
  const std::string plain = section_of(html_report(input), "traceability");
  EXPECT_FALSE(says(plain, "<th scope=\"col\" class=\"word\">tool</th>"));
  input.touches[3].tool = "P<2";
  input.touches[4].temperature_c = 21.25;
  input.calibration.cell.tool.id = "P1";
  input.calibration.cell.other_tools.push_back(input.calibration.cell.tool);
  input.calibration.cell.other_tools[0].id = "P<2";
  const std::string html = section_of(html_report(input), "traceability");
  EXPECT_TRUE(says(html, "<th scope=\"col\" class=\"word\">tool</th>"));
  EXPECT_TRUE(says(html, "<td class=\"word\">P&lt;2</td>"));
  EXPECT_TRUE(says(html, "<td class=\"word\">21.2</td>"));
  EXPECT_EQ(occurrences(html, "TCP from flange, mm"), 2U);
}

TEST(RawTouches, WithTooFewAnglesShowDashes) {
  ReportInput input = made_up_session();
  input.touches[0].joint_rad.resize(2);
  const std::string html = section_of(html_report(input), "traceability");
  EXPECT_TRUE(says(html,
                   "<td>\xE2\x80\x93</td><td>\xE2\x80\x93</td><td>\xE2\x80\x93</td>"
                   "<td>\xE2\x80\x93</td><td class=\"word\">S1</td>"));
}

TEST(ResidualByJoint, HasOnePlotPerJointAndNoOutlier) {
  const ReportInput input = made_up_session();
  const std::string html = section_of(html_report(input), "by-joint");
  EXPECT_EQ(occurrences(html, "<svg"), input.calibration.cell.robot.joints.size());
  EXPECT_TRUE(says(html, "A6, deg"));
  EXPECT_EQ(occurrences(html, "outlier after"), 0u);
  EXPECT_EQ(html_report(ReportInput{}).find("by-joint"), std::string::npos);
}

TEST(ErrorMap, ShowsBeforeAndAfterOnOneScaleWithTheTargets) {
  ReportInput input = made_up_session();
  EXPECT_EQ(html_report(input).find("id=\"error-map\""), std::string::npos) << "without a map";
  input.error_map = calib::ErrorMap{
      0.1,
      {{0.95, 0.25, 9, 2.5e-3, 6e-5}, {1.05, 0.25, 5, 3.5e-3, 8e-5}, {1.05, 0.35, 5, 1.0, 1.0}}};
  const std::string html = section_of(html_report(input), "error-map");
  EXPECT_TRUE(says(html, ">Before: nominal model<")) << "the summary has the mean error";
  EXPECT_TRUE(says(html, ">After: calibrated<"));
  EXPECT_TRUE(says(html, "not measured"));
  input.error_map->cells[2].nominal_m = std::numeric_limits<double>::quiet_NaN();
  const std::string finite = section_of(html_report(input), "error-map");
  EXPECT_EQ(occurrences(html, "<rect"), occurrences(finite, "<rect") + 2) << "a square in each";
  input.error_map->step_m = std::numeric_limits<double>::infinity();
  EXPECT_EQ(html_report(input).find("id=\"error-map\""), std::string::npos);
}

calib::DriftPoint check_of(std::int64_t session, double time_s, double share) {
  calib::DriftPoint point;
  point.check.session = session;
  point.check.time_s = time_s;
  point.check.verdict = calib::CheckVerdict::kHolds;
  point.share = share;
  return point;
}

TEST(CheckChart, ShowsTheChecksBeforeAndTheNumberedChangesOfTheCell) {
  ReportInput input = made_up_session();
  EXPECT_EQ(html_report(input).find("id=\"checks\""), std::string::npos) << "without any";
  constexpr double kBegin = 1.77e9, kDay = 86400.0;
  calib::DriftChart& chart = input.checks.emplace();
  chart.others.push_back({3, 1.0, {check_of(4, kBegin, 0.2), check_of(5, kBegin + kDay, 0.4)}});
  chart.points = {check_of(7, kBegin + 3 * kDay, 1.4)};
  chart.points.back().check.verdict = calib::CheckVerdict::kDoesNotHold;
  chart.events = {{.kind = calib::DriftEventKind::kUpdated,
                   .session = 6,
                   .time_s = kBegin + 2 * kDay,
                   .cell_changed = true,
                   .tcp_moved_m = 1.25e-3},
                  {.kind = calib::DriftEventKind::kActivated,
                   .session = 3,
                   .time_s = kBegin + 4 * kDay,
                   .by = "<anna>",
                   .reason = "torch"}};
  const std::string html = section_of(html_report(input), "checks");
  EXPECT_TRUE(says(html, "update of session 6: tool changed, TCP moved by 1.250 mm")) << html;
  EXPECT_TRUE(says(html, "calibration of session 3 in use again, by &lt;anna&gt; (torch)")) << html;
  EXPECT_TRUE(says(html, "2026-02-04"));
  EXPECT_EQ(occurrences(html, "class=\"fit after\""), 2u);
  EXPECT_EQ(occurrences(html, "class=\"outlier after\""), 1u) << "a check that does not hold";
  EXPECT_TRUE(says(html, "Control chart of 3 checks with 2 changes of the cell"));
  chart.points[0].share = std::numeric_limits<double>::quiet_NaN();
  chart.points[0].check.time_s = std::numeric_limits<double>::infinity();
  chart.events[0].time_s = 1e300;
  EXPECT_EQ(testing::joined(testing::complaints(html_report(input))), "");
}

TEST(Plots, AreThoseOfTheReportInTheLanguageAskedFor) {
  ReportInput input = made_up_session();
  input.error_map = calib::ErrorMap{0.1, {{0.95, 0.25, 9, 2.5e-3, 6e-5}}};
  const ReportPlots plots = report_plots(input);
  const std::string html = html_report(input);
  EXPECT_NE(html.find(plots.before_after), std::string::npos);
  EXPECT_NE(html.find(plots.error_map), std::string::npos);
  ASSERT_EQ(plots.by_joint.size(), input.calibration.cell.robot.joints.size());
  EXPECT_NE(html.find(plots.by_joint.back()), std::string::npos);
  input.language = *calib::Language::of("de");
  EXPECT_NE(report_plots(input).error_map.find(">Vorher: Nennmodell<"), std::string::npos);
  const ReportPlots none = report_plots(ReportInput{});
  EXPECT_TRUE(none.before_after.empty() && none.by_joint.empty() && none.error_map.empty());
}

}  // namespace
}  // namespace cellcal::daemon::report
