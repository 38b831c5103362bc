// Whole calibrations of an arm with a positioner: the daemon as a process, its emulated cell over both wires
// on virtual time.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>

#include "calib/files/calibration_json.h"
#include "calib/files/files.h"
#include "calib/model/units.h"
#include "daemon_fixture.h"
#include "sim/cell/truth.h"
#include "tests/calib/positioner_cell.h"

namespace cellcal::daemon::testing {
namespace {

constexpr std::uint64_t kSeed = 3;

struct PositionerFixture : DaemonFixture {
  /// `load`: lines of the robot file after E2's.
  explicit PositionerFixture(const std::string& wire = "eki", const std::string& more = "",
                             const std::string& load = "")
      : DaemonFixture(std::string(kFast) +
                      "positioner_speed_deg_s = 80\npositioner_acceleration_deg_s2 = 200\n"
                      "positioner_jerk_deg_s3 = 2000\n" +
                      more + "[mock]\nseed = " + std::to_string(kSeed) +
                      "\nstart_deg = [0, -90, 90, 0, 60, 0]\nwire = \"" + wire +
                      "\"\n[controller]\nexternal_axes = 2\n") {
    // Gears as stiff as a KR 16's; the experiments' are softer.
    std::string robot = content(CELLCAL_POSITIONER_ROBOT);
    const std::string soft = "per_nm = 2e-5";
    for (auto at = robot.find(soft); at != std::string::npos; at = robot.find(soft))
      robot.replace(at, soft.size(), "per_nm = 2e-6");
    std::ofstream(dir / "robot.toml") << robot << load;
    std::ofstream file(cell);
    file
        << "format = \"cellcal.cell/1\"\nrobot = \"robot.toml\"\n[tool]\nxyz_mm = [60.0, 50.0, 410.0]\n[touch]\nsigma_mm = 0.03\n"
           "radius_offset_sigma_mm = 0.1\n";
    for (const calib::Target& target : stated.targets)
      file << fmt::format(
          "[[target]]\nid = \"{}\"\nkind = \"sphere\"\ndiameter_mm = 40.0\ncentre_sigma_mm = 10.0\n"
          "centre_mm = [{:.1f}, {:.1f}, {:.1f}]\non = \"{}\"\n",
          target.id, 1e3 * target.centre_m.x(), 1e3 * target.centre_m.y(),
          1e3 * target.centre_m.z(), target.carried_by > 0 ? "E2" : "floor");
    for (const calib::CertifiedLength& length : stated.lengths)
      file << fmt::format("[[length]]\nbetween = [\"{}\", \"{}\"]\nmm = {:.6f}\nsigma_mm = 0.005\n",
                          length.from, length.to, 1e3 * length.length_m);
  }
  std::filesystem::path results() const { return dir.path() / "state/sessions/1"; }
  int run(const nlohmann::json& request) const { return begin(request).status; }

