// Statements that are not understood are refused by line, and nothing is written.

#include <gtest/gtest.h>

#include <algorithm>
#include <map>

#include "calib/model/enum_table.h"
#include "calib/model/error.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using krl::Why;

const std::string& point() {
  static const std::string text = pose_text({-0.2, -1.4, 1.5, 0.3, 0.8, 0.1});
  return text;
}
constexpr const char* kFrames = "BAS(#TOOL,1)\nBAS(#BASE,0)\n";

krl::CorrectedProgram correct(const std::string& body, const std::string& dat,
                              const krl::CorrectionOptions& options = {},
                              const calib::Calibration& c = calibration()) {
  krl::ProgramFiles f;
  f.src = {"p.src", "DEF p()\n" + body + "END\n"};
  f.dat = krl::KrlFile{"p.dat", dat};
  f.controller = {{"$config.dat",
                   "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
                   "BASE_DATA[2]={X 100.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n"
                   "DECL GLOBAL E6POS XCONFIG\n"}};
  return correct_program(c, f, options);
}

struct Case {
  const char* name;
  std::string body, dat;
  Why why;
  const char* file;
  int line;
};

std::string with(const std::string& more) {
  return point().substr(0, point().size() - 1) + more + "}";
}

std::string declared(const std::string& value) { return "DECL E6POS XP1=" + value + "\n"; }

