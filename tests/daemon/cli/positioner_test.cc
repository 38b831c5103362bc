// Commands for an arm with a positioner: planned, identified, predicted, exported.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "calib/files/files.h"
#include "tests/daemon/cli/content.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

constexpr const char* kCellWithPositioner = R"(format = "cellcal.cell/1"
robot = "positioner.toml"

[tool]
xyz_mm = [60.0, 50.0, 410.0]
mass_kg = 2.0

[[target]]
id = "T1"
kind = "sphere"
on = "E2"
diameter_mm = 40.0
centre_mm = [220.0, 0.0, 100.0]
centre_sigma_mm = 5.0

[[target]]
id = "T2"
kind = "sphere"
on = "E2"
diameter_mm = 40.0
centre_mm = [-120.0, 200.0, 160.0]
centre_sigma_mm = 5.0

[[target]]
id = "S1"
kind = "sphere"
diameter_mm = 60.0
centre_mm = [950.0, -750.0, 350.0]
centre_sigma_mm = 5.0

[touch]
sigma_mm = 0.03
radius_offset_sigma_mm = 0.1
)";

struct PositionerFiles {
  TemporaryDirectory dir;
  std::string cell = dir / "cell.toml", plan = dir / "plan.csv", result = dir / "c.json";

  PositionerFiles() {
    std::filesystem::copy_file(CELLCAL_POSITIONER_ROBOT, dir / "positioner.toml");
    std::ofstream(cell) << kCellWithPositioner;
  }
  Outcome planned(const std::vector<std::string>& more) const {
    std::vector<std::string> all = {CELLCAL,     "plan", "--cell",  cell,
                                    "--touches", "24",   "--check", "4"};
    all.insert(all.end(), more.begin(), more.end());
    return run_program(all);
  }
};

TEST(APositioner, OfARobotFileStaysWhereMachineDataHaveNone) {
  const PositionerFiles files;
  std::ofstream(files.dir / "$machine.dat") << "$SOFTP_END[1]=170.0\n";
  const Outcome made =
      run_program({CELLCAL, "import-robot", "--robot", files.dir / "positioner.toml",
                   "--machine-data", files.dir / "$machine.dat", "-o", files.dir / "made.toml"});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(calib::load_robot(files.dir / "made.toml").positioner.size(), 2u);
}

void expect_positioner_refused(const Outcome& outcome) {
  EXPECT_EQ(outcome.status, 1) << outcome.out;
  EXPECT_NE(outcome.err.find("positioner (E1)"), std::string::npos) << outcome.err;
}

/// Planned touches, and their calibration.
struct PositionerResult : PositionerFiles {
  Outcome identified;
  PositionerResult() {
    const Outcome made = planned({"-o", plan});
    EXPECT_EQ(made.status, 0) << made.err;
    identified =
        run_program({CELLCAL, "identify", "--cell", cell, "--touches", plan, "-o", result});
    EXPECT_TRUE(identified.status == 0 || identified.status == 3) << identified.err;
  }
  Outcome run(std::vector<std::string> words) const {
    words.insert(words.begin(), CELLCAL);
    words.insert(words.end(), {"--calibration", result, "--withheld"});
    return run_program(words);
  }
  std::string file(const std::string& name, const std::string& text) const {
    std::ofstream(dir / name) << text;
    return dir / name;
  }
};

const PositionerResult& made() {
  static const PositionerResult one;
  return one;
}

/// Numbers of the rows after the header.
std::vector<std::vector<double>> rows_of(const std::string& csv) {
  std::vector<std::vector<double>> rows;
  std::istringstream in(csv);
  std::string line;
  std::getline(in, line);
  while (std::getline(in, line)) {
    std::istringstream fields(line);
    rows.emplace_back();
    for (std::string field; std::getline(fields, field, ',');)
      rows.back().push_back(std::stod(field));
  }
  return rows;
}

constexpr const char* kJointsOnTable =
    "A1,A2,A3,A4,A5,A6,E1,E2\n5,-75,95,10,45,-20,20,-60\n-8,-70,90,0,50,15,-35,120\n";

TEST(APositioner, IsPlannedAndIdentifiedAndTheResultStatesItsAxes) {
  ASSERT_EQ(calib::load_touches(made().plan, calib::load_cell(made().cell)).size(), 28u);
  EXPECT_NE(made().identified.out.find("\nE2: X "), std::string::npos) << made().identified.out;
  const auto c = nlohmann::json::parse(content(made().result));
  ASSERT_EQ(c.at("positioner").size(), 2u);
  EXPECT_EQ(c["positioner"][1]["axis"], "E2");
  EXPECT_GT(c["positioner"][1]["place_u95_mm"], 0.0);
  EXPECT_EQ(c["positioner"][0]["touched_deg"].size(), 2u);
}

TEST(APositioner, HasTipsOnItsTablePredictedWithErrorAndBound) {
  const std::string joints = made().file("joints.csv", kJointsOnTable);
  const Outcome table = made().run({"predict", "--joints", joints, "--on", "E2"});
  ASSERT_EQ(table.status, 0) << table.err;
  EXPECT_TRUE(table.out.starts_with("x_mm,y_mm,z_mm,a_deg,b_deg,c_deg,u95_mm,dx_mm,dy_mm,dz_mm\n"));
  const Outcome base = made().run({"predict", "--joints", joints});
  ASSERT_EQ(base.status, 0) << base.err;
  EXPECT_TRUE(base.out.starts_with("x_mm,y_mm,z_mm,a_deg,b_deg,c_deg,u95_mm\n"));
  const Outcome nominal = made().run({"predict", "--joints", joints, "--on", "E2", "--nominal"});
  ASSERT_EQ(nominal.status, 0) << nominal.err;
  const auto told = rows_of(table.out), drawn = rows_of(nominal.out);
  ASSERT_EQ(told.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_GT(told[i][6], 0.0);
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(told[i][k] - drawn[i][k], told[i][7 + k], 1e-8);
  }
  const Outcome json = made().run({"predict", "--joints", joints, "--on", "E2", "--json"});
  EXPECT_NEAR(nlohmann::json::parse(json.out)[1]["dz_mm"].get<double>(), told[1][9], 1e-8);
}

