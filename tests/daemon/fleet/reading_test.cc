#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

#include "daemon/fleet/judge.h"
#include "tests/daemon/fleet/facts.h"

namespace cellcal::daemon::fleet {
namespace {

using nlohmann::json;
using testing::ask;
using testing::Database;
using testing::fact;
using testing::kPaint;
using testing::kWeld;

class FleetReading : public ::testing::Test {
 protected:
  void say(const plant::Fact& one) {
    Batch batch;
    batch.facts = {one};
    store.write(batch);
  }
  void calibrate(const plant::CellName& cell, std::int64_t number, bool published = true) {
    auto body = std::get<plant::CalibrationFact>(testing::one_of_each()[1]);
    body.published = published;
    if (!published) body.findings = {"changed"};
    say(fact(cell, number, body, number));
    // The cell's clock in these tests is in an arbitrary year.
    ask(database,
        "UPDATE fleet.calibrations SET at = now() WHERE number = " + std::to_string(number));
  }
  void check(std::int64_t number, plant::Held held, std::int64_t against = 1) {
    say(fact(kWeld, number, plant::CheckFact{against, held, 0.5e-3, 0.1e-3, "tool", {}, "{}"},
             number));
  }
  void session(std::int64_t number, plant::SessionState state) {
    auto body = std::get<plant::SessionFact>(testing::one_of_each()[0]);
    body.state = state;
    say(fact(kWeld, number, body, number));
  }
  std::string needs() {
    return ask(database, "SELECT what FROM fleet.attention WHERE cell = 'weld-3' ORDER BY what");
  }

