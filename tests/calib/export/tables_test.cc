#include "calib/export/tables.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "calib/estimate/predict.h"
#include "calib/model/units.h"
#include "tests/calib/export/arms.h"

namespace cellcal::calib::testing {
namespace {

/// As read by a ROS 2 driver: name, then six numbers.
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

/// A KR 5 with two slow waves per joint, a function of two orders, and a compliant joint.
Calibration waved_calibration() {
  Calibration c = rigid_calibration(25);
  const auto add = [&c](const ParameterKey& key, double value) {
    ParameterResult p;
    p.key = key;
    p.correction = value;
    p.sigma = 1e-5;
    c.parameters.push_back(p);
  };
  for (std::size_t i = 0; i < c.cell.robot.joints.size(); ++i) {
    Joint& joint = c.cell.robot.joints[i];
    joint.function_sigma_rad = 1e-4;
    joint.function_reach_rad = 0.1;
    joint.function_min_rad = -1.0;
    joint.function_max_rad = 1.5;
    for (const int order : {1, 4}) {
      add(wave_parameter(ParameterKind::kCosine, i, order), 5e-5);
      add(wave_parameter(ParameterKind::kSine, i, order), -3e-5);
    }
    for (const int order : {7, 23}) {
      add(wave_parameter(ParameterKind::kFunctionCosine, i, order), 4e-5);
      add(wave_parameter(ParameterKind::kFunctionSine, i, order), 6e-5);
    }
  }
  return c;
}

TEST(ArmJson, StatesWhatTheExportedRigidArmLeavesOut) {
  const Calibration c = soft_calibration();
  const OmittedEffects out = left_out(c, nearest_rigid_arm(c));
  const auto stated = nlohmann::json::parse(arm_json(c)).at("left_out_by_rigid_links");
  EXPECT_NEAR(stated["mean_mm"].get<double>(), out.mean_m * kMmPerM, 1e-9);
  EXPECT_NEAR(stated["max_mm"].get<double>(), out.max_m * kMmPerM, 1e-9);
}

/// Sum added to theta of the joint, rad.
double by_waves(const nlohmann::json& joint, double angle_rad) {
  const auto sum = [&](const char* key, double ratio) {
    double arcsec = 0.0;
    for (const auto& wave : joint.at(key)) {
      const double phase = wave["order"].get<double>() * ratio * angle_rad;
      arcsec += wave["cos_arcsec"].get<double>() * std::cos(phase) +
                wave["sin_arcsec"].get<double>() * std::sin(phase);
    }
    return arcsec * kRadPerArcsec;
  };
  return sum("gear", joint.at("gear_ratio")) + sum("function", 1.0);
}

TEST(ArmJson, AnotherProgramComputesThePredictedTipFromItsWaves) {
  const Calibration c = waved_calibration();
  const auto json = nlohmann::json::parse(arm_json(c));
  std::mt19937 random(26);
  const RigidArm arm = calibrated_rigid_arm(c);
  const Predictor predictor(c);
  for (int k = 0; k < 20; ++k) {
    const auto q = random_joints(arm.robot, random);
    auto turned = q;
    for (std::size_t i = 0; i < q.size(); ++i)
      turned[i] += json["joints"][i]["sign"].get<double>() * by_waves(json["joints"][i], q[i]);
    const Eigen::Vector3d tip = predictor.calibrated(q).tcp.translation();
    EXPECT_LT((tip - pose_of(arm, turned).tcp.translation()).norm(), 1e-9);
    EXPECT_GT((tip - pose_of(arm, q).tcp.translation()).norm(), 1e-6);
  }
  EXPECT_NEAR(json["joints"][2]["function_deg"][1].get<double>(), 1.5 * kDegPerRad, 1e-9);
}

TEST(ArmJson, LeavesNoDeflectionByMomentsOut) {
  Calibration c = waved_calibration();
  const auto add = [&c](const ParameterKey& key, double value) {
    ParameterResult p;
    p.key = key;
    p.correction = value;
    c.parameters.push_back(p);
  };
  c.cell.robot.joints[1].mass_kg = 20.0;
  add(joint_parameter(ParameterKind::kCompliance, 1), 2e-6);
  add(load_parameter(1, 2, 2), 3e-6);
  add(bearing_parameter(1, 1), 4e-6);
  add(joint_parameter(ParameterKind::kStiffening, 1), 5.0 * kRadPerArcsec);
  const auto joint = nlohmann::json::parse(arm_json(c))["joints"][1];
  EXPECT_EQ(joint["mass_kg"], 20.0);
  EXPECT_EQ(joint["compliance_rad_per_nm"]["value"], 2e-6);
  EXPECT_EQ(joint["load_kg_m_rad_per_nm"][0]["link"], c.cell.robot.joints[2].name);
  EXPECT_EQ(joint["load_kg_m_rad_per_nm"][0]["axis"], "z");
  EXPECT_EQ(joint["bearing_y_rad_per_nm"]["value"], 4e-6);
  EXPECT_NEAR(joint["stiffening_arcsec"]["value"].get<double>(), 5.0, 1e-9);
}

}  // namespace
}  // namespace cellcal::calib::testing
