// "cellcal.robot/1": semantics, and refusal of every kind of error.

#include <gtest/gtest.h>

#include "calib/model/units.h"
#include "tests/calib/files/documents.h"

namespace cellcal::calib {
namespace {

using testing::Broken;
using testing::expect_words;
using testing::kRobot;
using testing::line_of;
using testing::robot_refusal;
using testing::with;
using testing::without;

TEST(RobotFile, ReadsMillimetresAndDegreesIntoMetresAndRadians) {
  const Robot robot = testing::robot();
  EXPECT_EQ(robot.name, "Two axes");
  EXPECT_EQ(robot.source, "made up");
  EXPECT_EQ(robot.gravity_m_s2, Eigen::Vector3d(0.0, 0.1, -9.8));
  ASSERT_EQ(robot.joints.size(), 2u);
  const Joint& a1 = robot.joints[0];
  EXPECT_EQ(a1.name, "A1");
  EXPECT_EQ(a1.sign, -1);
  EXPECT_DOUBLE_EQ(a1.offset_rad, 12.5 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(a1.d_m, 0.4);
  EXPECT_DOUBLE_EQ(a1.a_m, 0.18);  // written as an integer
  EXPECT_DOUBLE_EQ(a1.alpha_rad, -90.0 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(a1.beta_rad, 1.5 * kRadPerDeg);
  EXPECT_EQ(a1.errors,
            (std::vector{JointError::kTheta, JointError::kD, JointError::kA, JointError::kAlpha}));
  EXPECT_DOUBLE_EQ(a1.min_rad, -155.0 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(a1.max_rad, 155.0 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(a1.max_speed_rad_s, 154.0 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(a1.tolerance_length_m, 1.25e-3);
  EXPECT_DOUBLE_EQ(a1.tolerance_angle_rad, 0.07 * kRadPerDeg);
  EXPECT_DOUBLE_EQ(a1.mass_kg, 20.5);
  EXPECT_LT((a1.com_m - Eigen::Vector3d(0.010, -0.020, 0.0305)).norm(), 1e-15);
  EXPECT_DOUBLE_EQ(a1.compliance_sigma_rad_per_nm, 1.5e-6);
  EXPECT_DOUBLE_EQ(a1.gear_ratio, -120.5);
  EXPECT_EQ(a1.harmonics, (std::vector{1, 2}));
  EXPECT_DOUBLE_EQ(a1.harmonic_sigma_rad, 10.0 * kRadPerDeg / 3600.0);
  EXPECT_LT((robot.flange_fixed.translation() - Eigen::Vector3d(0, 0, 0.08)).norm(), 1e-15);
}

TEST(RobotFile, FillsInWhatMayBeLeftOut) {
  const Joint a2 = testing::robot().joints[1];
  EXPECT_EQ(a2.sign, 1);
  EXPECT_EQ(a2.offset_rad, 0.0);
  EXPECT_EQ(a2.beta_rad, 0.0);
  EXPECT_DOUBLE_EQ(a2.tolerance_length_m, 0.7e-3);
  EXPECT_DOUBLE_EQ(a2.tolerance_angle_rad, 0.035 * kRadPerDeg);
  EXPECT_EQ(a2.mass_kg, 0.0);
  EXPECT_EQ(a2.compliance_sigma_rad_per_nm, 0.0);
  EXPECT_TRUE(a2.harmonics.empty());
}

TEST(RobotFile, StatesAbsoluteAccuracyOrNothingAndKeepsIt) {
  using enum AbsoluteAccuracy;
  const auto read_with = [](const char* line) {
    std::string text = kRobot;
    return read_robot(TomlTable::parse(text.insert(text.find("gravity"), line), "r.toml"));
  };
  for (const auto& [line, value] :
       {std::pair("", kNotStated), std::pair("absolute_accuracy = \"off\"\n", kOff),
        std::pair("absolute_accuracy = \"active\"\n", kActive),
        std::pair("absolute_accuracy = \"in this file\"\n", kInFile)}) {
    const Robot robot = read_with(line);
    EXPECT_EQ(robot.absolute_accuracy, value) << line;
    const std::string written = robot_to_toml(robot);
    EXPECT_EQ(written.find("absolute_accuracy") == std::string::npos, value == kNotStated);
    EXPECT_EQ(read_robot(TomlTable::parse(written, "w.toml")).absolute_accuracy, value);
  }
  EXPECT_THROW(read_with("absolute_accuracy = \"yes\"\n"), FileError);
  EXPECT_THROW(read_with("absolute_accuracy = true\n"), FileError);
}

TEST(RobotFile, TakesKukasFrameConventionForBaseAndFlange) {
  // R = Rz(A) Ry(B) Rx(C), element by element.
  const double a = 10 * kRadPerDeg, b = 20 * kRadPerDeg, c = 30 * kRadPerDeg;
  Eigen::Matrix3d expected;
  expected << cos(a) * cos(b), cos(a) * sin(b) * sin(c) - sin(a) * cos(c),
      cos(a) * sin(b) * cos(c) + sin(a) * sin(c),  //
      sin(a) * cos(b), sin(a) * sin(b) * sin(c) + cos(a) * cos(c),
      sin(a) * sin(b) * cos(c) - cos(a) * sin(c),  //
      -sin(b), cos(b) * sin(c), cos(b) * cos(c);
  EXPECT_LT((testing::robot().base_fixed.linear() - expected).norm(), 1e-14);
}

TEST(RobotFile, NeedsEveryKeyThatHasNoDefault) {
  for (const char* line :
       {"format = \"cellcal.robot/1\"", "name = \"Two axes\"", "gravity = [0.0, 0.1, -9.8]",
        "length_mm = 0.7", "angle_deg = 0.035", "name = \"A1\"", "d_mm = 400.0", "a_mm = 180",
        "alpha_deg = -90.0", "errors = [\"theta\", \"d\", \"a\", \"alpha\"]", "min_deg = -155.0",
        "max_deg = 155.0"}) {
    const std::string key(line, std::string_view(line).find(' '));
    expect_words(robot_refusal(without(kRobot, line)), {"robot.toml:", key, "missing"});
  }
}

TEST(RobotFile, AxisSpeedsAreForMotionAndNeedNotBeStated) {
  const Robot robot =
      read_robot(TomlTable::parse(without(kRobot, "max_speed_deg_s = 154.0"), "robot.toml"));
  EXPECT_EQ(robot.joints[0].max_speed_rad_s, 0.0);
  EXPECT_GT(robot.joints[1].max_speed_rad_s, 0.0);
  const std::string written = robot_to_toml(robot);
  EXPECT_EQ(robot_to_toml(read_robot(TomlTable::parse(written, "again.toml"))), written);
}

TEST(RobotFile, GravityIsOfAPlanetOrNone) {
  const std::string_view line = "gravity = [0.0, 0.1, -9.8]";
  for (const char* weak : {"[0.0, 0.0, -1e-20]", "[1e-3, 0.0, 0.05]", "[0.0, 0.0, -0.00981]"})
    expect_words(robot_refusal(with(kRobot, line, std::string("gravity = ") + weak)),
                 {"robot.toml:4", "gravity", "9.81"});
  // Denormal numbers would be very slow; values this small are zero.
  for (const char* none : {"[0, 0, 0]", "[0.0, 0.0, 1e-308]", "[-4e-320, 1e-31, 0.0]"})
    EXPECT_EQ(read_robot(TomlTable::parse(with(kRobot, line, std::string("gravity = ") + none),
                                          "robot.toml"))
                  .gravity_m_s2,
              Eigen::Vector3d::Zero())
        << none;
  const Robot dusty = read_robot(
      TomlTable::parse(with(kRobot, "mass_kg = 20.5", "mass_kg = 1e-308"), "robot.toml"));
  EXPECT_EQ(dusty.joints[0].mass_kg, 0.0);
}

TEST(RobotFile, AMissingKeyOfAJointIsNamedWithTheJointsNumberAndLine) {
  const std::string text = without(kRobot, "max_deg = 65.0");
  const int header = line_of(text, "[[joint]]\nname = \"A2\"");
  expect_words(robot_refusal(text),
               {"robot.toml:" + std::to_string(header) + ":", "joint[2].max_deg"});
}

void expect_named_in_robot(const Broken& broken) {
  SCOPED_TRACE(broken.now);
  const std::string text = with(kRobot, broken.line, broken.now);
  const std::string message = robot_refusal(text);
  expect_words(message,
               {"robot.toml:" + std::to_string(line_of(kRobot, broken.line)) + ": ", broken.key});
}

TEST(RobotFile, NamesLineAndKeyOfAWrongType) {
  for (const Broken& broken : std::initializer_list<Broken>{
           {"name = \"Two axes\"", "name = 5", "name"},
           {"source = \"made up\"", "source = [\"made up\"]", "source"},
           {"gravity = [0.0, 0.1, -9.8]", "gravity = 9.8", "gravity"},
           {"gravity = [0.0, 0.1, -9.8]", "gravity = [0.0, -9.8]", "gravity"},
           {"gravity = [0.0, 0.1, -9.8]", "gravity = [0.0, \"0.1\", -9.8]", "gravity"},
           {"length_mm = 0.7", "length_mm = \"0.7\"", "tolerance.length_mm"},
           {"length_mm = 0.7", "length_mm = true", "tolerance.length_mm"},
           {"length_mm = 0.7", "length_mm = 1979-05-27", "tolerance.length_mm"},
           {"sign = -1", "sign = -1.0", "joint[1].sign"},
           {"name = \"A1\"", "name = {}", "joint[1].name"},
           {"errors = [\"theta\", \"d\", \"a\", \"alpha\"]", "errors = \"theta\"", "errors"},
           {"errors = [\"theta\", \"d\", \"a\", \"alpha\"]", "errors = [1]", "errors"},
           {"harmonics = [1, 2]", "harmonics = 2", "harmonics"},
           {"harmonics = [1, 2]", "harmonics = [1.5]", "harmonics"},
           {"harmonics = [1, 2]", "harmonics = [2, 2]", "harmonics"},
           {"harmonics = [1, 2]", "wave_sigma_arcsec = [5, 5]\nwave_orders = [62]",
            "wave_sigma_arcsec"},
           {"harmonics = [1, 2]", "wave_sigma_arcsec = [5]", "wave_sigma_arcsec"},
           {"com_mm = [10.0, -20.0, 30.5]", "com_mm = [10.0, -20.0, 30.5, 1.0]", "com_mm"},
           {"abc_deg = [10.0, 20.0, 30.0]", "abc_deg = {a = 1}", "base.abc_deg"}})
    expect_named_in_robot(broken);
}

TEST(RobotFile, NamesLineAndKeyOfANumberOutOfRange) {
  for (const Broken& broken : std::initializer_list<Broken>{
           {"gravity = [0.0, 0.1, -9.8]", "gravity = [0.0, 0.0, -9810.0]", "gravity"},
           {"length_mm = 0.7", "length_mm = -0.7", "length_mm"},
           {"angle_deg = 0.035", "angle_deg = 91.0", "angle_deg"},
           {"sign = -1", "sign = 0", "sign"},
           {"sign = -1", "sign = 2", "sign"},
           {"offset_deg = 12.5", "offset_deg = 1e4", "offset_deg"},
           {"d_mm = 400.0", "d_mm = 4e5", "d_mm"},
           {"a_mm = 180", "a_mm = 99999999999", "a_mm"},
           {"min_deg = -155.0", "min_deg = 155.0", "min_deg"},
           {"max_deg = 155.0", "max_deg = 1e9", "max_deg"},
           {"max_speed_deg_s = 154.0", "max_speed_deg_s = 0.0", "max_speed_deg_s"},
           {"tolerance_length_mm = 1.25", "tolerance_length_mm = -1.25", "tolerance_length_mm"},
           {"tolerance_length_mm = 1.25", "tolerance_length_mm = 1225", "tolerance_length_mm"},
           {"tolerance_angle_deg = 0.07", "tolerance_angle_deg = 91.0", "tolerance_angle_deg"},
           {"mass_kg = 20.5", "mass_kg = -1.0", "mass_kg"},
           {"compliance_sigma_rad_per_nm = 1.5e-6", "compliance_sigma_rad_per_nm = -1.5e-6",
            "compliance_sigma_rad_per_nm"},
           {"harmonics = [1, 2]", "harmonics = [0, 2]", "harmonics"},
           {"harmonics = [1, 2]",
            "harmonics = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, "
            "16, 17]",
            "harmonics"},
           {"harmonic_sigma_arcsec = 10.0", "harmonic_sigma_arcsec = -1.0",
            "harmonic_sigma_arcsec"},
           {"harmonic_sigma_arcsec = 10.0", "function_sigma_arcsec = -1.0",
            "function_sigma_arcsec"},
           {"harmonic_sigma_arcsec = 10.0", "function_reach_deg = 0.0", "function_reach_deg"},
           {"harmonics = [1, 2]", "wave_orders = [4]\nwave_sigma_arcsec = [5]", "wave_orders"},
           {"harmonics = [1, 2]", "wave_sigma_arcsec = [0]\nwave_orders = [62]",
            "wave_sigma_arcsec"},
           {"harmonic_sigma_arcsec = 10.0", "function_deg = [10.0, -10.0]", "function_deg"}})
    expect_named_in_robot(broken);
}

TEST(RobotFile, NamesLineAndKeyOfWhatIsNotFinite) {
  for (const char* value : {"nan", "-nan", "inf", "+inf", "-inf", "1e999"}) {
    SCOPED_TRACE(value);
    for (const Broken& broken : std::initializer_list<Broken>{
             {"d_mm = 400.0", "d_mm", "d_mm"}, {"max_deg = 155.0", "max_deg", "max_deg"}}) {
      const std::string now = std::string(broken.now) + " = " + value;
      const std::string text = with(kRobot, broken.line, now);
      expect_words(robot_refusal(text), {"robot.toml:" + std::to_string(line_of(text, now)) + ":"});
    }
    const std::string gravity = "gravity = [0.0, " + std::string(value) + ", -9.8]";
    expect_words(robot_refusal(with(kRobot, "gravity = [0.0, 0.1, -9.8]", gravity)),
                 {"robot.toml:4:"});
  }
}

TEST(RobotFile, NamesAnUnknownKeyAndWhatIsKnownThere) {
  for (const Broken& broken : std::initializer_list<Broken>{
           {"sign = -1", "sgin = -1", "joint[1].sgin"},
           {"length_mm = 0.7", "length_mm = 0.7\nlenght_mm = 0.7", "tolerance.lenght_mm"},
           {"source = \"made up\"", "sauce = \"made up\"", "sauce"},
           {"xyz_mm = [0.0, 0.0, 80.0]", "zyx_mm = [0.0, 0.0, 80.0]", "flange.zyx_mm"},
           {"[flange]", "[flansch]", "flansch"}}) {
    SCOPED_TRACE(broken.now);
    const std::string message = robot_refusal(with(kRobot, broken.line, broken.now));
    expect_words(message, {"robot.toml:", broken.key, "unknown key", "known here are"});
  }
}

TEST(RobotFile, RefusesNamesThatStandTwiceOrCannotHeadAColumn) {
  for (const Broken& broken : std::initializer_list<Broken>{
           {"name = \"A2\"", "name = \"A1\"", "occurs twice"},
           {"name = \"A2\"", "name = \"A 2\"", "joint[2].name"},
           {"name = \"A2\"", "name = \"A,2\"", "joint[2].name"},
           {"name = \"A2\"", "name = \"\"", "joint[2].name"},
           {"name = \"A2\"", "name = \"#A\"", "joint[2].name"},
           {"name = \"A2\"", "name = \"A\\u0000\"", "joint[2].name"},
           {"errors = [\"theta\", \"beta\"]", "errors = [\"theta\", \"theta\"]", "occurs twice"},
           {"errors = [\"theta\", \"beta\"]", "errors = [\"gamma\"]", "theta, d, a, alpha, beta"}})
    expect_words(robot_refusal(with(kRobot, broken.line, broken.now)), {"robot.toml:", broken.key});
}

TEST(RobotFile, RefusesAKeyThatStandsTwice) {
  expect_words(robot_refusal(with(kRobot, "d_mm = 400.0", "d_mm = 400.0\nd_mm = 401.0")),
               {"robot.toml:15:", "not valid TOML"});
}

TEST(RobotFile, RefusesAnotherFormatAndSaysWhichItReads) {
  expect_words(robot_refusal(with(kRobot, "robot/1", "robot/2")),
               {"robot.toml:1: format", "cellcal.robot/2", "cellcal.robot/1"});
  expect_words(robot_refusal(with(kRobot, "robot/1", "cell/1")), {"robot.toml:1: format"});
}

TEST(RobotFile, RefusesLengthsInMetres) {
  std::string metres = with(kRobot, "d_mm = 400.0", "d_mm = 0.4");
  metres = with(metres, "a_mm = 180", "a_mm = 0.18");
  metres = with(metres, "a_mm = 600.0", "a_mm = 0.6");
  metres = with(metres, "xyz_mm = [1.0, 2.0, 3.0]", "xyz_mm = [0, 0, 0]");
  metres = with(metres, "xyz_mm = [0.0, 0.0, 80.0]", "xyz_mm = [0, 0, 0.08]");
  metres = with(metres, "[base]",
                "[[joint]]\nname = \"A3\"\nd_mm = 0.0\na_mm = 0.04\nalpha_deg = 0.0\n"
                "errors = []\nmin_deg = -180.0\nmax_deg = 65.0\nmax_speed_deg_s = 154.0\n\n[base]");
  expect_words(robot_refusal(metres), {"joint: ", "1.3 mm", "in millimetres, not in metres"});
}

TEST(RobotFile, NeedsOneToThirtyTwoJoints) {
  const std::string head = std::string(kRobot).substr(0, std::string(kRobot).find("[[joint]]"));
  expect_words(robot_refusal(head), {"robot.toml:", "has 0"});
  expect_words(robot_refusal(head + "[joint]\nname = \"A1\"\n"), {"robot.toml:", "[[joint]]"});
  expect_words(robot_refusal(head + "joint = [1, 2]\n"), {"robot.toml:"});
  std::string many = head;
  for (int i = 0; i < 33; ++i)
    many += "[[joint]]\nname = \"J" + std::to_string(i) +
            "\"\nd_mm = 0.0\na_mm = 1.0\nalpha_deg = 0.0\nerrors = []\nmin_deg = -1.0\nmax_deg = "
            "1.0\nmax_speed_deg_s = 1.0\n";
  expect_words(robot_refusal(many), {"robot.toml:", "has 33"});
}

TEST(RobotFile, BrokenTomlIsNamedWithItsLine) {
  expect_words(robot_refusal(with(kRobot, "length_mm = 0.7", "length_mm = 0,7")),
               {"robot.toml:7:", "a decimal comma"});
  expect_words(robot_refusal("format = \"cellcal.robot/1"), {"robot.toml:1:"});
}

}  // namespace
}  // namespace cellcal::calib
