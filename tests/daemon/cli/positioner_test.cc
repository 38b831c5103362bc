// An arm beside a positioner through the commands: planned and identified; all else refuses it.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

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

void expect_positioner_refused(const Outcome& outcome) {
  EXPECT_EQ(outcome.status, 1) << outcome.out;
  EXPECT_NE(outcome.err.find("positioner (E1)"), std::string::npos) << outcome.err;
}

TEST(a_positioner, is_planned_and_identified_and_the_result_states_its_axes) {
  const PositionerFiles files;
  const Outcome made = files.planned({"-o", files.plan});
  ASSERT_EQ(made.status, 0) << made.err;
  ASSERT_EQ(calib::load_touches(files.plan, calib::load_cell(files.cell)).size(), 28u);
  const Outcome identified = run_program(
      {CELLCAL, "identify", "--cell", files.cell, "--touches", files.plan, "-o", files.result});
  ASSERT_TRUE(identified.status == 0 || identified.status == 3) << identified.err;
  EXPECT_NE(identified.out.find("\nE2: X "), std::string::npos) << identified.out;
  const auto c = nlohmann::json::parse(content(files.result));
  ASSERT_EQ(c.at("positioner").size(), 2u);
  EXPECT_EQ(c["positioner"][1]["axis"], "E2");
  EXPECT_GT(c["positioner"][1]["place_u95_mm"], 0.0);
  expect_positioner_refused(run_program({CELLCAL, "export-robot", "--calibration", files.result,
                                         "--as", "dh", "--withheld", "-o", files.dir / "dh.csv"}));
}

TEST(a_positioner, has_its_angles_in_the_plans_json) {
  const PositionerFiles files;
  const Outcome made = files.planned({"--json"});
  ASSERT_EQ(made.status, 0) << made.err;
  for (const auto& touch : nlohmann::json::parse(made.out).at("touches")) {
    EXPECT_EQ(touch.at("joints_deg").size(), 6u);
    EXPECT_LE(std::abs(touch.at("positioner_deg").at("E1").get<double>()), 60.0);
    EXPECT_LE(std::abs(touch.at("positioner_deg").at("E2").get<double>()), 185.0);
  }
}

TEST(a_positioner, is_refused_by_name_where_it_cannot_be_carried_yet) {
  const PositionerFiles files;
  expect_positioner_refused(files.planned({"--suggest-spheres", "4"}));
  expect_positioner_refused(files.planned({"--picture", files.dir / "plan.svg"}));
  expect_positioner_refused(
      run_program({CELLCAL, "new-cell", "-o", files.dir / "new.toml", "--robot",
                   files.dir / "positioner.toml", "--tool", "0,0,250,0,0,0"}));
}

}  // namespace
}  // namespace cellcal::daemon::testing