  calib::Cell stated = calib::testing::positioner_cell(CELLCAL_POSITIONER_ROBOT);
  std::string cell = dir / "cell.toml";
};

/// A line in the base frame: point and direction.
using Line = std::pair<Eigen::Vector3d, Eigen::Vector3d>;

/// Axes at angles 0, with the cell's true errors.
std::vector<Line> true_axes(const calib::Cell& cell) {
  sim::TruthOptions options;
  options.seed = kSeed;
  const sim::Truth truth = sim::draw_truth(cell, options);
  std::vector<Line> lines;
  Eigen::Isometry3d place = Eigen::Isometry3d::Identity();
  for (std::size_t j = 0; j < cell.robot.positioner.size(); ++j) {
    double error[calib::kAxisErrors] = {};
    for (std::size_t p = 0; p < truth.arm.parameters().size(); ++p) {
      const calib::ArmParameter& parameter = truth.arm.parameters()[p];
      if (parameter.kind == calib::ParameterKind::kPositioner &&
          parameter.carrier == static_cast<int>(j))
        error[parameter.axis] = truth.errors[static_cast<Eigen::Index>(p)];
    }
    place = place * cell.robot.positioner[j].frame * Eigen::Translation3d(error[0], error[1], 0.0) *
            Eigen::AngleAxisd(error[2], Eigen::Vector3d::UnitX()) *
            Eigen::AngleAxisd(error[3], Eigen::Vector3d::UnitY());
    lines.emplace_back(place.translation(), place.linear().col(2));
  }
  return lines;
}

double angle_between(const Line& a, const Line& b) { return std::acos(a.second.dot(b.second)); }
double distance_between(const Line& a, const Line& b) {
  return std::abs((b.first - a.first).dot(a.second.cross(b.second).normalized()));
}

class ASessionWithAPositioner : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Wires, ASessionWithAPositioner, ::testing::Values("rsi", "eki"),
                         [](const auto& one) { return std::string(one.param); });

TEST_P(ASessionWithAPositioner, EndsInAPublishedResultWithItsAxesWhereTheyAre) {
  PositionerFixture fixture(GetParam(), "", "mass_kg = 250.0\ncom_mm = [120.0, 50.0, 200.0]\n");
  fixture.start();
  const Outcome outcome = fixture.cellcal(
      {"run", "--cell", fixture.cell, "--touches", "80", "--check", "10", "--seed", "12"});
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err << fixture.log();
  const std::string file = fixture.results() / "calibration.json";
  const calib::Calibration found = calib::calibration_from_json(content(file), file);
  EXPECT_TRUE(found.verdict.publish());
  EXPECT_LT(found.check.rms_m, 2e-4);

  const calib::Cell cell = calib::load_cell(fixture.cell);
  const auto touches = calib::load_touches((fixture.results() / "touches.csv").string(), cell);
  ASSERT_EQ(touches.size(), 90u);
  std::set<long> settings;
  for (const calib::Touch& touch : touches) {
    ASSERT_EQ(touch.joint_rad.size(), 6u);
    ASSERT_EQ(touch.positioner_rad.size(), 2u);
    settings.insert(std::lround(1e3 * touch.positioner_rad[1]));
  }
  EXPECT_GE(settings.size(), 4u);

  ASSERT_EQ(found.positioner.size(), 2u);
  std::vector<Line> axes;
  for (const calib::PositionerLine& line : found.positioner)
    axes.emplace_back(line.point_m, line.direction);
  const std::vector<Line> truth = true_axes(cell);
  const double angle_off = angle_between(axes[0], axes[1]) - angle_between(truth[0], truth[1]);
  const double place_off =
      distance_between(axes[0], axes[1]) - distance_between(truth[0], truth[1]);
  // As drawn: 2.1 mrad and 0.56 mm.
  EXPECT_LT(std::abs(angle_off), 2e-4);
  EXPECT_LT(std::abs(place_off), 1e-4);

  // The tilting axis bears up to 500 N m about itself.
  const calib::ParameterResult* gives =
      find(found, calib::positioner_parameter(0, calib::AxisError::kCompliance));
  ASSERT_NE(gives, nullptr);
  EXPECT_LT(gives->sigma, 0.3 * cell.robot.positioner[0].compliance_sigma_rad_per_nm);

  const std::string again = fixture.dir / "again.json";
  const Outcome identified = run_program({CELLCAL, "identify", "--cell", fixture.cell, "--touches",
                                          fixture.results() / "touches.csv", "--out", again});
  ASSERT_EQ(identified.status, 0) << identified.out << identified.err;
  const calib::Calibration from_file = calib::calibration_from_json(content(again), again);
  for (std::size_t j = 0; j < 2; ++j) {
    const calib::PositionerLine &one = found.positioner[j], &two = from_file.positioner.at(j);
    EXPECT_LT((one.point_m - two.point_m).norm(), 1e-6) << "the file's angles have fewer digits";
    EXPECT_LT((one.direction - two.direction).norm(), 1e-6);
  }
}

/// Angles of the positioner in a session's touches, in thousandths of a degree.
std::set<std::pair<long, long>> settings_in(const PositionerFixture& fixture, int session) {
  const auto list = fixture.get(fmt::format("/v1/sessions/{}/touches", session));
  std::set<std::pair<long, long>> all;
  for (const auto& touch : list.at("touches")) {
    const auto deg = touch.at("positioner_deg").get<std::vector<double>>();
    all.emplace(std::lround(1e3 * deg.at(0)), std::lround(1e3 * deg.at(1)));
  }
  return all;
}

TEST(ASessionWithAPositionerOverEki, IsFollowedByChecksThatHoldAndUpdatesThatChangeNothing) {
  PositionerFixture fixture("eki");
  fixture.start();
  const Outcome calibrated = fixture.cellcal(
      {"run", "--cell", fixture.cell, "--touches", "80", "--check", "10", "--seed", "12"});
  ASSERT_EQ(calibrated.status, 0) << calibrated.out << calibrated.err << fixture.log();
  for (const int session : {2, 3}) {
    const Outcome checked = fixture.cellcal({"check", "--cell", fixture.cell});
    EXPECT_EQ(checked.status, 0) << checked.out << checked.err << fixture.log();
    EXPECT_EQ(settings_in(fixture, session).size(), 1u);
  }
  const Outcome updated = fixture.cellcal({"run", "--cell", fixture.cell, "--update"});
  EXPECT_EQ(updated.status, 3) << updated.out << updated.err << fixture.log();
  EXPECT_NE(updated.out.find("nothing changed"), std::string::npos) << updated.out;
}

TEST(ASessionWithAPositionerOverRsi, ToAGoalEndsWhenItIsReached) {
  PositionerFixture fixture("rsi");
  fixture.start();
  const Outcome outcome = fixture.cellcal(
      {"run", "--cell", fixture.cell, "--goal", "2", "--touches", "60", "--check", "4"});
  EXPECT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err << fixture.log();
  const auto status = fixture.status();
  EXPECT_NE(status.at("why_ended").get<std::string>().find("goal reached"), std::string::npos)
      << status << fixture.log();
  EXPECT_LT(status.at("touches").get<int>(), 64);
  EXPECT_GE(settings_in(fixture, 1).size(), 3u);
}

TEST_P(ASessionWithAPositioner, ThatWasAbortedGoesOnFromWhereItStands) {
  PositionerFixture fixture(GetParam());
  fixture.start();
  ASSERT_EQ(fixture.run({{"cell", fixture.cell}, {"touches", 24}, {"check", 4}}), 201);
  fixture.wait_for_touches(3);
  EXPECT_EQ(fixture.cellcal({"abort"}).status, 0);
  const Outcome outcome = fixture.cellcal({"run", "--resume"});
  EXPECT_TRUE(outcome.status == 0 || outcome.status == 3) << outcome.err << fixture.log();
  const auto list = fixture.get("/v1/sessions/1/touches");
  ASSERT_EQ(list.at("touches").size(), 28u);
  EXPECT_EQ(list.at("touches").at(27).at("positioner_deg").size(), 2u);
}

TEST_P(ASessionWithAPositioner, IsTriedDryFirst) {
  PositionerFixture fixture(GetParam());
  fixture.start();
  const Outcome outcome =
      fixture.cellcal({"dry-run", "--cell", fixture.cell, "--touches", "12", "--check", "0"});
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err << fixture.log();
}

/// A sphere on the table and one on the floor, known only by boxes in their frames.
void put_in_boxes(const PositionerFixture& fixture) {
  std::string text = content(fixture.cell);
  for (const std::size_t t : {0u, 4u}) {
    const Eigen::Vector3d centre_mm = 1e3 * fixture.stated.targets[t].centre_m;
    const auto begin =
        text.find("centre_mm", text.find("\"" + fixture.stated.targets[t].id + "\""));
    text.replace(
        begin, text.find('\n', begin) - begin,
        fmt::format(
            "search_low_mm = [{:.1f}, {:.1f}, {:.1f}]\nsearch_high_mm = [{:.1f}, {:.1f}, {:.1f}]",
            centre_mm.x() - 15.0, centre_mm.y() - 10.0, centre_mm.z() - 10.0, centre_mm.x() + 10.0,
            centre_mm.y() + 15.0, centre_mm.z() + 8.0));
  }
  // Their certified distances refer to the former places.
  for (auto at = text.find("[[length]]"); at != std::string::npos;
       at = text.find("[[length]]", at)) {
    const auto end = std::min(text.find("[[length]]", at + 1), text.size());
    const std::string one = text.substr(at, end - at);
    if (one.find("T1") != std::string::npos || one.find("S5") != std::string::npos)
      text.erase(at, end - at);
    else
      at = end;
  }
  std::ofstream(fixture.cell) << text;
}

TEST_P(ASessionWithAPositioner, FindsSpheresOnTableAndFloorWhereThePositionerStands) {
  PositionerFixture fixture(GetParam());
  put_in_boxes(fixture);
  // The emulated axes are at 0, or as close as their limits permit.
  std::string robot = content(fixture.dir / "robot.toml");
  for (const auto& [limit, now] : {std::pair("min_deg = -60.0", "min_deg = 15.0"),
                                   std::pair("min_deg = -185.0", "min_deg = 40.0")})
    robot.replace(robot.rfind(limit), std::string(limit).size(), now);
  std::ofstream(fixture.dir / "robot.toml") << robot;
  fixture.start();
  const Outcome outcome = fixture.cellcal({"find", "--cell", fixture.cell});
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err << fixture.log();
  EXPECT_NE(outcome.out.find(", on = \"E2\", taught_deg = [15.00, 40.00]"), std::string::npos)
      << outcome.out;
  for (const auto& [e1, e2] : settings_in(fixture, 1)) {
    EXPECT_NEAR(e1, 15000, 10) << "it has not turned";
    EXPECT_NEAR(e2, 40000, 10);
  }

  const auto found = nlohmann::json::parse(content(fixture.results() / "found.json")).at("spheres");
  const calib::Cell cell = calib::load_cell(fixture.cell);
  sim::TruthOptions options;
  options.seed = kSeed;
  const sim::Truth truth = sim::draw_truth(cell, options);
  ASSERT_EQ(found.size(), cell.targets.size());
  for (std::size_t t = 0; t < found.size(); ++t) {
    const auto mm = found[t].at("centre_mm").get<std::vector<double>>();
    const Eigen::Vector3d off_mm =
        Eigen::Vector3d(mm.at(0), mm.at(1), mm.at(2)) - 1e3 * truth.centre_m[t];
    EXPECT_LT(off_mm.norm(), 10.0) << found[t];
    EXPECT_EQ(found[t].contains("taught_deg"), cell.targets[t].carried_by > 0) << found[t];
  }
}

TEST_P(ASessionWithAPositioner, CalibratesWithSpheresThatItFindsFirst) {
  PositionerFixture fixture(GetParam());
  put_in_boxes(fixture);
  fixture.start();
  const Outcome outcome = fixture.cellcal(
      {"run", "--cell", fixture.cell, "--find", "--touches", "90", "--check", "8", "--seed", "12"});
  ASSERT_EQ(outcome.status, 0) << outcome.out << outcome.err << fixture.log();
  const std::string file = fixture.results() / "calibration.json";
  const calib::Calibration found = calib::calibration_from_json(content(file), file);
  EXPECT_TRUE(found.verdict.publish());
  EXPECT_LT(found.check.rms_m, 2e-4);
  const auto touches = calib::load_touches((fixture.results() / "touches.csv").string(),
                                           calib::load_cell(fixture.cell));
  EXPECT_EQ(std::ranges::count(touches, calib::TouchSet::kCheck, &calib::Touch::set), 8);
  EXPECT_GE(settings_in(fixture, 1).size(), 4u);
}

TEST(ASessionWithAPositionerOverEki, ThatFindsSpheresWasAbortedAndGoesOn) {
  PositionerFixture fixture("eki");
  put_in_boxes(fixture);
  fixture.start();
  ASSERT_EQ(fixture.run({{"cell", fixture.cell}, {"kind", "find"}}), 201);
  fixture.wait_for_touches(9);
  EXPECT_EQ(fixture.cellcal({"abort"}).status, 0);
  const Outcome outcome = fixture.cellcal({"run", "--resume"});
  EXPECT_EQ(outcome.status, 0) << outcome.out << outcome.err << fixture.log();
  EXPECT_NE(outcome.out.find("taught_deg"), std::string::npos) << outcome.out;
}

TEST(ASessionWithAPositionerOverRsi, TurnsItByIncrementsWhereTheModeIsRelative) {
  PositionerFixture fixture("rsi", "[rsi]\nmode = \"relative\"\nhold_on = false\n");
  fixture.start();
  ASSERT_EQ(fixture.run({{"cell", fixture.cell}, {"touches", 12}, {"check", 0}}), 201);
  fixture.wait_for_touches(11);
  const auto list = fixture.get("/v1/sessions/1/touches");
  std::set<long> settings;
  for (const auto& touch : list.at("touches"))
    settings.insert(std::lround(touch.at("positioner_deg").at(1).get<double>()));
  EXPECT_GE(settings.size(), 2u);
}

}  // namespace
}  // namespace cellcal::daemon::testing
