#include "calib/export/tables.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "calib/model/units.h"
#include "tests/calib/export/arms.h"

namespace cellcal::calib::testing {
namespace {

/// As a ROS 2 driver reads it: name, then six numbers.
std::vector<Eigen::Isometry3d> frames_of_yaml(const std::string& text) {
  std::vector<Eigen::Isometry3d> frames;
  std::istringstream in(text);
  std::string line;
  std::vector<double> values;
  while (std::getline(in, line)) {
    if (!line.starts_with("    ")) continue;
    values.push_back(number(line.substr(line.find(':') + 1)).value());
    if (values.size() < 6) continue;
    frames.push_back(Eigen::Translation3d(values[0], values[1], values[2]) *
                     Eigen::Quaterniond(rotation_of({values[3], values[4], values[5]})));
    values.clear();
  }
  return frames;
}

TEST(RosYaml, HasTheCalibratedFrames) {
  const RigidArm arm = calibrated_rigid_arm(rigid_calibration(21));
  const JointFrames frames = joint_frames(arm);
  const std::string text = ros_yaml(frames, "one\ntwo");
  EXPECT_TRUE(text.starts_with("# one\n# two\nkinematics:\n  joint_a1:\n    x: 0\n")) << text;
  const auto read = frames_of_yaml(text);
  ASSERT_EQ(read.size(), 8U);
  std::mt19937 random(22);
  const auto q = random_joints(arm.robot, random);
  JointFrames again = frames;
  for (std::size_t i = 0; i < 6; ++i) again.joints[i].origin = read[i];
  again.flange = read[6];
  EXPECT_LT(apart_m(flange_of(again, q) * read[7], pose_of(arm, q).tcp), 1e-9);
}

TEST(DhTable, HasNominalAndCalibratedNumbersInMillimetresAndDegrees) {
  Calibration c = rigid_calibration(21);
  c.parameters.clear();
  ParameterResult p;
  p.key = joint_parameter(ParameterKind::kA, 1);
  p.correction = 5e-4;
  c.parameters.push_back(p);
  const std::string text = dh_csv(nominal_rigid_arm(c.cell), calibrated_rigid_arm(c));
  EXPECT_NE(text.find("\nA2,1,0,0,600,0,0,0,0,600.49999"), std::string::npos) << text;
}

TEST(ArmJson, HasValueAndSigmaOfEveryGeometricParameter) {
  const Calibration c = rigid_calibration(23);
  const auto json = nlohmann::json::parse(arm_json(c));
  EXPECT_EQ(json["format"], "cellcal.arm/1");
  ASSERT_EQ(json["joints"].size(), 6U);
  const auto& a = json["joints"][1]["a_mm"];
  EXPECT_EQ(a["nominal"], 600.0);
  EXPECT_NEAR(a["calibrated"].get<double>(),
              600.0 + 1e3 * correction_of(c, joint_parameter(ParameterKind::kA, 1)), 1e-9);
  EXPECT_NEAR(a["sigma"].get<double>(), 1e-2, 1e-12);
  EXPECT_LT(json["left_out_by_rigid_links"]["max_mm"].get<double>(), 1e-9);
}

}  // namespace
}  // namespace cellcal::calib::testing
