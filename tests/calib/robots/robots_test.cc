// Every shipped robot loads, with the geometry of its source.

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <numbers>

#include "calib/files/files.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {
namespace {

constexpr double kDeg = std::numbers::pi / 180.0;
constexpr double kMicron = 1e-6;
const std::filesystem::path kFolder = CELLCAL_ROBOTS_FOLDER;

std::vector<std::filesystem::path> shipped() {
  std::vector<std::filesystem::path> files;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder))
    if (entry.path().extension() == ".toml") files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

Eigen::Isometry3d flange(const std::string& file, std::vector<double> joint_deg) {
  for (double& angle : joint_deg) angle *= kDeg;
  return ArmModel(load_robot(kFolder / file), Tool{}).nominal_tcp(joint_deg);
}

void expect_at_mm(const Eigen::Isometry3d& frame, double x, double y, double z) {
  EXPECT_NEAR(frame.translation().x(), x * 1e-3, kMicron);
  EXPECT_NEAR(frame.translation().y(), y * 1e-3, kMicron);
  EXPECT_NEAR(frame.translation().z(), z * 1e-3, kMicron);
}

TEST(Robots, EveryShippedFileLoadsWithSourceLimitsSpeedsAndTolerances) {
  ASSERT_GE(shipped().size(), 46u);
  for (const auto& file : shipped()) {
    SCOPED_TRACE(file.filename().string());
    const Robot robot = load_robot(file);
    EXPECT_FALSE(robot.name.empty());
    EXPECT_FALSE(robot.source.empty());
    EXPECT_NEAR(robot.gravity_m_s2.norm(), 9.81, 0.02);
    for (const Joint& joint : robot.joints) {
      EXPECT_LT(joint.min_rad, joint.max_rad) << joint.name;
      EXPECT_GT(joint.max_speed_rad_s, 0.1) << joint.name;
      EXPECT_EQ(joint.errors.size(), 4u) << joint.name;
      EXPECT_GT(joint.tolerance_length_m, 1e-4) << joint.name;
      EXPECT_LT(joint.tolerance_length_m, 2e-3) << joint.name;
      EXPECT_GT(joint.tolerance_angle_rad, 1e-4) << joint.name;
      EXPECT_LT(joint.tolerance_angle_rad, 1e-2) << joint.name;
    }
  }
}

TEST(Robots, NoTwoFilesBearTheSameName) {
  std::map<std::string, std::string> seen;
  for (const auto& file : shipped()) {
    const auto [other, fresh] = seen.emplace(load_robot(file).name, file.filename().string());
    EXPECT_TRUE(fresh) << file.filename() << " and " << other->second;
  }
}

TEST(Robots, KukaArmsPointTheirFlangeAlongXWithAllAxesAtZeroAndReachWhatTheirNameSays) {
  for (const auto& file : shipped()) {
    const std::string name = file.filename().string();
    if (!name.starts_with("kr")) continue;
    SCOPED_TRACE(name);
    const Robot robot = load_robot(file);
    ASSERT_EQ(robot.joints.size(), 6u);
    const Eigen::Isometry3d at_zero = flange(name, {0, 0, 0, 0, 0, 0});
    EXPECT_NEAR(at_zero.linear().col(2).x(), 1.0, 1e-12);
    EXPECT_NEAR(at_zero.translation().y(), 0.0, kMicron);
    // Axis 1 to the wrist at full stretch; a model's name rounds it, "r900" is 900 mm.
    const auto& j = robot.joints;
    const double reach_mm = 1e3 * (j[0].a_m + j[1].a_m + std::hypot(j[3].d_m, j[2].a_m));
    const auto r = name.rfind("_r");
    if (r == std::string::npos) continue;
    const int stated_mm = std::atoi(name.c_str() + r + 2);
    EXPECT_NEAR(reach_mm, stated_mm, 40.0);
  }
}

