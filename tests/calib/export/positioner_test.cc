// A positioner in exports, corrections, and a KUKA controller's machine data.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <regex>

#include "calib/estimate/external_axes.h"
#include "calib/estimate/predict.h"
#include "calib/export/corrector.h"
#include "calib/export/machine_data.h"
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

/// rigid_calibration() with a positioner of two axes, the second with the opposite sign, with errors;
/// `give_per_nm`: size of the axes' compliance.
Calibration calibration_with_positioner(double scale = 3e-4, double give_per_nm = 0.0) {
  Calibration c = rigid_calibration(31);
  c.cell.robot.positioner.resize(2);
  PositionerAxis &tilt = c.cell.robot.positioner[0], &turn = c.cell.robot.positioner[1];
  tilt.name = "E1";
  tilt.frame = Eigen::Translation3d(1.1, 0.1, 0.4) * AngleAxisd(-1.5708, Vector3d::UnitX());
  tilt.min_rad = -1.0;
  tilt.max_rad = 1.2;
  turn.name = "E2";
  turn.sign = -1;
  turn.frame = Eigen::Translation3d(0.0, -0.1, 0.02) * AngleAxisd(1.5708, Vector3d::UnitX());
  turn.min_rad = -3.2;
  turn.max_rad = 3.2;
  for (PositionerAxis* axis : {&tilt, &turn}) {
    axis->place_sigma_m = axis->direction_sigma_rad = 2e-3;
    axis->scale_sigma = 1e-3;
    axis->mass_kg = 200.0;
    axis->com_m = Vector3d(0.05, -0.03, 0.15);
    axis->compliance_sigma_rad_per_nm = axis->bearing_sigma_rad_per_nm = 1e-6;
  }
  Target sphere;
  sphere.id = "T1";
  sphere.carried_by = 2;
  c.cell.targets.push_back(sphere);
  c.targets.push_back({"T1", Vector3d(0.1, 0.0, 0.1)});
  Random random(5);
  for (std::size_t j = 0; j < 2; ++j)
    for (int k = 0; k < kAxisErrors; ++k) {
      ParameterResult p;
      p.key = positioner_parameter(j, AxisError{k});
      p.correction = AxisError{k} == AxisError::kScale ? scale : 1e-3 * random.normal();
      if (k >= static_cast<int>(AxisError::kCompliance)) p.correction *= give_per_nm / 1e-3;
      p.sigma = 1e-5;
      c.parameters.push_back(p);
    }
  return c;
}

Isometry3d frame_of_json(const nlohmann::json& json) {
  const auto xyz = json.at("xyz_m").get<std::vector<double>>(),
             rpy = json.at("rpy_rad").get<std::vector<double>>();
  return Eigen::Translation3d(xyz[0], xyz[1], xyz[2]) * AngleAxisd(rpy[2], Vector3d::UnitZ()) *
         AngleAxisd(rpy[1], Vector3d::UnitY()) * AngleAxisd(rpy[0], Vector3d::UnitX());
}

Isometry3d turn_of_json(const nlohmann::json& json, double angle_rad) {
  const auto axis = json.at("axis").get<std::vector<double>>();
  return Isometry3d(AngleAxisd(angle_rad, Vector3d(axis[0], axis[1], axis[2])));
}

/// Moment of gravity about an axis, in its frame `place`; axes without an angle are at 0.
Vector3d moment_of_json(const nlohmann::json& arm, std::size_t axis, Isometry3d place,
                        const std::vector<double>& positioner_rad) {
  const auto vector = [](const nlohmann::json& three) {
    return Vector3d(three[0].get<double>(), three[1].get<double>(), three[2].get<double>());
  };
  const Isometry3d at = place;
  Vector3d moment = Vector3d::Zero();
  for (std::size_t k = axis; k < arm.at("positioner").size(); ++k) {
    const auto& one = arm["positioner"][k];
    if (k > axis) place = place * frame_of_json(one.at("frame"));
    place = place * turn_of_json(one, k < positioner_rad.size() ? positioner_rad[k] : 0.0);
    if (!one.contains("mass_kg")) continue;
    moment += one["mass_kg"].get<double>() *
              (place * vector(one["com_m"]) - at.translation()).cross(vector(arm["gravity_m_s2"]));
  }
  return at.linear().transpose() * moment;
}

