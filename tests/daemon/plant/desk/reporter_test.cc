// Report of a fact to the plant.

#include <gtest/gtest.h>

#include <limits>

#include "calib/files/calibration_json.h"
#include "daemon/plant/desk/journal_outbox.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/result/outcome_json.h"
#include "daemon/tasks/options.h"
#include "tests/daemon/journal/images.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using plant::PlantReporter;

plant::FactBody body_of(const Report& report) {
  return plant::body_from_json(report.kind, report.body);
}

SessionRecord session_of(SessionKind kind, RecordState state,
                         const std::optional<calib::TcpCheck>& check = {}) {
  SessionRecord record;
  record.id = 7;
  record.state = state;
  record.started = "2026-01-01T00:00:00.000Z";
  SessionOptions options;
  options.kind = kind;
  options.against = kind == SessionKind::kCheck ? 3 : 0;
  record.inputs.options = options_to_json(options);
  if (check) {
    record.outcome = outcome_of(SessionResult{*check});
    record.document = document_of(SessionResult{*check});
  }
  return record;
}

struct ReporterTest : ::testing::Test {
  PlantReporter plant_reporter{{true, 1 << 20, {"graz", "weld-3"}, {}, {}}};
};

TEST_F(ReporterTest, TellsWhatASessionIsForAndHowItStands) {
  const auto reports =
      plant_reporter.session(session_of(SessionKind::kCalibrate, RecordState::kAborted));
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_EQ(reports[0].worth, daemon::Worth::kResult);
  const auto fact = std::get<plant::SessionFact>(body_of(reports[0]));
  EXPECT_EQ(fact.state, plant::SessionState::kAborted);
  EXPECT_EQ(fact.purpose, "calibrate");
}

TEST_F(ReporterTest, TellsTheResultOfACheckWithItsEndByteForByte) {
  const calib::TcpCheck check{.holds = true, .touches = 9};
  EXPECT_EQ(plant_reporter.session(session_of(SessionKind::kCheck, RecordState::kRunning)).size(),
            1u);
  const auto reports =
      plant_reporter.session(session_of(SessionKind::kCheck, RecordState::kDone, check));
  ASSERT_EQ(reports.size(), 2u);
  EXPECT_EQ(std::get<plant::SessionFact>(body_of(reports[1])).outcome, "holds");
  const auto fact = std::get<plant::CheckFact>(body_of(reports[0]));
  EXPECT_EQ(fact.held, plant::Held::kYes);
  EXPECT_EQ(fact.against, 3);
  EXPECT_EQ(fact.document, calib::check_to_json(check) + "\n");
}

TEST_F(ReporterTest, TellsOfTouchesOnlyWhereItWasAskedTo) {
  const RecordTouch touch{4, touch_at(0.5)};
  const auto reports = plant_reporter.touch(touch);
  ASSERT_EQ(reports.size(), 1u);
  EXPECT_EQ(reports[0].worth, daemon::Worth::kTelemetry);
  EXPECT_EQ(std::get<plant::TouchFact>(body_of(reports[0])).index, 4u);
  EXPECT_TRUE(PlantReporter({}).touch(touch).empty());
}

TEST_F(ReporterTest, TellsOfATouchWhereItsTipWasAndHowFarOffItIsOnceThatIsKnown) {
  RecordTouch touch{4, touch_at(0.5), std::array{1.0, 0.5, 0.25}, 2e-4};
  auto fact = std::get<plant::TouchFact>(body_of(plant_reporter.touch(touch)[0]));
  EXPECT_NEAR((*fact.tip_m)[2], 0.25, 1e-12);
  EXPECT_NEAR(*fact.residual_m, 2e-4, 1e-12);
  touch.residual_m = std::numeric_limits<double>::quiet_NaN();
  fact = std::get<plant::TouchFact>(body_of(plant_reporter.touch(touch)[0]));
  EXPECT_FALSE(fact.residual_m);
}

TEST_F(ReporterTest, TellsOfAFailureByItsName) {
  SessionRecord failed = session_of(SessionKind::kCalibrate, RecordState::kFailed);
  failed.failure = "no-contact: end of the search";
  failed.failure_kind = FailureKind::kNoContact;
  EXPECT_EQ(std::get<plant::SessionFact>(body_of(plant_reporter.session(failed)[0])).failure_kind,
            "no-contact");
}

TEST_F(ReporterTest, NamesOfACalibrationTheFindingsThatWithholdIt) {
  calib::Calibration result = calib::load_calibration(CELLCAL_CALIBRATION);
  result.verdict.findings = {
      calib::Finding{calib::FindingKind::kScaleByLengths, calib::Severity::kInforms},
      calib::Finding{calib::FindingKind::kNoGain, calib::Severity::kWithholds},
      calib::Finding{calib::FindingKind::kModelError, calib::Severity::kWarns}};
  SessionRecord withheld = session_of(SessionKind::kCalibrate, RecordState::kDone);
  withheld.calibration = calib::calibration_to_json(result);
  const auto fact =
      std::get<plant::CalibrationFact>(body_of(plant_reporter.calibration(withheld, {})));
  EXPECT_EQ(fact.findings, std::vector<std::string>{"no_gain"});
}

TEST_F(ReporterTest, SpeaksUnderItsCellsNameAndForThoseThatItHad) {
  EXPECT_EQ(plant_reporter.address(), "graz/weld-3");
  EXPECT_FALSE(plant_reporter.publishes_name("graz/weld-2"));
  const PlantReporter renamed({true, 1 << 20, {"graz", "weld-3"}, {"graz/weld-2"}, {}});
  EXPECT_TRUE(renamed.publishes_name("graz/weld-2"));
}

}  // namespace
}  // namespace cellcal::daemon::testing
