#include "calib/export/machine_data.h"

#include <gtest/gtest.h>

#include "calib/model/error.h"
#include "calib/model/kinematics.h"
#include "tests/calib/export/arms.h"

namespace cellcal::calib::testing {
namespace {

/// Machine data of a KR 5, in a controller's format, with CRLF.
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
  EXPECT_EQ(data.type(), "#KR5 R1400 C4");
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

TEST(MachineData, StateAbsoluteAccuracyInTheWordsOfEachRelease) {
  using enum AbsoluteAccuracy;
  const auto of = [](const std::string& lines) {
    return with_machine_data(kr5(), read(kMachine + lines)).absolute_accuracy;
  };
  EXPECT_EQ(of(""), kNotStated);
  for (const char* active :
       {"BOOL $ABS_ACCUR=TRUE\r\n", "$ABS_ACCUR=#ACTIVATED\r\n", "ABS_ACCUR=TRUE\r\n"})
    EXPECT_EQ(of(active), kActive) << active;
  for (const char* off :
       {"$ABS_ACCUR=FALSE\r\n", "$ABS_ACCUR=#NONE\r\n", "$ABS_ACCUR=#SUPPRESSED\r\n",
        "$ABS_ACCUR=#INACTIVE\r\n", "$DEACTIVATE_ABS_ACCUR=TRUE\r\n$ABS_ACCUR=TRUE\r\n"})
    EXPECT_EQ(of(off), kOff) << off;
  EXPECT_EQ(of("$DEACTIVATE_ABS_ACCUR=FALSE\r\n$ABS_ACCUR=TRUE\r\n"), kActive);
  EXPECT_EQ(of("$DEACTIVATE_ABS_ACCUR=TRUE\r\n"), kNotStated) << "the option is not there";
  Robot with_model = kr5();
  with_model.absolute_accuracy = kInFile;
  EXPECT_EQ(with_machine_data(with_model, read(kMachine + "$ABS_ACCUR=TRUE\r\n")).absolute_accuracy,
            kInFile);
  const std::string refusal = machine_data_refusal("$ABS_ACCUR=7\r\n");
  EXPECT_NE(refusal.find("$machine.dat:1: $ABS_ACCUR is not TRUE, FALSE"), std::string::npos)
      << refusal;
  MachineData alone;
  read_absolute_accuracy("$LENGTH_A=x\r\n$ABS_ACCUR=TRUE\r\n", "$machine.dat", alone);
  EXPECT_EQ(alone.absolute_accuracy(), kActive) << "whatever else is in the file";
}

TEST(MachineData, OfTheOtherKR5AreToldByTheirLengths) {
  const Robot arc = load_robot(CELLCAL_ROBOTS_FOLDER "/kr5_arc.toml");
  const auto found = differences(read(kMachine), arc);
  ASSERT_EQ(found.size(), 2U);
  EXPECT_EQ(found[0].variable, "$TX3P3 Z");
  EXPECT_EQ(found[1].variable, "$TFLWP Z");
  EXPECT_EQ(found[1].joint, "A6");
  EXPECT_NEAR(found[1].controller_m, 0.080, 1e-12);
  EXPECT_NEAR(found[1].robot_m, 0.115, 1e-12);
}

TEST(MachineData, HaveTheToolsBasesAndLoadsOfTheConfiguration) {
  const MachineData data = read(
      "DECL FRAME TOOL_DATA[3]\nTOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
      "TOOL_DATA[2]={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\nframe base_data[1]={x 1,y -  2,z 0,a 0,b 0,c 0}\n"
      "TOOL_NAME[1,]=\" D\xfcse 1 \"\nTOOL_NAME[2,]=\" \"\nBASE_NAME[1,]=\"table\"\nTOOL_TYPE[3]=#TCP\n"
      "LOAD_DATA[1]={M 4.5,CM {X 1.0,Y 2.0,Z 80.0,A 0.0,B 0.0,C 0.0},J {X 0.1,Y 0.1,Z 0.1}}\n"
      "LOAD_DATA[2]={M -1.0,CM {X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}\n");
  ASSERT_EQ(data.tools.size(), 2U);
  EXPECT_EQ(data.tools.at(1).xyz_mm[2], 410.3);
  EXPECT_EQ(data.tools.at(1).abc_deg[0], 38.84);
  EXPECT_EQ(data.tools.at(2).xyz_mm[2], 0.0);
  EXPECT_EQ(data.tool_places.at(2), "$machine.dat:3");
  EXPECT_EQ(data.tool_names, (std::map<int, std::string>{{1, "D\xc3\xbcse 1"}}));
  EXPECT_EQ(data.base_names.at(1), "table");
  EXPECT_EQ(data.bases.at(1).xyz_mm[1], -2.0);
  EXPECT_EQ(data.fixed_tools, std::set<int>{3});
  EXPECT_EQ(data.loads.at(1).mass_kg, 4.5);
  EXPECT_EQ(data.loads.at(1).com_mm[2], 80.0);
  EXPECT_LT(data.loads.at(2).mass_kg, 0.0);
}

TEST(MachineData, OfAToolThatCannotBeReadAreRefusedByFileAndLine) {
  for (const char* line : {"TOOL_DATA[1]={X 1.0}", "BASE_DATA[2]=XWORK", "LOAD_DATA[3]=5",
                           "$ROBROOT={X 1e9,Y 0,Z 0,A 0,B 0,C 0}"})
    EXPECT_NE(machine_data_refusal(std::string("\n") + line).find("$machine.dat:2: "),
              std::string::npos)
        << line;
}

TEST(MachineData, OfAFrameStatedTwiceAreRefusedUnlessBothAgree) {
  const std::string frame = "={X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0}\n",
                    load = "={M 4.5,CM {X 1.0,Y 2.0,Z 80.0}}\n";
  for (const auto& [name, value] :
       {std::pair("TOOL_DATA[1]", frame), std::pair("BASE_DATA[2]", frame),
        std::pair("LOAD_DATA[3]", load), std::pair("$ROBROOT", frame)}) {
    const std::string line = name + value;
    std::string other = line;
    other.replace(other.find("2.0"), 3, "2.1");
    EXPECT_EQ(machine_data_refusal(line + line), "");
    EXPECT_EQ(machine_data_refusal(line + other),
              std::string("$machine.dat:2: ") + name +
                  " is not as stated before. Give the files of one robot");
  }
}

TEST(MachineData, ThatAreNoneOfItsAxesStay) {
  const MachineData data =
      read("$SOFTN_END[7]=-1.0\n$SOFTN_END[0]=-1.0\n$SOFTN_END=-1.0\n;$LENGTH_A=1.0\n");
  for (const MachineAxis& axis : data.axes) EXPECT_FALSE(axis.min_rad);
  EXPECT_FALSE(data.length_a_m);
}

TEST(MachineData, ThatCannotBeAreRefusedByFileLineAndVariable) {
  EXPECT_EQ(machine_data_refusal("\n$SOFTN_END[2]=fast\n"),
            "$machine.dat:2: $SOFTN_END[2] is not a number up to 100000");
  EXPECT_NE(machine_data_refusal("$LENGTH_A=nan"), "");
  EXPECT_NE(machine_data_refusal("$LENGTH_A=1e9"), "");
  EXPECT_NE(machine_data_refusal("$TFLWP={X 1.0,Y 2.0}").find("a structure with"),
            std::string::npos);
  EXPECT_NE(machine_data_refusal("$TFLWP=5").find("a structure {...}"), std::string::npos);
  EXPECT_NE(machine_data_refusal("$TFLWP={X 1.0,Y inf,Z 0,A 0,B 0,C 0}"), "");
  EXPECT_NE(machine_data_refusal("$RAT_MOT_AX[1]={N 125,D 0}").find("D is 0"), std::string::npos);
  EXPECT_NE(machine_data_refusal(std::string((16u << 20) + 1, ' ')).find("16 MB"),
            std::string::npos);
  for (std::size_t length = 0; length < kMachine.size(); ++length)
    machine_data_refusal(kMachine.substr(0, length));  // terminates, with a value or a refusal
}

/// A complete arm, in lower case and with the numerator of a gear, as on controllers.
std::string whole_arm(const std::string& more = {}) {
  std::string text =
      "defdat $machine public\nframe $tiroro={x 0.0,y 0.0,z 400.0,a 0.0,b 0.0,c 0.0} ;FOOT\n"
      "$length_a=180.0\n$length_b=600.0\n$dh_4={dhart_a 0.0,dhart_d 0.0,dhart_alpha 90.0}\n"
      "DECL DHART $DH_5={DHART_A 0.0,DHART_D 0.0,DHART_ALPHA -90.0000}\n"
      "$tx3p3={x 620.0,y 0.0,z 40.0,a 0.0,b 90.0,c 0.0}\n$tflwp={x 0.0,y 0.0,z 80.0,a 0.0,b 0.0,c 0.0}\n"
      "decl fra $rat_mot_ax[12]\n$rat_mot_ax[6]={n 6485103,d 49400}\nreal $vel_axis_ma[6]=4813.50439\n"
      "decl kinclass $kinclass=#standard\nint $a4par=0\nbool $def_a5link=false\n";
  for (int i = 1; i <= 6; ++i)
    text += "$softn_end[" + std::to_string(i) + "]=-100.0\n$softp_end[" + std::to_string(i) +
            "]=120.0\n$axis_dir[" + std::to_string(i) + "]=" + (i == 2 || i == 3 ? "1" : "-1") +
            "\n";
  return text + more + "\nenddat\n";
}

TEST(MachineData, OfAWholeArmMakeItsRobot) {
  const Robot robot = robot_of(read(whole_arm()));
  ASSERT_EQ(robot.joints.size(), 6U);
  const ArmModel made(robot, Tool{}), shipped(kr5(), Tool{});
  std::mt19937 random(1);
  for (int k = 0; k < 20; ++k) {
    const auto q = random_joints(kr5(), random);
    EXPECT_TRUE(made.nominal_tcp(q).isApprox(shipped.nominal_tcp(q), 1e-12));
  }
  EXPECT_NEAR(robot.joints[5].gear_ratio, 131.277, 1e-3);
  EXPECT_NEAR(robot.joints[5].max_speed_rad_s * kDegPerRad, 220.0, 0.01);
  EXPECT_TRUE(differences(read(whole_arm()), kr5()).empty());
}

TEST(MachineData, OfHeavyArmsAllowForACounterbalance) {
  const auto counterbalance_rad = [](const std::string& type) {
    return robot_of(read(whole_arm("$TRAFONAME[]=\"" + type + "\"")))
        .joints[1]
        .counterbalance_sigma_rad;
  };
  for (const char* type : {"#KR210R2700EXC4FLR", "#KR 120 R2700", "#KR_150_2"})
    EXPECT_GT(counterbalance_rad(type), 0.0) << type;
  for (const char* type : {"#KR16R1610-2", "#KR5 R1400 C4", "#KR", "", "#SCARA 210"})
    EXPECT_EQ(counterbalance_rad(type), 0.0) << type;
}

TEST(MachineData, OfTwoRobotsAreThoseOfTheGeometryAndSaySo) {
  const auto read_both = [](const std::string& trafo, const std::string& model) {
    MachineData data;  // in either order
    read_machine_data("$MODEL_NAME[]=\"" + model + "\"\n", "$robcor.dat", data);
    read_machine_data(whole_arm("$TRAFONAME[]=\"" + trafo + "\""), "$machine.dat", data);
    read_machine_data("\n$MODEL_NAME[]=\"" + model + "\"\n", "$robcor.dat", data);
    return data;
  };
  const MachineData two = read_both("#KR120R2700_2 C4 FLR", "#KR30L16_3A C4 FLR ZH16_2");
  EXPECT_EQ(robot_of(two).name, "KR120R2700_2 C4 FLR");
  EXPECT_GT(robot_of(two).joints[1].counterbalance_sigma_rad, 0.0) << "of the heavier";
  EXPECT_NE(two_robots(two).find(
                ": $TRAFONAME \"#KR120R2700_2 C4 FLR\", $robcor.dat:2: $MODEL_NAME \"#KR30L16_3A"),
            std::string::npos)
      << two_robots(two);
  EXPECT_EQ(two_robots(two).find("$machine.dat:"), 0U);
  EXPECT_NE(two_robots(read_both("#KR6", "#KR60HA C4")), "");
  for (const auto& [trafo, model] :
       {std::pair("#KR210R2700_2 C4 FLR", "#KR210R2700_2 C4 FLR"),
        std::pair("#KR5 R1400", "#KR5R1400 C4"), std::pair("#KR5 R1400 C4", "#KR5 R1400"),
        std::pair("#KR5 R1400", ""), std::pair(" ", "#KR5 R1400")})
    EXPECT_EQ(two_robots(read_both(trafo, model)), "") << trafo << " " << model;
  EXPECT_EQ(robot_of(read_both("", "#KR5 R1400")).name, "KR5 R1400");
}

TEST(MachineData, ThatDifferInSignOrHeightAreNamedWithIt) {
  for (const auto& [line, variable] :
       {std::pair("$TIRORO={X 0,Y 0,Z 500,A 0,B 0,C 0}", "$TIRORO Z"),
        std::pair("$TX3P3={X 620,Y 0,Z -40,A 0,B 90,C 0}", "$TX3P3 Z"),
        std::pair("$LENGTH_A=-180.0", "$LENGTH_A")}) {
    const auto found = differences(read(whole_arm(line)), kr5());
    ASSERT_EQ(found.size(), 1U) << line;
    EXPECT_EQ(found[0].variable, variable);
  }
  const auto turned = differences(read(whole_arm("$AXIS_DIR[4]=1")), kr5());
  ASSERT_EQ(turned.size(), 1U);
  EXPECT_EQ(turned[0].variable, "");
  EXPECT_GT(turned[0].robot_m, 1e-3);
}

TEST(MachineData, OfAnotherKindOfArmAreRefusedByVariable) {
  const auto why = [](const std::string& line) -> std::string {
    try {
      robot_of(read(whole_arm(line)));
    } catch (const FileError& error) {
      return error.what();
    }
    return "";
  };
  for (const char* line : {"$DH_5={DHART_A 265.0,DHART_D 0.0,DHART_ALPHA -90.0}",
                           "$KINCLASS=#DELTA_KIN", "$DEF_A5LINK=TRUE", "$A4PAR=1", "$MAIN_AXIS=#SS",
                           "$TRAFO_AXIS=5", "$TFLWP={X 5,Y 0,Z 80,A 0,B 0,C 0}",
                           "$TX3P3={X 620,Y 0,Z 40,A 0,B 0,C 0}", "$SOFTP_END[2]=-180.0"})
    EXPECT_NE(why(line).find(std::string(line).substr(0, 4)), std::string::npos)
        << line << ": " << why(line);
  EXPECT_NE(why("$DH_5={DHART_A 265.0,DHART_D 0.0,DHART_ALPHA -90.0}").find("DHART_A 265.000 mm"),
            std::string::npos);
  const std::string fixed = whole_arm("$DEF_A4FIX=TRUE");
  const auto line =
      std::to_string(1 + std::count(fixed.begin(), fixed.begin() + fixed.find("$DEF_A4FIX"), '\n'));
  EXPECT_EQ(why("$DEF_A4FIX=TRUE")
                .find("$machine.dat:" + line + ": $DEF_A4FIX = TRUE: not a six-axis arm"),
            0U)
      << why("$DEF_A4FIX=TRUE");
  EXPECT_EQ(why("$DH_5={DHART_A 265.0,DHART_D 0.0,DHART_ALPHA -90.0}").find("$machine.dat:"), 0U);
  EXPECT_THROW(robot_of(read("$LENGTH_A=1")), FileError);
  const std::string all = whole_arm();
  for (std::size_t length = 0; length < all.size(); length += 3)
    machine_data_refusal(all.substr(0, length));
}

TEST(MachineData, AreThoseOfTheArmBehindALinearUnit) {
  Robot on_unit = kr5();
  Joint unit;
  unit.name = "E1";
  unit.guide.emplace();
  unit.max_rad = 3.0;
  on_unit.joints.insert(on_unit.joints.begin(), unit);
  const MachineData data = read(whole_arm("$LENGTH_B=610.0"));
  const auto found = differences(data, on_unit);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].joint, "A2");
  const auto zeros = controllers_zeros(data, on_unit);
  ASSERT_TRUE(zeros);
  EXPECT_EQ(zeros->joints.size(), 6U);
  EXPECT_TRUE(zeros->same());
  const Robot made = with_machine_data(on_unit, data);
  EXPECT_EQ(made.joints[0].max_rad, 3.0);
  for (std::size_t i = 1; i < 7; ++i) EXPECT_NEAR(made.joints[i].max_rad * kDegPerRad, 120.0, 1e-9);
}

