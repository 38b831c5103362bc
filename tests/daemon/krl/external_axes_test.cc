// E1 to E6 of taught points, and machine data of these axes.

#include <gtest/gtest.h>

#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using krl::Why;

krl::CorrectedProgram moved_with(const std::string& external, const std::string& machine,
                                 const std::string& base = "0", const std::string& config = {}) {
  std::string pose = pose_text({0.2, -1.4, 1.5, 0.3, 0.8, 0.1});
  pose.insert(pose.size() - 1, external);
  return krl::correct_program(
      calibration(), {{"p.src", "DEF P()\nBAS(#TOOL,1)\nBAS(#BASE," + base + ")\nPTP XP\nEND\n"},
                      krl::KrlFile{"p.dat", "DEFDAT P\nDECL E6POS XP=" + pose + "\nENDDAT\n"},
                      {{"$config.dat",
                        "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
                        "BASE_DATA[2]={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n" +
                            config},
                       {"$machine.dat", machine}}});
}

TEST(ExternalAxes, ThatAreNotThereOrDoNotCarryTheArmMayStandAnywhere) {
  for (const char* machine :
       {"INT $EX_AX_NUM=0\n", "INT $EX_AX_NUM=2\nDECL EX_KIN $EX_KIN={ET1 #EASYS,ET2 #NONE}\n",
        "DECL EX_KIN $EX_KIN={ET1 #NONE,ET2 #NONE}\n"}) {
    const auto result = moved_with(",E1 88.24,E2 -700.0", machine);
    EXPECT_EQ(all_words(result), "") << machine;
    ASSERT_EQ(result.files.size(), 2U) << machine;
    EXPECT_NE(result.files[1].text.find(",E1 88.24,E2 -700.0}"), std::string::npos);
  }
}

TEST(ExternalAxes, ThatMayCarryTheArmAreRefusedAwayFrom0) {
  for (const char* machine :
       {"", "INT $EX_AX_NUM=1\n", "INT $EX_AX_NUM=1\nDECL EX_KIN $EX_KIN={ET1 #ERSYS,ET2 #NONE}\n",
        "INT $EX_AX_NUM=-1\n", "INT $EX_AX_NUM=1E9\n", "INT $EX_AX_NUM=\n", "$EX_KIN=\n",
        "DECL EX_KIN $EX_KIN={ET1 #NONE}\nDECL EX_KIN $EX_KIN={ET1 \n"}) {
    const auto result = moved_with(",E1 88.24", machine);
    ASSERT_EQ(result.refusals.size(), 1U) << machine;
    EXPECT_EQ(result.refusals[0].why, Why::kExternalAxes) << machine;
    EXPECT_EQ(all_words(moved_with(",E1 0.0", machine)), "") << machine;
  }
}

TEST(AMotionOfExternalAxesAlone, KeepsThePostureAndStaysAsWritten) {
  const std::string apart = "INT $EX_AX_NUM=1\nDECL EX_KIN $EX_KIN={ET1 #EASYS,ET2 #NONE}\n";
  const std::string pose = pose_text({0.2, -1.4, 1.5, 0.3, 0.8, 0.1}, false);
  const auto corrected = [&](const std::string& motion, const std::string& machine) {
    return krl::correct_program(
        calibration(),
        {{"p.src",
          "DEF P()\nBAS(#TOOL,1)\nBAS(#BASE,0)\nPTP {A1 10,A2 -80,A3 85,A4 0,A5 45,A6 0}\n" +
              motion + "LIN " + pose + "\nEND\n"},
         {},
         {{"$config.dat", "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"},
          {"$machine.dat", machine}}});
  };
  const auto plain = corrected("", apart);
  ASSERT_EQ(plain.points.size(), 2U) << all_words(plain);
  for (const char* motion : {"PTP {E1 20}\n", "PTP_REL {E1 5} C_PTP\n", "SPTP {E6AXIS: E1 -7.5}\n",
                             "LIN {E1 SPEED}\n", "ASYPTP {E1 20}\n"}) {
    const auto result = corrected(motion, apart);
    ASSERT_EQ(result.points.size(), 2U) << motion << all_words(result);
    EXPECT_EQ(result.points[1].shift_mm, plain.points[1].shift_mm) << motion;
    EXPECT_NE(result.files[0].text.find(motion), std::string::npos);
    for (const char* machine : {"", "INT $EX_AX_NUM=1\nDECL EX_KIN $EX_KIN={ET1 #ERSYS}\n"})
      EXPECT_FALSE(corrected(motion, machine).refusals.empty()) << motion << machine;
  }
  const auto some = corrected("PTP {A1 10}\n", apart);
  EXPECT_NE(all_words(some).find("line 5: incomplete components"), std::string::npos)
      << all_words(some);
}

TEST(ABaseThatAPositionerCarries, IsRefusedByName) {
  const std::string machine = "INT $EX_AX_NUM=1\nDECL EX_KIN $EX_KIN={ET1 #EASYS}\n";
  const std::string carried =
      "MACHINE_FRAME_DAT[2]={MACH_DEF_INDEX 2,PARENT[] \"\",GEOMETRY[] \"\"}\n";
  const auto result = moved_with(",E1 0.0", machine, "2", carried);
  ASSERT_EQ(result.refusals.size(), 1U);
  EXPECT_EQ(result.refusals[0].why, Why::kExternalBase);
  EXPECT_EQ(result.refusals[0].line, 4);
  EXPECT_EQ(all_words(moved_with(",E1 0.0", machine, "0", carried)), "");
  EXPECT_EQ(all_words(moved_with(",E1 0.0", machine, "2",
                                 "MACHINE_FRAME_DAT[2]={MACH_DEF_INDEX 0,PARENT[] \"\"}\n")),
            "");
  EXPECT_FALSE(
      moved_with(",E1 0.0", machine, "2", "MACHINE_FRAME_DAT[2]={MACH_DEF\n").refusals.empty());
}

}  // namespace
}  // namespace cellcal::daemon::testing
