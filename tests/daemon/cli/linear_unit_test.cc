// Commands with an arm on a linear unit: planned, identified, predicted, exported, corrected; refused by all others.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "tests/calib/random_calibration.h"
#include "tests/calib/track_cell.h"
#include "tests/daemon/cli/content.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

constexpr const char* kCellOnTrack = R"(format = "cellcal.cell/1"
robot = "track.toml"

[tool]
xyz_mm = [60.0, 50.0, 410.0]
mass_kg = 2.0

[[target]]
id = "S1"
kind = "sphere"
diameter_mm = 60.0
centre_mm = [1200.0, 400.0, 300.0]
centre_sigma_mm = 5.0

[[target]]
id = "S2"
kind = "sphere"
diameter_mm = 60.0
centre_mm = [1000.0, 1500.0, 700.0]
centre_sigma_mm = 5.0

[[target]]
id = "S3"
kind = "sphere"
diameter_mm = 60.0
centre_mm = [1250.0, 2600.0, 350.0]
centre_sigma_mm = 5.0

[touch]
sigma_mm = 0.03
radius_offset_sigma_mm = 0.1
)";

/// An arm with these lengths, and E1 along y of its foot.
constexpr const char* kMachineOnTrack = R"($TIRORO={X 0.0,Y 0.0,Z 400.0,A 0.0,B 0.0,C 0.0}
$LENGTH_A=180.0
$LENGTH_B=600.0
$TX3P3={X 620.0,Y 0.0,Z 40.0,A 0.0,B 90.0,C 0.0}
$TFLWP={X 0.0,Y 0.0,Z 80.0,A 0.0,B 0.0,C 0.0}
$EX_AX_NUM=1
$AXIS_TYPE[7]=1
$SOFTN_END[7]=0.0
$SOFTP_END[7]=3000.0
$EX_KIN={ET1 #ERSYS,ET2 #NONE,ET3 #NONE,ET4 #NONE,ET5 #NONE,ET6 #NONE}
$ET1_AX={TR_A1 #E1,TR_A2 #NONE,TR_A3 #NONE}
$ET1_TA1KR={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C -90.0}
)";

std::string machine_on_track(const std::string& flange) {
  std::string text = kMachineOnTrack + flange;
  for (int axis = 1; axis <= 6; ++axis)
    text += fmt::format("$SOFTN_END[{0}]=-100.0\n$SOFTP_END[{0}]=120.0\n", axis);
  return text;
}

TEST(ImportRobotWithMachineData, WritesTheLinearUnitThatCarriesTheArmOrNamesWhatIsMissing) {
  TemporaryDirectory dir;
  const std::string robot = dir / "r.toml";
  std::ofstream(dir / "$machine.dat")
      << machine_on_track("$ET1_TFLA3={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 90.0}\n");
  const Outcome whole =
      run_program({CELLCAL, "import-robot", "--machine-data", dir.path(), "-o", robot});
  ASSERT_EQ(whole.status, 0) << whole.err;
  EXPECT_NE(whole.err.find("linear unit E1: 0 to 3000 mm along [0, 1, 0]"), std::string::npos)
      << whole.err;
  EXPECT_NE(whole.err.find("add max_speed_mm_s"), std::string::npos) << whole.err;
  const calib::Robot read = calib::load_robot(robot);
  ASSERT_EQ(read.joints.size(), 7u);
  EXPECT_EQ(read.joints[0].guide->along, Eigen::Vector3d(0, 1, 0));

  std::ofstream(dir / "$machine.dat") << machine_on_track("");
  const Outcome part =
      run_program({CELLCAL, "import-robot", "--machine-data", dir.path(), "-o", robot});
  ASSERT_EQ(part.status, 0) << part.err;
  EXPECT_NE(part.err.find("warning: $ET1_TFLA3: not in the given machine data"), std::string::npos)
      << part.err;
  EXPECT_EQ(calib::load_robot(robot).joints.size(), 6u);
}

/// Its files, and a robot file of another arm on a unit of its own.
struct ControllersTrack {
  TemporaryDirectory dir;
  std::string robot = dir / "track.toml", cell = dir / "cell.toml";
  ControllersTrack() {
    std::filesystem::copy_file(CELLCAL_TRACK_ROBOT, robot);
    std::ofstream(cell) << kCellOnTrack;
    std::filesystem::create_directory(dir / "controller");
    std::ofstream(dir / "controller/$machine.dat")
        << machine_on_track("$ET1_TFLA3={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 90.0}\n");
    std::ofstream(dir / "controller/$config.dat")
        << "TOOL_DATA[3]={X 0.0,Y 0.0,Z 250.0,A 0.0,B 0.0,C 0.0}\n";
  }
  Outcome imported(const std::vector<std::string>& more) const {
    std::vector<std::string> all = {CELLCAL, "import-robot", "--machine-data", dir / "controller"};
    all.insert(all.end(), more.begin(), more.end());
    return run_program(all);
  }
};

TEST(ImportRobotWithMachineData, ComparesTheArmOfARobotFileBehindItsLinearUnitWhichStays) {
  const ControllersTrack files;
  const Outcome made = files.imported({"--robot", files.robot, "-o", files.dir / "made.toml"});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_NE(
      made.err.find(
          "$LENGTH_A 180.000 mm in the controller, 260.000 mm in the robot file (a_mm of A1)"),
      std::string::npos)
      << made.err;
  EXPECT_NE(made.err.find("That of the robot file stays"), std::string::npos) << made.err;
  const calib::Robot before = calib::load_robot(files.robot),
                     after = calib::load_robot(files.dir / "made.toml");
  ASSERT_EQ(after.joints.size(), 7u);
  EXPECT_EQ(after.joints[0].max_speed_rad_s, before.joints[0].max_speed_rad_s);
  EXPECT_EQ(after.joints[0].max_rad, before.joints[0].max_rad);
  for (std::size_t i = 1; i < 7; ++i)
    EXPECT_NEAR(after.joints[i].max_rad * calib::kDegPerRad, 120.0, 1e-9) << i;
}

TEST(ImportRobotWithMachineData, SetsTheToolOfACellOnALinearUnitAndOfAnArmThatCannotBeCompared) {
  const ControllersTrack files;
  const auto put = [&] { return files.imported({"--cell", files.cell, "--tool", "3"}); };
  const Outcome compared = put();
  ASSERT_EQ(compared.status, 0) << compared.err;
  EXPECT_NE(compared.err.find("$LENGTH_A 180.000 mm"), std::string::npos) << compared.err;
  EXPECT_EQ(calib::load_cell(files.cell).tool.tcp.translation().z(), 0.25);
  std::string near = kCellOnTrack;  // the arm of the next file reaches 0.8 m
  for (const auto& [far, at] : {std::pair("1200.0, 400.0, 300.0", "500.0, 0.0, 200.0"),
                                std::pair("1000.0, 1500.0, 700.0", "350.0, 350.0, 300.0"),
                                std::pair("1250.0, 2600.0, 350.0", "350.0, -350.0, 200.0")})
    near.replace(near.find(far), std::strlen(far), at);
  std::ofstream(files.cell) << near;
  std::filesystem::copy_file(CELLCAL_ROBOTS_FOLDER "/iiwa14.toml", files.robot,
                             std::filesystem::copy_options::overwrite_existing);
  const Outcome other = put();
  ASSERT_EQ(other.status, 0) << other.err;
  EXPECT_NE(other.err.find(
                "has 7 joints; machine data of a six-axis arm are read. Lengths are not compared"),
            std::string::npos)
      << other.err;
  EXPECT_EQ(calib::load_cell(files.cell).tool.tcp.translation().z(), 0.25);
}

struct TrackFiles {
  TemporaryDirectory dir;
  std::string cell = dir / "cell.toml", plan = dir / "plan.csv", result = dir / "c.json";

  TrackFiles() {
    std::filesystem::copy_file(CELLCAL_TRACK_ROBOT, dir / "track.toml");
    std::ofstream(cell) << kCellOnTrack;
  }
  Outcome planned(const std::vector<std::string>& more) const {
    std::vector<std::string> all = {CELLCAL,     "plan", "--cell",  cell,
                                    "--touches", "24",   "--check", "4"};
    all.insert(all.end(), more.begin(), more.end());
    return run_program(all);
  }
  Outcome identified() const {
    return run_program({CELLCAL, "identify", "--cell", cell, "--touches", plan, "-o", result});
  }
};

void expect_refused(const Outcome& outcome) {
  EXPECT_EQ(outcome.status, 1) << outcome.out;
  EXPECT_NE(outcome.err.find("linear unit (E1)"), std::string::npos) << outcome.err;
}

TEST(ALinearUnit, IsPlannedIdentifiedAndPredictedInMillimetres) {
  const TrackFiles files;
  const Outcome made = files.planned({"-o", files.plan});
  ASSERT_EQ(made.status, 0) << made.err;
  const calib::Cell cell = calib::load_cell(files.cell);
  const auto touches = calib::load_touches(files.plan, cell);
  ASSERT_EQ(touches.size(), 28u);
  const auto [least, most] = std::ranges::minmax(
      touches, {}, [](const calib::Touch& touch) { return touch.joint_rad[0]; });
  EXPECT_GT(most.joint_rad[0] - least.joint_rad[0], 1.5);
  EXPECT_EQ(content(files.plan).find("correction_limit_deg"), std::string::npos);
  const Outcome identified = files.identified();
  ASSERT_TRUE(identified.status == 0 || identified.status == 3) << identified.err;
  std::ofstream(files.dir / "joints.csv")
      << "E1 [mm],A1,A2,A3,A4,A5,A6\n0,0,-70,80,0,60,0\n1000,0,-70,80,0,60,0\n";
  const Outcome predicted =
      run_program({CELLCAL, "predict", "--calibration", files.result, "--joints",
                   files.dir / "joints.csv", "--nominal", "--withheld"});
  ASSERT_EQ(predicted.status, 0) << predicted.err;
  double x[2], y[2], z[2];
  const char* row = predicted.out.c_str();
  for (int k = 0; k < 2; ++k) {
    row = std::strchr(row, '\n') + 1;
    ASSERT_EQ(std::sscanf(row, "%lf,%lf,%lf", &x[k], &y[k], &z[k]), 3) << predicted.out;
  }
  EXPECT_NEAR(x[1], x[0], 1e-3);
  EXPECT_NEAR(y[1], y[0] + 1000.0, 1e-3);
  EXPECT_NEAR(z[1], z[0], 1e-3);
}

TEST(ALinearUnit, IsExportedWithWhatAFormCannotHoldInMillimetres) {
  const TrackFiles files;
  ASSERT_EQ(files.planned({"-o", files.plan}).status, 0);
  (void)files.identified();
  const Outcome tool = run_program(
      {CELLCAL, "frames", "--calibration", files.result, "--tool", "1", "--withheld"});
  EXPECT_EQ(tool.status, 0) << tool.err;
  EXPECT_NE(tool.out.find("TOOL_DATA[1]={X "), std::string::npos) << tool.out;
  expect_refused(run_program({CELLCAL, "frames", "--calibration", files.result, "--base",
                              "3=S1,S2,S3", "--withheld"}));
  const auto exported = [&](const std::string& as) {
    const Outcome made = run_program({CELLCAL, "export-robot", "--calibration", files.result,
                                      "--as", as, "--withheld", "-o", files.dir / as});
    EXPECT_EQ(made.status, 0) << made.err;
    return made.err;
  };
  EXPECT_NE(exported("urdf").find("E1 carries the arm: its joint has the direction found; scale"),
            std::string::npos);
  EXPECT_NE(content(files.dir / "urdf").find("type=\"prismatic\""), std::string::npos);
  EXPECT_NE(exported("yaml").find("are the table below"), std::string::npos);
  EXPECT_NE(content(files.dir / "yaml").find("\njoint_e1_motion:\n  position: [0, "),
            std::string::npos);
  EXPECT_NE(exported("dh").find(
                "E1 carries the arm: not in a table of the arm; driven as drawn it costs"),
            std::string::npos);
  exported("json");
  EXPECT_TRUE(nlohmann::json::parse(content(files.dir / "json")).contains("linear_unit"));
  exported("kuka");
  EXPECT_NE(content(files.dir / "kuka").find("; linear unit E1 as calibrated"), std::string::npos);
  const auto unit = nlohmann::json::parse(content(files.result)).at("linear_unit");
  EXPECT_EQ(unit.at("axis"), "E1");
  EXPECT_EQ(unit.at("at").size(), 13u);
  EXPECT_GT(unit.at("direction_u95_mrad").get<double>(), 0.0);
  EXPECT_LT(unit.at("direction_u95_mrad").get<double>(), 3.0) << "without a turn of the base";
  EXPECT_GT(unit.at("touched_mm").at(1).get<double>(), 1500.0);
}

TEST(ALinearUnit, IsCorrectedForSinglePosesWhereItStands) {
  const TrackFiles files;
  ASSERT_EQ(files.planned({"-o", files.plan}).status, 0);
  (void)files.identified();
  const std::string poses = files.dir / "poses.csv";
  std::ofstream(poses)
      << "x_mm,y_mm,z_mm,a_deg,b_deg,c_deg,E1,A1,A2,A3,A4,A5,A6\n1200,1500,700,0,90,0,1500,0,-70,80,0,60,0\n";
  const auto corrected = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = {CELLCAL,   "correct", "--calibration", files.result,
                                    "--poses", poses,     "--withheld"};
    all.insert(all.end(), more.begin(), more.end());
    return run_program(all);
  };
  const Outcome json = corrected({"--json"});
  ASSERT_EQ(json.status, 0) << json.err;
  const auto row = nlohmann::json::parse(json.out).at(0);
  EXPECT_NEAR(row.at("joints_mm").at("E1").get<double>(), 1500.0, 1e-9);
  EXPECT_EQ(row.at("joints_deg").size(), 6u);
  const Outcome csv = corrected({});
  ASSERT_EQ(csv.status, 0) << csv.err;
  EXPECT_NE(csv.out.find("E1,A1,A2,A3,A4,A5,A6\n1500.0000000000,"), std::string::npos) << csv.out;
  std::ofstream(poses) << "x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\n1200,1500,700,0,90,0\n";
  const Outcome without = corrected({});
  EXPECT_EQ(without.status, 1);
  EXPECT_NE(without.err.find("E1 carries the arm, and where it stands has to be stated"),
            std::string::npos)
      << without.err;
}

