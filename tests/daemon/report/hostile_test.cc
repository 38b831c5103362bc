// Names come from users' files, numbers from files that may be edited by hand.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "daemon/report/report.h"
#include "tests/daemon/report/fixture.h"
#include "tests/daemon/report/html_checker.h"

namespace cellcal::daemon::report::testing {
namespace {

// Every string of the input, so that none is forgotten in a test.
void for_each_string(ReportInput& input, void (*change)(std::string&, const std::string&),
                     const std::string& with) {
  calib::Calibration& result = input.calibration;
  std::vector<std::string*> strings{
      &input.session_id,        &input.started, &input.finished,         &input.cell_name,
      &input.software,          &result.method, &result.cell.robot.name, &result.cell.robot.source,
      &result.level_reason.text};
  for (auto& [figure, value] : input.truth) strings.insert(strings.end(), {&figure, &value});
  for (auto& touch : input.touches) strings.insert(strings.end(), {&touch.target, &touch.time});
  for (auto& joint : result.cell.robot.joints) strings.push_back(&joint.name);
  for (auto& target : result.cell.targets) strings.push_back(&target.id);
  for (auto& length : result.cell.lengths)
    strings.insert(strings.end(), {&length.from, &length.to});
  for (auto& parameter : result.parameters) {
    strings.push_back(&parameter.unit);
  }
  for (auto& target : result.targets) strings.push_back(&target.id);
  for (auto& finding : result.verdict.findings)
    strings.insert(strings.end(), {&finding.text, &finding.about.name, &finding.about.other_end});
  for (auto& outlier : result.outliers)
    strings.insert(strings.end(), {&outlier.target, &outlier.lies_on, &outlier.text});
  for (auto& file : result.inputs) {
    strings.insert(strings.end(), {&file.role, &file.name, &file.sha256});
  }
  for (auto& direction : result.unidentifiable) strings.push_back(&direction.text);
  for (std::string* text : strings) change(*text, with);
  std::string note = "a note";
  change(note, with);
  input.notes.emplace_back(note);
}

ReportInput full_session() {
  ReportInput input = made_up_session();
  input.truth = {{"M3", "0.08 mm"}};
  input.calibration.level_reason = {calib::LevelChoice::kRecorded, "a level"};
  calib::Finding recorded;
  recorded.text = "a reason";
  input.calibration.verdict.findings = {recorded, calib::Finding{calib::FindingKind::kAllLeftOut}};
  input.calibration.unidentifiable.emplace_back().text = "a direction";
  input.calibration.outliers.push_back({0, 1e-3, 0.1, calib::OutlierKind::kOnAnotherTarget, "S1"});
  return input;
}

class HostileName : public ::testing::TestWithParam<std::string> {};

TEST_P(HostileName, StaysTextEverywhere) {
  ReportInput input = full_session();
  for_each_string(
      input, [](std::string& text, const std::string& with) { text = with + text + with; },
      GetParam());
  EXPECT_EQ(joined(complaints(html_report(input))), "");
}

TEST_P(HostileName, StaysTextWhereItReplacesTheWholeName) {
  ReportInput input = full_session();
  for_each_string(
      input, [](std::string& text, const std::string& with) { text = with; }, GetParam());
  EXPECT_EQ(joined(complaints(html_report(input))), "");
}

INSTANTIATE_TEST_SUITE_P(
    Report, HostileName,
    ::testing::Values("", "<script>alert(1)</script>", "</style><script>alert(1)</script>",
                      "\" onload=\"alert(1)", "' onload='alert(1)", "<!--", "]]>", "&", "&lt;b",
                      "</title>", "</svg><img src=x onerror=alert(1)>", "{}", "{0} {name} %s %n",
                      "\xFF\xFE\xC0\x80", "\xE2\x80\xAEgpj.exe", std::string("a\0b", 3),
                      "\r\n\t\x1B[2J", ".", "..", "a.b.c", std::string(20000, 'x'),
                      std::string(3000, '\xE2')));

const std::array<double, 12> kBadNumbers{std::numeric_limits<double>::quiet_NaN(),
                                         std::numeric_limits<double>::infinity(),
                                         -std::numeric_limits<double>::infinity(),
                                         std::numeric_limits<double>::max(),
                                         -std::numeric_limits<double>::max(),
                                         std::numeric_limits<double>::denorm_min(),
                                         -0.0,
                                         0.0,
                                         1e300,
                                         -1e12,
                                         1e-300,
                                         7.0};

// Every number of the input.
std::vector<double*> numbers_of(ReportInput& input) {
  calib::Calibration& result = input.calibration;
  std::vector<double*> all{
      &result.predicted_near_targets_m,   &result.predicted_workspace_m, &result.chi2_per_dof,
      &result.degrees_of_freedom,         &result.touch_noise_m,         &result.cell.touch_sigma_m,
      &result.cell.radius_offset_sigma_m, &result.cell.tool.mass_kg,     &result.cell.tool.length_m,
      &result.cell.tool.tip_radius_m};
  calib::Observability& o = result.observability;
  all.insert(all.end(), {&o.o1, &o.o2, &o.o3, &o.o4, &o.o5, &o.condition});
  calib::RepeatedTouches& repeats = result.repeats;
  all.insert(all.end(), {&repeats.scatter_m, &repeats.degrees_of_freedom, &repeats.used_m});
  for (auto* summary : {&result.before, &result.after, &result.check_before, &result.check}) {
    all.insert(all.end(), {&summary->mean_m, &summary->max_m, &summary->rms_m});
  }
  for (auto& residual : result.residuals) {
    all.insert(all.end(),
               {&residual.before_m, &residual.after_m, &residual.whitened, &residual.direction.x(),
                &residual.direction.y(), &residual.direction.z()});
  }
  for (auto& parameter : result.parameters) {
    all.insert(all.end(),
               {&parameter.to_unit, &parameter.nominal, &parameter.correction, &parameter.sigma});
  }
  for (auto& target : result.targets) {
    all.insert(all.end(), {&target.centre_m.x(), &target.centre_m.y(), &target.centre_m.z(),
                           &target.effective_radius_m});
  }
  for (auto& target : result.cell.targets) {
    all.insert(all.end(), {&target.diameter_m, &target.diameter_sigma_m});
  }
  for (auto& length : result.cell.lengths) {
    all.insert(all.end(), {&length.length_m, &length.sigma_m});
  }
  for (auto& entry : result.levels) {
    all.insert(all.end(),
               {&entry.log_evidence, &entry.level.transmission, &entry.level.ripple_rad});
  }
  all.insert(all.end(), {&result.level.transmission, &result.level.ripple_rad});
  for (auto& outlier : result.outliers)
    all.insert(all.end(), {&outlier.residual_m, &outlier.leverage, &outlier.sigmas});
  for (auto& direction : result.unidentifiable) {
    for (auto& [key, share] : direction.direction) all.push_back(&share);
  }
  for (auto& touch : input.touches) {
    all.insert(all.end(), {&touch.sigma_m, &touch.spread_m, &touch.speed_m_s});
    for (double& angle : touch.joint_rad) all.push_back(&angle);
  }
  for (Eigen::Index i = 0; i < result.covariance.size(); ++i) {
    all.push_back(result.covariance.data() + i);
  }
  for (Eigen::Index i = 0; i < result.frame_basis.size(); ++i) {
    all.push_back(result.frame_basis.data() + i);
  }
  return all;
}

TEST(HostileNumbers, OneValueEverywhereLeavesTheDocumentSound) {
  for (const double bad : kBadNumbers) {
    ReportInput input = full_session();
    for (double* number : numbers_of(input)) *number = bad;
    EXPECT_EQ(joined(complaints(html_report(input))), "") << bad;
  }
}

TEST(HostileNumbers, MixedIntoAGoodSessionLeaveTheDocumentSound) {
  std::mt19937 engine(42);
  for (int round = 0; round < 60; ++round) {
    ReportInput input = full_session();
    for (double* number : numbers_of(input)) {
      if (engine() % 4 == 0) *number = kBadNumbers[engine() % kBadNumbers.size()];
    }
    ASSERT_EQ(joined(complaints(html_report(input))), "") << "round " << round;
  }
}

TEST(HostileNumbers, NeverShowAsWords) {
  ReportInput input = full_session();
  for (double* number : numbers_of(input)) *number = std::numeric_limits<double>::quiet_NaN();
  const std::string html = html_report(input);
  EXPECT_EQ(html.find(">nan"), std::string::npos);
  EXPECT_EQ(html.find("nan "), std::string::npos);
  EXPECT_EQ(html.find("\"nan"), std::string::npos);
}

TEST(HostileIndices, OfTouchesThatDoNotExistAreCountedNotFollowed) {
  ReportInput input = full_session();
  input.calibration.residuals[0].touch = std::numeric_limits<std::size_t>::max();
  input.calibration.residuals[1].touch = input.touches.size();
  input.calibration.outliers.push_back(
      {std::numeric_limits<std::size_t>::max(), 0.1, 0.0, calib::OutlierKind::kOffItsTarget, "S1"});
  input.calibration.outliers.push_back({input.touches.size(), 0.1});
  const std::string html = html_report(input);
  EXPECT_EQ(joined(complaints(html)), "");
  EXPECT_NE(html.find("2 residuals belong to touches that the report was not given"),
            std::string::npos);
  EXPECT_NE(html.find("reason not recorded"), std::string::npos);
}

TEST(HostileIndices, OfNegativeCountsReadAsNone) {
  ReportInput input = full_session();
  input.calibration.check.count = -5;
  input.calibration.before.count = -1;
  EXPECT_EQ(joined(complaints(html_report(input))), "");
}

TEST(HostileShapes, OfCovarianceAndBasisAreRefusedInWords) {
  ReportInput input = full_session();
  input.calibration.covariance.resize(3, 2);
  input.calibration.frame_basis.resize(1, 1);
  const std::string html = html_report(input);
  EXPECT_EQ(joined(complaints(html)), "");
  EXPECT_NE(html.find("has no usable covariance"), std::string::npos);
}

TEST(HostileNames, ThatAreShortenedInDrawingsStandInFullInTheTables) {
  ReportInput input = made_up_session({.spheres = 1, .certified_lengths = false});
  const std::string id = "left-hand-side-sphere-on-the-second-fixture-plate";
  input.calibration.targets[0].id = input.calibration.cell.targets[0].id = id;
  for (calib::Touch& touch : input.touches) touch.target = id;
  const std::string html = html_report(input);
  EXPECT_NE(section_of(html, "cell").find(">left-hand-sid\xE2\x80\xA6</text>"), std::string::npos);
  EXPECT_NE(section_of(html, "targets").find(">" + id + "<"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon::report::testing