/// As documented in the README, without functions of this library.
Isometry3d tcp_on_table(const nlohmann::json& arm, const std::vector<double>& joints_rad,
                        const std::vector<double>& positioner_rad) {
  Isometry3d table = Isometry3d::Identity(), tcp = Isometry3d::Identity();
  for (std::size_t j = 0; j < positioner_rad.size(); ++j) {
    const auto& axis = arm.at("positioner")[j];
    const auto of = [&](const char* key) { return axis[key]["value"].get<double>(); };
    table = table * frame_of_json(axis.at("frame"));
    const Vector3d m = moment_of_json(arm, j, table, positioner_rad);
    table = table * AngleAxisd(of("bearing_x_rad_per_nm") * m.x(), Vector3d::UnitX()) *
            AngleAxisd(of("bearing_y_rad_per_nm") * m.y(), Vector3d::UnitY()) *
            AngleAxisd(of("compliance_rad_per_nm") * m.z(), Vector3d::UnitZ()) *
            turn_of_json(axis, positioner_rad[j] * (1.0 + of("scale")));
  }
  for (std::size_t i = 0; i < joints_rad.size(); ++i)
    tcp = tcp * frame_of_json(arm.at("joints")[i].at("frame")) *
          turn_of_json(arm["joints"][i], joints_rad[i]);
  return table.inverse() * tcp * frame_of_json(arm.at("flange")) * frame_of_json(arm.at("tcp"));
}

TEST(PositionerJson, AnotherProgramComputesWhatTheTableGivesUnderItsLoad) {
  Calibration c = calibration_with_positioner(3e-4, 1e-6);
  c.cell.robot.positioner[0].mass_kg = 0.0;
  const auto json = nlohmann::json::parse(arm_json(c));
  EXPECT_FALSE(json["positioner"][0].contains("mass_kg"));
  EXPECT_EQ(json["positioner"][1]["mass_kg"], 200.0);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> angle(-1.0, 1.0);
  const Predictor predictor(c, 2);
  const auto q = random_joints(c.cell.robot, random);
  const std::vector<double> e = {angle(random), angle(random)};
  const Isometry3d told = predictor.calibrated(q, e).tcp;
  EXPECT_LT(apart_m(told, tcp_on_table(json, q, e)), 1e-6);
  Calibration stiff = c;
  for (PositionerAxis& axis : stiff.cell.robot.positioner) axis.mass_kg = 0.0;
  EXPECT_GT(apart_m(told, Predictor(stiff, 2).calibrated(q, e).tcp), 1e-5);
}

TEST(PositionerJson, AnotherProgramComputesThePredictedTipOnTheTable) {
  const Calibration c = calibration_with_positioner();
  const auto json = nlohmann::json::parse(arm_json(c));
  ASSERT_EQ(json.at("positioner").size(), 2u);
  EXPECT_EQ(json["positioner"][1]["name"], "E2");
  EXPECT_NEAR(json["positioner"][0]["max_deg"].get<double>(), 1.2 * kDegPerRad, 1e-12);
  EXPECT_EQ(json["positioner"][0]["scale"]["value"], 3e-4);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> angle(-1.0, 1.0);
  for (const int carriers : {1, 2}) {
    const Predictor predictor(c, carriers);
    for (int k = 0; k < 10; ++k) {
      const auto q = random_joints(c.cell.robot, random);
      std::vector<double> e;
      for (int j = 0; j < carriers; ++j) e.push_back(angle(random));
      const Isometry3d told = predictor.calibrated(q, e).tcp, found = tcp_on_table(json, q, e);
      EXPECT_LT(apart_m(told, found), 1e-9);
      EXPECT_LT(apart_rad(told, found), 1e-9);
      EXPECT_GT(apart_m(predictor.nominal(q, e), found), 1e-5);
    }
  }
}

