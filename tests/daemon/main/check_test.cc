// A check of the last calibration from the command line: unchanged, and with a knocked tool.

#include <gtest/gtest.h>

#include "changed_cell.h"
#include "daemon/journal/store/sqlite.h"

namespace cellcal::daemon::testing {
namespace {

class ACheck : public AChangedCell {
 protected:
  void calibrate() {
    const Outcome outcome =
        fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "40", "--check", "0"});
    ASSERT_EQ(outcome.status, 0) << outcome.err << outcome.out << fixture.log();
  }
};

TEST_F(ACheck, HoldsWhereNothingChangedAndNamesTheToolThatWasKnocked) {
  fixture.start();
  calibrate();
  const Outcome held = fixture.cellcal({"check", "--temperature", "21.5"});
  EXPECT_EQ(held.status, 0) << held.err << held.out << fixture.log();
  EXPECT_TRUE(held.out.starts_with("holds: TCP shift 0.")) << held.out;
  EXPECT_NE(held.out.find("nothing changed"), std::string::npos) << held.out;

  const auto shown = get("/v1/sessions/2");
  EXPECT_EQ(shown["kind"], "check");
  EXPECT_EQ(shown["state"], "done");
  EXPECT_EQ(shown["holds"], true);
  EXPECT_EQ(shown["outcome"]["kind"], "holds");
  EXPECT_GE(shown["touches"], 6);
  EXPECT_LE(shown["touches"], 8);
  const std::string events = shown["events"].dump();
  EXPECT_NE(events.find("check against session 1 and 0 checks before it: holds"), std::string::npos)
      << events;
  EXPECT_EQ(http_request(fixture.socket(), "GET", "/v1/sessions/2/calibration.json").status, 404);
  RecordProperty("robot_s", std::to_string(shown["times"]["total_s"].get<double>()));

  EXPECT_NE(fixture.cellcal({"history", "--drift"}).out.find("not enough checks: 1 of 5"),
            std::string::npos);
  for (int more = 0; more < 4; ++more)
    ASSERT_EQ(fixture.cellcal({"check"}).status, 0) << fixture.log();
  const Outcome in_control = fixture.cellcal({"history", "--drift"});
  EXPECT_EQ(in_control.status, 0) << in_control.err;
  EXPECT_NE(in_control.out.find("\nin control: TCP 0.0"), std::string::npos) << in_control.out;
  EXPECT_EQ(get("/v1/drift")["checks"]["points"][0]["temperature_c"], 21.5);

  restart("tool_shift_mm = [0.2, -0.2, 0.1]\n");
  const Outcome knocked = fixture.cellcal({"check", "--json"});
  ASSERT_EQ(knocked.status, 3) << knocked.err << knocked.out << fixture.log();
  const auto result = nlohmann::json::parse(knocked.out);
  EXPECT_EQ(result["format"], "cellcal.check/1");
  EXPECT_EQ(result["holds"], false);
  EXPECT_EQ(result["changed"], "tool");
  const double u = result["tcp_shift_mm"]["u_length"];
  EXPECT_NEAR(result["tcp_shift_mm"]["length"].get<double>(), 0.3, 1.5 * u);
  EXPECT_EQ(get("/v1/sessions/7/check.json")["changed"], "tool");
  for (const auto& said : {get("/v1/status"), get("/v1/sessions/7")}) {
    EXPECT_EQ(said["outcome"]["kind"], "does_not_hold") << said;
    EXPECT_EQ(said["outcome"]["cause"], "tool") << said;
    EXPECT_EQ(said["outcome"]["remedy"], "re_measure_tcp") << said;
    EXPECT_NEAR(said["outcome"]["tcp_shift_mm"]["length"].get<double>(), 0.3, 1.5 * u) << said;
  }
  EXPECT_TRUE(get("/v1/status")["publish"].is_null()) << "a check publishes nothing";
  EXPECT_NE(
      fixture.cellcal({"status"}).out.find("outcome: calibration does not hold: TCP shift 0."),
      std::string::npos);
  EXPECT_NE(get("/v1/sessions/7")["events"].dump().find("and 4 checks before it: does not hold"),
            std::string::npos);
  const Outcome drift = fixture.cellcal({"history", "--drift", "--json"});
  EXPECT_EQ(drift.status, 3) << drift.err << drift.out;
  const auto chart = nlohmann::json::parse(drift.out);
  EXPECT_EQ(chart["state"], "alarms") << drift.out;
  EXPECT_EQ(chart["advice"], "re_measure_tcp") << drift.out;
  EXPECT_EQ(chart["course"]["since"], 7) << drift.out;
  const Outcome history = fixture.cellcal({"history"});
  EXPECT_NE(history.out.find("  does not hold  "), std::string::npos) << history.out;
  EXPECT_NE(history.out.find("  holds  "), std::string::npos) << history.out;
  EXPECT_NE(history.out.find("  published  "), std::string::npos) << history.out;

  // The spheres are missed: that is a result, too, and no touch is dropped.
  restart("tool_shift_mm = [0.0, 0.0, -14.0]\n");
  const Outcome gone = fixture.cellcal({"check", "--calibration", "1", "--json"});
  ASSERT_EQ(gone.status, 3) << gone.err << gone.out << fixture.log();
  const auto missing = nlohmann::json::parse(gone.out);
  EXPECT_FALSE(missing["not_found"].empty()) << gone.out;
}

