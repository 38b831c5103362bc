// A positioner in robot files, its targets in cell files, its angles in tables of touches.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/files/robot_file.h"
#include "calib/files/touches.h"
#include "calib/model/units.h"
#include "tests/calib/files/documents.h"

namespace cellcal::calib {
namespace {

using testing::expect_words;
using testing::kCell;
using testing::kRobot;
using testing::refusal;
using testing::robot_refusal;
using testing::with;
using testing::without;

const std::string kAxes = R"(
[[positioner]]
name = "E1"
sign = -1
xyz_mm = [1250.0, 0.0, 500.0]
abc_deg = [0.0, 0.0, -90.0]
min_deg = -90.0
max_deg = 90.5
place_sigma_mm = 1.5
direction_sigma_mrad = 1.25
scale_sigma_mrad_per_rad = 0.2
max_speed_deg_s = 45.0
mass_kg = 350.0
com_mm = [10.0, -20.0, 150.0]
compliance_sigma_rad_per_nm = 3e-6
bearing_sigma_rad_per_nm = 1e-6

[[positioner]]
name = "E2"
xyz_mm = [0.0, -100.0, 0.0]
abc_deg = [0.0, 0.0, 90.0]
min_deg = -180
max_deg = 180
)";

Robot robot_of(const std::string& axes = kAxes) {
  return read_robot(TomlTable::parse(kRobot + axes, "robot.toml"));
}

const std::string kOnTable = with(kCell, "id = \"S1\"", "id = \"S1\"\non = \"E2\"");

/// Without the length, whose other end is on the floor.
std::string cell_text(const std::string& text = kOnTable) {
  const std::size_t from = text.find("[[length]]"), to = text.find("[touch]");
  return text.substr(0, from) + text.substr(to);
}

Cell positioner_cell_of(const std::string& text = cell_text()) {
  return read_cell(TomlTable::parse(text, "cell.toml"), robot_of());
}

std::string refused_cell(const std::string& text) {
  return refusal([&] { positioner_cell_of(text); });
}

std::vector<Touch> rows(const std::string& text) {
  return parse_touches(text, "touches.csv", positioner_cell_of());
}

std::string refused_rows(const std::string& text) {
  return refusal([&] { rows(text); });
}

TEST(PositionerFile, IsReadIntoMetresAndRadians) {
  const Robot robot = robot_of();
  ASSERT_EQ(robot.positioner.size(), 2u);
  const PositionerAxis &tilt = robot.positioner[0], &turn = robot.positioner[1];
  EXPECT_EQ(tilt.name, "E1");
  EXPECT_EQ(tilt.sign, -1);
  EXPECT_LT((tilt.frame.translation() - Eigen::Vector3d(1.25, 0.0, 0.5)).norm(), 1e-15);
  EXPECT_LT((tilt.frame.linear().col(2) - Eigen::Vector3d::UnitY()).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(tilt.max_rad, 90.5 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(tilt.place_sigma_m, 1.5e-3);
  EXPECT_DOUBLE_EQ(tilt.direction_sigma_rad, 1.25e-3);
  EXPECT_DOUBLE_EQ(tilt.scale_sigma, 0.2e-3);
  EXPECT_DOUBLE_EQ(tilt.max_speed_rad_s, 45.0 * kRadPerDeg);
  EXPECT_EQ(turn.max_speed_rad_s, 0.0);
  EXPECT_DOUBLE_EQ(tilt.mass_kg, 350.0);
  EXPECT_LT((tilt.com_m - Eigen::Vector3d(0.01, -0.02, 0.15)).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(tilt.compliance_sigma_rad_per_nm, 3e-6);
  EXPECT_DOUBLE_EQ(tilt.bearing_sigma_rad_per_nm, 1e-6);
  EXPECT_EQ(turn.mass_kg, 0.0);
  EXPECT_DOUBLE_EQ(turn.compliance_sigma_rad_per_nm, 2e-6);
  EXPECT_DOUBLE_EQ(turn.bearing_sigma_rad_per_nm, 5e-7);
  EXPECT_EQ(turn.sign, 1);
  EXPECT_DOUBLE_EQ(turn.place_sigma_m, 2e-3);
  EXPECT_DOUBLE_EQ(turn.direction_sigma_rad, 2e-3);
  EXPECT_DOUBLE_EQ(turn.scale_sigma, 1e-4);
  // Rotated by both, E2's axis follows from the chain.
  const Eigen::Isometry3d table = carried_at(robot, std::vector<double>{0.0, 0.3});
  EXPECT_LT((table.linear().col(2) - Eigen::Vector3d::UnitZ()).norm(), 1e-15);
  EXPECT_LT((table.translation() - Eigen::Vector3d(1.25, 0.0, 0.6)).norm(), 1e-15);
}

TEST(PositionerFile, SurvivesWritingAndReading) {
  const std::string written = robot_to_toml(robot_of());
  const Robot again = read_robot(TomlTable::parse(written, "again.toml"));
  EXPECT_EQ(robot_to_toml(again), written);
  ASSERT_EQ(again.positioner.size(), 2u);
  EXPECT_TRUE(again.positioner[0].frame.isApprox(robot_of().positioner[0].frame, 1e-12));
  EXPECT_EQ(again.positioner[0].mass_kg, 350.0);
  const std::string cell = cell_to_toml(positioner_cell_of(), "r.toml");
  EXPECT_EQ(cell_to_toml(positioner_cell_of(cell), "r.toml"), cell);
  EXPECT_EQ(positioner_cell_of(cell).targets[0].carried_by, 2);
  EXPECT_EQ(positioner_cell_of(cell).targets[1].carried_by, 0);
}

TEST(PositionerFile, ARobotWithoutOneIsWrittenAsBefore) {
  const Robot robot = testing::robot();
  EXPECT_TRUE(robot.positioner.empty());
  EXPECT_EQ(robot_to_toml(robot).find("positioner"), std::string::npos);
  EXPECT_EQ(cell_to_toml(testing::cell(), "r.toml").find("on ="), std::string::npos);
}

TEST(PositionerFile, NamesTheLineAndKeyOfEveryError) {
  const testing::Broken all[] = {
      {"name = \"E2\"", "name = \"E1\"", "name"},
      {"name = \"E2\"", "name = \"A1\"", "name"},
      {"name = \"E2\"", "name = \"target\"", "name"},
      {"name = \"E2\"", "name = \"E 2\"", "name"},
      {"sign = -1", "sign = 0", "sign"},
      {"sign = -1", "sign = 2", "sign"},
      {"xyz_mm = [1250.0, 0.0, 500.0]", "xyz_mm = [1250.0, nan, 500.0]", "xyz_mm"},
      {"xyz_mm = [1250.0, 0.0, 500.0]", "xyz_mm = [1250.0, 0.0]", "xyz_mm"},
      {"xyz_mm = [1250.0, 0.0, 500.0]", "xyz_mm = [1e9, 0.0, 0.0]", "xyz_mm"},
      {"abc_deg = [0.0, 0.0, -90.0]", "abc_deg = [0.0, inf, 0.0]", "abc_deg"},
      {"min_deg = -90.0", "min_deg = 91.0", "min_deg"},
      {"max_deg = 90.5", "max_deg = \"90\"", "max_deg"},
      {"place_sigma_mm = 1.5", "place_sigma_mm = -1.5", "place_sigma_mm"},
      {"direction_sigma_mrad = 1.25", "direction_sigma_mrad = 1e6", "direction_sigma_mrad"},
      {"scale_sigma_mrad_per_rad = 0.2", "scale_sigma = 0.2", "scale_sigma"},
      {"max_speed_deg_s = 45.0", "max_speed_deg_s = 0", "max_speed_deg_s"},
      {"mass_kg = 350.0", "mass_kg = -1", "mass_kg"},
      {"mass_kg = 350.0", "mass_kg = nan", "mass_kg"},
      {"com_mm = [10.0, -20.0, 150.0]", "com_mm = [10.0, -20.0]", "com_mm"},
      {"compliance_sigma_rad_per_nm = 3e-6", "compliance_sigma_rad_per_nm = 2",
       "compliance_sigma_rad_per_nm"},
      {"bearing_sigma_rad_per_nm = 1e-6", "bearing_sigma_rad_per_nm = -1e-6",
       "bearing_sigma_rad_per_nm"},
      {"sign = -1", "along = [0, 0, 1]", "along"}};
  for (const auto& [line, now, key] : all)
    expect_words(robot_refusal(kRobot + with(kAxes, line, now)), {"robot.toml:", key});
  for (const char* key : {"min_deg = -90.0", "max_deg = 90.5", "name = \"E1\""})
    EXPECT_FALSE(robot_refusal(kRobot + without(kAxes, key)).empty()) << key;
  std::string third = kAxes + with(kAxes.substr(kAxes.rfind("[[positioner]]")), "E2", "E3");
  expect_words(robot_refusal(kRobot + third), {"at most 2 axes"});
}

TEST(PositionerFile, AnyTruncationIsRefusedOrReadable) {
  const std::string whole = kRobot + kAxes;
  for (std::size_t size = std::string(kRobot).size(); size < whole.size(); ++size) {
    try {
      const Robot robot = read_robot(TomlTable::parse(whole.substr(0, size), "cut.toml"));
      EXPECT_LE(robot.positioner.size(), 2u);
    } catch (const FileError&) {
    }
  }
}

TEST(PositionerCell, PutsSpheresAndObstaclesOnAnAxisThatIsThere) {
  EXPECT_EQ(positioner_cell_of().targets[0].carried_by, 2);
  const std::string floor = with(cell_text(), "on = \"E2\"", "on = \"floor\"");
  EXPECT_EQ(positioner_cell_of(floor).targets[0].carried_by, 0);
  const std::string plate =
      "\n[[obstacle]]\nid = \"plate\"\nshape = \"cylinder\"\ndiameter_mm = 500.0\nheight_mm = 20.0\n"
      "xyz_mm = [0.0, 0.0, -10.0]\non = \"E1\"\n";
  const Cell with_plate = positioner_cell_of(cell_text() + plate);
  EXPECT_EQ(with_plate.obstacles.at(0).carried_by, 1);
  EXPECT_EQ(positioner_cell_of(cell_to_toml(with_plate, "r.toml")).obstacles.at(0).carried_by, 1);
  expect_words(refused_cell(cell_text() + with(plate, "\"E1\"", "\"E7\"")),
               {"cell.toml:", "on", "E7", "\"E1\" or \"E2\""});
}

TEST(PositionerCell, RefusesATargetOnAnAxisThatIsAbsentByLineAndKey) {
  const std::string absent = with(cell_text(), "on = \"E2\"", "on = \"E3\"");
  const std::string line = std::to_string(testing::line_of(absent, "on = "));
  expect_words(refused_cell(absent), {"cell.toml:" + line, "on", "\"E3\"", "\"E1\" or \"E2\""});
  expect_words(testing::cell_refusal(cell_text()), {"cell.toml:" + line, "on", "[[positioner]]"});
  expect_words(refused_cell(with(cell_text(), "on = \"E2\"", "on = 2")), {"on"});
}

TEST(PositionerCell, RefusesWhatCannotBeOnIt) {
  expect_words(refused_cell(with(cell_text(), "kind = \"wire\"", "kind = \"wire\"\non = \"E1\"")),
               {"on", "only spheres"});
  expect_words(refused_cell(kOnTable), {"between", "positioner"});
  expect_words(refused_cell(with(cell_text(), "id = \"S2\"", "id = \"E1\"")), {"id", "axis"});
  EXPECT_EQ(
      positioner_cell_of(with(kOnTable, "id = \"S2\"", "id = \"S2\"\non = \"E2\"")).lengths.size(),
      1u);
}

TEST(PositionerCell, StatesTheAnglesAtWhichAPlaceWasTaughtAndTheBoxOfOneToBeFound) {
  EXPECT_TRUE(positioner_cell_of().targets[0].taught_rad.empty());
  const std::string taught =
      with(cell_text(), "on = \"E2\"", "on = \"E2\"\ntaught_deg = [-20.5, 90]");
  const std::vector<double> angles = {-20.5 * kRadPerDeg, 90.0 * kRadPerDeg};
  EXPECT_EQ(positioner_cell_of(taught).targets[0].taught_rad, angles);
  const Cell again = positioner_cell_of(cell_to_toml(positioner_cell_of(taught), "r.toml"));
  ASSERT_EQ(again.targets[0].taught_rad.size(), 2u);
  EXPECT_NEAR(again.targets[0].taught_rad[0], angles[0], 1e-12);
  for (const char* wrong : {"[1]", "[1, 2, 3]", "[nan, 1]", "30", "[1, 1e9]"})
    expect_words(refused_cell(with(taught, "[-20.5, 90]", wrong)), {"cell.toml:", "taught_deg"});
  expect_words(refused_cell(with(taught, "on = \"E2\"", "on = \"floor\"")), {"taught_deg"});
  const std::string boxed = with(cell_text(), "centre_mm = [1340.0, 240.0, 350.0]",
                                 "search_low_mm = [0, 0, 0]\nsearch_high_mm = [9, 9, 9]");
  EXPECT_TRUE(positioner_cell_of(boxed).targets[0].has_box);
  EXPECT_EQ(positioner_cell_of(boxed).targets[0].carried_by, 2);
}

TEST(PositionerTouches, StateAllAxesInDegrees) {
  const auto touches = rows("A1,A2,E1,E2,target\n10.5,-20.25,30,-45.5,S1\n0,0,1,2,S2\n");
  ASSERT_EQ(touches.size(), 2u);
  ASSERT_EQ(touches[0].positioner_rad.size(), 2u);
  EXPECT_DOUBLE_EQ(touches[0].positioner_rad[0], 30.0 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(touches[0].positioner_rad[1], -45.5 * kRadPerDeg);
  EXPECT_EQ(touches[0].joint_rad.size(), 2u);
  const auto again = rows(format_touches(touches, robot_of()));
  ASSERT_EQ(again.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t k = 0; k < 2; ++k)
      EXPECT_NEAR(again[i].positioner_rad[k], touches[i].positioner_rad[k], 1e-11);
}

TEST(PositionerTouches, NameTheColumnOfEveryError) {
  expect_words(refused_rows("A1,A2,E1,target\n1,2,3,S1\n"), {"touches.csv:1", "E2"});
  expect_words(refused_rows("A1,A2,E1,E2,target\n1,2,3,nan,S1\n"), {"touches.csv:2", "E2"});
  expect_words(refused_rows("A1,A2,E1,E2,target\n1,2,,4,S1\n"), {"E1"});
  expect_words(refused_rows("A1,A2,E1,E2,target\n1,2,inf,4,S1\n"), {"E1"});
  expect_words(refused_rows("A1,A2,E1,E2,target\n1,2,150,4,S1\n"),
               {"touches.csv:2", "E1", "150 deg", "-90 to 90.5 deg"});
  expect_words(refused_rows("A1,A2,E1,E2,E3,target\n1,2,3,4,5,S1\n"), {"E3"});
  const std::string plain =
      refusal([] { parse_touches("A1,A2,E1,target\n1,2,3,S1\n", "touches.csv", testing::cell()); });
  expect_words(plain, {"E1"});
}

TEST(PositionerRows, HaveItsAnglesInAllColumnsOrNone) {
  const Robot robot = robot_of();
  const JointRows with_angles =
      parse_joints("E2,A1,A2,E1\n-45.5,1,2,30\n0,3,4,95\n", "j.csv", robot);
  ASSERT_EQ(with_angles.positioner_rad.size(), 2u);
  EXPECT_DOUBLE_EQ(with_angles.positioner_rad[0][0], 30.0 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(with_angles.positioner_rad[0][1], -45.5 * kRadPerDeg);
  EXPECT_EQ(with_angles.beyond_limits, 0u);
  EXPECT_TRUE(parse_joints("A1,A2\n1,2\n", "j.csv", robot).positioner_rad.empty());
  const JointRows beyond = parse_joints("A1,A2,E1,E2\n1,2,150,0\n", "j.csv", robot);
  EXPECT_EQ(beyond.beyond_limits, 1u);
  expect_words(beyond.beyond_limits_words.at(0), {"j.csv:2", "E1", "150 deg"});
  const auto refused = [&](const std::string& text) {
    return refusal([&] { parse_joints(text, "j.csv", robot); });
  };
  expect_words(refused("A1,A2,E1\n1,2,3\n"), {"j.csv:1", "E2"});
  expect_words(refused("A1,A2,E1,E2\n1,2,nan,3\n"), {"j.csv:2", "E1"});
  expect_words(refused("A1,A2,E1,E2\n1,2,3,1e9\n"), {"E2", "out of range"});
  expect_words(refused("A1,A2,E1,E2,E3\n1,2,3,4,5\n"), {"E3"});
  expect_words(refusal([] { parse_joints("A1,A2,E1\n1,2,3\n", "j.csv", testing::robot()); }),
               {"E1"});
}

TEST(PositionerRows, OfPosesHaveThemToo) {
  const Robot robot = robot_of();
  const std::string head = "x_mm,y_mm,z_mm,a_deg,b_deg,c_deg";
  const auto rows = parse_poses(head + ",E1,E2\n1,2,3,4,5,6,30,-60\n", "p.csv", robot);
  ASSERT_EQ(rows.size(), 1u);
  ASSERT_EQ(rows[0].positioner_rad.size(), 2u);
  EXPECT_DOUBLE_EQ(rows[0].positioner_rad[1], -60.0 * kRadPerDeg);
  EXPECT_TRUE(rows[0].seed_rad.empty());
  EXPECT_TRUE(parse_poses(head + "\n1,2,3,4,5,6\n", "p.csv", robot)[0].positioner_rad.empty());
  expect_words(refusal([&] { parse_poses(head + ",E2\n1,2,3,4,5,6,7\n", "p.csv", robot); }),
               {"p.csv:1", "E1"});
}

TEST(PositionerCalibration, CarriesTheLinesOfItsAxes) {
  Calibration c;
  c.cell = positioner_cell_of();
  PositionerLine line;
  line.axis = "E1";
  line.point_m = {1.2501, 0.0002, 0.4999};
  line.direction = Eigen::Vector3d(1e-3, 1.0, 2e-3).normalized();
  line.frame = c.cell.robot.positioner[0].frame;
  line.place_u95_m = 2e-5;
  line.direction_u95_rad = 4e-5;
  line.touched_rad = {-30.0 * kRadPerDeg, 45.0 * kRadPerDeg};
  c.positioner = {line};
  c.parameters.push_back(
      {positioner_parameter(1, AxisError::kScale), "mrad/rad", 1000.0, 0.0, 2e-5, 1e-6});
  c.covariance = Eigen::MatrixXd::Constant(1, 1, 1e-12);
  c.frame_basis = Eigen::MatrixXd(1, 0);
  const std::string text = calibration_to_json(c);
  expect_words(text, {"\"positioner\"", "\"place_u95_mm\": 0.02", "\"E2.scale\""});
  const Calibration again = calibration_from_json(text, "c.json");
  ASSERT_EQ(again.positioner.size(), 1u);
  EXPECT_EQ(again.positioner[0].axis, "E1");
  EXPECT_LT((again.positioner[0].point_m - line.point_m).norm(), 1e-12);
  EXPECT_LT((again.positioner[0].direction - line.direction).norm(), 1e-12);
  EXPECT_NEAR(again.positioner[0].direction_u95_rad, 4e-5, 1e-15);
  EXPECT_EQ(again.parameters[0].key, c.parameters[0].key);
  EXPECT_EQ(again.cell.targets[0].carried_by, 2);
  const std::string bad =
      with(testing::without_sum(text), "\"place_u95_mm\": 0.02", "\"place_u95_mm\": -1");
  expect_words(refusal([&] { calibration_from_json(bad, "c.json"); }), {"place_u95_mm"});
  ASSERT_TRUE(again.positioner[0].touched_rad.has_value());
  EXPECT_NEAR((*again.positioner[0].touched_rad)[1], 45.0 * kRadPerDeg, 1e-15);
  auto json = nlohmann::json::parse(testing::without_sum(text));
  for (const char* range : {"[45, -30]", "[1]", "[1, 2, 3]", "[1, null]", "\"all\"", "[]"}) {
    json["positioner"][0]["touched_deg"] = nlohmann::json::parse(range);
    expect_words(refusal([&] { calibration_from_json(json.dump(), "c.json"); }), {"touched_deg"});
  }
  json["positioner"][0].erase("touched_deg");
  EXPECT_FALSE(calibration_from_json(json.dump(), "c.json").positioner[0].touched_rad);
}

}  // namespace
}  // namespace cellcal::calib
