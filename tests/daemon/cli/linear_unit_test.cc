// An arm on a linear unit through the commands: planned, identified, predicted; all else refuses it.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calib/files/files.h"
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
};

void expect_refused(const Outcome& outcome) {
  EXPECT_EQ(outcome.status, 1) << outcome.out;
  EXPECT_NE(outcome.err.find("linear unit (E1)"), std::string::npos) << outcome.err;
}

TEST(a_linear_unit, is_planned_identified_and_predicted_in_millimetres) {
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
  const Outcome identified = run_program(
      {CELLCAL, "identify", "--cell", files.cell, "--touches", files.plan, "-o", files.result});
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
  expect_refused(run_program({CELLCAL, "export-robot", "--calibration", files.result, "--as", "dh",
                              "--withheld", "-o", files.dir / "dh.csv"}));
}

TEST(a_linear_unit, has_its_positions_beside_the_angles_in_the_plans_json) {
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

TEST(a_linear_unit, is_refused_by_name_where_it_cannot_be_carried_yet) {
  const TrackFiles files;
  expect_refused(files.planned({"--suggest-spheres", "4"}));
  expect_refused(run_program({CELLCAL, "new-cell", "-o", files.dir / "new.toml", "--robot",
                              files.dir / "track.toml", "--tool", "0,0,250,0,0,0"}));
}

}  // namespace
}  // namespace cellcal::daemon::testing