TEST(AProgramThatIsNotUnderstood, IsRefusedByFileAndLine) {
  const std::string f = kFrames, p1 = declared(point()),
                    twice = "XP1=" + point() + "\nXP1=" + point() + "\n";
  const Case cases[] = {
      {"changed", f + "XP1.X=XP1.X+10\nLIN XP1\n", p1, Why::kComputed, "p.src", 4},
      {"read", f + "LIN XP1\nXP2=XP1\n", p1, Why::kComputed, "p.src", 5},
      {"handed over", f + "LIN XP1\nSHIFT(XP1)\n", p1, Why::kComputed, "p.src", 5},
      {"operator", f + "LIN XP1:{X 0,Y 0,Z 50,A 0,B 0,C 0}\n", p1, Why::kGeometricOperator, "p.src",
       4},
      {"operator behind a literal", f + "LIN {X 1,Y 0,Z 50,A 0,B 0,C 0}:XP1\n", p1,
       Why::kGeometricOperator, "p.src", 4},
      {"array", f + "LIN PAL[I]\n", "DECL E6POS PAL[9]\n", Why::kArray, "p.src", 4},
      {"function", f + "LIN NEXT(1)\n", p1, Why::kComputed, "p.src", 4},
      {"relative", f + "LIN_REL {Z 50}\n", p1, Why::kRelativeMotion, "p.src", 4},
      {"partial", f + "LIN {Z 50}\n", "", Why::kPartial, "p.src", 4},
      {"partial axes", f + "PTP {A1 50}\n", "", Why::kPartial, "p.src", 4},
      {"partial axes without A1", f + "PTP {A2 -90,A3 90}\n", "", Why::kPartial, "p.src", 4},
      {"without a value in another file", f + "PTP XCONFIG\n", "", Why::kComputed, "p.src", 4},
      {"unknown", f + "PTP XP9\n", p1, Why::kUnknownPoint, "p.src", 4},
      {"twice", f + "PTP XP1\n", p1 + p1, Why::kDeclaredTwice, "p.dat", 2},
      {"twice in two lines", f + "PTP XP1\n", "DECL E6POS XP1\n" + twice, Why::kDeclaredTwice,
       "p.dat", 3},
      {"given and set", f + "PTP XP1\n", p1 + "XP1=" + point() + "\n", Why::kDeclaredTwice, "p.dat",
       2},
      {"a component of it", f + "PTP XP1\n", p1 + "XP1.X=5\n", Why::kDeclaredTwice, "p.dat", 2},
      {"an FDAT given twice otherwise", "FDAT_ACT=F1\nBAS(#FRAMES)\nPTP XP1\n",
       p1 + "DECL FDAT F1={TOOL_NO 1,BASE_NO 0}\nDECL FDAT F1={TOOL_NO 2,BASE_NO 0}\n",
       Why::kDeclaredTwice, "p.dat", 3},
      {"a base set twice", "BAS(#TOOL,1)\n$BASE=FB\nPTP XP1\n",
       p1 + "DECL FRAME FB={X 1,Y 0,Z 0,A 0,B 0,C 0}\nFB={X 9,Y 0,Z 0,A 0,B 0,C 0}\n",
       Why::kBaseNotKnown, "p.src", 4},
      {"given again", f + "XP1=" + point() + "\nPTP XP1\n", p1, Why::kDeclaredTwice, "p.src", 4},
      {"no tool", "BAS(#BASE,0)\nPTP XP1\n", p1, Why::kToolNotKnown, "p.src", 3},
      {"no base", "BAS(#TOOL,1)\nPTP XP1\n", p1, Why::kBaseNotKnown, "p.src", 3},
      {"tool computed", f + "$TOOL=TOOL_DATA[1]:OFFSET\nPTP XP1\n", p1, Why::kToolNotKnown, "p.src",
       5},
      {"tool by a variable", f + "BAS(#TOOL,N)\nPTP XP1\n", p1, Why::kToolNotKnown, "p.src", 5},
      {"tool changed in part", f + "$TOOL.Z=10\nPTP XP1\n", p1, Why::kToolNotKnown, "p.src", 5},
      {"after a call", f + "CHANGE_TOOL()\nPTP XP1\n", p1, Why::kToolNotKnown, "p.src", 5},
      {"in a branch", f + "IF $IN[1] THEN\nBAS(#TOOL,2)\nENDIF\nPTP XP1\n", p1, Why::kToolNotKnown,
       "p.src", 7},
      {"in a loop", f + "LOOP\nPTP XP1\nBAS(#BASE,2)\nENDLOOP\n", p1, Why::kBaseNotKnown, "p.src",
       5},
      {"after a BAS command that sets frames", f + "BAS(#INITMOV,0)\nPTP XP1\n", p1,
       Why::kToolNotKnown, "p.src", 5},
      {"after BAS(#ACT_TOOL)", f + "BAS(#ACT_TOOL,1)\nPTP XP1\n", p1, Why::kToolNotKnown, "p.src",
       5},
      {"a call over a loop's back edge", f + "LOOP\nPTP XP1\nCHANGE_TOOL()\nENDLOOP\n", p1,
       Why::kToolNotKnown, "p.src", 5},
      {"BAS over a loop's back edge", f + "LOOP\nPTP XP1\nBAS(#EX_BASE,1)\nENDLOOP\n", p1,
       Why::kToolNotKnown, "p.src", 5},
      {"a call as a loop's condition", f + "REPEAT\nPTP XP1\nUNTIL DONE()\n", p1,
       Why::kToolNotKnown, "p.src", 5},
      {"a call in a branch's condition", f + "IF READY() THEN\nPTP XP1\nENDIF\n", p1,
       Why::kToolNotKnown, "p.src", 5},
      {"a base set by a trigger",
       f + "TRIGGER WHEN DISTANCE=0 DELAY=0 DO $BASE=BASE_DATA[2]\nPTP XP1\n", p1,
       Why::kToolNotKnown, "p.src", 5},
      {"a tool set by a trigger", f + "TRIGGER WHEN DISTANCE=0 DELAY=0 DO BAS(#TOOL,2)\nPTP XP1\n",
       p1, Why::kToolNotKnown, "p.src", 5},
      {"a tool handed over", f + "WAIT FOR (F($TOOL))\nPTP XP1\n", p1, Why::kToolNotKnown, "p.src",
       5},
      {"a call whose result is a frame", f + "$BASE=FIND()\nBAS(#BASE,0)\nPTP XP1\n", p1,
       Why::kToolNotKnown, "p.src", 6},
      {"S alone", f + "PTP XP1\n",
       declared(pose_text({-0.2, -1.4, 1.5, 0.3, 0.8, 0.1}, false).insert(1, "S 2,")),
       Why::kPartial, "p.dat", 1},
      {"S is a name", f + "PTP XP1\n",
       declared(pose_text({-0.2, -1.4, 1.5, 0.3, 0.8, 0.1}, false).insert(1, "S SX,T TX,")),
       Why::kNotANumber, "p.dat", 1},
      {"S is text", f + "PTP XP1\n",
       declared(pose_text({-0.2, -1.4, 1.5, 0.3, 0.8, 0.1}, false).insert(1, "S 'B12',T 'B1',")),
       Why::kNotANumber, "p.dat", 1},
      {"S is no whole number", f + "PTP XP1\n",
       declared(pose_text({-0.2, -1.4, 1.5, 0.3, 0.8, 0.1}, false).insert(1, "S 2.5,T 3,")),
       Why::kNotANumber, "p.dat", 1},
      {"external axis by name", f + "PTP XP1\n", declared(with(",E1 EXPOS")), Why::kNotANumber,
       "p.dat", 1},
      {"external axis in hexadecimal", f + "PTP XP1\n", declared(with(",E1 'H10'")),
       Why::kExternalAxes, "p.dat", 1},
      {"external axis as an aggregate", f + "PTP XP1\n", declared(with(",E1 {V 5}")),
       Why::kNotANumber, "p.dat", 1},
      {"its tool's data assigned below", f + "PTP XP1\nTOOL_DATA[1]={X 1,Y 0,Z 0,A 0,B 0,C 0}\n",
       p1, Why::kFrameChanged, "p.src", 4},
      {"its base's data changed in part", "BAS(#TOOL,1)\nBAS(#BASE,2)\nPTP XP1\nBASE_DATA[2].X=7\n",
       p1, Why::kFrameChanged, "p.src", 4},
      {"its base's data from a function",
       "BAS(#TOOL,1)\nBASE_DATA[2]=FIND(1)\nBAS(#TOOL,1)\nBAS(#BASE,2)\nPTP XP1\n", p1,
       Why::kFrameChanged, "p.src", 6},
      {"a tool's data by a computed index", f + "TOOL_DATA[N]=X\nPTP XP1\n", p1, Why::kFrameChanged,
       "p.src", 5},
      {"its tool's data handed over", f + "PTP XP1\nMEASURE(TOOL_DATA[1])\n", p1,
       Why::kFrameChanged, "p.src", 4},
      {"its load's data assigned", f + "PTP XP1\nLOAD_DATA[1].M=7\n", p1, Why::kFrameChanged,
       "p.src", 4},
      {"$ROBROOT assigned", f + "$ROBROOT.Z=100\nPTP XP1\n", p1, Why::kFrameChanged, "p.src", 5},
      {"a TOOL_DATA of its own", f + "PTP XP1\n", p1 + "DECL FRAME TOOL_DATA[16]\n",
       Why::kFrameChanged, "p.src", 4},
      {"GLOBAL", f + "PTP XP1\n", "DECL GLOBAL E6POS XP1=" + point() + "\n", Why::kGlobal, "p.dat",
       1},
      {"a base, too", f + "PTP XP1\n$BASE=XP1\n", p1, Why::kComputed, "p.src", 5},
      {"a spline's base, too", f + "PTP XP1\nSPLINE WITH $BASE=XP1\nENDSPLINE\n", p1,
       Why::kComputed, "p.src", 5},
      {"in a BAS command, too", f + "PTP XP1\nBAS(#EX_BASE,XP1)\n", p1, Why::kComputed, "p.src", 5},
      {"given in a branch", f + "IF A THEN\nXP1=" + point() + "\nENDIF\nPTP XP1\n",
       "DECL E6POS XP1\n", Why::kComputed, "p.src", 7},
      {"given behind its first motion", f + "LOOP\nPTP XP1\nXP1=" + point() + "\nENDLOOP\n",
       "DECL E6POS XP1\n", Why::kComputed, "p.src", 5},
      {"another tool number", "BAS(#TOOL,7)\nBAS(#BASE,0)\nPTP XP1\n", p1, Why::kNoSuchTool,
       "p.src", 4},
      {"another base number", "BAS(#TOOL,1)\nBAS(#BASE,9)\nPTP XP1\n", p1, Why::kNoSuchBase,
       "p.src", 4},
      {"no FDAT", "FDAT_ACT=FP1\nBAS(#PTP_PARAMS,100)\nPTP XP1\n", p1, Why::kNoSuchFrameData,
       "p.src", 2},
      {"changed FDAT", "FP1.TOOL_NO=1\nFDAT_ACT=FP1\nBAS(#PTP_PARAMS,100)\nPTP XP1\n",
       p1 + "DECL FDAT FP1={TOOL_NO 1,BASE_NO 0,IPO_FRAME #BASE}\n", Why::kNoSuchFrameData, "p.src",
       2},
      {"two bases", f + "PTP XP1\nBAS(#BASE,2)\nPTP XP1\n", p1, Why::kTwoFrames, "p.src", 6},
      {"external tool", "FDAT_ACT=FP1\nBAS(#PTP_PARAMS,100)\nPTP XP1\n",
       p1 + "DECL FDAT FP1={TOOL_NO 1,BASE_NO 0,IPO_FRAME #TCP}\n", Why::kExternalTool, "p.src", 4},
      {"external axis", f + "PTP XP1\n", declared(with(",E1 12.5")), Why::kExternalAxes, "p.dat",
       1},
      {"external axes move", f + "ASYPTP {E1 10}\n", p1, Why::kExternalAxes, "p.src", 4},
      {"no status", f + "PTP XP1\n", declared(pose_text({-0.2, -1.4, 1.5, 0.3, 0.8, 0.1}, false)),
       Why::kNoConfiguration, "p.src", 4},
      {"a turn that the limits forbid", f + "PTP XP1\n",
       declared("{X 900.0,Y 100.0,Z 500.0,A 10.0,B 40.0,C 0.0,S 2,T 0}"), Why::kWrongTurn, "p.dat",
       1},
      {"too far", f + "PTP XP1\n",
       declared("{X 9000.0,Y 100.0,Z 500.0,A 10.0,B 40.0,C 0.0,S 2,T 35}"), Why::kWrongTurn,
       "p.dat", 1},
      {"no number", f + "PTP XP1\n",
       declared("{X 1e999,Y 100.0,Z 500.0,A 10.0,B 40.0,C 0.0,S 2,T 35}"), Why::kNotANumber,
       "p.dat", 1},
      {"by a singularity", f + "PTP XA\n",
       "DECL E6AXIS XA={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.001,A6 0.0}\n", Why::kNotReached,
       "p.dat", 1},
      {"beyond a limit", f + "PTP XA\n",
       "DECL E6AXIS XA={A1 170.0,A2 -90.0,A3 90.0,A4 0.0,A5 30.0,A6 0.0}\n", Why::kNotReached,
       "p.dat", 1},
  };
  for (const Case& one : cases) {
    SCOPED_TRACE(one.name);
    const auto result = correct(one.body, one.dat);
    EXPECT_TRUE(result.files.empty());
    const bool found =
        std::any_of(result.refusals.begin(), result.refusals.end(), [&](const krl::Refusal& r) {
          return r.why == one.why && r.file == one.file && r.line == one.line;
        });
    EXPECT_TRUE(found) << all_words(result);
    for (const krl::Refusal& r : result.refusals) {
      EXPECT_NE(std::string(name_of(r.why)), "");
      EXPECT_NE(words(r, cell().robot).find(": "), std::string::npos);
    }
  }
}

