// An arm on a linear unit in exports and corrections.

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <regex>
#include <sstream>

#include "calib/estimate/external_axes.h"
#include "calib/estimate/predict.h"
#include "calib/export/corrector.h"
#include "calib/export/machine_external.h"
#include "calib/export/tables.h"
#include "calib/export/urdf.h"
#include "calib/model/error.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "tests/calib/export/arms.h"

namespace cellcal::calib::testing {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kLowM = -0.5, kHighM = 2.5;

/// rigid_calibration() on a linear unit of 3 m, across and slightly upwards. With the errors of each motion up to
/// this order (0: only the slopes of the shifts), with or without scale.
Calibration on_a_track(int orders = 3, bool scale = true) {
  Calibration c = rigid_calibration(31);
  for (ParameterResult& p : c.parameters)
    if (p.key.joint >= 0) ++p.key.joint;
  Joint unit;
  unit.name = "E1";
  unit.min_rad = kLowM;
  unit.max_rad = kHighM;
  LinearGuide& guide = unit.guide.emplace();
  guide.along = Vector3d(0.1, 1.0, 0.05).normalized();
  guide.scale_sigma = 5e-4;
  guide.direction_sigma_rad = 3e-3;
  guide.straightness_sigma_m = 3e-4;
  guide.turn_sigma_rad_m = 5e-4;
  guide.turn_sigma_rad = 3e-4;
  c.cell.robot.joints.insert(c.cell.robot.joints.begin(), unit);
  Random random(9);
  const ArmModel arm(c.cell);
  for (const ArmParameter& one : arm.parameters()) {
    if (one.kind != ParameterKind::kGuide || one.harmonic > orders) continue;
    const GuideMotion motion{one.axis};
    if ((motion == GuideMotion::kAlong && !scale) || (orders == 0 && !is_shift(motion))) continue;
    ParameterResult p;
    p.key = one;
    p.correction = one.sigma * random.normal();
    p.sigma = 0.1 * one.sigma;
    c.parameters.push_back(p);
  }
  return c;
}

std::vector<double> three(const nlohmann::json& json) { return json.get<std::vector<double>>(); }

Isometry3d frame_from(const nlohmann::json& json) {
  const auto xyz = three(json.at("xyz_m")), rpy = three(json.at("rpy_rad"));
  return Eigen::Translation3d(xyz[0], xyz[1], xyz[2]) * AngleAxisd(rpy[2], Vector3d::UnitZ()) *
         AngleAxisd(rpy[1], Vector3d::UnitY()) * AngleAxisd(rpy[0], Vector3d::UnitX());
}

/// As documented in the README, without functions of this library.
Isometry3d carriage_from(const nlohmann::json& unit, double q) {
  const double low = unit.at("min_m").get<double>(), high = unit.at("max_m").get<double>();
  const auto motion = [&](const char* name) {
    const auto& one = unit.at(name);
    double value = one.at("slope_per_m").at("value").get<double>() * (q - (low + high) / 2.0);
    for (const auto& wave : one.at("wave"))
      value += wave.at("value").get<double>() *
               std::cos(wave.at("order").get<int>() * std::numbers::pi * (q - low) / (high - low));
    return value;
  };
  return frame_from(unit.at("frame")) *
         Eigen::Translation3d(q + motion("along_m"), motion("across_m"), motion("above_m")) *
         AngleAxisd(motion("roll_rad"), Vector3d::UnitX()) *
         AngleAxisd(motion("pitch_rad"), Vector3d::UnitY()) *
         AngleAxisd(motion("yaw_rad"), Vector3d::UnitZ());
}

Isometry3d tcp_from(const nlohmann::json& arm, const std::vector<double>& q) {
  Isometry3d at = carriage_from(arm.at("linear_unit"), q[0]);
  for (std::size_t i = 1; i < q.size(); ++i) {
    const auto& joint = arm.at("joints")[i - 1];
    const auto axis = three(joint.at("axis"));
    at = at * frame_from(joint.at("frame")) * AngleAxisd(q[i], Vector3d(axis[0], axis[1], axis[2]));
  }
  return at * frame_from(arm.at("flange")) * frame_from(arm.at("tcp"));
}

TEST(LinearUnitJson, AnotherProgramComputesThePredictedTip) {
  const Calibration c = on_a_track();
  const auto json = nlohmann::json::parse(arm_json(c));
  ASSERT_EQ(json.at("joints").size(), 6u);
  EXPECT_EQ(json["joints"][0]["name"], "A1");
  EXPECT_EQ(json["linear_unit"]["name"], "E1");
  EXPECT_GT(json["linear_unit"]["pitch_rad"]["wave"][1]["sigma"].get<double>(), 0.0);
  const Predictor predictor(c);
  std::mt19937 random(7);
  for (int k = 0; k < 20; ++k) {
    const auto q = random_joints(c.cell.robot, random);
    const Isometry3d told = predictor.calibrated(q).tcp, found = tcp_from(json, q);
    EXPECT_LT(apart_m(told, found), 1e-9);
    EXPECT_LT(apart_rad(told, found), 1e-9);
    EXPECT_GT(apart_m(predictor.nominal(q), found), 1e-5);
  }
}

/// The TCP of a URDF's chain at these joint positions.
Isometry3d tcp_of(const UrdfChain& chain, const RigidArm& arm, const std::vector<double>& q) {
  return flange_of(chain.frames, q) * arm.tcp;
}

TEST(LinearUnitUrdf, HasAPrismaticJointInTheDirectionFound) {
  const Calibration c = on_a_track(0, false);
  const RigidArm arm = calibrated_rigid_arm(c);
  const std::string text = urdf_of(joint_frames(arm), "a", "b");
  EXPECT_NE(text.find("<joint name=\"joint_e1\" type=\"prismatic\">"), std::string::npos) << text;
  const UrdfChain chain = read_urdf(text, "a.urdf", {"flange"});
  ASSERT_EQ(chain.frames.joints.size(), 7u);
  EXPECT_TRUE(chain.frames.joints[0].slides);
  EXPECT_EQ(chain.frames.joints[0].min_rad, kLowM);
  const Predictor predictor(c);
  std::mt19937 random(8);
  for (int k = 0; k < 20; ++k) {
    const auto q = random_joints(c.cell.robot, random);
    // An axis has length 1: half the square of its direction's error is scale, which joints lack.
    EXPECT_LT(apart_m(tcp_of(chain, arm, q), predictor.calibrated(q).tcp), 3e-5);
    EXPECT_LT(apart_rad(tcp_of(chain, arm, q), predictor.calibrated(q).tcp), 1e-9);
  }
}

TEST(LinearUnitUrdf, StatesWhatAJointCannotHold) {
  const OmittedEffects none = left_out_of_unit(on_a_track(0, false), true),
                       drawn = left_out_of_unit(on_a_track(0, false), false),
                       rest = left_out_of_unit(on_a_track(), true);
  EXPECT_LT(none.max_m, 3e-5);
  EXPECT_GT(drawn.max_m, 1e-3);
  EXPECT_GT(rest.max_m, 2e-4);
  EXPECT_GT(rest.mean_m, 1e-4);
  EXPECT_LT(rest.mean_m, rest.max_m);
  EXPECT_EQ(left_out_of_unit(rigid_calibration(1), true).max_m, 0.0);
}

TEST(LinearUnitUrdf, IsPutIntoAGivenOneThatHasIt) {
  const Calibration c = on_a_track(0, false);
  const RigidArm nominal = nominal_rigid_arm(c.cell), real = calibrated_rigid_arm(c);
  const std::string given = urdf_of(joint_frames(nominal), "a", "b");
  const std::string text = calibrated_urdf(given, "a.urdf", {"flange"}, nominal, real, "c");
  const UrdfChain chain = read_urdf(text, "b.urdf", {"flange"});
  // The axis remains, so that a file with only the origins has the direction, too.
  EXPECT_LT((chain.frames.joints[0].axis - Vector3d::UnitX()).norm(), 1e-12);
  std::mt19937 random(8);
  for (int k = 0; k < 10; ++k) {
    const auto q = random_joints(c.cell.robot, random);
    EXPECT_LT(apart_m(flange_of(chain.frames, q), pose_of(real, q).flange), 1e-9);
  }
}

TEST(LinearUnitUrdf, RefusesAChainWithoutItOrWithOneTooMany) {
  const auto refusal = [](const Calibration& given, const Calibration& calibrated) {
    const std::string text = urdf_of(joint_frames(nominal_rigid_arm(given.cell)), "a", "b");
    try {
      calibrated_urdf(text, "a.urdf", {"flange"}, nominal_rigid_arm(calibrated.cell),
                      calibrated_rigid_arm(calibrated), "c");
    } catch (const FileError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  const Calibration alone = rigid_calibration(31), track = on_a_track();
  EXPECT_NE(refusal(alone, track).find("no prismatic joint carries its arm, and E1"),
            std::string::npos)
      << refusal(alone, track);
  EXPECT_NE(refusal(track, alone).find("\"joint_e1\" slides"), std::string::npos)
      << refusal(track, alone);
  Calibration turned = track;
  turned.cell.robot.joints[0].guide->along = Vector3d::UnitX();
  EXPECT_NE(refusal(turned, track).find("off the axis of E1"), std::string::npos)
      << refusal(turned, track);
}

/// A list of the table after the frames.
std::vector<double> row_of(const std::string& yaml, const std::string& key) {
  const auto at = yaml.find("  " + key + ": [", yaml.find("joint_e1_motion:"));
  std::istringstream in(yaml.substr(yaml.find('[', at) + 1));
  std::vector<double> row;
  char comma = ',';
  for (double value = 0.0; comma == ',' && in >> value; in >> comma) row.push_back(value);
  return row;
}

TEST(LinearUnitYaml, HasAFrameBehindTheJointThatAddsTheRest) {
  const Calibration c = on_a_track();
  const JointFrames frames = joint_frames(calibrated_rigid_arm(c));
  const std::string yaml = ros_yaml(frames, "") + unit_yaml(c, frames.joints[0]);
  EXPECT_NE(yaml.find("\n  joint_e1:\n"), std::string::npos);
  std::vector<std::vector<double>> rows;
  for (const char* key : {"position", "x", "y", "z", "roll", "pitch", "yaw"})
    rows.push_back(row_of(yaml, key));
  ASSERT_EQ(rows[0].size(), 301u);
  for (const auto& row : rows) ASSERT_EQ(row.size(), rows[0].size());
  EXPECT_EQ(rows[0].front(), kLowM);
  EXPECT_EQ(rows[0].back(), kHighM);
  const Predictor predictor(c);
  std::mt19937 random(3);
  // At a row, and linearly between two of them.
  for (const double share : {0.0, 0.5}) {
    const std::size_t k = 117;
    const auto value = [&](std::size_t row) {
      return (1.0 - share) * rows[row][k] + share * rows[row][k + 1];
    };
    auto q = random_joints(c.cell.robot, random);
    q[0] = value(0);
    Isometry3d at = frames.joints[0].origin * Eigen::Translation3d(q[0] * frames.joints[0].axis) *
                    Eigen::Translation3d(value(1), value(2), value(3)) *
                    AngleAxisd(value(6), Vector3d::UnitZ()) *
                    AngleAxisd(value(5), Vector3d::UnitY()) *
                    AngleAxisd(value(4), Vector3d::UnitX());
    for (std::size_t i = 1; i < q.size(); ++i)
      at = at * frames.joints[i].origin * AngleAxisd(q[i], frames.joints[i].axis);
    at = at * frames.flange * frames.tcp;
    EXPECT_LT(apart_m(at, predictor.calibrated(q).tcp), share == 0.0 ? 1e-9 : 2e-7);
    EXPECT_LT(apart_rad(at, predictor.calibrated(q).tcp), share == 0.0 ? 1e-9 : 2e-7);
  }
  EXPECT_EQ(unit_yaml(rigid_calibration(1), frames.joints[0]), "");
}

TEST(LinearUnitTables, TheDhTableHasTheArmAlone) {
  const Calibration c = on_a_track(), alone = rigid_calibration(31);
  EXPECT_EQ(dh_csv(nominal_rigid_arm(c.cell), calibrated_rigid_arm(c)),
            dh_csv(nominal_rigid_arm(alone.cell), calibrated_rigid_arm(alone)));
}

TEST(LinearUnitKuka, TheFootTurnsByWhatTheDirectionIsOff) {
  const Calibration c = on_a_track();
  const std::string lines = external_kinematic_lines(c);
  std::smatch found;
  ASSERT_TRUE(std::regex_search(
      lines, found,
      std::regex("\\(frame\\)=\\{X (\\S+),Y (\\S+),Z (\\S+),A (\\S+),B (\\S+),C (\\S+)\\}")))
      << lines;
  FrameMmDeg frame;
  for (std::size_t k = 0; k < 3; ++k) frame.abc_deg[k] = std::stod(found[k + 4]);
  EXPECT_EQ(std::stod(found[1]), 0.0);
  // In a foot rotated by it the drawn travel has the direction as found.
  const Vector3d drawn = c.cell.robot.joints[0].guide->along,
                 seen = to_isometry(frame).linear().transpose() * drawn;
  EXPECT_GT((drawn - calibrated_rigid_arm(c).robot.joints[0].guide->along).norm(), 1e-3);
  EXPECT_LT((seen - calibrated_rigid_arm(c).robot.joints[0].guide->along).norm(), 5e-7);
  EXPECT_NE(lines.find("mm in the mean"), std::string::npos);
}

TEST(LinearUnitLine, StatesDirectionScaleAndMotionsFromEndToEnd) {
  Calibration c = on_a_track();
  Touch one, other;
  one.joint_rad = JointVector(7, 0.0);
  other.joint_rad = JointVector(7, 2.0);
  const std::vector<Touch> touches = {one, other};
  const auto line = linear_unit_line(c, touches);
  ASSERT_TRUE(line.has_value());
  EXPECT_EQ(line->axis, "E1");
  EXPECT_EQ(line->touched_m, (std::array<double, 2>{0.0, 2.0}));
  EXPECT_LT((line->direction - calibrated_rigid_arm(c).robot.joints[0].guide->along).norm(), 1e-12);
  // The length of the travel combines along and across.
  EXPECT_NEAR(line->scale, correction_of(c, guide_parameter(0, GuideMotion::kAlong, 0)), 3e-5);
  EXPECT_NE(line->scale, 0.0);
  ASSERT_EQ(line->at.size(), 13u);
  EXPECT_EQ(line->at.front().position_m, kLowM);
  EXPECT_EQ(line->at.back().position_m, kHighM);
  // Without a covariance there are no bounds.
  EXPECT_EQ(line->at[3].u95[0], 0.0);
  const double q = line->at[4].position_m, middle = (kLowM + kHighM) / 2.0;
  double pitch = correction_of(c, guide_parameter(0, GuideMotion::kPitch, 0)) * (q - middle),
         across = 0.0;
  for (int h = 1; h <= 3; ++h) {
    const double wave = std::cos(h * std::numbers::pi * (q - kLowM) / (kHighM - kLowM));
    pitch += correction_of(c, guide_parameter(0, GuideMotion::kPitch, h)) * wave;
    across += correction_of(c, guide_parameter(0, GuideMotion::kAcross, h)) * wave;
  }
  EXPECT_NEAR(line->at[4].motion[4], pitch, 1e-15);
  EXPECT_NEAR(line->at[4].motion[1], across, 1e-15);
  EXPECT_FALSE(linear_unit_line(rigid_calibration(1), {}).has_value());
}

TEST(LinearUnitCorrector, ReachesPosesWhereTheCarriageStands) {
  const Calibration c = on_a_track();
  const Corrector corrector(c);
  const Predictor predictor(c);
  for (const double e1 : {kLowM, 0.3, 2.4}) {
    const JointVector seed = {e1, 0.1, -1.2, 1.5, 0.2, 0.8, -0.3};
    const Isometry3d wanted = predictor.nominal(seed);
    EXPECT_GT(apart_m(predictor.calibrated(seed).tcp, wanted), 1e-4);
    const Reach reach = corrector.joints(wanted, seed);
    ASSERT_TRUE(std::holds_alternative<Reached>(reach));
    const JointVector& q = std::get<Reached>(reach).joint_rad;
    EXPECT_EQ(q[0], e1);
    EXPECT_LT(apart_m(predictor.calibrated(q).tcp, wanted), 1e-9);
    EXPECT_LT(apart_rad(predictor.calibrated(q).tcp, wanted), 1e-9);
    const Reach nearest = corrector.nearest(wanted, seed);
    ASSERT_TRUE(std::holds_alternative<Reached>(nearest));
    EXPECT_EQ(std::get<Reached>(nearest).joint_rad[0], e1);
  }
}

TEST(LinearUnitCorrector, NamesAPositionBeyondTheTrack) {
  const Calibration c = on_a_track();
  const JointVector seed = {kHighM + 0.1, 0.1, -1.2, 1.5, 0.2, 0.8, -0.3};
  const Reach reach = Corrector(c).joints(Predictor(c).nominal(seed), seed);
  ASSERT_TRUE(std::holds_alternative<NotReached>(reach));
  EXPECT_EQ(
      words(std::get<NotReached>(reach), c.cell.robot),
      "E1 would have to stand at 2600.000 mm, outside of its range of -500.000 to 2500.000 mm");
}

}  // namespace
}  // namespace cellcal::calib::testing
