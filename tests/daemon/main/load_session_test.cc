// Sessions with a load of the cell file in the tool: the daemon as a process, its emulated cell on virtual time.

#include <gtest/gtest.h>

#include <algorithm>

#include "calib/files/files.h"
#include "changed_cell.h"

namespace cellcal::daemon::testing {
namespace {

class ASessionWithALoad : public AChangedCell {
 protected:
  ASessionWithALoad() {
    // The demonstration's cell; its arm bends under load.
    std::string robot = content(std::string(CELLCAL_DEMO_FOLDER) + "/kr5_worn.toml");
    std::ofstream(fixture.dir / "kr5_worn.toml") << robot;
    std::ofstream(cell) << content(std::string(CELLCAL_DEMO_FOLDER) + "/cell.toml")
                        << "\n[[load]]\nid = \"part\"\nmass_kg = 3.0\ncom_mm = [0.0, 0.0, 90.0]\n";
    restart("compliance_sigma_rad_per_nm = 2e-6\n");
  }

  Outcome run(std::vector<std::string> more) const {
    std::vector<std::string> all{"run", "--cell", cell, "--touches", "40", "--check", "8"};
    all.insert(all.end(), more.begin(), more.end());
    return fixture.cellcal(all);
  }
  std::vector<calib::Touch> touches(int session) const {
    return calib::load_touches(
        (fixture.dir.path() / "state/sessions" / std::to_string(session) / "touches.csv").string(),
        calib::load_cell(cell));
  }

  std::string cell = fixture.dir / "cell.toml";
};

TEST_F(ASessionWithALoad, IsIdentifiedWithItAndStatesItEverywhere) {
  const Outcome outcome = run({"--load", "part"});
  ASSERT_EQ(outcome.status, 0) << outcome.err << outcome.out << fixture.log();
  const auto made = touches(1);
  EXPECT_EQ(made.size(), 48u);
  EXPECT_TRUE(std::ranges::all_of(made, [](const auto& t) { return t.load == "part"; }));
  const auto folder = fixture.dir.path() / "state/sessions/1";
  const auto json = nlohmann::json::parse(content(folder / "calibration.json"));
  EXPECT_LT(json.at("residuals").at("check").at("mean_mm").get<double>(), 0.1);
  EXPECT_NE(content(folder / "report.html").find("oads held in the touches: part (3 kg)"),
            std::string::npos);
  EXPECT_EQ(get("/v1/status")["load"], "part");
  EXPECT_EQ(get("/v1/sessions/1")["load"], "part");
  EXPECT_NE(fixture.cellcal({"history"}).out.find(", with load part"), std::string::npos);
  EXPECT_NE(fixture.cellcal({"status"}).out.find("done, with load part"), std::string::npos);

  const Outcome held = fixture.cellcal({"check", "--load", "part"});
  EXPECT_EQ(held.status, 0) << held.err << held.out << fixture.log();
  EXPECT_EQ(touches(2).front().load, "part");
  // References are checks with the same load.
  EXPECT_EQ(fixture.cellcal({"check"}).status, 0) << fixture.log();
  EXPECT_NE(get("/v1/sessions/3")["events"].dump().find("and 0 checks before it"),
            std::string::npos);
  EXPECT_EQ(get("/v1/sessions/3")["load"], nullptr);

  // Touches in both states are used together.
  ASSERT_EQ(run({"--seed", "2"}).status, 0) << fixture.log();
  const std::string together = fixture.dir / "together.csv";
  auto all = touches(4);
  all.insert(all.end(), made.begin(), made.end());
  std::ofstream(together) << calib::format_touches(all, calib::load_cell(cell).robot);
  const std::string result = fixture.dir / "together.json";
  const Outcome identified =
      run_program({CELLCAL, "identify", "--cell", cell, "--touches", together, "--output", result});
  EXPECT_EQ(identified.status, 0) << identified.err;
}

TEST_F(ASessionWithALoad, KeepsItWhenItIsResumed) {
  fixture.begin({{"cell", cell}, {"touches", 24}, {"check", 4}, {"load", "part"}});
  fixture.wait_for_touches(2);
  ASSERT_EQ(fixture.cellcal({"abort"}).status, 0);
  const Outcome other = fixture.cellcal({"run", "--resume", "--load", "part"});
  EXPECT_NE(other.status, 0);
  EXPECT_NE(other.err.find("keeps its load"), std::string::npos) << other.err;
  const Outcome outcome = fixture.cellcal({"run", "--resume"});
  EXPECT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err;
  for (const calib::Touch& touch : touches(1)) EXPECT_EQ(touch.load, "part");
}

TEST_F(ASessionWithALoad, ThatTheCellLacksIsRefusedBeforeAnythingMoves) {
  const Outcome outcome = run({"--load", "prat"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("load prat: the cell has no such [[load]]; it has: part"),
            std::string::npos)
      << outcome.err;
  EXPECT_EQ(get("/v1/status")["session"], 0);
}

}  // namespace
}  // namespace cellcal::daemon::testing
