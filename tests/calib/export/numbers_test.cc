#include <gtest/gtest.h>

#include <clocale>

#include "calib/export/tables.h"

namespace cellcal::calib::testing {
namespace {

TEST(ParsedNumber, IsTheWholeTextAndFinite) {
  EXPECT_EQ(number(" -1.5e-3\t"), -1.5e-3);
  EXPECT_EQ(number("+2"), 2.0);
  for (const char* no : {"", " ", "1,5", "1 2", "nan", "inf", "1e999", "--1", "+-1", "0x10", "1m"})
    EXPECT_FALSE(number(no)) << no;
}

TEST(ThreeNumbers, AreThreeWithBlanksOrCommasBetween) {
  for (const char* yes : {" 1  -2\n3e1 ", "1,-2,30", "1 , -2,\t30 "})
    EXPECT_EQ(three_numbers(yes), Eigen::Vector3d(1, -2, 30)) << yes;
  for (const char* no : {"", "1 2", "1 2 3 4", "1,2,3,", "1,2,3,4", "0,1 0,2 0,3", "1 2,3", "1,,2",
                         "1 2 x", "1 2 nan"})
    EXPECT_FALSE(three_numbers(no)) << no;
}

TEST(WrittenNumber, ComesBackBitForBit) {
  for (const double value : {0.1, -1.0 / 3.0, 1e-300, 12345.678901234567, 5e-324})
    EXPECT_EQ(number(shortest(value)), value);
  EXPECT_EQ(shortest(-0.0), "0");
}

TEST(NamesOfJoints, GoFromRobotFileToRosAndBack) {
  EXPECT_EQ(ros_joint_name("A1"), "joint_a1");
  EXPECT_EQ(robot_joint_name("joint_a1"), "A1");
  EXPECT_EQ(robot_joint_name("joint_1"), "A1");
  EXPECT_EQ(robot_joint_name("robot1_joint_a1"), "A1");
  EXPECT_EQ(robot_joint_name("robot1_joint_6"), "A6");
  EXPECT_EQ(robot_joint_name("myjoint_6"), "myjoint_6");
  EXPECT_EQ(robot_joint_name("shoulder_pan_joint"), "shoulder_pan_joint");
  EXPECT_EQ(robot_joint_name("my joint,\"1\"#"), "my_joint__1__");
  EXPECT_EQ(robot_joint_name("joint_"), "joint_");
}

}  // namespace
}  // namespace cellcal::calib::testing
