// 'cellcal plan --suggest-spheres' as a subprocess.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calib/files/toml.h"
#include "tests/daemon/cli/content.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using nlohmann::json;

TEST(SuggestedSpheres, KeepWhatTheCellFileStatesOfThem) {
  const TemporaryDirectory dir;
  const std::filesystem::path demo = std::filesystem::path(CELLCAL_DEMO_CELL).parent_path();
  std::filesystem::copy_file(demo / "kr5_worn.toml", dir / "kr5_worn.toml");
  json cell = calib::toml_to_json(content(CELLCAL_DEMO_CELL));
  json& second = cell["target"][1];
  second["diameter_mm"] = 50.8;
  second["serial"] = "K 7";
  second["stand_diameter_mm"] = 25.0;
  second.erase("centre_mm");
  second["search_low_mm"] = {1000.0, 300.0, 300.0};
  second["search_high_mm"] = {1100.0, 400.0, 400.0};
  std::ofstream(dir / "cell.toml") << calib::json_to_toml(cell);

  const std::vector<std::string> command{
      CELLCAL, "plan", "--cell", dir / "cell.toml", "--touches", "30", "--suggest-spheres", "5"};
  const Outcome made = run_program(command);
  ASSERT_EQ(made.status, 0) << made.err;
  const json suggested = calib::toml_to_json(made.out).at("target");
  ASSERT_EQ(suggested.size(), 5u);
  for (const char* place : {"centre_mm", "search_low_mm", "search_high_mm"}) second.erase(place);
  json kept = suggested[1];
  EXPECT_EQ(kept.at("centre_mm").size(), 3u);
  kept.erase("centre_mm");
  second["centre_sigma_mm"] = kept.at("centre_sigma_mm");
  EXPECT_EQ(kept, second) << made.out;
  EXPECT_EQ(suggested[4].at("diameter_mm"), 61.4) << "a new one is as the first";
  EXPECT_FALSE(suggested[4].contains("serial"));

  auto as_json = command;
  as_json.push_back("--json");
  EXPECT_NEAR(
      json::parse(run_program(as_json).out).at("spheres")[1].at("diameter_mm").get<double>(), 50.8,
      1e-9);
}

}  // namespace
}  // namespace cellcal::daemon::testing
