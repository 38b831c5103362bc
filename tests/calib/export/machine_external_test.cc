// Linear unit and positioner in machine data.

#include <gtest/gtest.h>

#include "calib/export/machine_data.h"
#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/toml.h"
#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"

namespace cellcal::calib {
namespace {

/// E1 along y of a foot that is upright on its carriage.
const std::string kUnit =
    "INT $EX_AX_NUM=1\r\n"
    "$AXIS_TYPE[7]=1\r\n$SOFTN_END[7]=-50.0\r\n$SOFTP_END[7]=3100.0\r\n"
    "DECL EX_KIN $EX_KIN={ET1 #ERSYS,ET2 #NONE,ET3 #NONE,ET4 #NONE,ET5 #NONE,ET6 #NONE}\r\n"
    "$ET1_NAME[]=\"KL 250\"\r\n"
    "DECL ET_AX $ET1_AX={TR_A1 #E1,TR_A2 #NONE,TR_A3 #NONE}\r\n"
    "FRAME $ET1_TA1KR={X 0.0,Y 0.0,Z 500.0,A 0.0,B 0.0,C -90.0}\r\n"
    "FRAME $ET1_TFLA3={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 90.0}\r\n";

MachineData data_of(const std::string& text) {
  MachineData data;
  read_machine_data(text, "$machine.dat", data);
  return data;
}

std::optional<Joint> unit_of(const std::string& text) {
  const MachineData data = data_of(text);
  return linear_unit_of(data.external, data.robroot);
}

Eigen::Isometry3d foot_of(const std::string& text) {
  const MachineData data = data_of(text);
  return foot_in_world(data.external, data.robroot);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

/// The message of the refusal; empty: none.
std::string unit_refusal(const std::string& text) {
  try {
    const auto unit = unit_of(text);
    return unit ? "taken" : "none";
  } catch (const FileError& error) {
    return error.what();
  }
}

TEST(MachineUnit, IsAPrismaticJointAlongTheAxisOfTheFoot) {
  const auto unit = unit_of(kUnit);
  ASSERT_TRUE(unit);
  EXPECT_EQ(unit->name, "E1");
  EXPECT_EQ(unit->guide->along, Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(unit->min_rad, -0.05);
  EXPECT_EQ(unit->max_rad, 3.1);
  EXPECT_EQ(unit->max_speed_rad_s, 0.0) << "not stated";
  EXPECT_EQ(unit_of(kUnit + "$AXIS_DIR[7]=-1\r\n")->guide->along, Eigen::Vector3d(0, -1, 0));
}

TEST(MachineUnit, HasThePriorsThatARobotFileWithoutThemHas) {
  const auto unit = unit_of(kUnit);
  Robot robot = load_robot(CELLCAL_ROBOTS_FOLDER "/kr5_r1400.toml");
  robot.joints.insert(robot.joints.begin(), *unit);
  std::string text = robot_to_toml(robot);
  for (std::size_t at; (at = text.find("_sigma_m")) != std::string::npos && at < text.find("A1");) {
    const std::size_t begin = text.rfind('\n', at);
    text.erase(begin, text.find('\n', at) - begin);
  }
  const LinearGuide usual = *read_robot(TomlTable::parse(text, "r.toml")).joints[0].guide;
  EXPECT_EQ(usual.scale_sigma, unit->guide->scale_sigma);
  EXPECT_EQ(usual.direction_sigma_rad, unit->guide->direction_sigma_rad);
  EXPECT_EQ(usual.straightness_sigma_m, unit->guide->straightness_sigma_m);
  EXPECT_EQ(usual.turn_sigma_rad_m, unit->guide->turn_sigma_rad_m);
  EXPECT_EQ(usual.turn_sigma_rad, unit->guide->turn_sigma_rad);
}

TEST(MachineUnit, IsNoneWhereNoKinematicCarriesTheArm) {
  EXPECT_EQ(unit_refusal("$LENGTH_A=180.0\r\n"), "none");
  EXPECT_EQ(unit_refusal(replaced(kUnit, "ET1 #ERSYS", "ET1 #EASYS")), "none");
}

TEST(MachineUnit, ThatIsNotWholeOrAnotherKinematicIsRefusedByVariable) {
  struct Case {
    const char *from, *to, *words;
  };
  for (const Case& one : {
           Case{"$ET1_TFLA3", "$ET1_TPINFL", "$ET1_TFLA3: not in the given"},
           Case{"$ET1_AX", "$ET2_AX", "$ET1_AX: not in the given"},
           Case{"$AXIS_TYPE[7]=1", "", "$AXIS_TYPE[7]: not in the given"},
           Case{"$AXIS_TYPE[7]=1", "$AXIS_TYPE[7]=3", "$AXIS_TYPE[7] is 3: E1 turns"},
           Case{"TR_A1 #E1", "TR_A1 #E2", "TR_A1 is #E2, and a linear unit is E1"},
           Case{"TR_A2 #NONE", "TR_A2 #E2", "TR_A2 is #E2: more than one axis"},
           Case{"$SOFTP_END[7]=3100.0", "", "not both in the given"},
           Case{"$SOFTP_END[7]=3100.0", "$SOFTP_END[7]=-49.0", "not a range of 50 mm"},
           Case{"ET2 #NONE", "ET2 #ERSYS", "ET1 and ET2 both carry the arm"},
           Case{"$EX_AX_NUM=1", "$EX_AX_NUM=0", "$EX_AX_NUM is 0"},
       }) {
    const std::string said = unit_refusal(replaced(kUnit, one.from, one.to));
    EXPECT_NE(said.find(one.words), std::string::npos) << one.from << ": " << said;
  }
}

TEST(MachineUnit, WithValuesThatCannotBeIsRefusedByFileLineAndVariable) {
  for (const char* line :
       {"$EX_AX_NUM=many", "$EX_AX_NUM=1.5", "$EX_AX_NUM=99", "$AXIS_TYPE[7]=nan",
        "$AXIS_TYPE[7]=0.5", "$EX_KIN=7", "$EX_KIN={ET1", "$ET1_AX=#E1", "$ET1_TFLA3={X 1.0}",
        "$ET1_TA1KR={X 1e99,Y 0", "$SOFTN_END[7]=1e300", "$ASR_ERSYSROOT={A 1.0}"}) {
    const std::string said = unit_refusal(std::string("\n") + line + "\n");
    EXPECT_EQ(said.rfind("$machine.dat:2: ", 0), 0u) << line << ": " << said;
  }
  // Truncated anywhere, it is refused or absent.
  for (std::size_t cut = 0; cut < kUnit.size(); cut += 7)
    EXPECT_FALSE(unit_refusal(kUnit.substr(0, cut)).empty());
  for (const char* none : {"$ET9_AX={TR_A1 #E1}", "$ET1_", "$ETX_AX={TR_A1 #E1}", "$ET1X=1"})
    EXPECT_EQ(unit_refusal(none), "none") << none;
}

TEST(MachineUnit, TurnsGravityWithTheKinematicThatHangsFromTheCeiling) {
  const auto down = [](const std::string& text) -> Eigen::Vector3d {
    return foot_of(text).linear().transpose() * Eigen::Vector3d(0, 0, -1);
  };
  EXPECT_NEAR(down(kUnit).z(), -1.0, 1e-12);
  EXPECT_NEAR(
      down(kUnit + "FRAME $ASR_ERSYSROOT={X 0.0,Y 0.0,Z 4000.0,A 0.0,B 0.0,C 180.0}\r\n").z(), 1.0,
      1e-12);
  EXPECT_NEAR(down(kUnit + "$ROBROOT={X 0.0,Y 0.0,Z 0.0,A 0.0,B 90.0,C 0.0}\r\n").x(), 1.0, 1e-12);
  EXPECT_TRUE(foot_of("").isApprox(Eigen::Isometry3d::Identity()));
}

/// E2 tilts, E3 turns a table; frames as for a calibrated unit.
const std::string kTable =
    "INT $EX_AX_NUM=3\r\n"
    "$AXIS_TYPE[8]=3\r\n$SOFTN_END[8]=-95.0\r\n$SOFTP_END[8]=90.0\r\n"
    "$AXIS_TYPE[9]=5\r\n$SOFTN_END[9]=-360.0\r\n$SOFTP_END[9]=360.0\r\n"
    "DECL EX_KIN $EX_KIN={ET1 #NONE,ET2 #EASYS,ET3 #NONE,ET4 #NONE,ET5 #NONE,ET6 #NONE}\r\n"
    "DECL ET_AX $ET2_AX={TR_A1 #E2,TR_A2 #E3,TR_A3 #NONE}\r\n"
    "FRAME $ET2_TA1KR={X 12.5,Y -3.0,Z 610.0,A 0.0,B 90.0,C 0.4}\r\n"
    "FRAME $ET2_TA2A1={X 80.2,Y 2.1,Z -6.3,A 90.3,B 89.6,C 89.8}\r\n"
    "FRAME $ET2_TFLA3={X 0.0,Y 0.0,Z 150.0,A -90.0,B 0.2,C -179.9}\r\n"
    "MACHINE_DEF[3]={NAME[] \"DKP\",COOP_KRC_INDEX 1,PARENT[] \"WORLD\",ROOT {X 1900.0,Y 21.0,Z "
    "-40.0,A 180.2,B 0.1,C -0.3},MECH_TYPE #EASYS,GEOMETRY[] \" \"}\r\n";

std::vector<PositionerAxis> axes_of(const std::string& text) {
  const MachineData data = data_of(text);
  return positioner_of(data.external, data.robroot);
}

/// The message of the refusal, or the number of axes.
std::string table_refusal(const std::string& text) {
  try {
    return std::to_string(axes_of(text).size()) + " axes";
  } catch (const FileError& error) {
    return error.what();
  }
}

Eigen::Isometry3d placed(double x, double y, double z, double a, double b, double c) {
  return to_isometry(FrameMmDeg{{x, y, z}, {a, b, c}});
}

/// The table's flange in the world at two angles, as the controller computes it.
Eigen::Isometry3d table_at(double tilt_rad, double turn_rad) {
  return placed(1900.0, 21.0, -40.0, 180.2, 0.1, -0.3) * placed(12.5, -3.0, 610.0, 0.0, 90.0, 0.4) *
         Eigen::AngleAxisd(tilt_rad, Eigen::Vector3d::UnitZ()) *
         placed(80.2, 2.1, -6.3, 90.3, 89.6, 89.8) *
         Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()) *
         placed(0.0, 0.0, 150.0, -90.0, 0.2, -179.9);
}

void expect_carries_the_table(const std::string& text, const Eigen::Isometry3d& foot) {
  Robot robot;
  robot.positioner = axes_of(text);
  ASSERT_EQ(robot.positioner.size(), 2u);
  const Eigen::Isometry3d flange = placed(0.0, 0.0, 150.0, -90.0, 0.2, -179.9);
  for (const auto& [tilt, turn] : {std::pair(0.0, 0.0), {0.7, 0.0}, {0.0, -1.3}, {-0.4, 2.9}})
    EXPECT_TRUE((foot * carried_at(robot, std::vector{tilt, turn}) * flange)
                    .isApprox(table_at(tilt, turn), 1e-12))
        << tilt << " " << turn;
}

TEST(MachineTable, HasTheAxesOfItsFramesFromTheArmsFoot) {
  const auto axes = axes_of(kTable);
  ASSERT_EQ(axes.size(), 2u);
  EXPECT_EQ(axes[0].name, "E2");
  EXPECT_EQ(axes[1].name, "E3");
  EXPECT_NEAR(axes[0].min_rad * kDegPerRad, -95.0, 1e-12);
  EXPECT_NEAR(axes[0].max_rad * kDegPerRad, 90.0, 1e-12);
  EXPECT_NEAR(axes[1].max_rad * kDegPerRad, 360.0, 1e-12);
  expect_carries_the_table(kTable, Eigen::Isometry3d::Identity());
  expect_carries_the_table(kTable + "$ROBROOT={X 10.0,Y -20.0,Z 300.0,A 30.0,B 0.0,C 180.0}\r\n",
                           placed(10.0, -20.0, 300.0, 30.0, 0.0, 180.0));
}

TEST(MachineTable, BesideALinearUnitIsSeenFromTheFootAtItsZero) {
  std::string both = kUnit + kTable;
  both = replaced(both, "$EX_AX_NUM=1", "$EX_AX_NUM=3");
  both = replaced(both, "{ET1 #NONE,ET2 #EASYS", "{ET1 #ERSYS,ET2 #EASYS");
  ASSERT_TRUE(unit_of(both));
  expect_carries_the_table(both, placed(0.0, 0.0, 500.0, 0.0, 0.0, 0.0));
}

TEST(MachineTable, HasThePriorsThatARobotFileWithoutThemHas) {
  Robot robot = load_robot(CELLCAL_ROBOTS_FOLDER "/kr5_r1400.toml");
  robot.positioner = axes_of(kTable);
  std::string text = robot_to_toml(robot);
  for (std::size_t at;
       (at = text.find("_sigma_", text.find("[[positioner]]"))) != std::string::npos;) {
    const std::size_t begin = text.rfind('\n', at);
    text.erase(begin, text.find('\n', at) - begin);
  }
  const PositionerAxis usual = read_robot(TomlTable::parse(text, "r.toml")).positioner.at(1);
  EXPECT_EQ(usual.place_sigma_m, robot.positioner[1].place_sigma_m);
  EXPECT_EQ(usual.direction_sigma_rad, robot.positioner[1].direction_sigma_rad);
  EXPECT_EQ(usual.scale_sigma, robot.positioner[1].scale_sigma);
}

TEST(MachineTable, IsNoneWhereNoKinematicCarriesWork) {
  EXPECT_EQ(table_refusal("$LENGTH_A=180.0\r\n"), "0 axes");
  EXPECT_EQ(table_refusal(kUnit), "0 axes");
  EXPECT_EQ(table_refusal(replaced(kTable, "$EX_AX_NUM=3", "$EX_AX_NUM=0")), "0 axes");
  EXPECT_EQ(table_refusal(replaced(kTable, "TR_A1 #E2", "TR_A1 #NONE")), "0 axes");
}

TEST(MachineTable, ThatIsNotWholeOrAnotherKinematicIsRefusedByVariable) {
  struct Case {
    const char *from, *to, *words;
  };
  for (const Case& one : {
           Case{"$EX_AX_NUM=3", "$EX_AX_NUM=2",
                "$EX_AX_NUM is 2, and $EX_KIN has a kinematic with E3"},
           Case{"$AXIS_TYPE[9]=5", "", "$AXIS_TYPE[9]: not in the given"},
           Case{"$AXIS_TYPE[8]=3", "$AXIS_TYPE[8]=1", "$AXIS_TYPE[8] is 1: E2 slides"},
           Case{"$SOFTP_END[8]=90.0", "", "$SOFTN_END[8], $SOFTP_END[8]: not both"},
           Case{"$SOFTP_END[9]=360.0", "$SOFTP_END[9]=-360.0", "not a range of 1 deg"},
           Case{"$ET2_TA2A1", "$ET2_TPINFL", "$ET2_TA2A1: not in the given"},
           Case{"TR_A3 #NONE", "TR_A3 #E4", "$ET2_AX: 3 axes"},
           Case{"MECH_TYPE #EASYS", "MECH_TYPE #EBSYS",
                "MACHINE_DEF with MECH_TYPE #EASYS: not in"},
           Case{"ROOT {X 1900.0", "ROOT {X 1e7", "MACHINE_DEF with MECH_TYPE #EASYS: not in"},
       }) {
    const std::string said = table_refusal(replaced(kTable, one.from, one.to));
    EXPECT_NE(said.find(one.words), std::string::npos) << one.from << ": " << said;
  }
  const std::string other =
      "$ET1_AX={TR_A1 #E1,TR_A2 #NONE}\r\n" + replaced(kTable, "ET1 #NONE", "ET1 #EBSYS");
  EXPECT_NE(table_refusal(other).find("ET1 and ET2 both carry work"), std::string::npos);
  const std::string twice =
      kTable + "MACHINE_DEF[4]={ROOT {X 1.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0},MECH_TYPE #EASYS}\r\n";
  EXPECT_NE(table_refusal(twice).find("several of MECH_TYPE #EASYS"), std::string::npos);
}

TEST(MachineTable, CutAnywhereIsReadNamedOrNone) {
  for (std::size_t cut = 0; cut < kTable.size(); cut += 5)
    EXPECT_FALSE(table_refusal(kTable.substr(0, cut)).empty());
}

}  // namespace
}  // namespace cellcal::calib