TEST(PositionerUrdf, HasTheAxesAsAChainOfTheirOwnFromTheBase) {
  const Calibration c = calibration_with_positioner(0.0);
  const RigidArm arm = calibrated_rigid_arm(c);
  const std::string text = urdf_of(joint_frames(arm), "a", "b");
  const UrdfChain second = read_urdf(text, "a.urdf", {"positioner_2"});
  ASSERT_EQ(second.frames.joints.size(), 2u);
  EXPECT_EQ(second.base_link, "base_link");
  EXPECT_EQ(second.frames.joints[0].name, "joint_e1");
  EXPECT_EQ(second.frames.joints[1].min_rad, -3.2);
  EXPECT_EQ(read_urdf(text, "a.urdf").tip_link, "flange");
  for (const double angle : {-0.9, 0.0, 0.4}) {
    const std::vector<double> e = {angle, 2.0 * angle};
    EXPECT_LT(apart_m(flange_of(second.frames, e), carried_as_found(c, e)), 1e-12);
    EXPECT_LT(apart_rad(flange_of(second.frames, e), carried_as_found(c, e)), 1e-12);
  }
}

TEST(PositionerUrdf, IsPutIntoAGivenOneOnce) {
  const Calibration c = calibration_with_positioner(0.0);
  const RigidArm nominal = nominal_rigid_arm(c.cell), real = calibrated_rigid_arm(c);
  RigidArm alone = nominal;
  alone.robot.positioner.clear();
  const std::string given = urdf_of(joint_frames(alone), "a", "b");
  const std::string text = calibrated_urdf(given, "a.urdf", {"flange"}, nominal, real, "c");
  const std::vector<double> e = {0.5, -1.0};
  EXPECT_LT(apart_m(flange_of(read_urdf(text, "b.urdf", {"positioner_2"}).frames, e),
                    carried_as_found(c, e)),
            1e-12);
  try {
    const std::string twice = urdf_of(joint_frames(nominal), "a", "b");
    calibrated_urdf(twice, "a.urdf", {"flange"}, nominal, real, "c");
    FAIL();
  } catch (const FileError& error) {
    EXPECT_NE(std::string(error.what()).find("\"positioner_1\" is there already"),
              std::string::npos)
        << error.what();
  }
}

TEST(PositionerTables, HaveItAsJointFramesAndLeaveTheDhTableAsItWas) {
  const Calibration c = calibration_with_positioner();
  const RigidArm arm = calibrated_rigid_arm(c);
  const std::string yaml = ros_yaml(joint_frames(arm), "");
  EXPECT_GT(yaml.find("\n  joint_e2:\n"), yaml.find("\n  tcp:\n"));
  EXPECT_NE(yaml.find("\n  joint_e2:\n"), std::string::npos);
  RigidArm nominal_alone = nominal_rigid_arm(c.cell), alone = arm;
  nominal_alone.robot.positioner.clear();
  alone.robot.positioner.clear();
  EXPECT_EQ(dh_csv(nominal_rigid_arm(c.cell), arm), dh_csv(nominal_alone, alone));
}

TEST(PositionerCorrector, GivesTheArmsAnglesAsWithoutIt) {
  const Calibration c = calibration_with_positioner();
  Calibration alone = c;
  alone.cell.robot.positioner.clear();
  std::erase_if(alone.parameters,
                [](const ParameterResult& p) { return p.key.kind == ParameterKind::kPositioner; });
  const JointVector seed = {0.1, -1.2, 1.5, 0.2, 0.8, -0.3};
  const Isometry3d wanted = Predictor(c).nominal(seed);
  const Reach one = Corrector(c).joints(wanted, seed),
              other = Corrector(alone).joints(wanted, seed);
  ASSERT_TRUE(std::holds_alternative<Reached>(one));
  EXPECT_EQ(std::get<Reached>(one).joint_rad, std::get<Reached>(other).joint_rad);
}

Isometry3d turned_about_z(const Isometry3d& frame, double angle) {
  return frame * AngleAxisd(angle, Vector3d::UnitZ());
}