TEST(ARefusal, HasTheNameOfItsEnumeratorInFiles) {
  std::string all;
  for (const Why why : all_values<Why>()) all += std::string(all.empty() ? "" : " ") + name_of(why);
  EXPECT_EQ(
      all,
      "computed handed_over array geometric_operator relative_motion partial not_a_number unknown_point "
      "declared_twice global imported elsewhere shared tool_not_known base_not_known "
      "no_such_tool no_such_base load_not_known no_such_load frame_changed "
      "no_such_frame_data two_frames external_tool external_axes external_base "
      "uncoupled_base no_external_value other_unit other_kinematic outside_touched no_configuration "
      "posture_not_known other_posture wrong_turn not_reached outside_scope not_verified "
      "own_position not_restored no_closed_form");
}

TEST(AFrame, ThatIsUnknownIsSoSinceTheStatement) {
  const struct {
    const char *body, *since;
  } cases[] = {
      {"BAS(#BASE,0)\n$TOOL=$TOOL\nPTP XP1\n", "tool unknown since $TOOL in line 3."},
      {"BAS(#TOOL,1)\n$BASE=$WORLD:BASE_DATA[2]\nPTP XP1\n", "base unknown since $BASE in line 3."},
      {"BAS(#BASE,0)\nBAS(#TOOL,N)\nPTP XP1\n", "tool unknown since BAS(#TOOL) in line 3."},
      {"BAS(#TOOL,1)\nBAS(#BASE,N)\nPTP XP1\n", "base unknown since BAS(#BASE) in line 3."},
      {"FDAT_ACT.TOOL_NO=N\nBAS(#PTP_PARAMS,1)\nPTP XP1\n",
       "tool unknown since FDAT_ACT in line 2."},
      {"BAS(#TOOL,N)\nBAS(#BASE,N)\nPTP XP1\n", "tool unknown since BAS(#TOOL) in line 2."},
      {"BAS(#TOOL,1)\nBAS(#BASE,0)\nFIND()\nBAS(#TOOL,1)\n$BASE.X=5\nPTP XP1\n",
       "base unknown since $BASE in line 6."},
      {"BAS(#TOOL,N)\nBAS(#TOOL,1)\nPTP XP1\n", "base unknown since DEF in line 1. "},
      {"$BASE=$WORLD\n$TOOL=TOOL_DATA[1]\nBAS(#PTP_PARAMS,100)\nPTP XP1\n",
       "tool unknown since BAS(#PTP_PARAMS) in line 4. Set it after that line"},
      {"BAS(#INITMOV,0)\nBAS(#BASE,0)\nPTP XP1\n",
       "tool unknown since BAS(#INITMOV) in line 2. Set it after that line, before the motion, by BAS(#TOOL,n)"},
      {"BAS(#INITMOV,0)\nBAS(#TOOL,1)\nPTP XP1\n",
       "base unknown since BAS(#INITMOV) in line 2. Set it after that line, before the motion, by BAS(#BASE,n)"},
      {"BAS(#TOOL,1)\nBAS(#BASE,0)\nTAKE()\nPTP XP1\nEND\nDEF TAKE()\n\n\nBAS(#TOOL,N)\n",
       "tool unknown since TAKE in line 4."},
      {"BAS(#TOOL,N)\nBAS(#BASE,0)\nPLACE()\nPTP XP1\nEND\nDEF PLACE()\nBAS(#BASE,2)\n",
       "tool unknown since BAS(#TOOL) in line 2."},
  };
  for (const auto& one : cases) {
    const auto result = correct(one.body, declared(point()));
    EXPECT_NE(all_words(result).find(one.since), std::string::npos)
        << one.body << all_words(result);
  }
}