TEST(Robots, KukaAxesPointAlongMinusZYYMinusXYMinusXAtZero) {
  Eigen::Matrix<double, 3, 6> expected;
  expected << 0, 0, 0, -1, 0, -1,  //
      0, 1, 1, 0, 1, 0,            //
      -1, 0, 0, 0, 0, 0;
  for (const auto& file : shipped()) {
    if (!file.filename().string().starts_with("kr")) continue;
    SCOPED_TRACE(file.filename().string());
    const ArmModel model(load_robot(file), Tool{});
    const auto jacobian = model.nominal_jacobian(std::vector<double>(6, 0.0));
    EXPECT_LT((jacobian.bottomRows<3>() - expected).norm(), 1e-12) << jacobian.bottomRows<3>();
  }
}

TEST(Robots, TheSeedPapersArmPointsForwardAt880And1040) {
  const Eigen::Isometry3d frame = flange("kr5_r1400.toml", {0, -90, 90, 0, 0, 0});
  expect_at_mm(frame, 880.0, 0.0, 1040.0);
  EXPECT_NEAR(frame.linear().col(2).x(), 1.0, 1e-12);
}

TEST(Robots, HomeTellsTheTwoKr5Apart) {
  expect_at_mm(flange("kr5_arc.toml", {0, -90, 90, 0, 90, 0}), 800.0, 0.0, 1005.0);
  expect_at_mm(flange("kr5_r1400.toml", {0, -90, 90, 0, 90, 0}), 800.0, 0.0, 960.0);
  expect_at_mm(flange("kr5_arc.toml", {0, 0, 0, 0, 0, 0}), 1515.0, 0.0, 520.0);
  expect_at_mm(flange("kr5_r1400.toml", {0, 0, 0, 0, 0, 0}), 1480.0, 0.0, 440.0);
}

TEST(Robots, TheParallelAxesOfKukaArmsHaveBetaInPlaceOfD) {
  for (const auto& file : shipped()) {
    if (!file.filename().string().starts_with("kr")) continue;
    SCOPED_TRACE(file.filename().string());
    const std::vector<Joint> joints = load_robot(file).joints;
    for (std::size_t i = 0; i < joints.size(); ++i) {
      const bool beta =
          std::count(joints[i].errors.begin(), joints[i].errors.end(), JointError::kBeta) > 0;
      const bool d =
          std::count(joints[i].errors.begin(), joints[i].errors.end(), JointError::kD) > 0;
      EXPECT_EQ(beta, i == 1) << joints[i].name;
      EXPECT_EQ(d, i != 1) << joints[i].name;
    }
  }
}

TEST(Robots, TheIiwaStandsUprightAndThePandaHangsItsHandAtZero) {
  expect_at_mm(flange("iiwa14.toml", {0, 0, 0, 0, 0, 0, 0}), 0.0, 0.0, 1306.0);
  const Eigen::Isometry3d panda = flange("panda.toml", {0, 0, 0, 0, 0, 0, 0});
  expect_at_mm(panda, 88.0, 0.0, 926.0);
  EXPECT_NEAR(panda.linear()(2, 2), -1.0, 1e-12);
}

TEST(Robots, LinkMassesHangWhereTheirSourceHasThem) {
  // The total and the common centre at zero, computed from the sources by hand.
  const Robot robot = load_robot(kFolder / "iiwa14.toml");
  const ArmShape shape = [&] {
    const ArmModel model(robot, Tool{});
    return model.shape(model.prepare(std::vector<double>(7, 0.0)), nullptr);
  }();
  double mass = 0.0;
  for (const Joint& joint : robot.joints) mass += joint.mass_kg;
  EXPECT_NEAR(mass, 22.85, 0.01);
  // The second link's centre is 47.5 mm off its axis along y and 76 mm above it.
  const Joint& a2 = robot.joints[1];
  EXPECT_NEAR(a2.com_m.norm(), std::hypot(0.000572, 0.037548, 0.076322), 1e-3);
  EXPECT_EQ(shape.joint_origin_m.size(), 8u);
}

}  // namespace
}  // namespace cellcal::calib
