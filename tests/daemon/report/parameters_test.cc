// The parameters: their table, undetermined directions, outliers, and correlations.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <limits>
#include <string>

#include "calib/model/units.h"
#include "daemon/report/report.h"
#include "tests/daemon/report/fixture.h"
#include "tests/daemon/report/html_checker.h"

namespace cellcal::daemon::report {
namespace {

using calib::ParameterKind;
using testing::made_up_session;
using testing::occurrences;
using testing::says;
using testing::section_of;

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
  EXPECT_TRUE(says(table,
                   "<td>0.0000</td><td>\xE2\x88\x92"
                   "0.0200</td><td>0.0010</td>"
                   "<td class=\"word\">deg</td><td class=\"word\">frame</td>"));
  EXPECT_TRUE(says(table, "1/(N m&sup2;)"));
}

TEST(Parameters, OfAZeroStateWhereThetaCountsAgainstTheAxis) {
  ReportInput input = made_up_session();
  auto& joints = input.calibration.cell.robot.joints;
  for (calib::Joint& joint : joints) joint.sign = 1;
  EXPECT_FALSE(says(html_report(input), "positive against the axis"));
  joints[3].sign = -1;
  const std::string table = section_of(html_report(input), "parameters");
  EXPECT_EQ(occurrences(table, "positive against the axis"), 1U);
  EXPECT_LT(table.find(">Joint A4"), table.find("positive against the axis"));
  EXPECT_GT(table.find(">Joint A5"), table.find("positive against the axis"));
}

TEST(Parameters, OfAPositionerAreItsAxesWithTheirBounds) {
  ReportInput input = made_up_session();
  const std::string before = html_report(input);
  EXPECT_FALSE(says(before, "Axes of the positioner"));
  calib::Cell& cell = input.calibration.cell;
  cell.robot.positioner.resize(1);
  cell.robot.positioner[0].name = "E<1>";
  cell.robot.positioner[0].frame.translation() = Eigen::Vector3d(1.2, 0.1, 0.4);
  cell.targets[0].carried_by = 1;
  calib::PositionerLine line;
  line.axis = "E<1>";
  line.point_m = {1.2, 0.1, 0.4};
  line.direction = {0.0, -1.0, 0.0};
  line.place_u95_m = 2.5e-5;
  line.direction_u95_rad = 6.1e-5;
  line.touched_rad = {-0.5 * calib::kRadPerDeg, 40.0 * calib::kRadPerDeg};
  input.calibration.positioner = {line};
  const std::string page = html_report(input), table = section_of(page, "parameters");
  EXPECT_EQ(testing::complaints(page), std::vector<std::string>{});
  EXPECT_TRUE(says(table, "<th scope=\"row\">E&lt;1&gt;</th><td>1200.000</td><td>100.000</td>"));
  EXPECT_TRUE(says(table,
                   "<td>0.025</td><td>0.061</td><td>0.000</td><td>\xE2\x88\x92"
                   "0.5</td><td>40.0</td>"));
  EXPECT_TRUE(says(section_of(page, "targets"),
                   cell.targets[0].id + ": x, y, z in the frame that E&lt;1&gt;"));
  EXPECT_TRUE(says(section_of(page, "cell"), ">E&lt;1&gt;</text>"));
  input.language = *calib::Language::of("de");
  EXPECT_TRUE(says(section_of(html_report(input), "parameters"), "Achsen des Drehkipptischs"));
}

TEST(Parameters, OfALinearUnitAreItsMotionsWithTheirBounds) {
  ReportInput input = made_up_session();
  EXPECT_FALSE(says(html_report(input), "Linear unit"));
  calib::LinearUnitLine line;
  line.axis = "E<1>";
  line.direction = {0.0, -1.0, 0.0};
  line.direction_u95_rad = 8.1e-5;
  line.scale = 2.34e-5;
  line.scale_u95 = 4.1e-6;
  line.touched_m = {0.01, 2.9};
  line.at.push_back(
      {0.25, {1e-5, -2e-5, 3e-5, 4e-5, 5e-5, 6e-5}, {1e-6, 2e-6, 3e-6, 4e-6, 5e-6, 6e-6}});
  input.calibration.linear_unit = line;
  const std::string page = html_report(input), table = section_of(page, "parameters");
  EXPECT_EQ(testing::complaints(page), std::vector<std::string>{});
  EXPECT_TRUE(says(table, "<th scope=\"row\">E&lt;1&gt;</th>"));
  EXPECT_TRUE(says(table, "<td>0.081</td><td>+0.0234</td><td>0.0041</td><td>10</td><td>2900</td>"));
  EXPECT_TRUE(says(table,
                   "<th scope=\"row\">250</th><td>+0.010</td><td>0.001</td><td>\xE2\x88\x92"
                   "0.020</td><td>0.002</td>"));
  input.language = *calib::Language::of("de");
  EXPECT_TRUE(says(section_of(html_report(input), "parameters"), "Gieren, mrad"));
}

TEST(Parameters, OfTheArmShowWhatTheirCorrectionIsACorrectionOf) {
  ReportInput input = made_up_session();
  for (auto& parameter : input.calibration.parameters) {
    if (parameter.key.target < 0) parameter.nominal = 0.0;  // as set by the estimator
  }
  input.calibration.parameters.push_back({tool_parameter(ParameterKind::kTcp, 0, 2), "mm", 1e3, 0.0,
                                          1e-4, 1e-5, calib::DecidedBy::kData});
  const std::string table = section_of(html_report(input), "parameters");
  EXPECT_TRUE(says(table, "<code>A2.a</code> <small>length of the link</small></th><td>600.000<"));
  EXPECT_TRUE(says(table,
                   "<code>A1.alpha</code> <small>twist of the link</small></th><td>\xE2\x88\x92"
                   "90.0000<"));
  EXPECT_TRUE(
      says(table, "<code>tool.z</code> <small>tip from the flange</small></th><td>410.300<"));
}

TEST(Parameters, OfTransmissionErrorAreFoldedAwayAndCounted) {
  ReportInput input = made_up_session();
  const std::string without = section_of(html_report(input), "parameters");
  EXPECT_FALSE(says(without, "<details>"));
  for (const calib::ParameterKey& wave :
       {wave_parameter(ParameterKind::kCosine, 0, 1), wave_parameter(ParameterKind::kSine, 0, 1),
        wave_parameter(ParameterKind::kCosine, 1, 12)}) {
    input.calibration.parameters.push_back(
        {wave, "arcsec", 206264.8, 0.0, 1e-5, 1e-6, calib::DecidedBy::kPrior});
  }
  input.calibration.parameters.back().decided_by = calib::DecidedBy::kData;
  const std::string table = section_of(html_report(input), "parameters");
  const std::size_t folded = table.find("<details>");
  ASSERT_NE(folded, std::string::npos);
  EXPECT_GT(table.find("A1.cos1"), folded);
  EXPECT_GT(table.find("A2.cos12"), folded);
  EXPECT_LT(table.find("A2.theta"), folded);
  EXPECT_TRUE(says(table, "Transmission error: 3 waves of the gears, 1 decided by the data"));
}

TEST(Parameters, OfAJointsFunctionAreDrawnOverTheTouchedAngles) {
  ReportInput input = made_up_session();
  calib::Calibration& result = input.calibration;
  EXPECT_FALSE(says(section_of(html_report(input), "parameters"), "over the touched angles"));
  result.parameters.push_back({wave_parameter(ParameterKind::kFunctionCosine, 1, 17), "arcsec",
                               206264.8, 0.0, 1e-4, 1e-5, calib::DecidedBy::kData});
  result.covariance = {};
  result.cell.robot.joints[1].function_min_rad = -1.0;
  result.cell.robot.joints[1].function_max_rad = 1.0;
  const std::string table = section_of(html_report(input), "parameters");
  EXPECT_TRUE(says(table, "Transmission error of 1 joint, over the touched angles"));
  EXPECT_TRUE(says(table, "A2, arcsec over deg"));
  EXPECT_EQ(occurrences(table, "class=\"curve\""), 1U);
  EXPECT_FALSE(says(table, "A2.fcos17"));
}

TEST(Parameters, OfSeveralToolsAreGroupedByTheirNames) {
  ReportInput input = made_up_session();
  calib::Calibration& result = input.calibration;
  result.cell.tool.id = "torch";
  result.cell.other_tools = {result.cell.tool};
  result.cell.other_tools[0].id = "probe";
  result.parameters.push_back({tool_parameter(ParameterKind::kTcp, 1, 0), "mm", 1e3, 0.0, 1e-4,
                               1e-5, calib::DecidedBy::kData});
  const std::string table = section_of(html_report(input), "parameters");
  EXPECT_TRUE(says(table, ">Tool torch<") && says(table, ">Tool probe<"));
  EXPECT_TRUE(says(table, "<code>torch.rho</code>") && says(table, "<code>probe.x</code>"));
  EXPECT_FALSE(says(table, ">Touch<"));
}

TEST(Parameters, OfTargetsWithADotInTheirNameFindTheirTarget) {
  ReportInput input = made_up_session({.spheres = 1, .certified_lengths = false});
  input.calibration.cell.targets[0].id = "bar.left";
  const std::string table = section_of(html_report(input), "parameters");
  EXPECT_TRUE(says(table, ">Target bar.left<"));
  EXPECT_TRUE(says(table, "<code>bar.left.x</code>"));
}

TEST(Parameters, OfTargetsWithoutStatedPositionSayWhatTheirNominalIs) {
  ReportInput input = made_up_session();
  for (auto& target : input.calibration.cell.targets) target.has_centre = true;
  EXPECT_FALSE(
      says(section_of(html_report(input), "parameters"), "without a position in the cell file"));
  input.calibration.cell.targets[1].has_centre = false;
  EXPECT_TRUE(
      says(section_of(html_report(input), "parameters"), "without a position in the cell file"));
}

TEST(Unidentifiable, DirectionsKeepTheirWordsAndTheirStrongestShares) {
  const std::string words = section_of(html_report(made_up_session()), "unidentifiable");
  EXPECT_TRUE(says(words, "Not determined by the touches: 3 combinations"));
  EXPECT_TRUE(says(words, "zero of A1: the same as turning all targets"));
  EXPECT_TRUE(says(words, "<code>A1.theta</code>&nbsp;+0.99"));
  EXPECT_FALSE(says(words, "S1.x")) << "shares below 0.05 are left out";
  EXPECT_LT(words.find("<code>A6.alpha"), words.find("<code>A6.theta")) << "strongest first";
}

TEST(Unidentifiable, StatesTheObservabilityWhereItIsKnown) {
  ReportInput input = made_up_session();
  calib::Observability& o = input.calibration.observability;
  o.condition = std::numeric_limits<double>::infinity();
  const std::string words = section_of(html_report(input), "unidentifiable");
  EXPECT_TRUE(says(words, "22 directions (without the frame) 21 are observable, 19 determined"));
  EXPECT_TRUE(says(words, "O1&nbsp;3.14 ("));
  EXPECT_TRUE(says(words, "scaled condition number \xE2\x80\x93."));
  o = {};
  EXPECT_FALSE(says(section_of(html_report(input), "unidentifiable"), "Observability"));
}

TEST(Outliers, AreListedByTouchLineTargetAndReason) {
  ReportInput input = made_up_session();
  const std::size_t touch = input.calibration.outliers.front().touch;
  input.calibration.outliers.front().residual_m = 0.000494;
  input.calibration.outliers.front().kind = calib::OutlierKind::kRecorded;
  input.calibration.outliers.front().text = "16.5 sigma from the robust fit";
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
  EXPECT_TRUE(says(html, "Frame directions fixed"));
}

TEST(Correlations, OfTargetCoordinatesAndOfTheFrameAreCountedNotListed) {
  ReportInput input = made_up_session();
  calib::Calibration& result = input.calibration;
  const auto size = static_cast<Eigen::Index>(result.parameters.size());
  result.covariance = Eigen::MatrixXd::Identity(size, size);
  result.covariance(size - 1, size - 2) = result.covariance(size - 2, size - 1) = 0.95;
  result.covariance(0, 2) = result.covariance(2, 0) = 0.95;
  ASSERT_EQ(result.parameters[0].decided_by, calib::DecidedBy::kFrame);
  result.frame_basis.resize(0, 0);
  const std::string html = section_of(html_report(input), "correlations");
  EXPECT_FALSE(says(html, "S4."));
  EXPECT_FALSE(says(html, "A1.theta"));
  EXPECT_TRUE(says(html, "Not listed: 2 pairs with a coordinate of a target"));
  EXPECT_TRUE(says(html, "No two parameters of robot, tool and touch"));
  EXPECT_TRUE(says(html, "Frame directions included"));
}

}  // namespace
}  // namespace cellcal::daemon::report