TEST(AnUnknownCallBeforeAPath, IsNamedWithWhatMakesThePostureKnown) {
  const std::string words = all_words(correct(
      kFrames + std::string("PTP XP1\nCLAMP(1)\n") + kFrames + "LIN XP1\n", declared(point())));
  EXPECT_NE(words.find("posture unknown since CLAMP in line 5, which LIN"), std::string::npos)
      << words;
  EXPECT_NE(words.find("name it with --does-not-move, or give its .src"), std::string::npos);
}

TEST(AComputedPoint, IsNoIncompleteOneAndNamedWhereAPathFollows) {
  const std::string computed = "LIN {X 200.0+17.5,Y 0.0,Z 900.0,A 0.0,B 90.0,C 0.0}\n",
                    words =
                        all_words(correct(kFrames + std::string("PTP XP1\n") + computed +
                                              "LIN {X 500.0,Y 0.0,Z 900.0,A 0.0,B 90.0,C 0.0}\n",
                                          declared(point())));
  EXPECT_NE(words.find("line 5: computed value"), std::string::npos) << words;
  EXPECT_NE(words.find("posture unknown since LIN in line 5"), std::string::npos) << words;
  for (const char* x : {"XP1.X+10", "OFF[1]", "LIFT(2)", "-(3)", "2*3"}) {
    const auto result = correct(kFrames + std::string("PTP {Y 0.0,X ") + x + ",Z 9,A 0,B 90,C 0}\n",
                                declared(point()), {.still = {"LIFT"}});
    EXPECT_NE(all_words(result).find("line 4: computed value"), std::string::npos)
        << x << all_words(result);
  }
  EXPECT_EQ(correct(kFrames + std::string("PTP {X -5,Y +1,X 2}\n"), "").refusals.at(0).why,
            Why::kPartial);
}

