// Whole calibrations of an arm on a linear unit: the daemon as a process, its emulated cell on virtual
// time. Over EKI the controller has a further external axis that is not a joint.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "calib/files/files.h"
#include "daemon_fixture.h"

namespace cellcal::daemon::testing {
namespace {

constexpr double kPlaces[][3] = {{1000, 300, 300},  {900, 600, 500},  {950, 1000, 350},
                                 {1050, 1700, 250}, {900, 2300, 550}, {1000, 2800, 350}};
constexpr const char* kUnit =
    "[[joint]]\nname = \"E1\"\nkind = \"prismatic\"\nalong = [0.0, 1.0, 0.0]\nmin_mm = 0.0\n"
    "max_mm = 3000.0\nmax_speed_mm_s = 1500.0\n\n";

struct TrackFixture : DaemonFixture {
  explicit TrackFixture(const std::string& wire)
      : DaemonFixture(
            std::string("[motion]\nspeed_percent = 80\nacceleration_deg_s2 = 600\n"
                        "jerk_deg_s3 = 8000\ntravel_acceleration_mm_s2 = 4000\n"
                        "travel_jerk_mm_s3 = 60000\n[mock]\nseed = 3\n"
                        "start_deg = [0, -90, 90, 0, 60, 0]\nstart_mm = 1500\nwire = \"") +
            wire + "\"\n[controller]\nexternal_axes = 2\n") {
    // The demonstration's arm, on a unit of 3 m.
    std::string robot = content(CELLCAL_ROBOTS_FOLDER "/kr5_r1400.toml");
    robot.insert(robot.find("[[joint]]"), kUnit);
    std::ofstream(dir / "track.toml") << robot;
    std::ofstream file(cell);
    file.precision(10);
    file
        << "format = \"cellcal.cell/1\"\nrobot = \"track.toml\"\n[tool]\nxyz_mm = [60.0, 50.0, 410.0]\n"
           "mass_kg = 2.0\n[touch]\nsigma_mm = 0.03\nradius_offset_sigma_mm = 0.1\n";
    for (std::size_t i = 0; i < std::size(kPlaces); ++i)
      file << "[[target]]\nid = \"S" << i + 1
           << "\"\nkind = \"sphere\"\ndiameter_mm = 60.0\ncentre_sigma_mm = 5.0\ncentre_mm = ["
           << kPlaces[i][0] << ".0, " << kPlaces[i][1] << ".0, " << kPlaces[i][2] << ".0]\n";
    for (std::size_t i = 1; i < std::size(kPlaces); ++i) {
      const auto &a = kPlaces[i - 1], &b = kPlaces[i];
      file << "[[length]]\nbetween = [\"S" << i << "\", \"S" << i + 1
           << "\"]\nmm = " << std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2])
           << "\nsigma_mm = 0.01\n";
    }
  }
  /// Restarts the daemon with the same cell and a knocked tool.
  void knock() {
    daemon.reset();
    std::string text = content(dir / "d.toml");
    text.insert(text.find("[controller]"), "tool_shift_mm = [0.6, -0.5, 0.4]\n");
    std::ofstream(dir / "d.toml") << text;
    start();
  }
  std::filesystem::path results() const { return dir.path() / "state/sessions/1"; }

  std::string cell = dir / "cell.toml";
};

class ASessionOnATrack : public ::testing::TestWithParam<const char*> {};