TEST(ALinearUnit, IsCorrectedForProgramsAtRunTime) {
  const TrackFiles files;
  ASSERT_EQ(files.planned({"-o", files.plan}).status, 0);
  (void)files.identified();
  const std::string src = files.dir / "p.src", folder = files.dir / "out";
  std::ofstream(src) << "DEF P()\nPTP {A1 0,A2 -70,A3 80,A4 0,A5 60,A6 0,E1 500}\n"
                        "PTP_REL {A1 5.0}\nEND\n";
  const Outcome outcome =
      run_program({CELLCAL, "correct", "--calibration", files.result, "--withheld", "--anywhere",
                   "--program", src, "--at-run-time", "--serial", "4711", "-o", folder});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(content(folder + "/p.src").find(",A6 +0.0,E1 +0.0})"), std::string::npos);
  EXPECT_NE(content(folder + "/cellcal_fix.src").find("ME.X.E1=P.E1"), std::string::npos);
  EXPECT_NE(content(folder + "/cellcal_fix.dat").find("CCF_XUNITS=1"), std::string::npos);
}

TEST(ALinearUnit, IsPlannedForThePointsOfPrograms) {
  const TrackFiles files;
  const std::string src = files.dir / "p.src";
  {
    std::ofstream text(src);
    text << "DEF P()\nBAS(#TOOL,0)\nBAS(#BASE,0)\n";
    for (int k = 0; k < 12; ++k)
      text << fmt::format("PTP {{A1 {},A2 -70,A3 80,A4 0,A5 60,A6 0,E1 {}}}\n", 3 * k, 200 * k);
    text << "END\n";
  }
  const Outcome made = files.planned({"--program", src});
  EXPECT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(made.err.find("warning: p.src"), std::string::npos) << made.err;
}

