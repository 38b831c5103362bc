// Motions rewritten for CELLCAL_FIX, and restored.

#include "daemon/krl/run_time_program.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "calib/estimate/predict.h"
#include "calib/model/error.h"
#include "daemon/krl/fix_module.h"
#include "tests/daemon/krl/fixture.h"
#include "tests/daemon/krl/krl_controller.h"

namespace cellcal::daemon::testing {
namespace {

using krl::restored;
using krl::RewrittenPrograms;
using krl::Why;

constexpr const char* kDat =
    "DEFDAT P PUBLIC\nDECL E6POS XP1={X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0,S 2,T 35}\n"
    "DECL E6POS XARR[5]\nDECL E6POS XQ\nDECL E6POS XZ={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0,S 0,T 0}\n"
    "POS XPOS\nFRAME XF\nDECL E6AXIS XA\nAXIS XB\n"
    "STRUC STATION E6POS ABOVE,AT,INT NR\nDECL STATION XS[3]\nDECL REAL R=0.0\n"
    "DECL FDAT FT={TOOL_NO 1,BASE_NO 1,IPO_FRAME #TCP}\nDECL FDAT FB={TOOL_NO 1,BASE_NO 1,IPO_FRAME #BASE}\nENDDAT\n";

RewrittenPrograms rewritten_of(const std::string& text,
                               const std::vector<std::string>& leave = {}) {
  krl::BackupFiles files;
  krl::ProgramFiles one;
  one.src = {"p.src", text};
  one.dat = krl::KrlFile{"p.dat", kDat};
  files.modules.push_back(one);
  return rewrite_motions(files, leave);
}

std::string program(const std::string& body) { return "DEF P ( )\r\n" + body + "\r\nEND\r\n"; }

/// The statement as rewritten; its refusal; or "unchanged".
std::string line_of(const std::string& body, const std::vector<std::string>& leave = {}) {
  const RewrittenPrograms result = rewritten_of(program(body), leave);
  if (!result.modules.at(0).refusals.empty()) return name_of(result.modules[0].refusals[0].why);
  if (result.files.empty()) return "unchanged";
  const std::string& text = result.files[0].text;
  EXPECT_EQ(restored(result.files[0]), program(body));
  return text.substr(11, text.size() - 11 - 7);
}

TEST(RunTimeProgram, RefusesMotionsOfAToolThatIsFixedInTheCell) {
  for (const char* motion : {"FDAT_ACT=FT\r\nBAS(#PTP_PARAMS,100)\r\nPTP XP1",
                             "$IPO_MODE=#TCP\r\nLIN XP1", "LIN XP1 WITH $IPO_MODE=#TCP",
                             "SLIN XP1 WITH $TOOL=STOOL2(FT),$IPO_MODE=SIPO_MODE(FT.IPO_FRAME)",
                             "FDAT_ACT=FT\r\nLIN_REL {X 1.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}"})
    EXPECT_EQ(line_of(motion), "external_tool") << motion;
  EXPECT_EQ(line_of("FDAT_ACT=FT\r\nFDAT_ACT=FB\r\nLIN XP1"),
            "FDAT_ACT=FT\r\nFDAT_ACT=FB\r\nLIN CC_FIX(XP1)");
  EXPECT_EQ(line_of("$IPO_MODE=#TCP\r\nLIN XP1", {"XP1"}),
            "$IPO_MODE=#TCP\r\nLIN CC_STAY_POS(XP1)");
  EXPECT_EQ(
      line_of("$IPO_MODE=#TCP\r\nLIN {X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0,S 2,T 35}", {"LINE 3"}),
      "$IPO_MODE=#TCP\r\nLIN CC_STAY_POS({E6POS:  X 1.0,Y 2.0,Z 3.0,A 0.0,B 0.0,C 0.0,S 2,T 35})");
  EXPECT_EQ(line_of("$IPO_MODE=#TCP\r\nLIN_REL {Z 5.0}", {"LINE 3"}), "unchanged");
  EXPECT_EQ(
      line_of("SLIN XP1 WITH $IPO_MODE=SIPO_MODE(FB.IPO_FRAME)"),
      "SLIN CC_FIX_IN(XP1,$TOOL,$BASE,SIPO_MODE(FB.IPO_FRAME),$LOAD) WITH $IPO_MODE=SIPO_MODE(FB.IPO_FRAME)");
}

TEST(RunTimeProgram, WrapsThePointOfAMotionByItsTypeAndWay) {
  EXPECT_EQ(line_of("LIN XP1 C_DIS"), "LIN CC_FIX(XP1) C_DIS");
  EXPECT_EQ(line_of("PTP  XP1  C_PTP ; Z\xfcge"), "PTP  CC_FIX_PTP(XP1)  C_PTP ; Z\xfcge");
  EXPECT_EQ(line_of("lin xp1"), "lin CC_FIX(xp1)");
  EXPECT_EQ(line_of("LIN XPOS"), "LIN CC_FIX_POS(XPOS)");
  EXPECT_EQ(line_of("PTP XPOS"), "PTP CC_FIX_PTP_POS(XPOS)");
  EXPECT_EQ(line_of("LIN XF C_VEL"), "LIN CC_FIX_FRAME(XF) C_VEL");
  EXPECT_EQ(line_of("PTP XA"), "PTP CC_FIX_E6AXIS(XA)");
  EXPECT_EQ(line_of("PTP XB"), "PTP CC_FIX_AXIS(XB)");
  EXPECT_EQ(line_of("CIRC XP1,XARR[2],CA 180.0 C_DIS"),
            "CIRC CC_FIX(XP1),CC_FIX(XARR[2]),CA 180.0 C_DIS");
  EXPECT_EQ(line_of("SPL XP1"), "SPL CC_FIX(XP1)");
}

TEST(RunTimeProgram, PartsAMotionFromItsCallWhereTheFileHasNoBlank) {
  EXPECT_EQ(line_of("PTP{A1 10.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.0,A6 0.0}").substr(0, 11),
            "PTP \tCC_FIX");
  EXPECT_EQ(line_of("LIN_REL{Z 100} #BASE").substr(0, 15), "LIN_REL \tCC_BY(");
}

/// Like cellcal's mark for a blank of its own, which would be removed.
TEST(RunTimeProgram, IsRefusedAloneWhereItWouldNotComeBack) {
  EXPECT_EQ(line_of("LIN \tXP1"), "not_restored");
}

TEST(RunTimeProgram, WrapsWhatOnlyTheRunningProgramKnows) {
  EXPECT_EQ(line_of("LIN XARR[I+1]"), "LIN CC_FIX(XARR[I+1])");
  EXPECT_EQ(line_of("LIN XS[N].ABOVE C_DIS"), "LIN CC_FIX(XS[N].ABOVE) C_DIS");
  EXPECT_EQ(line_of("LIN XP1:XF"), "LIN CC_FIX_FRAME(XP1:XF)");
  EXPECT_EQ(line_of("LIN XF:XP1 C_DIS"), "LIN CC_FIX(XF:XP1) C_DIS");
  EXPECT_EQ(line_of("LIN INV_POS(XF):XP1"), "LIN CC_FIX(INV_POS(XF):XP1)");
  EXPECT_EQ(line_of("DECL FRAME HERE\r\nPTP HERE"), "DECL FRAME HERE\r\nPTP CC_FIX_FRAME(HERE)");
  EXPECT_EQ(line_of("LIN PLACE(3)\r\nEND\r\nDEFFCT E6POS PLACE (N:IN)\r\nDECL INT N\r\n"
                    "RETURN (XP1)\r\nENDFCT\r\nDEF Q()"),
            "LIN CC_FIX(PLACE(3))\r\nEND\r\nDEFFCT E6POS PLACE (N:IN)\r\nDECL INT N\r\n"
            "RETURN (XP1)\r\nENDFCT\r\nDEF Q()");
}

TEST(RunTimeProgram, WrapsPointsWrittenOut) {
  const std::string at = "X 1.0,Y 2,Z -3.0,A 0,B 0,C 0";
  EXPECT_EQ(line_of("LIN {" + at + "}"), "LIN CC_FIX_FRAME({FRAME:  " + at + "})");
  EXPECT_EQ(line_of("PTP {E6POS: " + at + ",S 2,T 35} C_PTP"),
            "PTP CC_FIX_PTP({E6POS: " + at + ",S 2,T 35}) C_PTP");
  EXPECT_EQ(line_of("PTP {A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0}"),
            "PTP CC_FIX_E6AXIS({E6AXIS:  A1 0,A2 -90,A3 90,A4 0,A5 0,A6 0})");
  EXPECT_EQ(line_of("LIN { " + at + " }"), "LIN CC_FIX_FRAME({FRAME:   " + at + " })");
  EXPECT_EQ(line_of("PTP {E6POS:  " + at + ",S 2,T 35}"), "partial");  // as if written by cellcal
  EXPECT_EQ(line_of("LIN {Z 500.0}"), "partial");
  EXPECT_EQ(line_of("PTP {A3 90.0}"), "partial");
  EXPECT_EQ(line_of("PTP {" + at + ",S 2}"), "partial");
}

TEST(RunTimeProgram, KeepsRelativeMotionsRelative) {
  EXPECT_EQ(line_of("LIN_REL {Z 60.0} C_DIS"),
            "LIN_REL CC_BY({FRAME:  Z 60.0,  X +0.0,Y +0.0,A +0.0,B +0.0,C +0.0}) C_DIS");
  EXPECT_EQ(line_of("LIN_REL {X 1.0,  Y 2.0,Z 3.0,A 0.0,B 0.0,  C 0.0}"),
            "LIN_REL CC_BY({FRAME:  X 1.0,  Y 2.0,Z 3.0,A 0.0,B 0.0,  C 0.0})");
  EXPECT_EQ(line_of("LIN_REL XF #TOOL"), "LIN_REL CC_BY_TOOL(XF) #TOOL");
  EXPECT_EQ(line_of("PTP_REL {A1 10.0,A2 0,A3 0,A4 0,A5 0,A6 -5}"),
            "PTP_REL CC_BY_AXES({E6AXIS:  A1 10.0,A2 0,A3 0,A4 0,A5 0,A6 -5})");
  EXPECT_EQ(line_of("PTP_REL {A3 10.0}"),
            "PTP_REL CC_BY_AXES({E6AXIS:  A3 10.0,  A1 +0.0,A2 +0.0,A4 +0.0,A5 +0.0,A6 +0.0})");
  EXPECT_EQ(line_of("LIN_REL {A 10.0}"), "relative_motion");
  EXPECT_EQ(line_of("CIRC_REL {X 1.0},{X 2.0}"), "relative_motion");
  EXPECT_EQ(line_of("LIN_REL XP1"), "relative_motion");
  EXPECT_EQ(line_of("LIN_REL {}"), "relative_motion");
}

TEST(RunTimeProgram, GivesToolBaseAndLoadOfTheMotionsOwnWith) {
  const std::string with =
      "WITH $VEL=SVEL_CP(2.0,,LDAT),$TOOL=STOOL2(FP1),$BASE=SBASE(FP1.BASE_NO),$IPO_MODE=SIPO_MODE("
      "FP1.IPO_FRAME),$LOAD=SLOAD(FP1.TOOL_NO) C_SPL";
  EXPECT_EQ(line_of("SLIN XP1 " + with),
            "SLIN CC_FIX_IN(XP1,STOOL2(FP1),SBASE(FP1.BASE_NO),SIPO_MODE(FP1.IPO_FRAME),SLOAD("
            "FP1.TOOL_NO)) " +
                with);
  EXPECT_EQ(line_of("SPTP XA WITH $TOOL=TOOL_DATA[1]"),
            "SPTP CC_FIX_E6AXIS_IN(XA,TOOL_DATA[1],$LOAD) WITH $TOOL=TOOL_DATA[1]");
  EXPECT_EQ(line_of("SPTP XA WITH $LOAD=LOAD_DATA[1]"),
            "SPTP CC_FIX_E6AXIS_IN(XA,$TOOL,LOAD_DATA[1]) WITH $LOAD=LOAD_DATA[1]");
  EXPECT_EQ(line_of("SPLINE WITH $BASE=BASE_DATA[2]\r\nSPL XP1\r\nENDSPLINE\r\nLIN XP1"),
            "SPLINE WITH $BASE=BASE_DATA[2]\r\n"
            "SPL CC_FIX_IN(XP1,$TOOL,BASE_DATA[2],$IPO_MODE,$LOAD)\r\n"
            "ENDSPLINE\r\nLIN CC_FIX(XP1)");
}

TEST(RunTimeProgram, LeavesMotionsOfExternalAxesThatCarryNothingKnown) {
  const std::string apart = "INT $EX_AX_NUM=1\nDECL EX_KIN $EX_KIN={ET1 #EASYS,ET2 #NONE}\n";
  const auto rewritten = [](const std::string& machine, const std::vector<std::string>& external) {
    krl::BackupFiles files;
    files.modules = {{{"p.src", program("PTP {E1 20}\r\nPTP_REL {E1 5}\r\nLIN XP1")},
                      krl::KrlFile{"p.dat", kDat},
                      {},
                      {}}};
    files.controller = {{"$machine.dat", machine}};
    return rewrite_motions(files, {}, external);
  };
  const auto result = rewritten(apart, {});
  ASSERT_EQ(result.files.size(), 1U);
  EXPECT_EQ(result.files[0].text, program("PTP {E1 20}\r\nPTP_REL {E1 5}\r\nLIN CC_FIX(XP1)"));
  EXPECT_TRUE(rewritten("", {}).files.empty());
  EXPECT_TRUE(rewritten(apart, {"E1"}).files.empty());
  EXPECT_TRUE(rewritten(apart + "MACHINE_FRAME_DAT[2]={MACH_DEF_INDEX 2}\n", {}).files.empty());
}

/// CC_BY computes with the active ones.
TEST(RunTimeProgram, RefusesARelativeMotionWithToolBaseLoadOrModeOfItsOwn) {
  for (const char* with : {"$TOOL=TOOL_DATA[1]", "$BASE=BASE_DATA[2]", "$LOAD=LOAD_DATA[1]",
                           "$IPO_MODE=#TCP", "$VEL.CP=0.2,$BASE=SBASE(FP1.BASE_NO)"}) {
    const std::string own = std::string(" WITH ") + with + " C_SPL";
    EXPECT_EQ(line_of("SLIN_REL {X 100}" + own), "relative_motion") << with;
    EXPECT_EQ(line_of("SLIN_REL {X 100} #TOOL" + own), "relative_motion") << with;
    EXPECT_EQ(line_of("SPTP_REL {A1 10}" + own), "relative_motion") << with;
    EXPECT_EQ(line_of("SPLINE\r\nSLIN_REL {X 100}" + own + "\r\nENDSPLINE"), "relative_motion")
        << with;
  }
  EXPECT_EQ(line_of("SPLINE WITH $BASE=BASE_DATA[2]\r\nSLIN_REL {X 100}\r\nENDSPLINE"),
            "relative_motion");
  EXPECT_EQ(
      line_of("SLIN_REL {Z 60.0} WITH $VEL.CP=0.2"),
      "SLIN_REL CC_BY({FRAME:  Z 60.0,  X +0.0,Y +0.0,A +0.0,B +0.0,C +0.0}) WITH $VEL.CP=0.2");
}

TEST(RunTimeProgram, LeavesHomesAndNamedPointsWhereTheyAre) {
  EXPECT_EQ(line_of("PTP XHOME"), "PTP CC_STAY(XHOME)");
  EXPECT_EQ(line_of("PTP $AXIS_ACT"), "PTP CC_STAY($AXIS_ACT)");
  EXPECT_EQ(line_of("LIN $POS_ACT"), "LIN CC_STAY_POS($POS_ACT)");
  EXPECT_EQ(line_of("SPTP $NULLFRAME"), "SPTP CC_FIX_FRAME($NULLFRAME)") << "the base's origin";
  EXPECT_EQ(line_of("DECL E6POS $MINE\r\nLIN $MINE"), "DECL E6POS $MINE\r\nLIN CC_FIX($MINE)")
      << "of $config.dat, as a system's builder declares them";
  EXPECT_EQ(line_of("PTP $POS_RET C_PTP"), "PTP CC_STAY_POS($POS_RET) C_PTP");
  EXPECT_EQ(line_of("LIN XP1", {"XP1"}), "LIN CC_STAY_POS(XP1)");
  EXPECT_EQ(line_of("WAIT SEC 0\r\nR=XP1.X"), "unchanged");
  EXPECT_THROW(line_of("LIN XP1", {"XP9"}), calib::FileError);
}

TEST(RunTimeProgram, LeavesTheModulesBelowSystemAndTPAlsoOfTheFolderR1Alone) {
  const struct {
    const char *root, *config, *left;
  } cases[] = {{"KRC/R1/", "KRC/R1/System/", "KRC/R1/Program/TP/X.src "},
               {"", "System\\", "Program/TP/X.src "},
               {"", "", "System/X.src TP/X.src Program/TP/X.src "}};
  for (const auto& one : cases) {
    krl::BackupFiles files;
    for (const char* folder : {"System/", "TP/", "Program/TP/"})
      files.modules.push_back(
          {{std::string(one.root) + folder + "X.src", program("PTP $AXIS_ACT")}, {}, {}, {}});
    files.controller = {{std::string(one.config) + "$config.dat", ""}};
    std::string changed;
    for (const krl::KrlFile& file : rewrite_motions(files, {}).files) changed += file.name + " ";
    EXPECT_EQ(changed, one.left);
  }
}

TEST(RunTimeProgram, NamesWhatStaysAndCorrectsAHomeOfTheModuleAlone) {
  krl::BackupFiles files;
  const auto module = [](const std::string& name, const std::string& dat) {
    return krl::ProgramFiles{
        {name + ".src", "DEF " + name + "()\nPTP XHOME1\nPTP XP1\nPTP $H_POS\nEND\n"},
        krl::KrlFile{name + ".dat", dat + "DECL E6POS XP1\n"},
        {},
        {}};
  };
  files.modules = {module("A", "DECL E6POS XHOME1\n"), module("B", "DECL GLOBAL E6POS XHOME1\n"),
                   module("C", ""), module("MasRef_User", "")};
  files.controller = {{"$config.dat", "DECL E6POS XHOME1\nDECL E6AXIS XMMD_ORIGIN\n"}};
  const RewrittenPrograms result = rewrite_motions(files, {"XP1"});
  const std::string why = "home or mastering reference";
  const std::map<std::string, std::string> named = {{"XP1", "--leave"}, {"$H_POS", why}};
  auto all = named;
  all.emplace("XHOME1", why);
  EXPECT_EQ(result.modules.at(0).left, named);
  EXPECT_NE(result.files.at(0).text.find("PTP CC_FIX_PTP(XHOME1)"), std::string::npos);
  EXPECT_EQ(result.modules.at(1).left, all);
  EXPECT_EQ(result.modules.at(2).left, all);
  EXPECT_TRUE(result.modules.at(3).kukas);
  EXPECT_EQ(result.modules[3].motions, 3);
  EXPECT_EQ(result.files.size(), 3U);
  EXPECT_EQ(line_of("PTP XMMD_ORIGIN"), "PTP CC_STAY(XMMD_ORIGIN)");
}

/// "line:name" of each refusal for the arm's own position.
std::string own_of(const std::string& body, const std::vector<std::string>& leave = {}) {
  const RewrittenPrograms result = rewritten_of(program(body), leave);
  std::string all;
  for (const krl::Refusal& one : result.modules.at(0).refusals)
    if (one.why == Why::kOwnPosition) all += std::to_string(one.line) + ":" + one.what + " ";
  return all;
}

TEST(RunTimeProgram, RefusesPointsThatComeFromTheArmsOwnPosition) {
  EXPECT_EQ(own_of("XP1=$POS_ACT\r\nXP1.Z=XP1.Z+50\r\nLIN XP1"), "4:XP1 ");
  EXPECT_EQ(own_of("LIN $POS_ACT:{Z -50.0}"), "2:$POS_ACT ");
  EXPECT_EQ(own_of("R=$POS_INT.Z\r\nXP1.Z=R+5.0\r\nLIN XP1"), "4:XP1 ");
  EXPECT_EQ(own_of("XARR[2]=XP1\r\nXF=$POS_FOR\r\nXARR[1]=XF:XP1\r\nPTP XARR[1]"), "5:XARR[1] ");
  EXPECT_EQ(own_of("LIN FORWARD($AXIS_ACT,R)"), "2:$AXIS_ACT ");
  EXPECT_EQ(own_of("XF.Z=$POS_ACT.Z\r\nLIN_REL XF"), "3:XF ");
  EXPECT_EQ(own_of("$BASE=$POS_ACT\r\nLIN XP1"), "2:$BASE ");
  EXPECT_EQ(own_of("SUB($POS_ACT)\r\nEND\r\nDEF SUB (P :IN)\r\nDECL E6POS P\r\nP.Z=P.Z+5\r\nLIN P"),
            "7:P ");
  EXPECT_EQ(own_of("SUB(XP1)\r\nLIN XP1\r\nEND\r\nDEF SUB (P :OUT)\r\nDECL E6POS P\r\n"
                   "P=$POS_ACT\r\nP.Z=0.0"),
            "3:XP1 ");
  EXPECT_EQ(own_of("LIN UP()\r\nEND\r\nDEFFCT E6POS UP ()\r\nRETURN (XF:$POS_ACT)\r\nENDFCT\r\n"
                   "DEF Q()"),
            "2:UP ");
  const RewrittenPrograms based = rewritten_of(program("BASE_DATA[3]=$POS_ACT\r\nLIN XP1"), {});
  const std::string words = krl::words(based.modules.at(0).refusals.at(0), cell().robot);
  EXPECT_NE(words.find("points in it would be corrected twice"), std::string::npos) << words;
  // --leave is the way out.
  EXPECT_EQ(line_of("XP1=$POS_ACT\r\nXP1.Z=XP1.Z+50\r\nLIN XP1", {"XP1"}),
            "XP1=$POS_ACT\r\nXP1.Z=XP1.Z+50\r\nLIN CC_STAY_POS(XP1)");
}

TEST(RunTimeProgram, RefusesNothingForLooksAtTheArmsOwnPosition) {
  EXPECT_EQ(own_of("IF $POS_ACT.Z<500.0 THEN\r\nLIN XP1\r\nENDIF"), "");
  EXPECT_EQ(own_of("R=$POS_ACT.Z\r\nLIN XP1\r\nLIN_REL {Z 50.0,X R2}"), "");
  EXPECT_EQ(own_of("XP1.E1=$AXIS_ACT.E1\r\nXP1.S=$POS_ACT.S\r\nLIN XP1"), "");
  EXPECT_EQ(own_of("XA=INVERSE(XP1,$AXIS_ACT,R)\r\nPTP XA"), "");
  EXPECT_EQ(own_of("DECL REAL Z\r\nZ=$POS_ACT.Z\r\nLIN_REL {Z 100.0}"), "");
  // An index selects, and a count of steps is no place.
  EXPECT_EQ(own_of("DECL INT I\r\nI=$POS_ACT.Z\r\nXF=XARR[I]\r\nLIN XARR[I]\r\nLIN_REL XF"), "");
  EXPECT_EQ(own_of("INT I\r\nI=($POS_ACT.Z-100)/50\r\nXP1.Z=100+50*I\r\nLIN XP1"), "");
  EXPECT_EQ(own_of("INT I\r\nI=$POS_ACT.Z\r\nXP1.Z=I\r\nLIN XP1"), "5:XP1 ");
  EXPECT_EQ(own_of("REAL R\r\nR=$POS_ACT.Z/2\r\nXP1.Z=2*R\r\nLIN XP1"), "5:XP1 ");
  // Variables of other routines.
  EXPECT_EQ(own_of("REAL Z\r\nXP1.Z=Z\r\nLIN XP1\r\nEND\r\nDEF SUB()\r\nREAL Z\r\nZ=$POS_ACT.Z"),
            "");
  EXPECT_EQ(own_of("LIN XP1\r\nEND\r\nDEF SUB (XP1 :IN)\r\nDECL E6POS XP1\r\nXP1=$POS_ACT"), "");
  EXPECT_EQ(own_of("SUB(XP1)\r\nSUB($POS_ACT)\r\nLIN XP1\r\nEND\r\nDEF SUB (P :IN)\r\n"
                   "DECL E6POS P\r\nR=P.X"),
            "");
}

TEST(RunTimeProgram, LeavesVariablesThatAreTheArmsOwnPositionAndNothingElse) {
  EXPECT_EQ(line_of("XA=$AXIS_ACT\r\nPTP XA"), "XA=$AXIS_ACT\r\nPTP CC_STAY(XA)");
  for (const std::string name : {"XQ", "XZ"})
    EXPECT_EQ(line_of(name + "=$POS_INT\r\nLIN " + name),
              name + "=$POS_INT\r\nLIN CC_STAY_POS(" + name + ")");
  EXPECT_EQ(own_of("XP1=$POS_INT\r\nLIN XP1"), "3:XP1 ") << "it is taught as well";
  EXPECT_EQ(own_of("XF=$POS_ACT\r\nLIN XF"), "3:XF ")
      << "CELLCAL_FIX cannot know of a FRAME that stays";
  EXPECT_EQ(own_of("XA=$AXIS_ACT\r\nXA=XHOME\r\nPTP XA"), "4:XA ");
  EXPECT_EQ(own_of("XA=$AXIS_ACT\r\nXA.A1=0.0\r\nPTP XA"), "4:XA ");
}

/// In the other module, or through a GLOBAL variable.
TEST(RunTimeProgram, FollowsTheArmsOwnPositionThroughModules) {
  const auto module = [](const char* name, const std::string& body, const std::string& data) {
    krl::ProgramFiles one;
    one.src = {std::string(name) + ".src", "DEF " + std::string(name) + "( )\n" + body + "\nEND\n"};
    one.dat = krl::KrlFile{std::string(name) + ".dat", "DEFDAT D PUBLIC\n" + data + "\nENDDAT\n"};
    return one;
  };
  krl::BackupFiles files;
  files.modules = {module("A", "LIN XRET\nLIN XOWN", "DECL E6POS XOWN"),
                   module("B", "XRET=$POS_ACT\nXRET.Z=0.0\nXOWN=$POS_ACT\nXOWN.Z=0.0",
                          "DECL GLOBAL E6POS XRET\nDECL E6POS XOWN")};
  const RewrittenPrograms together = rewrite_motions(files, {});
  ASSERT_EQ(together.modules.at(0).refusals.size(), 1U);
  EXPECT_EQ(together.modules[0].refusals[0].what, "XRET");
  krl::BackupFiles alone;
  alone.modules = {module("A", "DECL E6POS P\nASIDE(P)\nLIN P", "")};
  alone.modules[0].modules = {
      {"ASIDE.src", "DEF ASIDE(Q :OUT)\nDECL E6POS Q\nQ=$POS_ACT\nQ.Z=0.0\nEND\n"},
      {"binary.src", std::string("\0\1", 2)}};
  const RewrittenPrograms result = rewrite_motions(alone, {});
  ASSERT_EQ(result.modules.at(0).refusals.size(), 1U);
  EXPECT_EQ(result.modules[0].refusals[0].what, "P");
}

TEST(RunTimeProgram, ReturnsToWhereTheArmStood) {
  const auto taught = postures(2, 9);
  const std::string src =
      "DEF P ( )\nDECL E6AXIS SAVED\nDECL E6POS FOUND\nPTP XP1\nSAVED=$AXIS_ACT\nFOUND=$POS_ACT\n"
      "PTP XP2\nPTP SAVED\nPTP XP2\nPTP FOUND\nLIN_REL {Z 20.0}\nEND\n";
  const std::string dat = "DEFDAT P PUBLIC\nDECL E6POS XP1=" + pose_text(taught[0]) +
                          "\nDECL E6POS XP2=" + pose_text(taught[1]) + "\nENDDAT\n";
  krl::BackupFiles files;
  krl::ProgramFiles one;
  one.src = {"p.src", src};
  one.dat = krl::KrlFile{"p.dat", dat};
  files.modules.push_back(one);
  const RewrittenPrograms result = rewrite_motions(files, {});
  ASSERT_EQ(result.files.size(), 1U);
  const calib::Calibration c = calibration();
  const krl::FixModule fix = fix_module(c, krl::Data{}, {4711, "0"});
  KrlController controller(cell().robot, {{"p.src", result.files[0].text},
                                          {"p.dat", dat},
                                          {fix.src.name, fix.src.text},
                                          {fix.dat.name, fix.dat.text}});
  controller.set_frame("$TOOL", calib::to_frame(frames().tool));
  controller.run("P");
  ASSERT_EQ(controller.reached.size(), 6U) << controller.message();
  const calib::Predictor predictor(c);
  const auto tip = [&](std::size_t i) -> Eigen::Vector3d {
    return predictor.calibrated(controller.reached[i]).tcp.translation();
  };
  EXPECT_LT((tip(0) - predictor.nominal(taught[0]).translation()).norm(), 2e-5);
  for (const std::size_t i : {2U, 4U}) EXPECT_LT((tip(i) - tip(0)).norm(), 2e-6) << i;
  EXPECT_LT((tip(5) - tip(4) - Eigen::Vector3d(0.0, 0.0, 0.02)).norm(), 2e-5);
}

TEST(RunTimeProgram, RefusesAPointOfAnUnknownTypeByFileAndLine) {
  const RewrittenPrograms result = rewritten_of(program("LIN XP1\r\nLIN XNOWHERE"));
  ASSERT_EQ(result.modules.at(0).refusals.size(), 1U);
  EXPECT_TRUE(result.files.empty());
  const krl::Refusal& refusal = result.modules[0].refusals[0];
  EXPECT_EQ(refusal.why, Why::kUnknownPoint);
  EXPECT_EQ(words(refusal, cell().robot).substr(0, 18), "p.src:3: XNOWHERE:");
  EXPECT_EQ(line_of("LIN R"), "unknown_point");
  EXPECT_EQ(line_of("LIN XS[1].NR"), "unknown_point");
  EXPECT_EQ(line_of("LIN XB"), "unknown_point");  // a path to axis angles
}

TEST(RunTimeProgram, RefusesASecondCorrection) {
  const RewrittenPrograms once = rewritten_of(program("LIN XP1"));
  EXPECT_THROW(rewritten_of(once.files.at(0).text), calib::FileError);
}

TEST(RunTimeProgram, ComesBackAlsoWhereTheProgramWasEditedSince) {
  RewrittenPrograms once = rewritten_of(program("LIN XP1\r\nLIN_REL {Z 5.0}"));
  std::string& text = once.files.at(0).text;
  text.insert(text.find("LIN CC_FIX"), "WAIT SEC 0.1\r\n");
  text.insert(text.find("CC_BY("), "  ");
  EXPECT_EQ(restored(once.files[0]), program("WAIT SEC 0.1\r\nLIN XP1\r\nLIN_REL   {Z 5.0}"));
}

TEST(RunTimeProgram, TakesNothingBackThatItDidNotWrite) {
  for (const char* text :
       {"LIN XP1", "LIN CC_FIX XP1", "LIN CC_FIX(", "LIN CC_FIX()", "LIN CC_FIX(XP1,CC_FIX(XP2))",
        "XP1=CC_FIX(XP1)", "LIN CC_FIX(CC_FIX(XP1))", "", "LIN CC_BY({Z 1.0"})
    EXPECT_THROW(restored({"p.src", program(text)}), calib::FileError) << text;
  EXPECT_THROW(restored({"p.src", std::string("LIN CC_FIX(X\0)", 14)}), calib::FileError);
  EXPECT_THROW(restored({"p.src", std::string(20'000, 'X')}), calib::FileError);
}

TEST(RunTimeProgram, SurvivesEveryPlaceWhereAFileCanBeCutShort) {
  const std::string whole = program(
      "SPLINE WITH $TOOL=TOOL_DATA[1]\r\nSPL {X 1.0,Y (2.0+R),Z XF.Z}:XF\r\nENDSPLINE\r\n"
      "CIRC XS[1].AT,XARR[N],CA 90.0\r\nLIN_REL {Z 60.0} #TOOL\r\nPTP (XP1)");
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    const RewrittenPrograms result = rewritten_of(whole.substr(0, size));
    if (!result.files.empty()) {
      EXPECT_EQ(restored(result.files[0]), whole.substr(0, size));
    }
  }
}

/// Programs in inline forms, as taught.
TEST(RunTimeProgram, CorrectsATaughtProgramInItsInlineForms) {
  const auto taught_at = postures(20, 9);
  const KrlProgram before = taught(cell().robot, frames(), taught_at);
  krl::BackupFiles files;
  krl::ProgramFiles one;
  one.src = {"weld.src", before.src};
  one.dat = krl::KrlFile{"weld.dat", before.dat};
  files.modules.push_back(one);
  files.controller = {{"$config.dat", before.config}};
  const RewrittenPrograms result = rewrite_motions(files, {});
  ASSERT_EQ(result.files.size(), 1U);
  EXPECT_EQ(result.modules[0].corrected, 20);
  EXPECT_EQ(result.modules[0].motions, 21);
  EXPECT_EQ(restored(result.files[0]), before.src);
  // The controller of the tests executes it.
  const calib::Calibration c = calibration();
  krl::Data data;
  read_data(files.controller[0], data);
  const krl::FixModule fix = fix_module(c, data, {4711, "0"});
  KrlController controller(cell().robot, {{"weld.src", result.files[0].text},
                                          {"weld.dat", before.dat},
                                          {fix.src.name, fix.src.text},
                                          {fix.dat.name, fix.dat.text}});
  controller.put_data("TOOL_DATA", 1, frames().tool);
  controller.put_data("BASE_DATA", 3, frames().base);
  controller.run("WELD");
  ASSERT_EQ(controller.reached.size(), 21U) << controller.message();
  const calib::Predictor predictor(c);
  for (std::size_t i = 0; i < taught_at.size(); ++i)
    EXPECT_LT((predictor.calibrated(controller.reached[i + 1]).tcp.translation() -
               predictor.nominal(taught_at[i]).translation())
                      .norm() *
                  calib::kMmPerM,
              0.02)
        << i;
  // Only the motions have changed.
  std::size_t changed = 0;
  for (std::size_t a = 0, b = 0; a < before.src.size();) {
    const auto end_a = before.src.find('\n', a), end_b = result.files[0].text.find('\n', b);
    const std::string old = before.src.substr(a, end_a - a);
    const std::string fresh = result.files[0].text.substr(b, end_b - b);
    if (old != fresh) {
      ++changed;
      EXPECT_TRUE(old.starts_with("PTP ") || old.starts_with("LIN ")) << old;
    }
    a = end_a + 1;
    b = end_b + 1;
  }
  EXPECT_EQ(changed, 21U);
}

}  // namespace
}  // namespace cellcal::daemon::testing