TEST(APointFromWhereTheArmIs, IsRefusedAsOneThatIsRightAsItIs) {
  const std::string dat = declared(point()) + "DECL E6POS XR\nDECL E6POS XQ[3]\nDECL FRAME F\n",
                    start = kFrames + std::string("PTP XP1\n");
  const auto why = [&](const std::string& body, const std::vector<std::string>& leave = {}) {
    std::string all;
    for (const krl::Refusal& one : correct(start + body, dat, {leave}).refusals)
      all += krl::name_of(one.why) + (":" + one.what) + " ";
    return all;
  };
  for (const char* body : {"XR=$POS_ACT\nXR.Z=XR.Z+50\nLIN XR\n",
                           "XR=FORWARD($AXIS_ACT,ERR)\nLIN XR\n", "XR.X=$POS_INT.X+5\nLIN XR\n",
                           "XR=F\nF=$POS_ACT:SHIFT\nLIN XR\n", "LIN XR\nXR=$AXIS_RET\n"})
    EXPECT_EQ(why(body), "own_position:XR ") << body;
  EXPECT_EQ(why("XQ[I]=$POS_ACT\nLIN XQ[I]\n"), "own_position:XQ ");
  EXPECT_EQ(why("LIN $POS_ACT:{X 0,Y 0,Z 50,A 0,B 0,C 0}\n"), "own_position:$POS_ACT ");
  EXPECT_EQ(why("LIN $POS_ACT:{X 0,Y 0,Z 50,A 0,B 0,C 0}\n", {"$POS_ACT"}), "");
  EXPECT_EQ(why("XR=$POS_ACT\nLIN XR\nLIN XR:{Z 5}\n", {"XR"}), "");
  EXPECT_EQ(why("XQ[I]=$POS_ACT\nLIN XQ[I]\n", {"XQ"}), "");
  EXPECT_EQ(why("LIN FORWARD($AXIS_ACT,ERR)\n", {"FORWARD"}), "");
  EXPECT_EQ(why("XR=XP1:SHIFT\nIF $POS_ACT.Z==5 THEN\nLIN XR\nENDIF\n"),
            "computed:XP1 computed:XR ");
  EXPECT_NE(
      all_words(correct(start + "XR=$POS_ACT\nLIN XR\n", dat)).find("which is corrected already"),
      std::string::npos);
}

