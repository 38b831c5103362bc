#include "calib/export/urdf.h"

#include <gtest/gtest.h>

#include <cstring>
#include <filesystem>
#include <numbers>
#include <random>
#include <utility>

#include "calib/estimate/predict.h"
#include "calib/export/rigid_arm.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/model/error.h"
#include "tests/calib/export/arms.h"

namespace cellcal::calib::testing {
namespace {

/// Like kuka_experimental's KR 5: every frame parallel to the base's, axes along y and x.
const std::string kDrawn = R"(<?xml version="1.0"?>
<!-- drawn by hand -->
<robot name="kr5">
  <link name="world"/>
  <link name="base_link"><visual><geometry><mesh filename="package://x/base.stl"/></geometry></visual></link>
  <joint name="world_joint" type="fixed"><parent link="world"/><child link="base_link"/></joint>
  <link name="link_1"/>
  <link name="link_2"><inertial><mass value="12.5"/><origin xyz="0.3 0 0" rpy="0 0 0"/></inertial></link>
  <link name="link_3"/> <link name="link_4"/> <link name="link_5"/> <link name="link_6"/>
  <joint name="joint_a1" type="revolute">
    <origin xyz="0 0 0.4" rpy="0 0 0"/><parent link="base_link"/><child link="link_1"/>
    <axis xyz="0 0 -1"/><limit lower="-2.7" upper="2.7" velocity="2.6" effort="0"/></joint>
  <joint name="joint_a2" type="revolute">
    <origin xyz="0.18 0 0" rpy="0 0 0"/><parent link="link_1"/><child link="link_2"/>
    <axis xyz="0 1 0"/><limit lower="-3.1" upper="1.1" velocity="2.6" effort="0"/></joint>
  <joint name="joint_a3" type="revolute">
    <origin xyz="0.6 0 0"/><parent link="link_2"/><child link="link_3"/>
    <axis xyz="0 1 0"/><limit lower="-0.2" upper="2.7" velocity="3.9" effort="0"/></joint>
  <joint name="joint_a4" type="revolute">
    <origin xyz="0 0 0.04"/><parent link="link_3"/><child link="link_4"/>
    <axis xyz="-1 0 0"/><limit lower="-6.1" upper="6.1" velocity="5.9" effort="0"/></joint>
  <joint name="joint_a5" type="revolute">
    <origin xyz="0.62 0 0"/><parent link="link_4"/><child link="link_5"/>
    <axis xyz="0 1 0"/><limit lower="-2.2" upper="2.2" velocity="6.7" effort="0"/></joint>
  <joint name="joint_a6" type="revolute">
    <parent link="link_5"/><child link="link_6"/>
    <axis xyz="-1 0 0"/><limit lower="-6.1" upper="6.1" velocity="12.5" effort="0"/></joint>
  <joint name="joint_flange" type="fixed">
    <origin xyz="0.08 0 0"/><parent link="link_6"/><child link="flange"/></joint>
  <link name="flange"/> <link name="tool0"/> <link name="camera"/>
  <joint name="joint_tool0" type="fixed">
    <origin rpy="3.141592653589793 -1.5707963267948966 0"/><parent link="flange"/><child link="tool0"/></joint>
  <joint name="joint_camera" type="fixed">
    <origin xyz="0 0.1 0"/><parent link="link_6"/><child link="camera"/></joint>
  <gazebo reference="link_1"><material>Orange</material></gazebo>
</robot>
)";

std::string urdf_refusal(const std::string& text, const UrdfEnds& ends = {}) {
  try {
    read_urdf(text, "robot.urdf", ends);
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

std::string replaced(std::string text, const std::string& what, const std::string& by) {
  const auto at = text.find(what);
  EXPECT_NE(at, std::string::npos) << what;
  return text.replace(at, what.size(), by);
}

TEST(GeneratedUrdf, AgreesWithTheCalibratedArmAtAThousandPoses) {
  const Calibration c = rigid_calibration(31);
  const RigidArm arm = calibrated_rigid_arm(c);
  const std::string text = urdf_of(joint_frames(arm), "KR 5 & \"co\"", "a -- b");
  EXPECT_EQ(read_urdf(text, "x").robot_name, "KR 5 & \"co\"");
  const UrdfChain flange = read_urdf(text, "x", {"flange"}), tcp = read_urdf(text, "x", {"tcp"});
  EXPECT_EQ(flange.base_link, "base_link");
  const Predictor predictor(c);
  std::mt19937 random(32);
  for (int k = 0; k < 1000; ++k) {
    const auto q = random_joints(arm.robot, random);
    EXPECT_LT(apart_m(flange_of(tcp.frames, q), predictor.calibrated(q).tcp), 1e-9);
    EXPECT_LT(apart_m(flange_of(flange.frames, q), pose_of(arm, q).flange), 1e-9);
  }
}

TEST(GivenUrdf, HasTheNominalArmsKinematicsAndBecomesTheCalibratedOne) {
  const Calibration c = rigid_calibration(33);
  const RigidArm nominal = nominal_rigid_arm(c.cell), real = calibrated_rigid_arm(c);
  const UrdfChain given = read_urdf(kDrawn, "kr5.urdf");
  EXPECT_EQ(given.tip_link, "tool0");
  EXPECT_EQ(given.base_link, "base_link");  // where it stands in "world" is none of the arm
  const std::string text = calibrated_urdf(kDrawn, "kr5.urdf", {}, nominal, real, "by cellcal");
  const UrdfChain made = read_urdf(text, "made");
  const UrdfChain camera_before = read_urdf(kDrawn, "x", {"camera"}),
                  camera = read_urdf(text, "x", {"camera"});
  std::mt19937 random(34);
  for (int k = 0; k < 1000; ++k) {
    const auto q = random_joints(real.robot, random);
    const RigidPose nominally = pose_of(nominal, q), really = pose_of(real, q);
    ASSERT_LT(apart_m(flange_of(given.frames, q), nominally.flange), 1e-12);
    EXPECT_LT(apart_m(flange_of(made.frames, q), really.flange), 1e-9);
    // Other parts of the last link move with the flange.
    const Eigen::Isometry3d on_flange =
        nominally.flange.inverse() * flange_of(camera_before.frames, q);
    EXPECT_LT(apart_m(flange_of(camera.frames, q), really.flange * on_flange), 1e-9);
  }
}

TEST(GivenUrdf, KeepsAllButTheOriginsOfItsChain) {
  const Calibration c = rigid_calibration(33);
  const std::string text = calibrated_urdf(kDrawn, "kr5.urdf", {}, nominal_rigid_arm(c.cell),
                                           calibrated_rigid_arm(c), "by cellcal");
  for (const char* kept : {"<!-- drawn by hand -->", "package://x/base.stl", "<axis xyz=\"0 0 -1\"",
                           "<gazebo reference=\"link_1\">", "<mass value=\"12.5\"",
                           "velocity=\"12.5\"", "<!-- by cellcal -->", "<?xml version=\"1.0\"?>",
                           "rpy=\"3.141592653589793 -1.5707963267948966 0\""})
    EXPECT_NE(text.find(kept), std::string::npos) << kept << "\n" << text;
}

TEST(GivenUrdf, WithoutCorrectionsHasTheSameKinematicsAsBefore) {
  const RigidArm nominal = nominal_rigid_arm(rigid_calibration(33).cell);
  const std::string text = calibrated_urdf(kDrawn, "x", {}, nominal, nominal, "");
  const UrdfChain before = read_urdf(kDrawn, "x"), after = read_urdf(text, "x");
  for (std::size_t i = 0; i < before.frames.joints.size(); ++i)
    EXPECT_LT(
        (before.frames.joints[i].origin.matrix() - after.frames.joints[i].origin.matrix()).norm(),
        1e-12);
}

TEST(GivenUrdf, OfAnotherRobotIsRefusedByFileAndJoint) {
  const RigidArm nominal = nominal_rigid_arm(rigid_calibration(33).cell);
  try {
    calibrated_urdf(replaced(kDrawn, "0.6 0 0", "0.61 0 0"), "kr5.urdf", {}, nominal, nominal, "");
    FAIL() << "taken";
  } catch (const FileError& error) {
    EXPECT_EQ(std::string(error.what()).find("kr5.urdf: joint \"joint_a3\": its axis is 10.000 mm"),
              0U)
        << error.what();
  }
}

/// The drawn arm ends at the last joint's own link: the calibrated flange, off that joint's axis, is a link of its own.
TEST(GivenUrdf, ThatEndsAtItsLastJointGetsALinkForTheCalibratedFlange) {
  std::string alone = kDrawn;
  for (const char* joint : {"joint_flange", "joint_camera"}) {
    const auto at = alone.find(std::string("<joint name=\"") + joint);
    alone.erase(at, alone.find("</joint>", at) + 8 - at);
  }
  for (const std::string& given : {alone, kDrawn}) {  // nothing is fixed to it, or something
    const UrdfEnds ends{"link_6"};
    Calibration c = rigid_calibration(33);
    c.cell.robot = robot_of(read_urdf(given, "x", ends).frames);
    const RigidArm nominal = nominal_rigid_arm(c.cell), real = calibrated_rigid_arm(c);
    const std::string text = calibrated_urdf(given, "x", ends, nominal, real, "");
    const UrdfChain flange = read_urdf(text, "x", {"link_6_calibrated"}),
                    axis = read_urdf(text, "x", ends);
    std::mt19937 random(35);
    double off_m = 0.0;
    for (int k = 0; k < 200; ++k) {
      const auto q = random_joints(real.robot, random);
      ASSERT_LT(apart_m(flange_of(flange.frames, q), pose_of(real, q).flange), 1e-9);
      off_m = std::max(off_m, apart_m(flange_of(axis.frames, q), pose_of(real, q).flange));
    }
    EXPECT_GT(off_m, 1e-5) << "an axis holds no flange beside it";
    EXPECT_THROW(calibrated_urdf(text, "x", ends, real, real, ""), FileError) << "twice";
  }
  EXPECT_EQ(calibrated_flange(read_urdf(kDrawn, "x")), "");
}

TEST(RobotOfUrdf, IsTheShippedOne) {
  const Robot robot = robot_of(read_urdf(kDrawn, "x").frames);
  const Robot shipped = kr5();
  std::mt19937 random(35);
  for (int k = 0; k < 50; ++k) {
    const auto q = random_joints(shipped, random);
    EXPECT_LT(apart_m(pose_of({robot, Eigen::Isometry3d::Identity()}, q).flange,
                      pose_of({shipped, Eigen::Isometry3d::Identity()}, q).flange),
              1e-9);
  }
  EXPECT_EQ(robot.joints[1].mass_kg, 12.5);
}

std::string file_of_tests(const char* path) {
  return read_file(std::filesystem::path(CELLCAL_TESTS_FOLDER) / path, kMostUrdfBytes);
}

/// Largest distance of the flanges over a thousand postures, of the robot and of the URDF's own joints [m].
double farthest_m(const Robot& robot, const JointFrames& frames) {
  std::mt19937 random(36);
  std::uniform_real_distribution<double> angle(-std::numbers::pi, std::numbers::pi);
  double worst = 0.0;
  for (int k = 0; k < 1000; ++k) {
    std::vector<double> q(robot.joints.size());
    for (double& one : q) one = angle(random);
    worst = std::max(worst, apart_m(pose_of({robot, Eigen::Isometry3d::Identity()}, q).flange,
                                    flange_of(frames, q)));
  }
  return worst;
}

TEST(RobotOfUrdf, HasItsKinematicsWithParallelSkewedAndTurnedAxesAndFixedJoints) {
  const UrdfChain chain =
      read_urdf(file_of_tests("calib/export/awkward.urdf"), "awkward.urdf", {"tip"});
  ASSERT_EQ(chain.frames.joints.size(), 7u);
  EXPECT_LT(farthest_m(robot_of(chain.frames), chain.frames), 1e-12);
}

TEST(ShippedRobot, HasTheKinematicsOfItsUrdf) {
  const struct {
    const char *robot, *urdf;
    UrdfEnds ends;
  } all[] = {{"iiwa14", "real-data/mukca/urdf/iiwa14.urdf", {"tool0", "base_link"}},
             {"panda", "real-data/mukca/urdf/panda.urdf", {"panda_link8", "panda_link0"}}};
  for (const auto& one : all) {
    const UrdfChain chain = read_urdf(file_of_tests(one.urdf), one.urdf, one.ends);
    const Robot robot = load_robot(std::filesystem::path(CELLCAL_ROBOTS_FOLDER) /
                                   (one.robot + std::string(".toml")));
    EXPECT_LT(farthest_m(robot, chain.frames), 1e-12) << one.robot;
    for (std::size_t i = 0; i < robot.joints.size(); ++i) {
      EXPECT_NEAR(robot.joints[i].min_rad, chain.frames.joints[i].min_rad, 1e-6);
      EXPECT_NEAR(robot.joints[i].max_rad, chain.frames.joints[i].max_rad, 1e-6);
      EXPECT_NEAR(robot.joints[i].max_speed_rad_s, chain.frames.joints[i].max_speed_rad_s, 1e-6);
    }
  }
}

TEST(ParsedUrdf, BeginsAtTheRootThatIsNamed) {
  const UrdfChain whole = read_urdf(kDrawn, "x"), wrist = read_urdf(kDrawn, "x", {"", "link_3"});
  EXPECT_EQ(wrist.base_link, "link_3");
  ASSERT_EQ(wrist.frames.joints.size(), 3u);
  EXPECT_EQ(wrist.frames.joints[0].name, "joint_a4");
  EXPECT_TRUE(wrist.frames.joints[0].origin.isApprox(whole.frames.joints[3].origin));
  EXPECT_EQ(read_urdf(kDrawn, "x", {"", "world"}).base_link, "world");
  for (const char* off : {"nowhere", "camera", "tool0"})
    EXPECT_NE(urdf_refusal(kDrawn, {"", off}).find("no chain of joints"), std::string::npos) << off;
}

/// The drawn arm with this behind its flange, whose links have no usual names.
std::string with_behind(const std::string& more) {
  std::string text = replaced(kDrawn, "</robot>", more + "</robot>");
  for (const auto& [usual, other] :
       {std::pair{"\"flange\"", "\"plate\""}, {"\"tool0\"", "\"plate_turned\""}})
    for (std::size_t at; (at = text.find(usual)) != std::string::npos;)
      text.replace(at, std::strlen(usual), other);
  return text;
}

std::string moving(const std::string& name, const std::string& parent, const std::string& child,
                   const std::string& more, const std::string& type = "revolute") {
  return "<link name=\"" + child + "\"/><joint name=\"" + name + "\" type=\"" + type +
         "\"><parent link=\"" + parent + "\"/><child link=\"" + child + "\"/>" + more + "</joint>";
}

TEST(ParsedUrdf, EndsBeforeAGripper) {
  const std::string bent = "<mimic joint=\"knuckle\"/>";
  const std::string fingers = moving("knuckle", "plate_turned", "left", "") +
                              moving("left_tip_joint", "left", "left_tip", bent) +
                              moving("right_joint", "plate_turned", "right", bent) +
                              moving("right_tip_joint", "right", "right_tip", bent);
  const std::string sliding =
      moving("left_slide", "plate_turned", "left", "", "prismatic") +
      moving("right_slide", "plate_turned", "right", "<mimic joint=\"left_slide\"/>", "prismatic");
  for (const std::string& gripper : {fingers, sliding}) {
    const UrdfChain chain = read_urdf(with_behind(gripper), "x");
    ASSERT_EQ(chain.frames.joints.size(), 6u) << gripper;
    EXPECT_EQ(chain.frames.joints.back().name, "joint_a6");
    EXPECT_EQ(chain.behind.size(), gripper == fingers ? 4u : 2u);
    EXPECT_TRUE(chain.followed.empty()) << "nothing within the arm";
  }
  // A tool with a joint of its own, behind the link that ROS names for the flange.
  const UrdfChain behind = read_urdf(
      replaced(kDrawn, "</robot>", moving("spindle", "tool0", "cutter", "") + "</robot>"), "x");
  EXPECT_EQ(behind.tip_link, "tool0");
  EXPECT_EQ(behind.frames.joints.size(), 6u);
  EXPECT_EQ(behind.behind, std::vector<std::string>{"spindle"});
  // Asked for, it is part of the chain.
  EXPECT_EQ(
      read_urdf(replaced(kDrawn, "</robot>", moving("spindle", "tool0", "cutter", "") + "</robot>"),
                "x", {"cutter"})
          .frames.joints.size(),
      7u);
  // What moves with the last joint of an arm is no gripper where the flange is behind that joint.
  const UrdfChain hose = read_urdf(
      replaced(kDrawn, "</robot>",
               moving("hose", "link_5", "hose", "<mimic joint=\"joint_a6\"/>") + "</robot>"),
      "x");
  EXPECT_EQ(hose.frames.joints.size(), 6u);
  // Two arms with a gripper each stay two arms.
  EXPECT_NE(urdf_refusal(with_behind(fingers + moving("joint_b6", "link_5", "link_b6", "")))
                .find("two chains of 6 joints"),
            std::string::npos);
}

TEST(ParsedUrdf, NamesWhatElseCouldBeTheFlange) {
  EXPECT_TRUE(read_urdf(kDrawn, "x").other_flanges.empty()) << "its name tells it";
  EXPECT_TRUE(read_urdf(with_behind(""), "x", {"plate"}).other_flanges.empty()) << "it was named";
  const UrdfChain chain = read_urdf(with_behind(""), "x");
  EXPECT_EQ(chain.tip_link, "link_6");
  ASSERT_EQ(chain.other_flanges.size(), 3u);
  EXPECT_EQ(chain.other_flanges[0].first, "plate");
  EXPECT_NEAR(chain.other_flanges[0].second.translation().x(), 0.08, 1e-12);
  EXPECT_EQ(chain.other_flanges[2].first, "camera");
}

TEST(ParsedUrdf, NamesTheJointThatAParallelLinkageFollows) {
  const UrdfChain chain = read_urdf(
      replaced(kDrawn, "</robot>",
               moving("rod", "link_2", "rod", "<mimic joint=\"joint_a3\"/>") + "</robot>"),
      "x");
  ASSERT_EQ(chain.followed.size(), 1u);
  EXPECT_EQ(chain.followed[0], (std::pair<std::string, std::string>("joint_a3", "rod")));
  EXPECT_TRUE(read_urdf(kDrawn, "x").followed.empty());
}

TEST(ParsedUrdf, TakesATurnToEitherSideForAJointWithoutLimits) {
  const std::string limit = "<limit lower=\"-6.1\" upper=\"6.1\" velocity=\"5.9\" effort=\"0\"/>";
  std::string text =
      replaced(kDrawn, "joint_a4\" type=\"revolute\"", "joint_a4\" type=\"continuous\"");
  EXPECT_TRUE(read_urdf(text, "x").unlimited.empty()) << "limits that it states are its limits";
  text = replaced(text, limit, "<limit velocity=\"5.9\" effort=\"0\"/>");
  const UrdfChain chain = read_urdf(text, "x");
  EXPECT_EQ(chain.unlimited, std::vector<std::string>{"joint_a4"});
  EXPECT_DOUBLE_EQ(chain.frames.joints[3].min_rad, -2.0 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(chain.frames.joints[3].max_rad, 2.0 * std::numbers::pi);
  EXPECT_DOUBLE_EQ(read_urdf(replaced(kDrawn, limit, ""), "x").frames.joints[3].max_rad, 0.0)
      << "a revolute has to state them";
}

TEST(ParsedUrdf, StatesHowItsBaseIsMountedInTheWorld) {
  const std::string ceiling =
      replaced(kDrawn, "type=\"fixed\"><parent link=\"world\"/>",
               "type=\"fixed\"><origin rpy=\"0 3.14159 0\"/><parent link=\"world\"/>");
  const auto down = [](const std::string& text, const UrdfEnds& ends = {}) -> Eigen::Vector3d {
    return read_urdf(text, "x", ends).mounted.transpose() * Eigen::Vector3d(0, 0, -1);
  };
  const Eigen::Vector3d upwards(0, 0, 1), downwards(0, 0, -1);
  EXPECT_TRUE(down(kDrawn).isApprox(downwards));
  EXPECT_TRUE(down(ceiling).isApprox(upwards, 1e-5));
  EXPECT_TRUE(down(ceiling, {"", "base_link"}).isApprox(upwards, 1e-5));
  EXPECT_TRUE(down(ceiling, {"", "link_3"}).isApprox(upwards, 1e-5)) << "with all that is left out";
  EXPECT_TRUE(down(ceiling, {"", "world"}).isApprox(downwards)) << "nothing is left out";
  std::string other = ceiling;
  for (std::size_t at; (at = other.find("\"world\"")) != std::string::npos;)
    other.replace(at, 7, "\"cabin\"");
  EXPECT_TRUE(down(other, {"", "base_link"}).isApprox(downwards)) << "gravity is not known there";
}

TEST(ParsedUrdf, ThatCannotBeUsedIsRefusedByNameAndPlace) {
  EXPECT_EQ(urdf_refusal(kDrawn), "");
  const struct {
    const char *what, *by, *words;
  } kWrong[] = {
      {"0 0 0.4", "0 0 nan", "joint \"joint_a1\": <origin> xyz=\"0 0 nan\""},
      {"0 0 0.4", "0 0", "is not three numbers"},
      {"0 0 0.4", "0 0 1e999", "is not three numbers"},
      {"<axis xyz=\"0 0 -1\"/>", "<axis xyz=\"0 0 0\"/>", "has no direction"},
      {"joint_a2", "joint_a1", "two joints \"joint_a1\""},
      {"<child link=\"link_2\"/>", "<child link=\"link_1\"/>", "the child of two joints"},
      {"<parent link=\"base_link\"/>", "<parent link=\"link_6\"/>", "form a loop"},
      {"joint_a2\" type=\"revolute\"", "joint_a2\" type=\"prismatic\"", "is prismatic"},
      {"<robot name", "<automat name", "line "},
      {"velocity=\"2.6\"", "velocity=\"fast\"", "velocity=\"fast\" is not a number"},
      {"<parent link=\"link_1\"/>", "", "needs name, parent and child"},
      {"xyz=\"0.3 0 0\"", "xyz=\"0.3 499.9 0\"",
       "robot.urdf:8: link \"link_2\": 12.5 kg at 0.3 499.9 0 m"},
      {"value=\"12.5\"", "value=\"-1\"", "link \"link_2\": -1 kg"},
      {"<limit lower=\"-2.7\"", "<mimic joint=\"joint_a2\"/><limit lower=\"-2.7\"",
       "robot.urdf:10: joint \"joint_a1\" mimics \"joint_a2\". In the chain each joint has to turn by itself"},
  };
  for (const auto& one : kWrong)
    EXPECT_NE(urdf_refusal(replaced(kDrawn, one.what, one.by)).find(one.words), std::string::npos)
        << one.by << ": " << urdf_refusal(replaced(kDrawn, one.what, one.by));
  EXPECT_NE(urdf_refusal(kDrawn, {"nowhere"}).find("no link \"nowhere\""), std::string::npos);
  EXPECT_NE(urdf_refusal("<robot/>").find("no <joint>"), std::string::npos);
  EXPECT_NE(urdf_refusal("<xacro/>").find("no <robot>"), std::string::npos);
  EXPECT_NE(urdf_refusal(""), "");
  EXPECT_NE(urdf_refusal(std::string(kMostUrdfBytes + 1, ' ')).find("limit"), std::string::npos);
}

TEST(ParsedUrdf, WithAReferencePositionOtherThanZeroIsRefusedByLine) {
  const auto with = [](const std::string& calibration) {
    return urdf_refusal(
        replaced(kDrawn, "<limit lower=\"-2.7\"", calibration + "<limit lower=\"-2.7\""));
  };
  EXPECT_EQ(with("<calibration rising=\"0.0\" falling=\"0\"/>"), "");
  EXPECT_EQ(with("<calibration/>"), "");
  for (const char* value : {"0.5", "nan", "", "1e999", "${zero}"}) {
    const std::string words = with("\n<calibration rising=\"" + std::string(value) + "\"/>\n");
    EXPECT_NE(words.find("<calibration rising=\"" + std::string(value)), std::string::npos)
        << words;
    EXPECT_NE(words.find("joint \""), std::string::npos) << words;
  }
  const std::string before = kDrawn.substr(0, kDrawn.find("<limit lower=\"-2.7\""));
  const auto line = 2 + std::count(before.begin(), before.end(), '\n');
  EXPECT_NE(with("\n<calibration falling=\"-1\"/>").find(":" + std::to_string(line) + ": joint"),
            std::string::npos)
      << with("\n<calibration falling=\"-1\"/>");
}

TEST(ParsedUrdf, OfXacroNamesTheCommandThatExpandsIt) {
  const std::string words = urdf_refusal(
      "<robot xmlns:xacro=\"http://www.ros.org/wiki/xacro\" name=\"a\">\n<xacro:macro name=\"b\"/>"
      "</robot>");
  EXPECT_NE(words.find(":2: <xacro:macro>"), std::string::npos) << words;
  EXPECT_NE(words.find("xacro "), std::string::npos) << words;
  EXPECT_NE(words.find("> robot.urdf"), std::string::npos) << words;
  // An expanded file keeps the namespace.
  EXPECT_EQ(urdf_refusal(replaced(kDrawn, "<robot ", "<robot xmlns:xacro=\"http://x\" ")), "");
}

TEST(ParsedUrdf, CutAnywhereIsRefusedOrReadAndNothingElse) {
  for (std::size_t length = 0; length < kDrawn.size(); length += 7)
    EXPECT_NE(urdf_refusal(kDrawn.substr(0, length)), "") << length;
  std::string deep = "<robot><joint name='a' type='revolute'>";
  for (int i = 0; i < 200000; ++i) deep += "<a>";
  EXPECT_NE(urdf_refusal(deep), "");
}

TEST(ParsedUrdf, WithTwoArmsAsksForTheTip) {
  std::string text = kDrawn;
  text.insert(
      text.find("</robot>"),
      "<joint name=\"b\" type=\"revolute\"><parent link=\"link_5\"/><child link=\"other\"/></joint>");
  EXPECT_NE(urdf_refusal(text).find("--tip"), std::string::npos) << urdf_refusal(text);
  EXPECT_EQ(urdf_refusal(text, {"other"}), "");
}

}  // namespace
}  // namespace cellcal::calib::testing
