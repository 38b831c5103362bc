// Every kind of session with touches, on a computer that delivers the sensor's bytes late every few seconds: by
// default it continues, and ends as on an idle computer.

#include <gtest/gtest.h>

#include "changed_cell.h"

namespace cellcal::daemon::testing {
namespace {

/// Searches take a second, and the wait after each delay two: most touches are stopped once.
constexpr const char* kBusy = "busy_every_s = 3.7\n";

class OnABusyComputer : public AChangedCell {
 protected:
  void expect_repeats(const Outcome& outcome) {
    EXPECT_EQ(outcome.status, 0) << outcome.err << outcome.out << fixture.log();
    const nlohmann::json status = fixture.status();
    EXPECT_EQ(status["phase"], "done") << status.dump(1);
    EXPECT_GT(status["busy_repeats"], 0) << status.dump(1);
    EXPECT_EQ(status["interruptions"], status["busy_repeats"]);
    const nlohmann::json& by_cause = status["interruptions_by_cause"];
    EXPECT_EQ(by_cause["sensor-data-late"], status["busy_repeats"]) << by_cause;
    EXPECT_EQ(by_cause["robot-replies-late"], 0);
    EXPECT_EQ(by_cause["packets-stopped"], 0);
    const std::string session = std::to_string(status["session"].get<int>());
    EXPECT_EQ(get("/v1/sessions/" + session)["times"]["interruptions_by_cause"], by_cause);
    EXPECT_TRUE(status["busy_left_s"].is_null());
    const std::string metrics = http_request(fixture.socket(), "GET", "/metrics").body;
    EXPECT_NE(metrics.find("cellcal_session_busy_repeats " +
                           std::to_string(status["busy_repeats"].get<int>()) + "\n"),
              std::string::npos)
        << metrics;
    EXPECT_NE(metrics.find("cellcal_session_interruptions_by_cause{cause=\"sensor-data-late\"} " +
                           std::to_string(status["busy_repeats"].get<int>()) + "\n"),
              std::string::npos)
        << metrics;
    EXPECT_NE(fixture.cellcal({"status"}).out.find("sensor data late (this computer was busy)"),
              std::string::npos);
  }
};

TEST_F(OnABusyComputer, ACalibrationACheckAndAnUpdateEndAsOnAQuietOne) {
  restart(kBusy);
  expect_repeats(
      fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "40", "--check", "0"}));
  const std::string show = fixture.cellcal({"show", "1"}).out;
  EXPECT_NE(show.find(" sensor data late (this computer was busy), each resumed"),
            std::string::npos)
      << show;
  const std::string report = content(fixture.dir.path() / "state/sessions/1/report.html");
  EXPECT_NE(report.find("sensor data late (this computer was busy)"), std::string::npos);
  expect_repeats(fixture.cellcal({"check"}));
  restart(std::string(kBusy) + "tool_shift_mm = [1.0, -0.8, 0.5]\n");
  expect_repeats(fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--update"}));
}

TEST_F(OnABusyComputer, WithASecondStopPathACalibrationIsStoppedOnlyUntilItIsProven) {
  restart(std::string(kBusy) +
          "[rsi]\ncontact_tag = \"Contact.R\"\n[controller]\ncontact_level = \"off\"\n");
  const Outcome outcome =
      fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "40", "--check", "0"});
  EXPECT_EQ(outcome.status, 0) << outcome.err << outcome.out << fixture.log();
  const nlohmann::json status = fixture.status();
  EXPECT_EQ(status["phase"], "done") << status.dump(1);
  EXPECT_LE(status["busy_repeats"], 1) << status.dump(1);
}

TEST_F(OnABusyComputer, TouchesChosenOneByOneComeToTheirGoal) {
  restart(kBusy);
  expect_repeats(
      fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--goal", "0.4", "--check", "4"}));
}

TEST_F(OnABusyComputer, SpheresAreFound) {
  restart(kBusy);
  expect_repeats(fixture.cellcal({"find", "--cell", CELLCAL_DEMO_CELL}));
}

TEST_F(OnABusyComputer, AQualificationMeasuresTheContacts) {
  restart(kBusy);
  expect_repeats(fixture.cellcal({"qualify", "--cell", CELLCAL_DEMO_CELL, "--target", "S2"}));
}

TEST_F(OnABusyComputer, SessionsOverEkiEndPublishedByEitherStop) {
  // With a flag a search takes nine seconds.
  for (const auto& [stop, every] : {std::pair("input", "5"), std::pair("flag", "19")}) {
    restart(std::string("busy_every_s = ") + every +
            "\nwire = \"eki\"\nseed = 12\n[eki]\nstop = \"" + stop + "\"\n");
    expect_repeats(fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "24",
                                    "--check", "4", "--seed", "12", "--accept-change"}));
  }
}

TEST_F(OnABusyComputer, ASessionThatMayNotRepeatEndsByThatName) {
  restart(std::string(kBusy) + "[session]\nbusy_repeats = 0\n");
  const Outcome outcome =
      fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "40", "--check", "0"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_EQ(fixture.status()["failure"]["kind"], "computer-busy") << outcome.err;
  EXPECT_NE(outcome.err.find("this computer was busy: sensor data "), std::string::npos)
      << outcome.err;
}

}  // namespace
}  // namespace cellcal::daemon::testing