  std::string database = Database::shared().emptied();
  Store store{{database}};
  Reading reading{database};
};

TEST_F(FleetReading, ACellThatHoldsItsCalibrationNeedsNothing) {
  calibrate(kWeld, 1);
  check(2, plant::Held::kYes);
  session(3, plant::SessionState::kDone);
  EXPECT_EQ(needs(), "");
}

TEST_F(FleetReading, ACellWithoutACalibrationIsOverdue) {
  session(1, plant::SessionState::kDone);
  EXPECT_EQ(needs(), "overdue");
  EXPECT_EQ(json::parse(reading.overdue()).at("overdue").at(0).at("of"), "calibration");
}

TEST_F(FleetReading, AnOldCalibrationIsOverdueAndAnOldCheckWhereChecksAreAskedFor) {
  calibrate(kWeld, 1);
  ask(database, "UPDATE fleet.calibrations SET at = now() - interval '100 days'");
  EXPECT_EQ(needs(), "");
  ask(database, "UPDATE fleet.settings SET check_days = 7");
  EXPECT_EQ(json::parse(reading.overdue()).at("overdue").at(0).at("of"), "check");
  ask(database, "UPDATE fleet.settings SET check_days = 0, calibration_days = 90");
  EXPECT_EQ(json::parse(reading.overdue()).at("overdue").at(0).at("of"), "calibration");
}

TEST_F(FleetReading, AFailedCheckCountsUntilThereIsANewCalibration) {
  calibrate(kWeld, 1);
  check(2, plant::Held::kNo);
  EXPECT_EQ(needs(), "check-not-held");
  calibrate(kWeld, 3);
  EXPECT_EQ(needs(), "");
  check(2, plant::Held::kNo);  // again
  EXPECT_EQ(needs(), "");
}

TEST_F(FleetReading, ACheckOfACalibrationThatIsNotInUseSaysNothingOfTheOne) {
  calibrate(kWeld, 1);
  calibrate(kWeld, 3);
  check(4, plant::Held::kNo, 1);
  EXPECT_EQ(needs(), "");
  check(5, plant::Held::kNo, 3);
  check(6, plant::Held::kYes, 1);
  EXPECT_EQ(needs(), "check-not-held");
  check(7, plant::Held::kYes, 3);
  EXPECT_EQ(needs(), "");
}

TEST_F(FleetReading, ADriftAlarmCountsUntilAnotherCalibrationIsInUse) {
  calibrate(kWeld, 1);
  say(fact(kWeld, 2, plant::AlarmFact{"drifted", "drifted", "0.4 mm"}));
  EXPECT_EQ(needs(), "drifted");
  say(fact(kWeld, 3, plant::ActivationFact{"M. Huber", "back"}, 1));
  EXPECT_EQ(needs(), "");
}

TEST_F(FleetReading, ADriftAlarmEndsWhereTheCellSaysThatItIsOver) {
  calibrate(kWeld, 1);
  say(fact(kWeld, 2, plant::AlarmFact{"drifted", "drifted", "0.4 mm"}));
  EXPECT_EQ(needs(), "drifted");
  say(fact(kWeld, 3, plant::AlarmFact{"recovered", "over", ""}));
  EXPECT_EQ(needs(), "");
  say(fact(kWeld, 4, plant::AlarmFact{"drifted", "drifted", "0.4 mm"}));
  EXPECT_EQ(needs(), "drifted");
}

TEST_F(FleetReading, AnUpdateThatFoundNothingChangedWithholdsNoCalibration) {
  calibrate(kWeld, 1);
  auto update = std::get<plant::CalibrationFact>(testing::one_of_each()[1]);
  update.published = false;
  update.update = true;
  update.findings = {"update_not_needed"};
  say(fact(kWeld, 2, update, 2));
  EXPECT_EQ(needs(), "");
}

TEST_F(FleetReading, TheNewestSessionAndCalibrationDecideByNumberNotByArrival) {
  calibrate(kWeld, 1);
  session(9, plant::SessionState::kFailed);
  session(8, plant::SessionState::kDone);
  EXPECT_EQ(needs(), "failed");
  session(10, plant::SessionState::kInterrupted);
  EXPECT_EQ(needs(), "interrupted");
  session(11, plant::SessionState::kDone);
  calibrate(kWeld, 12, false);
  EXPECT_EQ(needs(), "withheld");
  EXPECT_EQ(ask(database, "SELECT calibration FROM fleet.cell_states"), "1");  // it remains in use
}

TEST_F(FleetReading, OfACellWithANewDiskTheNewestJournalThatHasSomethingDecides) {
  calibrate(kWeld, 50);
  session(51, plant::SessionState::kFailed);
  auto body = std::get<plant::SessionFact>(testing::one_of_each()[0]);
  body.state = plant::SessionState::kInterrupted;
  plant::Fact first_of_the_new = fact(kWeld, 1, body, 1);
  first_of_the_new.journal = "j2";
  say(first_of_the_new);
  EXPECT_EQ(needs(), "interrupted");
  EXPECT_EQ(ask(database, "SELECT session, calibration, journal FROM fleet.cell_states"),
            "1|50|j1");
}

TEST_F(FleetReading, CellsThatNeedAttentionComeFirst) {
  calibrate(kPaint, 1);
  calibrate(kWeld, 1);
  Batch batch;
  batch.presences = {{kWeld, false, false, "j1", 1, "1.9.0", "2026-11-22T20:00:00Z", false},
                     {kPaint, true, false, "j1", 1, "1.9.0", "2026-11-22T20:00:00Z", false}};
  store.write(batch);
  const json cells = json::parse(reading.cells()).at("cells");
  ASSERT_EQ(cells.size(), 2u);
  EXPECT_EQ(cells[0].at("cell"), "weld-3");
  EXPECT_EQ(cells[0].at("needs").at(0).at("what"), "offline");
  EXPECT_TRUE(cells[1].at("needs").empty());
  const Totals totals = reading.totals();
  EXPECT_EQ(totals.cells, 2);
  EXPECT_EQ(totals.online, 1);
}

TEST_F(FleetReading, ANeedIsCountedByTheCellsThatHaveIt) {
  calibrate(kWeld, 1);
  check(2, plant::Held::kNo);
  session(3, plant::SessionState::kFailed);
  const std::map<std::string, std::int64_t> having{{"check-not-held", 1}, {"failed", 1}};
  const Totals totals = reading.totals();
  EXPECT_GT(totals.needs.size(), having.size());
  for (const auto& [what, cells] : totals.needs)
    EXPECT_EQ(cells, having.contains(what) ? 1 : 0) << what;
}

TEST_F(FleetReading, OneJointIsComparedOverTheRobotsOfAModel) {
  calibrate(kWeld, 1);
  calibrate(kPaint, 1);
  const json compared = json::parse(reading.compare("KR 5 R1400", "A2"));
  ASSERT_EQ(compared.at("corrections").size(), 2u);
  EXPECT_EQ(compared["corrections"][0].at("parameter"), "theta");
  EXPECT_EQ(compared["corrections"][0].at("unit"), "deg");
  EXPECT_TRUE(json::parse(reading.compare("KR 5 R1400", "A9")).at("corrections").empty());
}

TEST_F(FleetReading, OneCellHasItsHistory) {
  calibrate(kWeld, 1);
  check(2, plant::Held::kYes);
  const json cell = json::parse(reading.cell(kWeld).value());
  EXPECT_EQ(cell.at("state").at("calibration"), 1);
  EXPECT_EQ(cell.at("calibrations").size(), 1u);
  EXPECT_EQ(cell.at("checks").at(0).at("held"), "yes");
  EXPECT_FALSE(reading.cell({"graz", "nowhere"}));
}

TEST_F(FleetReading, EachSessionIsListedOnceByItsNewestFact) {
  const auto state = [this](std::int64_t number, std::int64_t of, plant::SessionState now) {
    auto body = std::get<plant::SessionFact>(testing::one_of_each()[0]);
    body.state = now;
    say(fact(kWeld, number, body, of));
  };
  state(1, 7, plant::SessionState::kRunning);
  state(3, 7, plant::SessionState::kAborted);
  state(5, 7, plant::SessionState::kRunning);  // resumed
  state(4, 8, plant::SessionState::kRunning);
  state(6, 7, plant::SessionState::kDone);
  const json sessions = json::parse(reading.cell(kWeld).value()).at("sessions");
  ASSERT_EQ(sessions.size(), 2U);
  EXPECT_EQ(sessions[0].at("session"), 8) << "newest first";
  EXPECT_EQ(sessions[1].at("state"), "done");
}

TEST_F(FleetReading, DocumentsAndCertificatesComeBackWhole) {
  calibrate(kWeld, 1);
  say(fact(kWeld, 2, testing::one_of_each()[4], 1));
  EXPECT_EQ(reading.calibration(kWeld, "j1", 1).value().bytes, testing::a_calibration());
  EXPECT_FALSE(reading.calibration(kWeld, "j1", 2));
  const std::vector<StoredFile> files = reading.certificate(kWeld, "j1", 1);
  ASSERT_EQ(files.size(), 2u);
  EXPECT_EQ(files[1].bytes, std::string("\0\xff\x80", 3));
}

}  // namespace
}  // namespace cellcal::daemon::fleet