TEST(TheHomeOfTheMachineData, IsLeftAsItIs) {
  const auto body = [](const std::string& more) {
    return kFrames + more + "PTP $H_POS\nPTP XP1\n";
  };
  const auto result = correct(body(""), declared(point()));
  EXPECT_EQ(all_words(result), "");
  ASSERT_EQ(result.left.size(), 1U);
  EXPECT_EQ(result.left[0].name, "$H_POS");
  EXPECT_EQ(all_words(correct(body("$H_POS=XP2\n"), declared(point()))), "");
  EXPECT_EQ(correct(body("$H_POS=XP1\n"), declared(point())).refusals.at(0).why, Why::kComputed);
  krl::BackupFiles files;
  files.modules = {{{"p.src", "DEF P()\nBAS(#TOOL,1)\nPTP $H_POS\nEND\n"}, {}, {}, {}}};
  files.controller = {
      {"$machine.dat", "E6AXIS $H_POS={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 10.0,A6 0.0}\n"}};
  const auto together = correct_backup(calibration(), files);
  EXPECT_TRUE(together.files.empty());
  EXPECT_TRUE(together.modules[0].refusals.empty());
}

TEST(APoint, ThatIsToStayIsLeftAsItIs) {
  const std::string dat =
      "DECL E6AXIS XA={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.0,A6 0.0}\nDECL E6POS UNUSED=" +
      point() + "\n";
  const auto result = correct(std::string(kFrames) + "PTP XA\n", dat, {{"XA"}});
  ASSERT_TRUE(result.refusals.empty()) << all_words(result);
  EXPECT_EQ(result.files[1].text, dat);
  ASSERT_EQ(result.left.size(), 2U);
  EXPECT_EQ(result.left[0].name, "UNUSED");
  EXPECT_EQ(result.left[0].why, "no motion goes to it");
  EXPECT_EQ(result.left[1].why, "--leave");
}

TEST(APoint, WrittenOutIsLeftByTheNameOfItsRefusal) {
  const std::string start = "PTP {A1 5.0,A2 -90.0,A3 90.0,A4 0.0,A5 20.0,A6 0.0}\n",
                    body = start + kFrames + "LIN XP1\n";
  const auto refused = correct(body, declared(point()));
  EXPECT_EQ(refused.refusals.at(0).what, "line 2");
  const auto result = correct(body, declared(point()), {{"LINE 2"}});
  ASSERT_TRUE(result.refusals.empty()) << all_words(result);
  EXPECT_EQ(result.points.size(), 1U) << "its angles are the posture before the LIN";
  EXPECT_NE(result.files.at(0).text.find(start), std::string::npos);
  ASSERT_EQ(result.left.size(), 1U);
  EXPECT_EQ(result.left[0].name, "line 2");
  const std::string p = point();
  const auto arc = correct(kFrames + ("PTP " + p + "\nCIRC " + p + "," + p + "\n"), "",
                           {{"LINE 5", "LINE 5 (SECOND POINT)"}});
  EXPECT_EQ(all_words(arc), "");
  EXPECT_EQ(arc.left.size(), 2U);
  EXPECT_EQ(arc.points.size(), 1U);
  for (const char* other :
       {"LIN {Z 50}", "LIN {}", "LIN {X 1,Y 0,Z 50,A 0,B 0,C 0}:XP1", "LIN (XP1)"})
    EXPECT_EQ(
        all_words(correct(kFrames + ("PTP " + p + "\n") + other + "\n", declared(p), {{"LINE 5"}})),
        "")
        << other;
  EXPECT_THROW(correct(body, declared(point()), {{"LINE 3"}}), calib::FileError);
}

TEST(APoint, ThatIsToStayHasToBeThere) {
  const std::string body = std::string(kFrames) + "PTP XP1\n";
  for (const auto& [name, words] :
       std::map<std::string, std::string>{{"P1", "P1 is XP1"}, {"P7", "no point is named P7. "}}) {
    try {
      correct(body, declared(point()), {{name}});
      ADD_FAILURE() << name;
    } catch (const calib::FileError& error) {
      EXPECT_NE(std::string(error.what()).find(words), std::string::npos) << error.what();
    }
  }
}

TEST(AGlobalPoint, IsLeftWhereItIsNamed) {
  const std::string dat = "DECL GLOBAL E6POS XP1=" + point() + "\n";
  const auto result = correct(std::string(kFrames) + "PTP XP1\n", dat, {{"XP1"}});
  ASSERT_TRUE(result.refusals.empty()) << all_words(result);
  EXPECT_EQ(result.files[1].text, dat);
}

