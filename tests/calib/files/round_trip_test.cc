// Written files are read back, to the digits specified by the formats.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "calib/files/toml.h"
#include "calib/model/units.h"
#include "tests/calib/files/documents.h"
#include "tests/calib/model/random_arm.h"

namespace cellcal::calib {
namespace {

constexpr int kArms = 100;

void expect_near(const Robot& a, const Robot& b) {
  constexpr double kSame = 1e-12;  // m and rad: fourteen digits of degrees and millimetres
  EXPECT_EQ(a.name, b.name);
  EXPECT_EQ(a.source, b.source);
  EXPECT_LT((a.gravity_m_s2 - b.gravity_m_s2).norm(), 1e-10);
  EXPECT_LT((a.base_fixed.matrix() - b.base_fixed.matrix()).norm(), kSame);
  EXPECT_LT((a.flange_fixed.matrix() - b.flange_fixed.matrix()).norm(), kSame);
  ASSERT_EQ(a.joints.size(), b.joints.size());
  for (std::size_t i = 0; i < a.joints.size(); ++i) {
    const Joint &x = a.joints[i], &y = b.joints[i];
    EXPECT_EQ(x.name, y.name);
    EXPECT_EQ(x.sign, y.sign);
    EXPECT_EQ(x.errors, y.errors);
    EXPECT_NEAR(x.offset_rad, y.offset_rad, kSame);
    EXPECT_NEAR(x.d_m, y.d_m, kSame);
    EXPECT_NEAR(x.a_m, y.a_m, kSame);
    EXPECT_NEAR(x.alpha_rad, y.alpha_rad, kSame);
    EXPECT_NEAR(x.beta_rad, y.beta_rad, kSame);
    EXPECT_NEAR(x.min_rad, y.min_rad, kSame);
    EXPECT_NEAR(x.max_rad, y.max_rad, kSame);
    EXPECT_NEAR(x.max_speed_rad_s, y.max_speed_rad_s, kSame);
    EXPECT_NEAR(x.tolerance_length_m, y.tolerance_length_m, 1e-14);
    EXPECT_NEAR(x.tolerance_angle_rad, y.tolerance_angle_rad, 1e-14);
    EXPECT_NEAR(x.mass_kg, y.mass_kg, 1e-9);
    EXPECT_LT((x.com_m - y.com_m).norm(), kSame);
    EXPECT_NEAR(x.compliance_sigma_rad_per_nm, y.compliance_sigma_rad_per_nm, 1e-17);
    EXPECT_EQ(x.harmonics, y.harmonics);
    EXPECT_NEAR(x.gear_ratio, y.gear_ratio, 1e-9);
    EXPECT_NEAR(x.harmonic_sigma_rad, y.harmonic_sigma_rad, 1e-15);
    EXPECT_NEAR(x.bearing_sigma_rad_per_nm, y.bearing_sigma_rad_per_nm, 1e-15);
    EXPECT_NEAR(x.counterbalance_sigma_rad, y.counterbalance_sigma_rad, 1e-15);
    EXPECT_NEAR(x.stiffening_sigma_rad, y.stiffening_sigma_rad, 1e-15);
    if (x.stiffening_sigma_rad > 0.0) {
      EXPECT_NEAR(x.stiffening_nm, y.stiffening_nm, 1e-9);
    }
    ASSERT_EQ(x.waves.size(), y.waves.size());
    for (std::size_t k = 0; k < x.waves.size(); ++k) {
      EXPECT_EQ(x.waves[k].order, y.waves[k].order);
      EXPECT_NEAR(x.waves[k].sigma_rad, y.waves[k].sigma_rad, 1e-15);
    }
    EXPECT_NEAR(x.function_sigma_rad, y.function_sigma_rad, 1e-15);
    if (x.function_sigma_rad > 0.0) {
      EXPECT_NEAR(x.function_fast_sigma_rad, y.function_fast_sigma_rad, 1e-15);
      EXPECT_NEAR(x.function_reach_rad, y.function_reach_rad, 1e-12);
      EXPECT_NEAR(x.function_min_rad, y.function_min_rad, 1e-12);
      EXPECT_NEAR(x.function_max_rad, y.function_max_rad, 1e-12);
    }
  }
}

Robot read_back(const Robot& robot) {
  return read_robot(TomlTable::parse(robot_to_toml(robot), "robot.toml"));
}

TEST(RobotRoundTrip, KeepsAnyArm) {
  Random random(1);
  for (int k = 0; k < kArms; ++k) {
    Robot robot = testing::random_arm(random).robot;
    robot.source = "drawn";
    expect_near(robot, read_back(robot));
    expect_near(read_back(robot),
                read_robot(table_from_json(toml_to_json(robot_to_toml(robot)), "robot.json")));
  }
}

TEST(RobotRoundTrip, KeepsWhatIsSetWithoutItsCompanions) {
  Robot robot = testing::robot();
  robot.joints[1].gear_ratio = 77.5;
  robot.joints[1].harmonic_sigma_rad = 1e-5;
  robot.joints[1].bearing_sigma_rad_per_nm = 3e-7;
  robot.joints[1].counterbalance_sigma_rad = 1e-3;
  robot.joints[1].stiffening_sigma_rad = 3e-4;
  robot.joints[1].stiffening_nm = 700.0;
  robot.joints[1].function_sigma_rad = 2e-4;
  robot.joints[1].function_reach_rad = 0.1;
  robot.joints[1].function_min_rad = -1.0;
  robot.joints[1].function_max_rad = 0.5;
  robot.joints[1].waves = {{103, 3e-5}};
  robot.joints[1].com_m = {0.1, 0.2, 0.3};
  expect_near(robot, read_back(robot));
}

TEST(RobotRoundTrip, SettlesAfterOnce) {
  Random random(2);
  for (int k = 0; k < kArms; ++k) {
    const std::string once = robot_to_toml(read_back(testing::random_arm(random).robot));
    EXPECT_EQ(robot_to_toml(read_robot(TomlTable::parse(once, "robot.toml"))), once);
  }
}

TEST(RobotRoundTrip, WritesWhatAPersonWrote) {
  const std::string text = robot_to_toml(testing::robot());
  for (const char* line :
       {"offset_deg = 12.5", "a_mm = 180.0", "beta_deg = 1.5", "min_deg = -155.0",
        "angle_deg = 0.07", "gear_ratio = -120.5", "compliance_sigma_rad_per_nm = 1.5e-06",
        "gravity = [0.0, 0.1, -9.8]", "harmonic_sigma_arcsec = 10.0", "xyz_mm = [1.0, 2.0, 3.0]"})
    EXPECT_NE(text.find(line), std::string::npos) << line << " is not in\n" << text;
}

TEST(RobotRoundTrip, KeepsNamesWithQuotesAndBackslashesAndASourceOfSeveralLines) {
  Robot robot = testing::robot();
  robot.source = "a\tb\r\nc";
  EXPECT_EQ(read_back(robot).source, robot.source);
  for (const std::string& name : {std::string("5\" arm"), std::string("C:\\temp\\new"),
                                  std::string("Greifarm für Köln \xE2\x84\xA2"), std::string()}) {
    robot.name = name;
    robot.source = name;
    EXPECT_EQ(read_back(robot).name, name);
    EXPECT_EQ(read_back(robot).source, name);
  }
}

void expect_near(const Cell& a, const Cell& b) {
  constexpr double kSame = 1e-12;
  expect_near(a.robot, b.robot);
  EXPECT_LT((a.tool.tcp.matrix() - b.tool.tcp.matrix()).norm(), kSame);
  EXPECT_LT((a.tool.tcp_sigma_m - b.tool.tcp_sigma_m).norm(), kSame);
  EXPECT_LT((a.tool.com_m - b.tool.com_m).norm(), kSame);
  EXPECT_NEAR(a.tool.mass_kg, b.tool.mass_kg, 1e-10);
  EXPECT_NEAR(a.tool.length_m, b.tool.length_m, kSame);
  EXPECT_NEAR(a.tool.tip_radius_m, b.tool.tip_radius_m, kSame);
  EXPECT_NEAR(a.tool.deflection_sigma, b.tool.deflection_sigma, kSame);
  ASSERT_EQ(a.targets.size(), b.targets.size());
  for (std::size_t i = 0; i < a.targets.size(); ++i) {
    const Target &x = a.targets[i], &y = b.targets[i];
    EXPECT_EQ(x.id, y.id);
    EXPECT_EQ(x.kind, y.kind);
    EXPECT_EQ(x.has_centre, y.has_centre);
    EXPECT_EQ(x.has_normal, y.has_normal);
    EXPECT_LT((x.normal - y.normal).norm(), kSame);
    EXPECT_NEAR(x.normal_sigma_rad, y.normal_sigma_rad, 1e-15);
    EXPECT_NEAR(x.extent_m, y.extent_m, kSame);
    EXPECT_NEAR(x.diameter_m, y.diameter_m, kSame);
    EXPECT_NEAR(x.diameter_sigma_m, y.diameter_sigma_m, 1e-15);
    EXPECT_LT((x.centre_m - y.centre_m).norm(), kSame);
    EXPECT_NEAR(x.centre_sigma_m, y.centre_sigma_m, kSame);
  }
  ASSERT_EQ(a.lengths.size(), b.lengths.size());
  for (std::size_t i = 0; i < a.lengths.size(); ++i) {
    EXPECT_EQ(a.lengths[i].from, b.lengths[i].from);
    EXPECT_EQ(a.lengths[i].to, b.lengths[i].to);
    EXPECT_NEAR(a.lengths[i].length_m, b.lengths[i].length_m, kSame);
    EXPECT_NEAR(a.lengths[i].sigma_m, b.lengths[i].sigma_m, 1e-15);
  }
  EXPECT_NEAR(a.touch_sigma_m, b.touch_sigma_m, 1e-15);
  EXPECT_NEAR(a.radius_offset_sigma_m, b.radius_offset_sigma_m, 1e-15);
}

Cell read_back(const Cell& cell, const std::string& reference) {
  return read_cell(TomlTable::parse(cell_to_toml(cell, reference), "cell.toml"), cell.robot);
}

TEST(CellRoundTrip, KeepsEveryKindOfTarget) {
  Cell cell = testing::cell();
  cell.targets.push_back(cell.targets[2]);
  cell.targets.back().id = "P";
  cell.targets.back().kind = TargetKind::kPoint;
  cell.targets.push_back(cell.targets[0]);
  cell.targets.back().id = "E";
  cell.targets.back().kind = TargetKind::kPlane;
  cell.targets.back().diameter_m = cell.targets.back().diameter_sigma_m = 0.0;
  expect_near(cell, read_back(cell, "two.toml"));  // without a normal, too
  cell.targets.back().has_normal = true;
  cell.targets.back().normal = Eigen::Vector3d(1.0, -2.0, 3.0).normalized();
  cell.targets.back().normal_sigma_rad = 0.01;
  cell.targets.back().extent_m = 0.15;
  cell.targets.push_back({});
  cell.targets.back().id = "L";
  cell.targets.back().kind = TargetKind::kTracker;
  expect_near(cell, read_back(cell, "two.toml"));
}

TEST(CellRoundTrip, KeepsAnyTool) {
  Random random(3);
  Cell cell = testing::cell();
  for (int k = 0; k < kArms; ++k) {
    cell.tool = testing::random_arm(random).tool;
    expect_near(cell, read_back(cell, "two.toml"));
  }
}

TEST(CellRoundTrip, KeepsIdsAndReferencesWithBackslashesAndQuotes) {
  Cell cell = testing::cell();
  cell.targets[0].id = "left\\back";
  cell.lengths[0].from = cell.targets[0].id;
  cell.targets[1].id = "n\\u0041";
  cell.lengths[0].to = cell.targets[1].id;
  expect_near(cell, read_back(cell, "C:\\robots\\\"new\".toml"));
}

TEST(FrameRoundTrip, KeepsEveryRotationGimbalLockIncluded) {
  Random random(4);
  for (int k = 0; k < 1000; ++k) {
    const Eigen::Isometry3d pose = testing::random_pose(random, 2.0);
    EXPECT_LT((to_isometry(to_frame(pose)).matrix() - pose.matrix()).norm(), 1e-12);
  }
  for (const double b : {90.0, -90.0})
    for (const double a : {0.0, 33.0, -170.0})
      for (const double c : {0.0, 12.0, 179.0}) {
        const Eigen::Isometry3d pose = to_isometry({{1, 2, 3}, {a, b, c}});
        EXPECT_LT((to_isometry(to_frame(pose)).matrix() - pose.matrix()).norm(), 1e-12);
      }
}

TEST(TouchesRoundTrip, KeepsAnglesToABillionthOfADegreeAndEverythingElse) {
  Random random(5);
  Cell cell = testing::cell();
  cell.targets.push_back({});
  cell.targets.back().id = "L";
  cell.targets.back().kind = TargetKind::kTracker;
  std::vector<Touch> touches;
  for (int k = 0; k < 500; ++k) {
    Touch touch;
    for (const Joint& joint : cell.robot.joints)
      touch.joint_rad.push_back(random.uniform(joint.min_rad, joint.max_rad));
    const Target& target = cell.targets[random.below(4)];
    touch.target = target.id;
    if (random.uniform() < 0.3) touch.set = TouchSet::kCheck;
    if (random.uniform() < 0.5) touch.sigma_m = random.uniform(1e-6, 1e-4);
    if (target.kind == TargetKind::kWire) touch.radius_m = random.uniform(0.1, 2.0);
    if (target.kind == TargetKind::kTracker && random.uniform() < 0.9)  // otherwise its origin
      for (double& m : touch.tracker_m) m = random.uniform(-20.0, 20.0);
    if (random.uniform() < 0.5) touch.speed_m_s = random.uniform(1e-3, 2e-2);
    if (random.uniform() < 0.5) touch.approach = {0.48, -0.6, 0.64};
    if (random.uniform() < 0.5) touch.time = "2024-09-24T10:00:00.125Z";
    touches.push_back(touch);
  }
  const auto back = parse_touches(format_touches(touches, cell.robot), "touches.csv", cell);
  ASSERT_EQ(back.size(), touches.size());
  for (std::size_t i = 0; i < touches.size(); ++i) {
    for (std::size_t j = 0; j < touches[i].joint_rad.size(); ++j)
      EXPECT_NEAR(back[i].joint_rad[j], touches[i].joint_rad[j], 1e-9 * kRadPerDeg);
    EXPECT_EQ(back[i].target, touches[i].target);
    EXPECT_EQ(back[i].set, touches[i].set);
    EXPECT_EQ(back[i].time, touches[i].time);
    EXPECT_NEAR(back[i].speed_m_s, touches[i].speed_m_s, 1e-5 * touches[i].speed_m_s);
    ASSERT_EQ(back[i].approach.has_value(), touches[i].approach.has_value());
    for (std::size_t j = 0; j < 3 && touches[i].approach; ++j)
      EXPECT_NEAR((*back[i].approach)[j], (*touches[i].approach)[j], 1e-9);
    EXPECT_NEAR(back[i].sigma_m, touches[i].sigma_m, 1e-5 * touches[i].sigma_m);
    EXPECT_NEAR(back[i].radius_m, touches[i].radius_m, 1e-8);
    for (int j = 0; j < 3; ++j)
      EXPECT_NEAR(back[i].tracker_m[j], touches[i].tracker_m[j], 1e-8 * 20.0);
  }
  EXPECT_EQ(format_touches(back, cell.robot), format_touches(touches, cell.robot));
}

}  // namespace
}  // namespace cellcal::calib