TEST(ExternalKinematic, TurnsEachAxisInTheControllersSense) {
  const auto& axes = calibration_with_positioner().cell.robot.positioner;
  const ExternalKinematic kuka = external_kinematic(axes);
  ASSERT_EQ(kuka.axes.size(), 2u);
  Robot robot;
  robot.positioner = axes;
  for (const double angle : {-0.7, 0.0, 0.3}) {
    const std::vector<double> e = {angle, -2.0 * angle};
    const Isometry3d table =
        turned_about_z(turned_about_z(kuka.axes[0], e[0]) * kuka.axes[1], e[1]) * kuka.flange;
    EXPECT_LT(apart_m(table, carried_at(robot, e)), 1e-12);
    EXPECT_LT(apart_rad(table, carried_at(robot, e)), 1e-12);
  }
}

/// The first frame assigned to a variable in the lines.
Isometry3d stated_frame(const std::string& lines, const std::string& variable) {
  const std::regex pattern(variable +
                           "=\\{X (\\S+),Y (\\S+),Z (\\S+),A (\\S+),B (\\S+),C (\\S+)\\}");
  std::smatch found;
  EXPECT_TRUE(std::regex_search(lines, found, pattern)) << variable << "\n" << lines;
  FrameMmDeg frame;
  for (std::size_t k = 0; k < 6; ++k)
    (k < 3 ? frame.xyz_mm[k] : frame.abc_deg[k - 3]) = std::stod(found[k + 1]);
  return to_isometry(frame);
}

TEST(ExternalKinematic, IsPrintedAsFoundByTheAxisOrByTheRootPoint) {
  const Calibration c = calibration_with_positioner(0.0);
  const std::string lines = external_kinematic_lines(c);
  const Isometry3d first = stated_frame(lines, "\\$ETn_TA1KR"),
                   second = stated_frame(lines, "\\$ETn_TA2A1"),
                   flange = stated_frame(lines, "\\$ETn_TFLA3"),
                   root = stated_frame(lines, "MACHINE_DEF\\[n\\]\\.ROOT");
  const ExternalKinematic drawn = external_kinematic(c.cell.robot.positioner);
  const std::vector<double> e = {0.4, 1.1};
  const Isometry3d found = carried_as_found(c, e);
  constexpr double kDecimals = 1e-6;  // of the printed digits, over the lever of the positioner
  for (const Isometry3d& start : {first, Isometry3d(root * drawn.axes[0])}) {
    const Isometry3d table = turned_about_z(turned_about_z(start, e[0]) * second, e[1]) * flange;
    EXPECT_LT(apart_m(table, found), kDecimals);
    EXPECT_LT(apart_rad(table, found), kDecimals);
  }
  EXPECT_NE(lines.find("scale of its angle +0.000 mrad/rad"), std::string::npos) << lines;
  EXPECT_THROW(external_kinematic_lines(rigid_calibration(1)), FileError);
}

TEST(APositionerAsFound, IsReadBackFromTheMachineDataThatItIsExportedTo) {
  const Calibration c = calibration_with_positioner(0.0);
  const std::string text =
      std::regex_replace(external_kinematic_lines(c), std::regex("\\$ETn"), "$$ET2") +
      "$EX_KIN={ET2 #EASYS}\n$ET2_AX={TR_A1 #E1,TR_A2 #E2}\n"
      "MACHINE_DEF[2]={ROOT {X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0},MECH_TYPE #EASYS}\n"
      "$AXIS_TYPE[7]=3\n$SOFTN_END[7]=-57.0\n$SOFTP_END[7]=68.0\n"
      "$AXIS_TYPE[8]=3\n$SOFTN_END[8]=-180.0\n$SOFTP_END[8]=180.0\n";
  MachineData data;
  read_machine_data(text, "kuka", data);
  Robot read;
  read.positioner = positioner_of(data.external, data.robroot);
  ASSERT_EQ(read.positioner.size(), 2u) << text;
  const Isometry3d flange = to_isometry(data.external.kinematics.at("ET2").frames.at("TFLA3"));
  for (const std::vector<double>& angles : {std::vector{0.0, 0.0}, {0.6, -1.1}, {-0.9, 3.0}}) {
    const Isometry3d stated = carried_at(read, angles) * flange,
                     found = carried_as_found(c, angles);
    EXPECT_LT((stated.translation() - found.translation()).norm(), 3e-7);
    EXPECT_LT(AngleAxisd(stated.linear().transpose() * found.linear()).angle(), 1e-6);
  }
}

}  // namespace
}  // namespace cellcal::calib::testing