TEST_F(ACheck, AlarmsEverywhereWhereEveryCheckSinceTheCalibrationFails) {
  fixture.start();
  calibrate();
  restart("tool_shift_mm = [0.8, -0.5, 0.3]\n");
  for (int k = 2; k <= 4; ++k) {
    EXPECT_EQ(fixture.cellcal({"check"}).status, 3) << fixture.log();
    const Outcome drift = fixture.cellcal({"history", "--drift"});
    EXPECT_EQ(drift.status, 3) << drift.out;
    EXPECT_NE(drift.out.find("alarm: check " + std::to_string(k)), std::string::npos) << drift.out;
    const auto chart = get("/v1/drift")["checks"];
    EXPECT_EQ(chart["state"], "alarms") << chart;
    EXPECT_EQ(chart["advice"], "re_measure_tcp") << chart;
    EXPECT_EQ(chart["not_held"]["since"], 2) << chart;
    EXPECT_EQ(chart["counted"], 0) << "no reference is made of what does not hold";
    const std::string metrics = http_request(fixture.socket(), "GET", "/metrics").body;
    EXPECT_NE(metrics.find("cellcal_drift_state{state=\"in_control\"} 0\n"), std::string::npos)
        << metrics;
    EXPECT_NE(metrics.find("cellcal_drift_state{state=\"alarms\"} 1\n"), std::string::npos);
    EXPECT_NE(metrics.find("cellcal_session_outcome{outcome=\"does_not_hold\"} 1\n"),
              std::string::npos);
  }
}

TEST_F(ACheck, IsRefusedWithTheWayOutWhereATouchOfTheCalibrationInUseIsAnother) {
  fixture.start();
  calibrate();
  calibrate();
  fixture.daemon.reset();
  {
    Database journal(fixture.dir / "state/journal.db");
    journal.execute(
        "UPDATE touch SET joint_rad=(SELECT joint_rad FROM touch WHERE session=2 AND number=4) WHERE "
        "session=2 AND number=3");
  }
  restart("");
  EXPECT_EQ(get("/v1/sessions")[0]["state"], "damaged");
  const auto refused = [&](const std::vector<std::string>& command) {
    const Outcome outcome = fixture.cellcal(command);
    EXPECT_EQ(outcome.status, 1) << command[0] << outcome.out;
    EXPECT_NE(outcome.err.find("the calibration in use, of session 2: "), std::string::npos)
        << command[0] << outcome.err;
    EXPECT_NE(outcome.err.find("'cellcal activate ID --reason WHY'"), std::string::npos)
        << command[0] << outcome.err;
  };
  refused({"check"});
  refused({"run", "--cell", CELLCAL_DEMO_CELL, "--update"});
  refused({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "8"});
  refused({"history", "--drift"});
  EXPECT_EQ(http_request(fixture.socket(), "GET", "/metrics").status, 200);
  EXPECT_NE(fixture.cellcal({"versions"}).out.find("damaged"), std::string::npos);
  EXPECT_EQ(get("/v1/sessions").size(), 2u) << "nothing began";
  EXPECT_EQ(fixture.cellcal({"activate", "--back", "--reason", "damaged"}).status, 0);
  EXPECT_EQ(fixture.cellcal({"check"}).status, 0) << fixture.log();
}

TEST_F(ACheck, IsRefusedWhereThereIsNothingToCheck) {
  fixture.start();
  fixture.refuse({{"kind", "check"}}, 422, "no published calibration: nothing to check");
  fixture.refuse({{"kind", "check"}, {"calibration", 9}}, 422,
                 "session 9 has no published calibration");
  fixture.refuse({{"kind", "check"}, {"cell", "/other.toml"}}, 422, "of /other.toml");
  fixture.refuse({{"kind", "check"}, {"goal_mm", 0.2}}, 422, "a check has its own touches");
  fixture.refuse({{"kind", "check"}, {"calibration", "one"}}, 400, "wrong type");
  fixture.refuse({{"kind", "check"}, {"temperature_c", "warm"}}, 400, "wrong type");
  fixture.refuse({{"kind", "check"}, {"temperature_c", 300}}, 422,
                 "temperature_c must be -40 to 80");
  fixture.refuse({{"cell", CELLCAL_DEMO_CELL}, {"temperature_c", 20}}, 422, "applies to a check");
  fixture.refuse({{"cell", CELLCAL_DEMO_CELL}, {"calibration", 1}}, 422, "applies to a check");
  EXPECT_EQ(fixture.status()["session"], 0);
}

}  // namespace
}  // namespace cellcal::daemon::testing