TEST(MachineData, GiveTheArmOfAnotherFileTheirGravityIfStated) {
  Robot ceiling = kr5();
  ceiling.gravity_m_s2 = -ceiling.gravity_m_s2;
  EXPECT_EQ(with_machine_data(ceiling, read(kMachine)).gravity_m_s2, ceiling.gravity_m_s2);
  const std::string root = "={X 0.0,Y 0.0,Z 2000.0,A 0.0,B 0.0,C ";
  const auto gravity = [&](const std::string& more) {
    return with_machine_data(ceiling, read(kMachine + more)).gravity_m_s2;
  };
  EXPECT_TRUE(gravity("$ROBROOT" + root + "0.0}\r\n").isApprox(kr5().gravity_m_s2));
  EXPECT_TRUE(gravity("$ROBROOT" + root + "180.0}\r\n").isApprox(ceiling.gravity_m_s2));
  EXPECT_TRUE(gravity("$EX_KIN={ET1 #ERSYS}\r\n$ET1_AX={TR_A1 #E1}\r\n$ET1_TA1KR" + root +
                      "0.0}\r\n$ET1_TFLA3" + root + "0.0}\r\n$ERSYSROOT" + root + "90.0}\r\n")
                  .isApprox(Eigen::Vector3d(0.0, -9.81, 0.0)));
}

TEST(MachineData, OfAnArmWithSevenAxesAreNotCompared) {
  EXPECT_THROW(differences({}, load_robot(CELLCAL_ROBOTS_FOLDER "/iiwa14.toml")), FileError);
}

}  // namespace
}  // namespace cellcal::calib::testing
