// 'cellcal priors' as a subprocess, from calibrations in files to a robot file.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/files/priors_file.h"
#include "tests/calib/random_calibration.h"
#include "tests/calib/simulate.h"
#include "tests/daemon/cli/content.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

namespace fs = std::filesystem;

void write(const fs::path& path, const std::string& text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path, std::ios::binary) << text;
}

std::string calibration(unsigned seed, double scale = 0.5, bool published = true) {
  calib::Random random(seed);
  calib::Calibration c =
      calib::testing::random_calibration(calib::testing::demo_cell(), random, scale);
  c.verdict.judged = published;
  return calib::calibration_to_json(c);
}

/// Eight arms, closer to nominal than stated; one of them twice, with its serial number.
void write_fleet(const fs::path& folder) {
  for (unsigned arm = 1; arm < 8; ++arm)
    write(folder / ("arm" + std::to_string(arm) + ".json"), calibration(arm));
  for (const char* day : {"01", "02"}) {
    const fs::path session = folder / "sessions" / day;
    write(session / "export.json",
          std::string(R"({"format": "cellcal.export/1", "started": "2026-11-)") + day + R"("})");
    write(session / "calibration.json", calibration(100 + static_cast<unsigned>(day[1])));
    write(session / "compared.json", "{}");
    write(session / "cell.toml", "[identity]\nrobot_serial = \"4711\"\n");
  }
}

std::string kinds(const nlohmann::json& set_aside) {
  std::string all;
  for (const auto& one : set_aside)
    all += fs::path(one.at("file").get<std::string>()).filename().string() + " " +
           one.at("kind").get<std::string>() + "; ";
  return all;
}

TEST(PriorsOfAFleet, GoFromCalibrationsToARobotFile) {
  const TemporaryDirectory dir;
  write_fleet(dir / "fleet");
  const std::string file = dir / "priors.toml", robot = dir / "mine.toml",
                    drawn = dir / "drawn.toml";
  const Outcome learned = run_program({CELLCAL, "priors", "learn", dir / "fleet", "-o", file});
  ASSERT_EQ(learned.status, 0) << learned.err;
  EXPECT_NE(learned.out.find("8 arms"), std::string::npos) << learned.out;
  EXPECT_NE(learned.out.find("01/calibration.json: same arm as"), std::string::npos) << learned.out;
  const calib::FleetPriors priors = calib::load_priors(file);
  EXPECT_EQ(priors.version, 1);
  EXPECT_EQ(priors.arms, 8);

  const Outcome shown = run_program({CELLCAL, "priors", "show", file});
  ASSERT_EQ(shown.status, 0) << shown.err;
  EXPECT_NE(shown.out.find("offered"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(run_program({CELLCAL, "priors", "show", file, "--json"}).out)
                .at("arms"),
            8);

  write(drawn, content(calib::robots_directories().front() / "kr5_r1400.toml"));
  const std::string before = content(drawn);
  const Outcome accepted =
      run_program({CELLCAL, "priors", "accept", file, "--robot", drawn, "-o", robot});
  ASSERT_EQ(accepted.status, 0) << accepted.err;
  EXPECT_NE(accepted.out.find("old"), std::string::npos) << accepted.out;
  EXPECT_NE(accepted.out.find("In the cell file: robot = \"/"), std::string::npos)
      << "a relative one would be relative to the cell file: " << accepted.out;
  EXPECT_EQ(content(drawn), before);
  const calib::Robot mine = calib::load_robot(robot);
  EXPECT_NEAR(mine.joints[1].tolerance_length_m,
              calib::offered(*priors.joints[1].of(calib::SpreadKind::kLength)), 1e-12);
  EXPECT_NE(mine.source.find("fleet priors version 1 of 8 arms"), std::string::npos) << mine.source;

  const Outcome again = run_program(
      {CELLCAL, "priors", "learn", dir / "fleet", "--after", file, "-o", dir / "next.toml"});
  ASSERT_EQ(again.status, 0) << again.err;
  EXPECT_EQ(calib::load_priors(dir / "next.toml").version, 2);
}

TEST(PriorsOfAFleet, NameEveryCalibrationThatWasSetAside) {
  const TemporaryDirectory dir;
  write_fleet(dir / "fleet");
  write(dir / "fleet" / "withheld.json", calibration(50, 0.5, false));
  write(dir / "fleet" / "cut.json", calibration(51).substr(0, 5000));
  write(dir / "fleet" / "far.json", calibration(52, 50.0));
  const Outcome learned = run_program({CELLCAL, "priors", "learn", dir / "fleet", "--json"});
  ASSERT_EQ(learned.status, 0) << learned.err;
  const auto json = nlohmann::json::parse(learned.out);
  EXPECT_EQ(
      kinds(json.at("set_aside")),
      "cut.json unreadable; far.json too_far; calibration.json same_arm; withheld.json withheld; ");
  EXPECT_EQ(json.at("priors").at("arms"), 8);
}

TEST(PriorsOfAFleet, AreNoneOfWithheldCalibrationsAlone) {
  const TemporaryDirectory dir;
  for (unsigned arm = 0; arm < 5; ++arm)
    write(dir / "fleet" / (std::to_string(arm) + ".json"), calibration(arm, 0.5, false));
  const Outcome learned =
      run_program({CELLCAL, "priors", "learn", dir / "fleet", "-o", dir / "priors.toml"});
  EXPECT_EQ(learned.status, 1);
  EXPECT_EQ(learned.err.find("cellcal priors learn: 0 arms; priors need 3"), 0u) << learned.err;
  EXPECT_NE(learned.err.find("withheld, not used"), std::string::npos);
  EXPECT_FALSE(fs::exists(dir / "priors.toml"));
}

TEST(PriorsOfAnotherNominalGeometry, AreRefusedByName) {
  const TemporaryDirectory dir;
  write_fleet(dir / "fleet");
  const std::string file = dir / "priors.toml", robot = dir / "mine.toml";
  ASSERT_EQ(run_program({CELLCAL, "priors", "learn", dir / "fleet", "-o", file}).status, 0);
  const Outcome refused =
      run_program({CELLCAL, "priors", "accept", file, "--robot", "kr10_r900_2", "-o", robot});
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find(file + ": priors of "), std::string::npos) << refused.err;
  EXPECT_NE(refused.err.find("KR 10"), std::string::npos) << refused.err;
  EXPECT_FALSE(fs::exists(robot));
}

TEST(AnAcceptedRobotFile, IsNeverTheOneThatWasRead) {
  const TemporaryDirectory dir;
  write_fleet(dir / "fleet");
  const std::string file = dir / "priors.toml", robot = dir / "mine.toml";
  ASSERT_EQ(run_program({CELLCAL, "priors", "learn", dir / "fleet", "-o", file}).status, 0);
  write(robot, content(calib::robots_directories().front() / "kr5_r1400.toml"));
  const std::string before = content(robot);
  const Outcome refused =
      run_program({CELLCAL, "priors", "accept", file, "--robot", robot, "-o", robot});
  EXPECT_EQ(refused.status, 1);
  EXPECT_NE(refused.err.find("is the robot file itself"), std::string::npos) << refused.err;
  EXPECT_EQ(content(robot), before);
}

}  // namespace
}  // namespace cellcal::daemon::testing
