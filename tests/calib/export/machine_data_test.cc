#include "calib/export/machine_data.h"

#include <gtest/gtest.h>

#include "calib/model/error.h"
#include "tests/calib/export/arms.h"

namespace cellcal::calib::testing {
namespace {

/// A KR 5's, in a controller's format; CRLF as there.
const std::string kMachine =
    "DEFDAT  $MACHINE PUBLIC\r\n"
    "CHAR $V_R1MADA[32]\r\n"
    "$V_R1MADA[]=\"V4.4.0/KUKA5.2\" ;VERSIONSKENNUNG\r\n"
    "$TRAFONAME[]=\"#KR5 R1400 C4\"  ;NAME ; OF IT\r\n"
    "$SOFTN_END[1]=-155.0\r\n$SOFTN_END[2]=-180.0\r\n$SOFTN_END[3]=-15.0\r\n"
    "$SOFTN_END[4]=-350.0\r\n$SOFTN_END[5]=-130.0\r\n$SOFTN_END[6]=-350.0\r\n$SOFTN_END[7]=-1.0\r\n"
    "$SOFTP_END[1]=155.0\r\n$SOFTP_END[2]=65.0\r\n$SOFTP_END[3]=158.0\r\n"
    "$SOFTP_END[4]=350.0\r\n$SOFTP_END[5]=130.0\r\n$SOFTP_END[6]=350.0\r\n"
    "FRAC $RAT_MOT_AX[1]={N 125,D -1}\r\n"
    "REAL $VEL_AXIS_MA[1]=3208.333333\r\n"
    "$LENGTH_A=180.0\r\n$length_b = 600.0\r\n"
    "$TX3P3={X 620.0,Y 0.0,Z 40.0,A 0.0,B 90.0,C 0.0}\r\n"
    "FRAME $TFLWP={FRAME: X 0.0,Y 0.0,Z 80.0,A 0.0,B 0.0,C 0.0}\r\n"
    "ENDDAT\r\n";

MachineData read(const std::string& text) {
  MachineData data;
  read_machine_data(text, "$machine.dat", data);
  return data;
}

std::string machine_data_refusal(const std::string& text) {
  try {
    read(text);
  } catch (const FileError& error) {
    return error.what();
  }
  return "";
}

TEST(MachineData, OfAKR5MakeTheShippedRobot) {
  const MachineData data = read(kMachine);
  EXPECT_EQ(data.type, "#KR5 R1400 C4");
  EXPECT_TRUE(differences(data, kr5()).empty());
  Robot other = kr5();
  for (Joint& joint : other.joints) joint.min_rad = joint.max_rad = 0.0;
  other.joints[0].max_speed_rad_s = 1.0;
  const Robot made = with_machine_data(other, data);
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_NEAR(made.joints[i].min_rad, kr5().joints[i].min_rad, 1e-12) << i;
    EXPECT_NEAR(made.joints[i].max_rad, kr5().joints[i].max_rad, 1e-12) << i;
    EXPECT_NEAR(made.joints[i].max_speed_rad_s, kr5().joints[i].max_speed_rad_s, 1e-6) << i;
  }
}

TEST(MachineData, OfTheOtherKR5AreToldByTheirLengths) {
  const Robot arc = load_robot(CELLCAL_ROBOTS_FOLDER "/kr5_arc.toml");
  const auto found = differences(read(kMachine), arc);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].variable, "$TX3P3");
  EXPECT_EQ(found[1].variable, "$TFLWP");
  EXPECT_EQ(found[1].joint, "A6");
  EXPECT_NEAR(found[1].controller_m, 0.080, 1e-12);
  EXPECT_NEAR(found[1].robot_m, 0.115, 1e-12);
}

TEST(MachineData, HaveTheToolsOfTheConfiguration) {
  const MachineData data = read(
      "DECL FRAME TOOL_DATA[2]\nTOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
      "TOOL_DATA[2]={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\nBASE_DATA[1]={X 1,Y 0,Z 0,A 0,B 0,C 0}\n");
  ASSERT_EQ(data.tools.size(), 1U);
  EXPECT_EQ(data.tools.at(1).xyz_mm[2], 410.3);
  EXPECT_EQ(data.tools.at(1).abc_deg[0], 38.84);
}

TEST(MachineData, ThatAreNoneOfItsAxesStay) {
  const MachineData data =
      read("$SOFTN_END[7]=-1.0\n$SOFTN_END[0]=-1.0\n$SOFTN_END=-1.0\n;$LENGTH_A=1.0\n");
  for (const MachineAxis& axis : data.axes) EXPECT_FALSE(axis.min_rad);
  EXPECT_FALSE(data.length_a_m);
}

TEST(MachineData, ThatCannotBeAreRefusedByFileLineAndVariable) {
  EXPECT_EQ(machine_data_refusal("\n$SOFTN_END[2]=fast\n"),
            "$machine.dat, line 2: $SOFTN_END[2] = \"fast\" is not a number up to 100000");
  EXPECT_NE(machine_data_refusal("$LENGTH_A=nan"), "");
  EXPECT_NE(machine_data_refusal("$LENGTH_A=1e9"), "");
  EXPECT_NE(machine_data_refusal("$TFLWP={X 1.0,Y 2.0}").find("a structure with Z"),
            std::string::npos);
  EXPECT_NE(machine_data_refusal("$TFLWP=5").find("a structure {...}"), std::string::npos);
  EXPECT_NE(machine_data_refusal("$TFLWP={X 1.0,Y inf,Z 0,A 0,B 0,C 0}"), "");
  EXPECT_NE(machine_data_refusal("$RAT_MOT_AX[1]={N 125,D 0}").find("D is 0"), std::string::npos);
  EXPECT_NE(machine_data_refusal(std::string((16u << 20) + 1, ' ')).find("limit"),
            std::string::npos);
  for (std::size_t length = 0; length < kMachine.size(); ++length)
    machine_data_refusal(kMachine.substr(0, length));  // terminates, with a value or a refusal
}

TEST(MachineData, OfAnArmWithSevenAxesAreNotCompared) {
  EXPECT_THROW(differences({}, load_robot(CELLCAL_ROBOTS_FOLDER "/iiwa14.toml")), FileError);
}

}  // namespace
}  // namespace cellcal::calib::testing