TEST(APointOfAProgram, ThatAnotherImportsOrThatItImportsIsRefused) {
  krl::ProgramFiles f = {
      {"p.src", "DEF p()\n" + std::string(kFrames) + "PTP XP1\nEND\n"},
      krl::KrlFile{"p.dat", declared(point())},
      {{"$config.dat", "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"}}};
  f.modules = {{"user.src", "DEF USER()\nIMPORT E6POS XA IS /R1/P..XP1\nEND\n"}};
  const auto shared = correct_program(calibration(), f);
  ASSERT_EQ(shared.refusals.size(), 1U) << all_words(shared);
  EXPECT_EQ(shared.refusals[0].why, Why::kGlobal);
  f.modules[0].text = "DEF USER()\nIMPORT E6POS XA IS /R1/P2..XP1\nEND\n";
  EXPECT_EQ(all_words(correct_program(calibration(), f)), "");
  const auto own =
      correct("IMPORT E6POS XP1 IS /R1/POINTS..XP1\n" + std::string(kFrames) + "PTP XP1\n", "");
  ASSERT_EQ(own.refusals.size(), 1U) << all_words(own);
  EXPECT_EQ(own.refusals[0].why, Why::kElsewhere);
}

TEST(AToolsData, ThatTheProgramOnlyReadsOrThatAreOfAnotherAreNoReason) {
  const auto result = correct(
      std::string(kFrames) + "TOOL_DATA[9].X=3\n$TOOL=TOOL_DATA[1]\nPTP XP1\n", declared(point()));
  EXPECT_TRUE(result.refusals.empty()) << all_words(result);
}

TEST(AxisAngles, AreRefusedFarFromTheTargetsToo) {
  calib::Calibration c = calibration();
  c.verdict.workspace = false;
  const std::string dat = "DECL E6AXIS XA={A1 90.0,A2 -60.0,A3 60.0,A4 10.0,A5 45.0,A6 0.0}\n",
                    body = std::string(kFrames) + "PTP XA\n";
  const auto result = correct(body, dat, {}, c);
  ASSERT_EQ(result.refusals.size(), 1U) << all_words(result);
  EXPECT_EQ(result.refusals[0].why, Why::kOutsideScope);
  EXPECT_TRUE(correct(body, dat, {{}, true}, c).refusals.empty());
}

TEST(Robroot, IsTakenHoweverItIsDeclaredAndNeverGuessed) {
  krl::ProgramFiles f = files(taught(cell().robot, frames(), postures(1)));
  for (const char* before : {"", "FRAME ", "DECL FRAME ", "DECL GLOBAL FRAME "}) {
    f.controller.resize(1);
    f.controller.push_back(
        {"$machine.dat", before + std::string("$ROBROOT={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n")});
    EXPECT_TRUE(correct_program(calibration(), f).robroot_stated) << before;
    f.controller[1].text = before + std::string("$ROBROOT={X 0.0,Y Y0,Z 0.0,A 0.0,B 0.0,C 0.0}\n");
    try {
      correct_program(calibration(), f);
      ADD_FAILURE() << before;
    } catch (const calib::FileError& error) {
      EXPECT_EQ(std::string(error.what()).find("$machine.dat:1: $ROBROOT"), 0U) << error.what();
    }
  }
}

TEST(ACalibrationThatHoldsNearItsTargets, RefusesPointsElsewhereUnlessAsked) {
  calib::Calibration c = calibration();
  c.verdict.workspace = false;
  const KrlProgram program = taught(cell().robot, frames(), postures(10));
  const auto result = correct_program(c, files(program));
  ASSERT_FALSE(result.refusals.empty());
  EXPECT_EQ(result.refusals[0].why, Why::kOutsideScope);
  EXPECT_TRUE(correct_program(c, files(program), {{}, true}).refusals.empty());
}

