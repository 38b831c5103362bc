// A linear unit in robot files and tables of touches.

#include <gtest/gtest.h>

#include "calib/files/robot_file.h"
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

const std::string kUnit =
    "[[joint]]\nname = \"E1\"\nkind = \"prismatic\"\nalong = [0.0, 0.6, 0.8]\nmin_mm = -250.0\n"
    "max_mm = 2750\nmax_speed_mm_s = 1250.0\nscale_sigma_mm_per_m = 0.25\n"
    "direction_sigma_mrad = 1.5\nstraightness_sigma_mm = 0.2\nturn_sigma_mrad_per_m = 0.4\n"
    "turn_sigma_mrad = 0.1\n\n";

/// The document with the line of a key replaced, or left out.
std::string set(const std::string& document, const std::string& key, const std::string& line) {
  const std::size_t at = document.find("\n" + key + " =");
  if (at == std::string::npos) {
    ADD_FAILURE() << "the document does not hold: " << key;
    return document;
  }
  std::string text = document;
  const std::size_t end = text.find('\n', at + 1);
  return text.replace(at + 1, end - at, line.empty() ? "" : line + "\n");
}

/// The test robot mounted on the unit.
std::string on_unit(const std::string& unit = kUnit) {
  std::string text = kRobot;
  return text.insert(text.find("[[joint]]"), unit);
}

Robot robot_on_unit(const std::string& unit = kUnit) {
  return read_robot(TomlTable::parse(on_unit(unit), "robot.toml"));
}

Cell cell_on_unit() { return parse_cell({"cell.toml", kCell, "robot.toml", on_unit()}); }

std::vector<Touch> rows_on_unit(const std::string& text) {
  return parse_touches(text, "touches.csv", cell_on_unit());
}

std::string touches_refused(const std::string& text) {
  return refusal([&] { rows_on_unit(text); });
}

