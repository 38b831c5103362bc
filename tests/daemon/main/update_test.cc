// A cell with a knocked tool is recalibrated by a few touches based on its last calibration, from the command line.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "changed_cell.h"

namespace cellcal::daemon::testing {
namespace {

class AnUpdate : public AChangedCell {
 protected:
  /// By another spelling of the file's path than that of the calibration.
  Outcome update() {
    const std::filesystem::path cell = CELLCAL_DEMO_CELL;
    return fixture.cellcal(
        {"run", "--cell", cell.parent_path() / "." / cell.filename(), "--update"});
  }
};

TEST_F(AnUpdate, BringsBackACellWhoseToolWasKnockedAndSaysWhereThereIsNothingToDo) {
  fixture.start();
  const Outcome calibrated =
      fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "40", "--check", "0"});
  ASSERT_EQ(calibrated.status, 0) << calibrated.err << calibrated.out << fixture.log();

  restart("tool_shift_mm = [1.0, -0.8, 0.5]\n");
  const Outcome mended = update();
  ASSERT_EQ(mended.status, 0) << mended.err << mended.out << fixture.log();
  EXPECT_NE(mended.out.find("tool shifted by 1.3"), std::string::npos) << mended.out;
  const auto shown = get("/v1/sessions/2");
  EXPECT_EQ(shown["kind"], "calibrate");
  EXPECT_GE(shown["touches"], 6);
  EXPECT_LE(shown["touches"], 15);
  RecordProperty("robot_s", std::to_string(shown["times"]["total_s"].get<double>()));
  const auto calibration = get("/v1/sessions/2/calibration.json");
  EXPECT_EQ(calibration["verdict"]["publish"], true);
  EXPECT_EQ(calibration["update"]["outcome"], "updated");
  EXPECT_TRUE(calibration["update"]["stands_on"].get<std::string>().starts_with("session 1 of "));
  const auto& change = calibration["update"]["explanations"][0];
  EXPECT_EQ(change["kind"], "tool");
  EXPECT_NEAR(std::hypot(change["shift_mm"][0].get<double>(), change["shift_mm"][1].get<double>(),
                         change["shift_mm"][2].get<double>()),
              1.375, 0.15);

  const Outcome replayed = fixture.cellcal({"replay", "2"});
  EXPECT_EQ(replayed.status, 0) << replayed.err;
  EXPECT_NE(replayed.out.find("same to the bit"), std::string::npos) << replayed.out;

  const Outcome status = fixture.cellcal({"status"});
  EXPECT_NE(status.out.find("\ncalibration: an update of session 1 of "), std::string::npos)
      << status.out;
  EXPECT_NE(status.out.find("tool shifted by 1.3"), std::string::npos) << status.out;

  // It is now the cell's calibration, and nothing remains to be done.
  const Outcome held = fixture.cellcal({"check"});
  EXPECT_EQ(held.status, 0) << held.err << held.out;
  const Outcome nothing =
      fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--update", "--or-full"});
  EXPECT_EQ(nothing.status, 3) << nothing.err << nothing.out;
  EXPECT_NE((nothing.err + nothing.out).find("nothing to update"), std::string::npos)
      << nothing.err << nothing.out;
  EXPECT_NE(nothing.out.find("verdict: nothing changed"), std::string::npos) << nothing.out;
  EXPECT_EQ(nothing.out.find("NOT publishable"), std::string::npos) << nothing.out;
  EXPECT_EQ(get("/v1/sessions/4/calibration.json")["update"]["outcome"], "nothing_changed");
  EXPECT_EQ(get("/v1/sessions/4")["outcome"]["kind"], "nothing_changed");
  EXPECT_EQ(get("/v1/sessions/4")["outcome"]["good"], true);
  const std::string metrics = http_request(fixture.socket(), "GET", "/metrics").body;
  EXPECT_NE(metrics.find("\ncellcal_calibration_published 1\n"), std::string::npos) << metrics;

  // If spheres are missed a full session is required; it can be replayed nevertheless.
  restart("tool_shift_mm = [0.0, 0.0, -14.0]\n");
  const Outcome lost =
      fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--update", "--or-full"});
  EXPECT_EQ(lost.status, 3) << lost.err << lost.out << fixture.log();
  EXPECT_NE((lost.err + lost.out).find("run a full session"), std::string::npos)
      << lost.err << lost.out;
  EXPECT_EQ(get("/v1/sessions/5/calibration.json")["update"]["outcome"], "not_found");
  EXPECT_EQ(fixture.cellcal({"replay", "5"}).status, 0);

  // A withheld update continues with a full session if requested; not if nothing changed.
  restart("tool_shift_mm = [1.0, 0.0, 0.0]\ngeometry_scale = 1.3\n");
  const Outcome full = fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--update", "--or-full",
                                        "--touches", "20", "--check", "0", "--accept-change"});
  EXPECT_NE(full.err.find("A full session begins now"), std::string::npos) << full.err << full.out;
  EXPECT_EQ(get("/v1/sessions/6/calibration.json")["verdict"]["publish"], false);
  EXPECT_EQ(get("/v1/sessions/7")["planned"], 20) << full.err << full.out << fixture.log();
}

TEST_F(AnUpdate, IsRefusedWhereThereIsNothingToStandOnOrMoreIsAskedFor) {
  fixture.start();
  const std::string cell = CELLCAL_DEMO_CELL;
  fixture.refuse({{"cell", cell}, {"update", true}}, 422,
                 "nothing to update. Run a full session first");
  fixture.refuse({{"cell", cell}, {"update", true}, {"goal_mm", 0.2}}, 422,
                 "an update has its own touches");
  fixture.refuse({{"cell", cell}, {"update", true}, {"find", true}}, 422,
                 "an update has its own touches");
  fixture.refuse({{"resume", true}, {"update", true}}, 422, "an update is not resumed");
  fixture.refuse({{"kind", "check"}, {"update", true}}, 422, "applies to a calibration");
  fixture.refuse({{"cell", cell}, {"update", "yes"}}, 400, "wrong type");
  EXPECT_EQ(fixture.status()["session"], 0);
}

}  // namespace
}  // namespace cellcal::daemon::testing
