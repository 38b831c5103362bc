// cellcal relate as a subprocess, on two arms that touched the demonstration's spheres.

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <regex>

#include "calib/files/calibration_json.h"
#include "tests/calib/check/second_arm.h"
#include "tests/daemon/cli/content.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using calib::Calibration;

struct TwoArms {
  TwoArms() : TwoArms(calib::testing::second_calibration()) {}
  explicit TwoArms(const Calibration& other) {
    std::ofstream(first) << calib::calibration_to_json(calib::testing::calibration());
    std::ofstream(second) << calib::calibration_to_json(other);
  }
  Outcome relate(std::vector<std::string> more = {}) const {
    std::vector<std::string> command{CELLCAL, "relate", first, second};
    command.insert(command.end(), more.begin(), more.end());
    return run_program(command);
  }

  TemporaryDirectory dir;
  std::string first = dir / "first.json", second = dir / "second.json";
};

TEST(Relate, PrintsTheSecondBaseInTheFirstWithItsUncertaintyAndEverySphere) {
  const TwoArms arms;
  const Outcome words = arms.relate();
  ASSERT_EQ(words.status, 0) << words.err;
  EXPECT_NE(words.out.find("{X 1"), std::string::npos) << words.out;
  EXPECT_NE(words.out.find("U (k=2)"), std::string::npos);
  EXPECT_NE(words.out.find("S4"), std::string::npos);
  const std::string file = arms.dir / "frame.json";
  ASSERT_EQ(arms.relate({"--json", "-o", file}).status, 0);
  const auto json = nlohmann::json::parse(content(file));
  const auto frame = json.at("second_in_first");
  EXPECT_NEAR(frame.at("xyz_mm").at(0).get<double>(), 150.0, 5.0);
  EXPECT_NEAR(frame.at("abc_deg").at(0).get<double>(), 40.0, 0.5);
  EXPECT_EQ(json.at("spheres").size(), 4u);
  EXPECT_EQ(json.at("agrees"), true);
  EXPECT_LT(json.at("u_middle_mm").get<double>(), 1.0);
}

TEST(Relate, InGermanHasDecimalCommasButInTheFrame) {
  const Outcome words = TwoArms().relate({"--language", "de"});
  ASSERT_EQ(words.status, 0) << words.err;
  EXPECT_NE(words.out.find("Basis des zweiten Arms in der Basis des ersten"), std::string::npos)
      << words.out;
  EXPECT_TRUE(std::regex_search(words.out, std::regex("\\{X 1[0-9]+\\.[0-9]{4},Y "))) << words.out;
  EXPECT_TRUE(std::regex_search(words.out, std::regex("S4 +[0-9],[0-9]{3} mm Abstand")))
      << words.out;
}

TEST(Relate, ExitsWithThreeAndNamesTheSphereThatMoved) {
  Calibration moved = calib::testing::second_calibration();
  moved.targets[2].centre_m.z() += 2e-3;
  const Outcome outcome = TwoArms(moved).relate();
  EXPECT_EQ(outcome.status, 3);
  EXPECT_NE(outcome.out.find("does not agree and is left out"), std::string::npos) << outcome.out;
}

TEST(Relate, PairsSpheresAsGivenOrBySerialNumber) {
  Calibration renamed = calib::testing::second_calibration();
  for (std::size_t t = 0; t < renamed.targets.size(); ++t)
    renamed.targets[t].id = renamed.cell.targets[t].id = "K" + std::to_string(t + 1);
  renamed.lengths.clear();
  renamed.cell.lengths.clear();
  const TwoArms arms(renamed);
  const Outcome none = arms.relate();
  EXPECT_EQ(none.status, 1);
  EXPECT_NE(none.err.find("0 common spheres, 3 are needed"), std::string::npos) << none.err;
  EXPECT_EQ(arms.relate({"--same", "S1=K1,S2=K2,S3=K3"}).status, 0);
  EXPECT_EQ(arms.relate({"--same", "S1"}).status, 2);
  const auto cell = [&](const std::string& file, const std::string& letter, int last) {
    std::ofstream out(arms.dir / file);
    for (int t = 1; t <= 4; ++t)
      out << "[[target]]\nid = \"" << letter << t << "\"\nserial = \"" << std::min(t, last)
          << "\"\n";
    return std::string(arms.dir / file);
  };
  const std::string first = cell("first.toml", "S", 4), second = cell("second.toml", "K", 4);
  const Outcome by_serial = arms.relate({"--cells", first, second, "--json"});
  ASSERT_EQ(by_serial.status, 0) << by_serial.err;
  EXPECT_EQ(nlohmann::json::parse(by_serial.out).at("spheres").at(3).at("second"), "K4");
  const Outcome twice = arms.relate({"--cells", first, cell("twice.toml", "K", 3)});
  EXPECT_EQ(twice.status, 1);
  EXPECT_NE(twice.err.find("is that of K3, too"), std::string::npos) << twice.err;
}

TEST(Relate, RefusesAWithheldCalibration) {
  Calibration withheld = calib::testing::second_calibration();
  withheld.verdict.judged = false;
  const Outcome outcome = TwoArms(withheld).relate();
  EXPECT_EQ(outcome.status, 3);
  EXPECT_NE(outcome.err.find("withheld"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace cellcal::daemon::testing
