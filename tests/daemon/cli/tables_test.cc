#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "calib/result/finding.h"
#include "daemon/cli/actions.h"
#include "daemon/cli/offline.h"

namespace cellcal::daemon {
namespace {

TEST(ANoticeOfTheFleet, NamesWhatWithholdsACalibrationInWords) {
  const auto words = [](const char* detail) {
    return need_words({{"what", "withheld"}, {"since", nullptr}, {"detail", detail}});
  };
  EXPECT_EQ(words("touch_scatter, no_gain"), "newest calibration withheld: touch scatter, no gain");
  EXPECT_EQ(words("of_a_later_version"), "newest calibration withheld: of_a_later_version");
}

TEST(TheResult, ShowsBeforeAfterCheckAndTheVerdictWithScopeAndReasons) {
  calib::Calibration calibration;
  calibration.before = {24, 0.0012, 0.0034, 0.0015};
  calibration.after = {24, 0.00003, 0.00009, 0.00004};
  calibration.verdict.workspace = true;
  calibration.verdict.findings = {calib::Finding{calib::FindingKind::kReferenceMethod}};
  calibration.outliers = {{4, 0.0005, 0.0, calib::OutlierKind::kOffItsTarget, "S1"}};
  const std::string words = result_words(calibration);
  EXPECT_NE(words.find("fit before          24    1.2000    3.4000    1.5000\n"), std::string::npos)
      << words;
  EXPECT_NE(words.find("fit after           24    0.0300    0.0900    0.0400\n"), std::string::npos)
      << words;
  EXPECT_NE(words.find("check after       none\n"), std::string::npos) << words;
  EXPECT_NE(words.find("1 outlier left out: touch 5\n"), std::string::npos) << words;
  std::vector<calib::Touch> touches(5);
  touches[4].line = 7;
  EXPECT_NE(
      result_words(calibration, touches, Detail::kAll).find("outlier: touch 5 (line 7): +0.500 mm"),
      std::string::npos);
  EXPECT_NE(words.find("verdict: NOT publishable, scope: workspace\n  - reference method, for "
                       "comparison only\n"),
            std::string::npos)
      << words;
}

TEST(TheResult, ThatIsNoneHasNoFigures) {
  calib::Calibration calibration;
  calibration.before = calibration.after = {24, 0.1, 0.2, 0.15};
  calibration.predicted_near_targets_m = calibration.predicted_workspace_m = 1e-4;
  calibration.level_reason.choice = calib::LevelChoice::kNothingIdentified;
  const std::string words = result_words(calibration);
  EXPECT_NE(words.find("fit before          24  100.0000"), std::string::npos) << words;
  EXPECT_EQ(words.find("fit after"), std::string::npos) << words;
  EXPECT_EQ(words.find("predicted"), std::string::npos) << words;
}

TEST(TheResult, IsTenLinesThatKeepBackNothingToLookAt) {
  calib::Calibration calibration;
  calibration.before = calibration.after = {24, 0.0012, 0.0034, 0.0015};
  calibration.predicted_near_targets_m = calibration.predicted_workspace_m = 1e-4;
  calibration.nominal_near_targets_m = calibration.nominal_workspace_m = 3e-3;
  calibration.nominal_near_targets_u_m = calibration.nominal_workspace_u_m = 8e-5;
  calibration.chi2 = calibration.degrees_of_freedom = 60.0;
  calibration.unidentifiable.emplace_back().text = "turning the zero of A1; fixed by convention";
  for (std::size_t k = 0; k < 9; ++k) {
    calibration.outliers.push_back({k, 0.0005});
    calibration.outliers.back().text = "off S1";
  }
  calib::Finding informed, warned;
  informed.kind = calib::FindingKind::kGain;
  informed.severity = calib::Severity::kInforms;
  warned.kind = calib::FindingKind::kNoCheckTouches;
  warned.severity = calib::Severity::kWarns;
  calibration.verdict.findings = {informed, warned};
  const std::string brief = result_words(calibration);
  EXPECT_LE(std::count(brief.begin(), brief.end(), '\n'), 10) << brief;
  EXPECT_NE(brief.find(
                "9 outliers left out: touch 1, touch 2, touch 3, touch 4, touch 5, touch 6, ...\n"),
            std::string::npos)
      << brief;
  EXPECT_NE(
      brief.find("with the nominal arm: 3.00 ± 0.08 mm near the targets, 3.00 ± 0.08 mm over the "
                 "workspace (k = 2)\n"),
      std::string::npos)
      << brief;
  EXPECT_NE(brief.find("  - " + calib::words(warned)), std::string::npos) << brief;
  EXPECT_EQ(brief.find("  - " + calib::words(informed)), std::string::npos) << brief;
  const std::string all = result_words(calibration, {}, Detail::kAll);
  for (const char* one : {"chi^2", "not identifiable", "outlier: touch 9: off S1"})
    EXPECT_NE(all.find(one), std::string::npos) << one;
  EXPECT_NE(all.find("  - " + calib::words(informed)), std::string::npos) << all;
}

TEST(TheResult, SaysInWordsWhatTheTouchesCannotTell) {
  calib::Calibration calibration;
  EXPECT_EQ(result_words(calibration, {}, Detail::kAll).find("not identifiable"),
            std::string::npos);
  calibration.unidentifiable.emplace_back().text = "turning the zero of A1; fixed by convention";
  EXPECT_NE(result_words(calibration, {}, Detail::kAll)
                .find("not identifiable: turning the zero of A1; fixed by convention\n"),
            std::string::npos);
}

TEST(TheResult, SaysInOneLineHowWellTheTouchesTellTheGeometry) {
  calib::Calibration calibration;
  EXPECT_EQ(result_words(calibration, {}, Detail::kAll).find("observability"), std::string::npos);
  calib::Observability& o = calibration.observability;
  o.rows = 106;
  o.directions = 22;
  o.rank = 22;
  o.determined = 20;
  o.o1 = 3.14159;
  o.o3 = 0.0271828;
  o.condition = 1234.5;
  const std::string words = result_words(calibration, {}, Detail::kAll);
  EXPECT_NE(words.find("observability: 20 of 22 directions of the geometry determined better than "
                       "their tolerance, 22 observable; O1 3.14,"),
            std::string::npos)
      << words;
  EXPECT_NE(words.find("O3 0.0272,"), std::string::npos) << words;
  EXPECT_NE(words.find("condition 1234\n"), std::string::npos) << words;
}

TEST(TheResult, StatesChiSquaredWithItsDegreesOfFreedom) {
  calib::Calibration calibration;
  EXPECT_EQ(result_words(calibration, {}, Detail::kAll).find("chi^2"), std::string::npos);
  calibration.chi2 = 61.24;
  calibration.degrees_of_freedom = 68.04;
  calibration.chi2_per_dof = 0.9;
  EXPECT_NE(result_words(calibration, {}, Detail::kAll)
                .find("chi^2 of the fit: 61.2 at 68.0 degrees of freedom, 0.90 per degree\n"),
            std::string::npos)
      << result_words(calibration, {}, Detail::kAll);
}

TEST(TheResult, StatesTheNoiseThatRepeatedTouchesMeasured) {
  calib::Calibration calibration;
  calibration.cell.touch_sigma_m = 3e-5;
  EXPECT_EQ(result_words(calibration, {}, Detail::kAll).find("touch noise"), std::string::npos);
  calibration.repeats = {30, 1.2e-5, 20.0, 1.7e-5};
  EXPECT_NE(result_words(calibration, {}, Detail::kAll)
                .find("touch noise: 0.030 mm stated, 0.012 mm measured by 30 repeated touches (20 "
                      "degrees of freedom), 0.017 mm used\n"),
            std::string::npos)
      << result_words(calibration, {}, Detail::kAll);
}

TEST(TheResult, NamesTheThreeStrongestPairsThatGoTogetherAndCountsTheOthers) {
  calib::Calibration calibration;
  for (const char* name : {"A1", "A2", "A3", "A4", "A5", "A6"})
    calibration.cell.robot.joints.emplace_back().name = name;
  const auto pair = [&calibration](const char* one, const char* other, double correlation) {
    const auto at = static_cast<Eigen::Index>(calibration.parameters.size());
    for (const char* name : {one, other}) {
      calibration.parameters.emplace_back();
      calibration.parameters.back().key = *parameter_key(calibration.cell, name);
    }
    calibration.covariance.conservativeResizeLike(Eigen::MatrixXd::Identity(at + 2, at + 2));
    calibration.covariance(at, at + 1) = calibration.covariance(at + 1, at) = correlation;
  };
  EXPECT_EQ(result_words(calibration, {}, Detail::kAll).find("strongly correlated"),
            std::string::npos);
  pair("A1.d", "A1.a", 0.89);
  pair("A2.theta", "A3.theta", -0.94);
  pair("A4.theta", "A6.theta", 0.991);
  EXPECT_NE(result_words(calibration, {}, Detail::kAll)
                .find("strongly correlated parameters: A4.theta and A6.theta (+0.99), A2.theta "
                      "and A3.theta (-0.94)\n"),
            std::string::npos)
      << result_words(calibration, {}, Detail::kAll);
  pair("A5.d", "A5.a", 0.93);
  pair("A2.a", "A2.alpha", 0.92);
  EXPECT_NE(result_words(calibration, {}, Detail::kAll)
                .find("A5.d and A5.a (+0.93); 1 more pair beyond 0.9\n"),
            std::string::npos)
      << result_words(calibration, {}, Detail::kAll);
}

TEST(TheResult, OfAnUpdateThatFindsNothingChangedSaysSoAndNotThatItIsNoGood) {
  calib::Calibration calibration;
  calibration.update.emplace();
  calibration.update->outcome = calib::UpdateOutcome::kNothingChanged;
  const std::string words = result_words(calibration);
  EXPECT_NE(words.find("verdict: nothing changed, the calibration in use holds\n"),
            std::string::npos)
      << words;
  EXPECT_EQ(words.find("publishable"), std::string::npos) << words;
  calibration.update->outcome = calib::UpdateOutcome::kNotResolved;
  EXPECT_NE(result_words(calibration).find("verdict: NOT publishable"), std::string::npos);
}

TEST(TheLatchDelay, IsOneLineWithBothEstimatesOfItInOneUnit) {
  EXPECT_EQ(delay_words(nullptr, {}), "");
  const ContactsDelay contacts{1.4e-4, 1e-5, 40};
  EXPECT_EQ(delay_words(nullptr, contacts),
            "latch delay (k = 2): +0.14 ± 0.02 ms by fast against slow contacts of 40 touches\n");
  calib::Calibration fit;
  calib::ParameterResult delay;
  delay.key = calib::latch_delay_parameter();
  delay.nominal = 1e-4;
  delay.correction = 2e-5;
  delay.sigma = 3e-5;
  delay.decided_by = calib::DecidedBy::kPrior;
  fit.parameters.push_back(delay);
  EXPECT_EQ(delay_words(&fit, {}), "") << "a prior is no finding";
  EXPECT_EQ(delay_words(&fit, contacts), delay_words(nullptr, contacts));
  fit.parameters[0].decided_by = calib::DecidedBy::kData;
  EXPECT_EQ(delay_words(&fit, {}), "latch delay (k = 2): +0.12 ± 0.06 ms by the fit\n");
  EXPECT_EQ(delay_words(&fit, contacts),
            "latch delay (k = 2): +0.12 ± 0.06 ms by the fit, +0.14 ± 0.02 ms by fast against slow "
            "contacts of 40 touches: they agree\n");
  fit.verdict.findings = {calib::Finding{calib::FindingKind::kTooFewTouches}};
  EXPECT_EQ(result_words(fit, {}, Detail::kAll, contacts).find(delay_words(nullptr, contacts)), 0u);
  fit.parameters[0].correction = 4e-4;
  EXPECT_NE(delay_words(&fit, contacts).find("not one delay. Measure the contact itself"),
            std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon
