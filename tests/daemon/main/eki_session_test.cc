// Whole calibrations over EKI: the daemon as a process, its emulated cell on virtual time.

#include <gtest/gtest.h>

#include <algorithm>

#include "daemon_fixture.h"

namespace cellcal::daemon::testing {
namespace {

std::string over_eki(const std::string& stop) {
  return "[motion]\nspeed_percent = 80\nacceleration_deg_s2 = 600\n[eki]\nstop = \"" + stop +
         "\"\n[mock]\nwire = \"eki\"\nseed = 12\ndeflection = 0.002\njoint_noise_deg = 0.001\n";
}

class ASessionOverEki : public ::testing::TestWithParam<const char*> {};

TEST_P(ASessionOverEki, EndsInAPublishedResult) {
  DaemonFixture fixture(over_eki(GetParam()));
  fixture.start();
  const Outcome outcome = fixture.cellcal(
      {"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "32", "--check", "8", "--seed", "12"});
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err << fixture.log();
  const auto results = fixture.dir.path() / "state/sessions/1";
  const auto json = nlohmann::json::parse(content(results / "calibration.json"));
  EXPECT_TRUE(json.at("verdict").at("publish").get<bool>());
  EXPECT_NEAR(fixture.status().at("residual_mm").get<double>(),
              json.at("residuals").at("after").at("mean_mm").get<double>(), 1e-4)
      << "after the end the fit's, not the newest touch's before it";
  const std::string csv = content(results / "touches.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 41) << csv;
}

INSTANTIATE_TEST_SUITE_P(Stops, ASessionOverEki, ::testing::Values("input", "flag"),
                         [](const auto& one) { return std::string(one.param); });

TEST(ASessionOverEkiTwice, GivesTheSameBitsForTheSameSeed) {
  std::string touches[2];
  for (std::string& one : touches) {
    DaemonFixture fixture(over_eki("input"));
    fixture.start();
    fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "8", "--check", "2"});
    one = content(fixture.dir.path() / "state/sessions/1/touches.csv");
  }
  EXPECT_FALSE(touches[0].empty());
  EXPECT_EQ(touches[0], touches[1]);
}

TEST(AnAbortedSessionOverEki, CanBeGoneOnWith) {
  DaemonFixture fixture(over_eki("input"));
  fixture.start();
  fixture.begin({{"cell", CELLCAL_DEMO_CELL}, {"touches", 12}, {"check", 4}});
  fixture.wait_for_touches(2);
  const Outcome aborted = fixture.cellcal({"abort"});
  EXPECT_EQ(aborted.status, 0) << aborted.err;
  const Outcome outcome = fixture.cellcal({"run", "--resume"});
  EXPECT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err;
}

}  // namespace
}  // namespace cellcal::daemon::testing
