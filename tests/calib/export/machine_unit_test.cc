// The linear unit that carries the arm, of machine data.

#include <gtest/gtest.h>

#include "calib/export/machine_data.h"
#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/toml.h"
#include "calib/model/error.h"

namespace cellcal::calib {
namespace {

/// E1 along y of a foot that stands upright on its carriage.
const std::string kUnit =
    "INT $EX_AX_NUM=1\r\n"
    "$AXIS_TYPE[7]=1\r\n$SOFTN_END[7]=-50.0\r\n$SOFTP_END[7]=3100.0\r\n"
    "DECL EX_KIN $EX_KIN={ET1 #ERSYS,ET2 #NONE,ET3 #NONE,ET4 #NONE,ET5 #NONE,ET6 #NONE}\r\n"
    "$ET1_NAME[]=\"KL 250\"\r\n"
    "DECL ET_AX $ET1_AX={TR_A1 #E1,TR_A2 #NONE,TR_A3 #NONE}\r\n"
    "FRAME $ET1_TA1KR={X 0.0,Y 0.0,Z 500.0,A 0.0,B 0.0,C -90.0}\r\n"
    "FRAME $ET1_TFLA3={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 90.0}\r\n";

MachineData unit_data(const std::string& text) {
  MachineData data;
  read_machine_data(text, "$machine.dat", data);
  return data;
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

/// Words of the refusal; empty: none.
std::string unit_refusal(const std::string& text) {
  try {
    const auto unit = linear_unit_of(unit_data(text));
    return unit ? "taken" : "none";
  } catch (const FileError& error) {
    return error.what();
  }
}

TEST(MachineUnit, IsAPrismaticJointAlongTheAxisOfTheFoot) {
  const auto unit = linear_unit_of(unit_data(kUnit));
  ASSERT_TRUE(unit);
  EXPECT_EQ(unit->name, "E1");
  EXPECT_EQ(unit->guide->along, Eigen::Vector3d(0, 1, 0));
  EXPECT_EQ(unit->min_rad, -0.05);
  EXPECT_EQ(unit->max_rad, 3.1);
  EXPECT_EQ(unit->max_speed_rad_s, 0.0) << "not stated";
  EXPECT_EQ(linear_unit_of(unit_data(kUnit + "$AXIS_DIR[7]=-1\r\n"))->guide->along,
            Eigen::Vector3d(0, -1, 0));
}

TEST(MachineUnit, HasThePriorsThatARobotFileWithoutThemHas) {
  const auto unit = linear_unit_of(unit_data(kUnit));
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
  // Cut anywhere, it is read, named or none.
  for (std::size_t cut = 0; cut < kUnit.size(); cut += 7)
    EXPECT_FALSE(unit_refusal(kUnit.substr(0, cut)).empty());
  for (const char* none : {"$ET9_AX={TR_A1 #E1}", "$ET1_", "$ETX_AX={TR_A1 #E1}", "$ET1X=1"})
    EXPECT_EQ(unit_refusal(none), "none") << none;
}

TEST(MachineUnit, TurnsGravityWithTheKinematicThatHangsFromTheCeiling) {
  const auto down = [](const std::string& text) -> Eigen::Vector3d {
    return foot_in_world(unit_data(text)).transpose() * Eigen::Vector3d(0, 0, -1);
  };
  EXPECT_NEAR(down(kUnit).z(), -1.0, 1e-12);
  EXPECT_NEAR(
      down(kUnit + "FRAME $ASR_ERSYSROOT={X 0.0,Y 0.0,Z 4000.0,A 0.0,B 0.0,C 180.0}\r\n").z(), 1.0,
      1e-12);
  EXPECT_NEAR(down(kUnit + "$ROBROOT={X 0.0,Y 0.0,Z 0.0,A 0.0,B 90.0,C 0.0}\r\n").x(), 1.0, 1e-12);
  EXPECT_EQ(foot_in_world(unit_data("")), Eigen::Matrix3d::Identity());
}

}  // namespace
}  // namespace cellcal::calib