TEST(WhatIsNoKrl, IsRefusedByFileAndLine) {
  const auto refusal = [](const std::string& text) -> std::string {
    try {
      correct(text, "");
    } catch (const calib::FileError& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_NE(refusal(std::string("PTP \0 X", 7)).find("p.src: byte 12 is NUL"), std::string::npos);
  EXPECT_NE(refusal(std::string(20000, 'A') + "\n").find("p.src:2: longer"), std::string::npos);
  try {
    calib::krl::read_lines({"backup.zip", std::string("PK\3\4\x14\0\0\0", 8)});
    FAIL();
  } catch (const calib::FileError& error) {
    EXPECT_NE(std::string(error.what()).find("backup.zip: a ZIP archive, no KRL file"),
              std::string::npos)
        << error.what();
  }
  EXPECT_NE(refusal(std::string(17u << 20, '\n')).find("more than 16 MB"), std::string::npos);
}

TEST(ARefusedPoint, ThatMayStayIsNamedWithTheWayToKeepIt) {
  const std::string frames = kFrames;
  const auto system = correct(frames + "SPTP $NULLFRAME\n", "");
  EXPECT_NE(
      all_words(system).find(
          "$NULLFRAME: the controller's own variable, not a taught point. Teach one there, or "
          "keep it as it is with --leave"),
      std::string::npos)
      << all_words(system);
  const auto home = correct(frames + "PTP XA\n",
                            "DECL E6AXIS XA={A1 0.0,A2 -90.0,A3 90.0,A4 0.0,A5 0.001,A6 0.0}\n");
  EXPECT_NE(all_words(home).find(
                "or turn the tool. One that may stay as it is, as a home may, keep with --leave"),
            std::string::npos)
      << all_words(home);
}

TEST(APoint, DeclaredAndSetInTwoLinesOfItsFileHasThatValue) {
  const std::string body = std::string(kFrames) + "PTP XP1\n";
  const auto two = correct(body, "DECL E6POS XP1\nXP1=" + point() + "\n"),
             one = correct(body, declared(point()));
  ASSERT_EQ(two.points.size(), 1U) << all_words(two);
  EXPECT_EQ(two.points[0].shift_mm, one.points.at(0).shift_mm);
  EXPECT_EQ(two.points[0].line, 2);
}

TEST(APoint, OfAnArrayOfSeveralIndicesHasItsOwnValue) {
  const std::string frames = kFrames, one = point();
  const std::string grid = "DECL E6POS XG[2,2]\nXG[1,1]=" + one + "\nXG[1,2]={X 2,Y 0,Z 0}\n" +
                           "STRUC SEAM E6POS P,INT NR\nDECL SEAM XS[2,2,2]\nXS[2,1,2]={P " + one +
                           ",NR 1}\n";
  for (const char* name : {"XG[1,1]", "XG[ 1 , 1 ]", "XS[2,1,2].P"}) {
    const auto result = correct(frames + "PTP " + name + "\n", grid);
    ASSERT_EQ(result.points.size(), 1U) << name << all_words(result);
    EXPECT_EQ(result.points[0].shift_mm,
              correct(frames + "PTP XP1\n", declared(one)).points.at(0).shift_mm);
    EXPECT_EQ(result.points[0].name.find(' '), std::string::npos) << name;
  }
  const auto why = [&](const std::string& name) {
    return correct(frames + "PTP " + name + "\n", grid).refusals.at(0).why;
  };
  EXPECT_EQ(why("XG[1,2]"), Why::kPartial);
  EXPECT_EQ(why("XG[2,1]"), Why::kArray);
  EXPECT_EQ(why("XG[1,I]"), Why::kArray);
  EXPECT_EQ(why("XG[1,1"), Why::kArray);
  EXPECT_EQ(correct(frames + "PTP XG[1,1]\n", grid + "XG[1,1]=" + one + "\n").refusals.at(0).why,
            Why::kDeclaredTwice);
}

TEST(AFileWithoutAProgram, IsRefusedByName) {
  for (const char* text :
       {"", "\r\n", "MODULE m\nPROC main()\nMoveL p10,v100,fine,tool0;\nENDPROC\n"}) {
    try {
      krl::correct_program(calibration(), {{"p.src", text}, {}, {}});
      ADD_FAILURE() << text;
    } catch (const calib::FileError& error) {
      EXPECT_EQ(std::string(error.what()).find("p.src: no DEF"), 0U) << error.what();
    }
  }
}

TEST(AFileWithTheMarkOfUtf8, HasItsFirstStatement) {
  const std::string text = std::string("\xEF\xBB\xBF") + "DEF P()\nEND\n";
  EXPECT_NO_THROW(krl::correct_program(calibration(), {{"p.src", text}, {}, {}}));
}

TEST(AFileWithCarriageReturnsAsLineEnds, IsReadByItsLines) {
  for (const std::string end : {"\r", "\r\n", "\r\r\n"}) {
    std::string body;
    for (const char* line : {"BAS(#TOOL,1)", "BAS(#BASE,0)", "; PTP XP2", "PTP XP1"})
      body += line + end;
    const auto result = correct(body, "DEFDAT P" + end + "DECL E6POS XP1=" + point() + end);
    ASSERT_EQ(result.points.size(), 1U) << all_words(result);
    EXPECT_EQ(result.points[0].line, 2);
    const auto refused = correct(body + "LIN_REL {Z 1}" + end, "");
    EXPECT_EQ(refused.refusals.at(1).line, 6) << all_words(refused);
  }
  const std::string many(4'000'000, '\r');  // each ends an empty line, and is looked at once
  const auto after = correct(many + "LIN_REL {Z 1}\r", "");
  EXPECT_EQ(after.refusals.at(0).line, 4'000'002) << all_words(after);
}

}  // namespace
}  // namespace cellcal::daemon::testing