TEST_P(ASessionOnATrack, EndsInAPublishedResult) {
  TrackFixture fixture(GetParam());
  fixture.start();
  const Outcome outcome = fixture.cellcal(
      {"run", "--cell", fixture.cell, "--touches", "60", "--check", "10", "--seed", "12"});
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err << fixture.log();
  const auto json = nlohmann::json::parse(content(fixture.results() / "calibration.json"));
  EXPECT_TRUE(json.at("verdict").at("publish").get<bool>());
  EXPECT_LT(json.at("residuals").at("check").at("mean_mm").get<double>(), 0.2);

  const calib::Cell cell = calib::load_cell(fixture.cell);
  const auto touches = calib::load_touches((fixture.results() / "touches.csv").string(), cell);
  ASSERT_EQ(touches.size(), 70u);
  const auto [least, most] = std::ranges::minmax(
      touches, {}, [](const calib::Touch& touch) { return touch.joint_rad[0]; });
  EXPECT_GT(most.joint_rad[0] - least.joint_rad[0], 1.0);
  for (const calib::Touch& touch : touches)
    EXPECT_NEAR(touch.settled_joint_rad.empty() ? touch.joint_rad[0] : touch.settled_joint_rad[0],
                touch.joint_rad[0], 5e-5)
        << "the carriage stands in a touch";

  const std::string report = content(fixture.results() / "report.html");
  EXPECT_NE(report.find("<th scope=\"col\">E1, mm</th>"), std::string::npos);
  EXPECT_NE(report.find("<th scope=\"col\">A1, deg</th>"), std::string::npos);
  const auto first = fixture.get("/v1/sessions/1/touches").at("touches").at(0);
  EXPECT_NEAR(first.at("joints_deg").at(0).get<double>(), 1e3 * touches[0].joint_rad[0], 1e-3);
  const Outcome certified = fixture.cellcal(
      {"certificate", "1", "--no-pdf", "--no-sign", "--out", fixture.dir / "certificate"});
  EXPECT_EQ(certified.status, 0) << certified.err;
  const std::string certificate = content(fixture.dir / "certificate/certificate.html");
  EXPECT_NE(certificate.find("<h2>Linear unit</h2>"), std::string::npos) << certificate;
  EXPECT_NE(certificate.find(">E1</span>, mm</th>"), std::string::npos);
  const auto joint = fixture.get("/v1/scene").at("joints").at(0);
  EXPECT_EQ(joint.at("along"), nlohmann::json({0.0, 1.0, 0.0}));
  EXPECT_EQ(joint.at("max_deg"), 3000.0);
}

INSTANTIATE_TEST_SUITE_P(Wires, ASessionOnATrack, ::testing::Values("rsi", "eki"),
                         [](const auto& one) { return std::string(one.param); });

TEST(ACheckOnATrack, HoldsNamesTheKnockedToolAndAnUpdateFollowsIt) {
  TrackFixture fixture("eki");
  fixture.start();
  ASSERT_EQ(fixture
                .cellcal({"run", "--cell", fixture.cell, "--touches", "80", "--check", "0",
                          "--seed", "12"})
                .status,
            0)
      << fixture.log();
  const Outcome held = fixture.cellcal({"check"});
  EXPECT_EQ(held.status, 0) << held.out << held.err << fixture.log();
  fixture.knock();
  const Outcome knocked = fixture.cellcal({"check", "--json"});
  ASSERT_EQ(knocked.status, 3) << knocked.out << knocked.err << fixture.log();
  EXPECT_EQ(nlohmann::json::parse(knocked.out).at("changed"), "tool") << knocked.out;
  const Outcome updated = fixture.cellcal({"run", "--cell", fixture.cell, "--update"});
  EXPECT_EQ(updated.status, 0) << updated.out << updated.err << fixture.log();
}

TEST(AnAbortedSessionOnATrack, CanBeGoneOnWith) {
  TrackFixture fixture("eki");
  fixture.start();
  fixture.begin({{"cell", fixture.cell}, {"touches", 24}, {"check", 4}});
  fixture.wait_for_touches(2);
  EXPECT_EQ(fixture.cellcal({"abort"}).status, 0);
  const Outcome outcome = fixture.cellcal({"run", "--resume"});
  EXPECT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err;
}

TEST(ASearchForSpheresOnATrack, FindsThemAllAlongIt) {
  TrackFixture fixture("eki");
  fixture.start();
  const Outcome found = fixture.cellcal({"find", "--cell", fixture.cell});
  EXPECT_EQ(found.status, 0) << found.out << found.err << fixture.log();
  for (std::size_t i = 1; i <= std::size(kPlaces); ++i)
    EXPECT_NE(found.out.find("S" + std::to_string(i)), std::string::npos) << found.out;
}

}  // namespace
}  // namespace cellcal::daemon::testing