TEST(ALinearUnit, HasItsPositionsBesideTheAnglesInThePlansJson) {
  const TrackFiles files;
  const Outcome made = files.planned({"--json", "--from", "1200,0,-70,90,0,60,0"});
  ASSERT_EQ(made.status, 0) << made.err;
  for (const auto& touch : nlohmann::json::parse(made.out).at("touches")) {
    EXPECT_EQ(touch.at("joints_deg").size(), 6u);
    EXPECT_FALSE(touch.at("joints_deg").contains("E1"));
    const double position_mm = touch.at("joints_mm").at("E1");
    EXPECT_GE(position_mm, 0.0);
    EXPECT_LE(position_mm, 3000.0);
  }
  const Outcome beyond = files.planned({"--from", "3200,0,-70,90,0,60,0"});
  EXPECT_EQ(beyond.status, 1);
  EXPECT_NE(beyond.err.find("3200 mm for E1"), std::string::npos) << beyond.err;
}

TEST(ALinearUnit, LeavesEachAxisOfTheArmTheMarkOfItsNumber) {
  TemporaryDirectory dir;
  calib::Random random(1);
  std::ofstream(dir / "c.json") << calib::calibration_to_json(
      calib::testing::random_calibration(calib::testing::track_cell(CELLCAL_TRACK_ROBOT), random));
  std::ofstream(dir / "$machine.dat")
      << "$MAMES[1]=1.0\n$MAMES[2]=2.0\n$MAMES[3]=3.0\n$MAMES[4]=4.0\n$MAMES[5]=5.0\n$MAMES[6]=6.0\n";
  const Outcome told = run_program({CELLCAL, "mastering", "--calibration", dir / "c.json",
                                    "--machine-data", dir / "$machine.dat", "--json"});
  ASSERT_EQ(told.status, 0) << told.err;
  const auto axes = nlohmann::json::parse(told.out).at("axes");
  ASSERT_EQ(axes.size(), 6u);
  for (const auto& axis : axes)
    EXPECT_EQ(fmt::format("A{:.0f}", axis.at("mark_deg").get<double>()), axis.at("joint")) << axis;
}

TEST(ALinearUnit, IsRefusedByNameWhereItCannotBeCarriedYet) {
  const TrackFiles files;
  expect_refused(files.planned({"--suggest-spheres", "4"}));
}

TEST(ALinearUnit, IsCarriedByANewCell) {
  const TrackFiles files;
  std::ofstream(files.dir / "spheres.csv")
      << "id,diameter_mm,x_mm,y_mm,z_mm\nS1,50,900,0,400\nS2,50,900,1500,600\n";
  const Outcome made = run_program({CELLCAL, "new-cell", "-o", files.dir / "new.toml", "--robot",
                                    files.dir / "track.toml", "--tool", "0,0,250,0,0,0", "--mass",
                                    "1", "--spheres", files.dir / "spheres.csv"});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(calib::load_cell(files.dir / "new.toml").robot.joints[0].name, "E1");
}

}  // namespace
}  // namespace cellcal::daemon::testing