TEST(APositioner, HasPosesOnItsTableCorrectedToWhatPredictTells) {
  const std::string poses = made().file(
      "poses.csv",
      "x_mm,y_mm,z_mm,a_deg,b_deg,c_deg,E1,E2\n100,50,120,0,0,180,10,30\n-80,60,90,20,5,175,-25,-100\n");
  const std::string joints = made().dir / "corrected.csv";
  const Outcome corrected = made().run({"correct", "--poses", poses, "--on", "E2", "-o", joints});
  ASSERT_EQ(corrected.status, 0) << corrected.err;
  EXPECT_TRUE(content(joints).starts_with("A1,A2,A3,A4,A5,A6,E1,E2\n"));
  const Outcome back = made().run({"predict", "--joints", joints, "--on", "E2"});
  ASSERT_EQ(back.status, 0) << back.err;
  const auto told = rows_of(back.out), asked = rows_of(content(poses));
  ASSERT_EQ(told.size(), asked.size());
  for (std::size_t i = 0; i < told.size(); ++i)
    for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(told[i][k], asked[i][k], 1e-6);
}

TEST(APositioner, IsAskedForByAnAxisThatIsThereWithItsAngles) {
  const std::string joints = made().file("joints.csv", kJointsOnTable),
                    plain = made().file("plain.csv", "A1,A2,A3,A4,A5,A6\n0,-90,90,0,0,0\n"),
                    far = made().file("far.csv",
                                      "A1,A2,A3,A4,A5,A6,E1,E2\n0,-90,90,0,0,0,0,0\n"
                                      "0,-90,90,0,0,0,59.9,0\n");
  const auto said = [&](const std::vector<std::string>& words, int status) {
    const Outcome outcome = made().run(words);
    EXPECT_EQ(outcome.status, status) << outcome.err;
    return outcome.err;
  };
  EXPECT_NE(said({"predict", "--joints", joints, "--on", "E3"}, 1).find("it has: E1, E2"),
            std::string::npos);
  EXPECT_NE(said({"predict", "--joints", plain, "--on", "E2"}, 1).find("no column E1, E2"),
            std::string::npos);
  const auto range =
      nlohmann::json::parse(content(made().result))["positioner"][0]["touched_deg"][1];
  if (range.get<double>() < 59.9) {
    EXPECT_NE(said({"predict", "--joints", far, "--on", "E2"}, 0)
                  .find("1 of 2 poses, the first in row 2 with E1 at 59.900 deg"),
              std::string::npos);
  }
}

TEST(APositioner, IsExportedAsASecondChainAndForMachineData) {
  const auto exported = [&](const std::string& as) {
    Outcome outcome = made().run({"export-robot", "--as", as});
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome;
  };
  EXPECT_NE(exported("urdf").out.find("<joint name=\"joint_e2\" type=\"revolute\">"),
            std::string::npos);
  EXPECT_NE(exported("yaml").out.find("joint_e1:"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(exported("json").out).at("positioner").size(), 2u);
  const Outcome dh = exported("dh");
  EXPECT_EQ(dh.out.find("E1"), std::string::npos);
  EXPECT_NE(dh.err.find("E2 of the positioner: not in a table of the arm"), std::string::npos)
      << dh.err;
  const std::string kuka = exported("kuka").out;
  for (const char* line : {"\n$ETn_TA1KR={X 10", "\n$ETn_TA2A1={", "\n$ETn_TFLA3={X 0.0000,",
                           "; MACHINE_DEF[n].ROOT={"})
    EXPECT_NE(kuka.find(line), std::string::npos) << line << "\n" << kuka;
}

TEST(APositioner, IsDrawnWithItsPlan) {
  const PositionerFiles files;
  const Outcome drawn = files.planned({"--picture", files.dir / "plan.svg", "-o", files.plan});
  ASSERT_EQ(drawn.status, 0) << drawn.err;
  EXPECT_NE(content(files.dir / "plan.svg").find(">E2</text>"), std::string::npos);
}

TEST(APositioner, HasItsAnglesInThePlansJson) {
  const PositionerFiles files;
  const Outcome made = files.planned({"--json"});
  ASSERT_EQ(made.status, 0) << made.err;
  for (const auto& touch : nlohmann::json::parse(made.out).at("touches")) {
    EXPECT_EQ(touch.at("joints_deg").size(), 6u);
    EXPECT_LE(std::abs(touch.at("positioner_deg").at("E1").get<double>()), 60.0);
    EXPECT_LE(std::abs(touch.at("positioner_deg").at("E2").get<double>()), 185.0);
  }
}

TEST(APositioner, IsRefusedByNameWhereItCannotBeCarriedYet) {
  const PositionerFiles files;
  expect_positioner_refused(files.planned({"--suggest-spheres", "4"}));
  expect_positioner_refused(
      run_program({CELLCAL, "new-cell", "-o", files.dir / "new.toml", "--robot",
                   files.dir / "positioner.toml", "--tool", "0,0,250,0,0,0"}));
}

}  // namespace
}  // namespace cellcal::daemon::testing