TEST(LinearUnitFile, IsReadIntoMetresAndRadians) {
  const Robot robot = robot_on_unit();
  ASSERT_EQ(robot.joints.size(), 3u);
  EXPECT_EQ(robot.first_turning(), 1u);
  const Joint& unit = robot.joints[0];
  ASSERT_TRUE(unit.is_prismatic());
  EXPECT_EQ(unit.name, "E1");
  EXPECT_LT((unit.guide->along - Eigen::Vector3d(0.0, 0.6, 0.8)).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(unit.min_rad, -0.25);
  EXPECT_DOUBLE_EQ(unit.max_rad, 2.75);
  EXPECT_DOUBLE_EQ(unit.max_speed_rad_s, 1.25);
  EXPECT_DOUBLE_EQ(unit.guide->scale_sigma, 0.25e-3);
  EXPECT_DOUBLE_EQ(unit.guide->direction_sigma_rad, 1.5e-3);
  EXPECT_DOUBLE_EQ(unit.guide->straightness_sigma_m, 0.2e-3);
  EXPECT_DOUBLE_EQ(unit.guide->turn_sigma_rad_m, 0.4e-3);
  EXPECT_DOUBLE_EQ(unit.guide->turn_sigma_rad, 0.1e-3);
  EXPECT_FALSE(robot.joints[1].is_prismatic());
}

TEST(LinearUnitFile, HasUsualSigmasWhereNoneAreStatedAndNoneWhereTheyAreZero) {
  std::string bare = kUnit, exact = kUnit;
  for (const char* key : {"scale_sigma_mm_per_m", "direction_sigma_mrad", "straightness_sigma_mm",
                          "turn_sigma_mrad_per_m", "turn_sigma_mrad"}) {
    bare = set(bare, key, "");
    exact = set(exact, key, std::string(key) + " = 0.0");
  }
  const auto usual = robot_on_unit(bare).joints[0].guide,
             none = robot_on_unit(exact).joints[0].guide;
  EXPECT_DOUBLE_EQ(usual->scale_sigma, 0.5e-3);
  EXPECT_DOUBLE_EQ(usual->direction_sigma_rad, 3e-3);
  EXPECT_DOUBLE_EQ(usual->straightness_sigma_m, 0.3e-3);
  EXPECT_EQ(none->scale_sigma + none->direction_sigma_rad + none->straightness_sigma_m +
                none->turn_sigma_rad_m + none->turn_sigma_rad,
            0.0);
}

TEST(LinearUnitFile, SurvivesWritingAndReading) {
  const Robot robot = robot_on_unit();
  const std::string written = robot_to_toml(robot);
  const Robot again = read_robot(TomlTable::parse(written, "again.toml"));
  EXPECT_EQ(robot_to_toml(again), written);
  ASSERT_TRUE(again.joints[0].is_prismatic());
  EXPECT_LT((again.joints[0].guide->along - robot.joints[0].guide->along).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(again.joints[0].max_rad, robot.joints[0].max_rad);
  EXPECT_DOUBLE_EQ(again.joints[1].tolerance_length_m, robot.joints[1].tolerance_length_m);
  EXPECT_DOUBLE_EQ(again.joints[2].tolerance_angle_rad, robot.joints[2].tolerance_angle_rad);
}

TEST(LinearUnitFile, IsPartOfTheNominalGeometry) {
  const std::string own = nominal_geometry_sha256(robot_on_unit());
  EXPECT_NE(own, nominal_geometry_sha256(testing::robot()));
  EXPECT_NE(own, nominal_geometry_sha256(robot_on_unit(set(kUnit, "along", "along = [1, 0, 0]"))));
}

TEST(LinearUnitFile, AJointMayStateThatItTurns) {
  const std::string text = with(kRobot, "name = \"A2\"", "name = \"A2\"\nkind = \"revolute\"");
  const Robot robot = read_robot(TomlTable::parse(text, "robot.toml"));
  EXPECT_FALSE(robot.joints[1].is_prismatic());
}

TEST(LinearUnitFile, NamesTheLineAndKeyOfEveryError) {
  const testing::Broken all[] = {
      {"along", "along = [0.0, 0.6]", "along"},
      {"along", "along = [0.0, 0.6, 0.6]", "along"},
      {"along", "along = [0.0, nan, 1.0]", "along"},
      {"along", "along = [0.0, 0.0, 0.0]", "along"},
      {"along", "along = \"y\"", "along"},
      {"kind", "kind = \"linear\"", "kind"},
      {"kind", "kind = 1", "kind"},
      {"min_mm", "min_mm = 2740.0", "min_mm"},
      {"min_mm", "min_mm = inf", "min_mm"},
      {"max_mm", "max_mm = 1e9", "max_mm"},
      {"max_mm", "max_mm = -300", "min_mm"},
      {"max_speed_mm_s", "max_speed_mm_s = 0.0", "max_speed_mm_s"},
      {"scale_sigma_mm_per_m", "scale_sigma_mm_per_m = -0.1", "scale_sigma_mm_per_m"},
      {"turn_sigma_mrad", "turn_sigma_mrad = 1e6", "turn_sigma_mrad"},
      {"straightness_sigma_mm", "straightness_sigma_mm = \"0.2\"", "straightness_sigma_mm"},
      {"max_mm", "max_deg = 155.0", "max_mm"},
      {"turn_sigma_mrad", "errors = [\"theta\"]", "errors"},
      {"turn_sigma_mrad", "d_mm = 400.0", "d_mm"},
      {"turn_sigma_mrad", "sign = -1", "sign"}};
  for (const auto& [line, now, key] : all) {
    const std::string text = on_unit(set(kUnit, line, now));
    expect_words(robot_refusal(text), {"robot.toml:", key});
  }
  for (const char* key : {"name", "along", "min_mm", "max_mm"})
    expect_words(robot_refusal(on_unit(set(kUnit, key, ""))), {"robot.toml", key});
}

TEST(LinearUnitFile, OnlyTheFirstJointMayBePrismaticAndItCarriesAnArm) {
  const std::string second = kUnit + set(kUnit, "name", "name = \"E2\"");
  expect_words(robot_refusal(on_unit(second)), {"kind", "first joint"});
  std::string last = std::string(kRobot);
  last.insert(last.rfind("[[joint]]"), kUnit);
  expect_words(robot_refusal(last), {"kind", "first joint"});
  std::string alone = on_unit();
  const std::size_t first = alone.find("[[joint]]\nname = \"A1\"");
  ASSERT_NE(first, std::string::npos);
  alone = alone.substr(0, first);
  expect_words(robot_refusal(alone), {"kind", "carries the arm"});
}

TEST(LinearUnitFile, AnArmKeepsItsOwnKeys) {
  const std::string text = with(kRobot, "name = \"A2\"", "name = \"A2\"\nmin_mm = 0.0");
  expect_words(robot_refusal(text), {"min_mm"});
}

TEST(LinearUnitTouches, AreInMillimetresBesideDegrees) {
  for (const char* head : {"E1,A1,A2,target\n", "E1_mm,A1,A2,target\n", "E1 [mm],A1,A2,target\n",
                           "E1 [mm],A1 [deg],A2 [deg],target\n"}) {
    const auto touches = rows_on_unit(head + std::string("1234.5,10.5,-20.25,S1\n"));
    ASSERT_EQ(touches.size(), 1u) << head;
    EXPECT_DOUBLE_EQ(touches[0].joint_rad[0], 1.2345) << head;
    EXPECT_DOUBLE_EQ(touches[0].joint_rad[1], 10.5 * kRadPerDeg) << head;
  }
  const auto metres = rows_on_unit("E1 [m],A1,A2,target\n1.2345,10.5,-20.25,S1\n");
  EXPECT_DOUBLE_EQ(metres[0].joint_rad[0], 1.2345);
}

TEST(LinearUnitTouches, SurviveWritingAndReading) {
  const auto touches = rows_on_unit("E1,A1,A2,target\n1234.56789,10.5,-20.25,S1\n-100,0,0,S2\n");
  const auto again = rows_on_unit(format_touches(touches, robot_on_unit()));
  ASSERT_EQ(again.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i)
    for (std::size_t k = 0; k < 3; ++k)
      EXPECT_NEAR(again[i].joint_rad[k], touches[i].joint_rad[k], 1e-11);
}

TEST(LinearUnitTouches, NameTheColumnOfEveryError) {
  expect_words(touches_refused("A1,A2,target\n1,2,S1\n"), {"touches.csv:1", "E1"});
  expect_words(touches_refused("E1 [deg],A1,A2,target\n10,1,2,S1\n"), {"E1", "mm"});
  expect_words(touches_refused("E1,A1 [mm],A2,target\n10,1,2,S1\n"), {"A1"});
  expect_words(touches_refused("E1,E1_mm,A1,A2,target\n10,10,1,2,S1\n"), {"E1"});
  expect_words(touches_refused("E1,A1,A2,target\n3000,1,2,S1\n"),
               {"touches.csv:2", "E1", "3000 mm", "-250 to 2750 mm"});
  expect_words(touches_refused("E1,A1,A2,target\n1e9,1,2,S1\n"), {"E1", "millimetres"});
  expect_words(touches_refused("E1,A1,A2,target\nnan,1,2,S1\n"), {"E1"});
  expect_words(touches_refused("E1,A1,A2,target\n,1,2,S1\n"), {"E1"});
}

TEST(LinearUnitTouches, JointsForPredictionMayLieBeyondTheLimits) {
  const JointRows rows = parse_joints("A1,A2,E1\n1,2,4000\n", "joints.csv", robot_on_unit());
  ASSERT_EQ(rows.joint_rad.size(), 1u);
  EXPECT_DOUBLE_EQ(rows.joint_rad[0][0], 4.0);
  EXPECT_EQ(rows.beyond_limits, 1u);
}

}  // namespace
}  // namespace cellcal::calib
