// Tool, base and load at a motion: known where all paths to it agree.

#include <gtest/gtest.h>

#include <chrono>
#include <map>

#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using krl::Why;

constexpr const char* kPathsConfig =
    "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
    "TOOL_DATA[2]={X 0.0,Y 0.0,Z 250.0,A 0.0,B 0.0,C 0.0}\n"
    "BASE_DATA[1]={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n"
    "BASE_DATA[2]={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n"
    "LOAD_DATA[1]={M 1.5,CM {X 0.0,Y 0.0,Z 90.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}\n"
    "LOAD_DATA[2]={M 5.0,CM {X 60.0,Y 0.0,Z 150.0,A 0.0,B 0.0,C 0.0},J {X 0.0,Y 0.0,Z 0.0}}\n";

/// XP1 to XP4 in one posture.
krl::CorrectedProgram paths_corrected(const std::string& body, const std::string& behind = {},
                                      const std::string& dat = {}) {
  std::string points;
  for (int i = 1; i <= 4; ++i)
    points += "DECL E6POS XP" + std::to_string(i) + "=" +
              pose_text({0.1 * i, -1.4, 1.5, 0.3, 0.8, 0.1}) + "\n";
  return krl::correct_program(calibration(),
                              {{"p.src", "DEF P()\n" + body + "END\n" + behind},
                               krl::KrlFile{"p.dat", "DEFDAT P\n" + points + dat + "ENDDAT\n"},
                               {{"$config.dat", kPathsConfig}}},
                              {.anywhere = true});
}

/// "XP1:1.2 XP2:1.0" of each corrected point: its tool and base.
std::string frames_of(const krl::CorrectedProgram& result) {
  std::map<std::string, std::string> all;
  for (const krl::CorrectedPoint& one : result.points)
    all[one.name] = std::to_string(one.tool) + "." + std::to_string(one.base);
  std::string text;
  for (const auto& [name, frames] : all) text += name + ":" + frames + " ";
  return text + all_words(result);
}

TEST(AFrame, SetBeforeABranchOrLoopIsKnownInItThoughABaseIsSetThere) {
  const struct {
    const char *body, *frames;
  } cases[] = {
      {"BAS(#TOOL,1)\nLOOP\nBAS(#BASE,1)\nPTP XP1\nLIN XP2\nBAS(#BASE,2)\nPTP XP3\nENDLOOP\n",
       "XP1:1.1 XP2:1.1 XP3:1.2 "},
      {"BAS(#TOOL,1)\nIF A THEN\nBAS(#BASE,1)\nPTP XP1\nELSE\nBAS(#BASE,2)\nPTP XP2\nENDIF\n"
       "BAS(#BASE,0)\nPTP XP3\n",
       "XP1:1.1 XP2:1.2 XP3:1.0 "},
      {"$TOOL=TOOL_DATA[1]\n$BASE=BASE_DATA[2]\nPTP XP1\nWHILE N<5\n$BASE=BASE_DATA[1]\nLIN XP2\n"
       "$BASE=BASE_DATA[2]\nLIN XP3\nENDWHILE\nLIN XP4\n",
       "XP1:1.2 XP2:1.1 XP3:1.2 XP4:1.2 "},
      {"BAS(#TOOL,1)\nBAS(#BASE,1)\nPTP XP1\nIF A THEN\nBAS(#BASE,2)\nLIN XP2\n$BASE=BASE_DATA[1]\n"
       "ENDIF\nLIN XP3\n",
       "XP1:1.1 XP2:1.2 XP3:1.1 "},
      {"BAS(#TOOL,1)\nSTART:\nBAS(#BASE,1)\nPTP XP1\nLIN XP2\nGOTO START\n", "XP1:1.1 XP2:1.1 "},
      {"SWITCH N\nCASE 1\nBAS(#TOOL,1)\nCASE 2,3\nBAS(#TOOL,1)\nDEFAULT\nRETURN\nENDSWITCH\n"
       "REPEAT\nBAS(#BASE,2)\nPTP XP1\nUNTIL B\nPTP XP2\n",
       "XP1:1.2 XP2:1.2 "},
      {"FOR I=1 TO 3\nBAS(#TOOL,1)\nBAS(#BASE,I)\nBAS(#BASE,1)\nIF A THEN\nEXIT\nENDIF\n"
       "PTP XP1\nENDFOR\nBAS(#TOOL,1)\nBAS(#BASE,2)\nPTP XP2\n",
       "XP1:1.1 XP2:1.2 "},
      {"FDAT_ACT=F1\nIF A THEN\nBAS(#PTP_PARAMS,100)\nPTP XP1\nELSE\nBAS(#FRAMES)\nENDIF\nPTP XP2\n"
       "SPLINE WITH $BASE=BASE_DATA[1]\nSPL XP3\nENDSPLINE\nIF A THEN\nENDIF\nPTP XP4\n",
       "XP1:1.2 XP2:1.2 XP3:1.1 XP4:1.2 "},
  };
  const std::string fdat = "DECL FDAT F1={TOOL_NO 1,BASE_NO 2,IPO_FRAME #BASE}\n";
  for (const auto& one : cases)
    EXPECT_EQ(frames_of(paths_corrected(one.body, {}, fdat)), one.frames) << one.body;
}

TEST(AFrame, IsUnknownWherePathsDisagreeAndTheirLinesAreNamed) {
  const struct {
    const char *body, *words;
  } cases[] = {
      {"BAS(#BASE,0)\nBAS(#TOOL,1)\nIF A THEN\nBAS(#TOOL,2)\nENDIF\nPTP XP1\n",
       "tool unknown, as lines 3 and 5 set different ones. Set $TOOL"},
      {"BAS(#TOOL,1)\nBAS(#BASE,1)\nLOOP\nPTP XP1\n$BASE=BASE_DATA[2]\nENDLOOP\n",
       "base unknown, as lines 3 and 6 set different ones. Set $BASE"},
      {"BAS(#TOOL,1)\nBAS(#BASE,1)\nGOTO ON\nAGAIN:\nBAS(#BASE,2)\nON:\nPTP XP1\nGOTO AGAIN\n",
       "base unknown, as lines 3 and 6 set different ones"},
      {"BAS(#TOOL,1)\nBAS(#BASE,1)\nSWITCH N\nCASE 1\nBAS(#BASE,N)\nENDSWITCH\nPTP XP1\n",
       "base unknown since BAS(#BASE) in line 6"},
      {"BAS(#TOOL,1)\nBAS(#BASE,1)\nLOOP\nPTP XP1\nCLAMP()\nENDLOOP\n",
       "tool unknown since CLAMP in line 6"},
      {"BAS(#BASE,1)\nIF A THEN\nBAS(#TOOL,1)\nENDIF\nPTP XP1\n",
       "tool unknown since DEF in line 1"},
      {"BAS(#TOOL,1)\nBAS(#BASE,1)\nIF A THEN\n$LOAD=LOAD_DATA[1]\nELSE\n$LOAD=LOAD_DATA[2]\nENDIF\n"
       "PTP XP1\n",
       "load in force unknown, as lines 5 and 7 set different ones"},
      {"BAS(#TOOL,1)\nBAS(#BASE,1)\nIF A THEN\n$LOAD.M=5\nELSE\n$LOAD.M=6\nENDIF\n"
       "$LOAD.CM={X 0,Y 0,Z 90,A 0,B 0,C 0}\nPTP XP1\n",
       "load in force unknown since $LOAD in line 9"},
      {"BAS(#TOOL,1)\nBAS(#BASE,1)\nIF A THEN\n$IPO_MODE=#TCP\nENDIF\nPTP XP1\n", "external tool"},
  };
  for (const auto& one : cases) {
    const auto result = paths_corrected(one.body);
    EXPECT_NE(all_words(result).find(one.words), std::string::npos)
        << one.body << all_words(result);
    EXPECT_TRUE(result.files.empty());
  }
}

TEST(AFrame, IsThatOfTheCallsInARoutineOfTheFileAlone) {
  const std::string main = "BAS(#TOOL,1)\nBAS(#BASE,1)\n", pick = "DEF PICK()\nPTP XP1\nEND\n";
  const std::string dispatch =
      "LOOP\nSWITCH N\nCASE 1\nPICK()\nCASE 2\nPLACE()\nENDSWITCH\nENDLOOP\n";
  EXPECT_EQ(frames_of(paths_corrected(main + dispatch, pick + "DEF PLACE()\nPTP XP2\nEND\n")),
            "XP1:1.1 XP2:1.1 ");
  EXPECT_EQ(frames_of(paths_corrected(
                main + dispatch, pick + "DEF PLACE()\nBAS(#BASE,2)\nPTP XP2\nBAS(#BASE,1)\nEND\n")),
            "XP1:1.1 XP2:1.2 ");
  const struct {
    std::string body, behind, words;
  } cases[] = {
      {main + dispatch, pick + "DEF PLACE()\nBAS(#BASE,2)\nPTP XP2\nEND\n",
       "base unknown, as lines 3 and 9 set"},
      {main + "PICK()\n", "GLOBAL " + pick, "tool unknown since GLOBAL in line 6"},
      {main + "PICK()\nINTERRUPT DECL 3 WHEN $IN[1] DO PICK()\n", pick, "tool unknown since DEF"},
      {main + "PICK()\nIF PICK() THEN\nENDIF\n", pick, "tool unknown since DEF"},
      {"P()\n" + main, "DEF OTHER()\n" + main + "P()\nEND\n" + pick, "tool unknown since DEF"},
  };
  for (const auto& one : cases) {
    const auto result = paths_corrected(one.body, one.behind);
    EXPECT_NE(all_words(result).find(one.words), std::string::npos)
        << one.body << one.behind << all_words(result);
  }
}

TEST(ACalledBody, SetsWhatAllItsPathsSet) {
  const auto after = [](const std::string& body) {
    return frames_of(paths_corrected("BAS(#BASE,1)\nTOOLS(1)\nPTP XP1\n",
                                     "DEF TOOLS(N :IN)\nINT N\n" + body + "END\n"));
  };
  EXPECT_EQ(after("IF A THEN\nBAS(#TOOL,N)\nRETURN\nENDIF\nBAS(#TOOL,1)\n"), "XP1:1.1 ");
  EXPECT_EQ(after("WHILE A\nBAS(#BASE,2)\nBAS(#BASE,1)\nENDWHILE\nBAS(#TOOL,N)\n"), "XP1:1.1 ");
  EXPECT_NE(
      after("IF A THEN\nRETURN\nENDIF\nBAS(#TOOL,N)\n").find("tool unknown since DEF in line 1"),
      std::string::npos);
  for (const char* body :
       {"IF A THEN\nBAS(#TOOL,N)\nELSE\nBAS(#TOOL,2)\nENDIF\n", "BAS(#TOOL,N)\nLOOP\nENDLOOP\n"})
    EXPECT_NE(after(body).find("tool unknown since TOOLS in line 3"), std::string::npos)
        << after(body);
}

/// "line 9 " of each motion that no path leads to.
std::string never_reached(const krl::CorrectedProgram& result) {
  std::string all;
  for (const auto& one : result.left)
    if (one.why == "no path leads to it") all += one.name + " ";
  return all;
}

TEST(AMotion, ThatNoPathReachesStaysAndIsListed) {
  const std::string frames = "BAS(#TOOL,1)\nBAS(#BASE,1)\nPTP XP1\n";
  const struct {
    const char *body, *lines;
  } cases[] = {
      {"GOTO DONE\nLIN XP2\nCIRC XP3,{X 1}\nCLAMP()\nDONE:\nLIN XP4\n", "line 6 line 7 "},
      {"IF A THEN\nLIN XP4\nRETURN\nLIN XP2\nENDIF\n", "line 8 "},
      {"LOOP\nLIN XP4\nENDLOOP\nBAS(#TOOL,N)\nLIN XP2\n", "line 9 "},
      {"LOOP\nEXIT\nLIN_REL {Z 5}\nPTP {X 1}\nENDLOOP\nLIN XP4\n", "line 7 line 8 "},
      {"LIN XP4\nRETURN\nSUB()\nEND\nDEF SUB()\nLIN XP2\n", "line 10 "},
  };
  for (const auto& one : cases) {
    const auto result = paths_corrected(frames + one.body);
    EXPECT_EQ(frames_of(result), "XP1:1.1 XP4:1.1 ") << one.body;
    EXPECT_EQ(never_reached(result), one.lines) << one.body;
  }
  EXPECT_EQ(frames_of(paths_corrected(frames + "GOTO ON\nLIN XP2\nON:\nLIN XP2\n")),
            "XP1:1.1 XP2:1.1 ")
      << "another motion goes there";
}

TEST(AMotion, BehindACallThatDoesNotReturnIsReachedByAnInterruptsResume) {
  const auto result = paths_corrected("BAS(#TOOL,1)\nBAS(#BASE,1)\nPTP XP1\nSEARCH()\nPTP XP2\n",
                                      "DEF SEARCH()\nLOOP\nLIN XP3\nENDLOOP\nEND\n");
  EXPECT_EQ(frames_of(result), "XP1:1.1 XP2:1.1 XP3:1.1 ");
  EXPECT_EQ(never_reached(result), "");
}

TEST(PathsWithoutEnd, AreFollowedInLittleTime) {
  const auto start = std::chrono::steady_clock::now();
  std::string body = "BAS(#TOOL,1)\n", bodies;
  for (int i = 0; i < 4000; ++i)
    body += "IF A THEN\nBAS(#BASE,2)\nGOTO L" + std::to_string(i) + "\nENDIF\nBAS(#BASE,1)\nL" +
            std::to_string(i) + ":\nPTP XP1\nBAS(#BASE,1)\n";
  EXPECT_NE(frames_of(paths_corrected(body)).find("base unknown, as lines 4 and 7"),
            std::string::npos);
  for (int i = 0; i < 40; ++i)
    bodies += "DEF S" + std::to_string(i) + "()\nLOOP\nIF A THEN\nBAS(#BASE,2)\nEXIT\nENDIF\nS" +
              std::to_string(i + 1) + "()\nBAS(#BASE,1)\nS" + std::to_string(i + 1) +
              "()\nENDLOOP\nEND\n";
  EXPECT_FALSE(paths_corrected("S0()\nPTP XP1\n", bodies).refusals.empty());
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
}

TEST(AFrame, ThatAnInterruptOrTriggerSetsIsUnknownInTheWholeModule) {
  const std::string frames = "BAS(#TOOL,1)\nBAS(#BASE,1)\n",
                    sets = "DEF AT_ANY_TIME()\nBAS(#TOOL,2)\nEND\n";
  for (const std::string line :
       {"INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO AT_ANY_TIME()\nINTERRUPT ON 3\n",
        "GLOBAL INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO AT_ANY_TIME()\n",
        "TRIGGER WHEN DISTANCE=1 DELAY=0 DO AT_ANY_TIME() PRIO=-1\n"}) {
    EXPECT_NE(frames_of(paths_corrected(line + frames + "PTP XP1\n", sets))
                  .find("tool unknown: AT_ANY_TIME, which the interrupt or trigger of line"),
              std::string::npos)
        << line;
    EXPECT_EQ(
        frames_of(paths_corrected(line + frames + "PTP XP1\n", "DEF AT_ANY_TIME()\nN=2\nEND\n")),
        "XP1:1.1 ")
        << line;
  }
}

TEST(AFrame, OfACallThatResumeMayLeaveIsUnknownAfterIt) {
  const std::string body = "INTERRUPT DECL 3 WHEN $IN[1]==TRUE DO STOP_IT()\nSEARCH()\nLIN XP1\n";
  const std::string search =
      "DEF SEARCH()\nBAS(#TOOL,2)\nBAS(#BASE,1)\nPTP XP2\nBAS(#TOOL,1)\nEND\n";
  EXPECT_NE(frames_of(paths_corrected(body, search + "DEF STOP_IT()\nBRAKE\nRESUME\nEND\n"))
                .find("tool unknown"),
            std::string::npos);
}

TEST(AFrame, OfARoutineOfAnotherModuleIsNotThatOfANameThatItsDatMayHide) {
  krl::ProgramFiles files{
      {"p.src", "DEF P()\nBAS(#BASE,1)\nM2()\nPTP XP1\nEND\n"},
      krl::KrlFile{"p.dat", "DEFDAT P\nDECL E6POS XP1=" +
                                pose_text({0.1, -1.4, 1.5, 0.3, 0.8, 0.1}) + "\nENDDAT\n"},
      {{"$config.dat", std::string(kPathsConfig) +
                           "CONST INT TNO=1\nFRAME TF={X 1.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n"}}};
  for (const std::string sets : {"BAS(#TOOL,TNO)\n", "$TOOL=TF\n"}) {
    files.modules = {{"m2.src", "DEF M2()\nSETT()\nEND\nDEF SETT()\n" + sets + "END\n"}};
    EXPECT_NE(frames_of(krl::correct_program(calibration(), files, {.anywhere = true}))
                  .find("tool unknown"),
              std::string::npos)
        << sets;
  }
}

TEST(AFrame, OfAToolThatStandsInTheCellStaysSoAfterAnUnknownCall) {
  const auto result =
      paths_corrected("$IPO_MODE=#TCP\nFOO()\nBAS(#TOOL,1)\nBAS(#BASE,1)\nPTP XP1\n");
  ASSERT_FALSE(result.refusals.empty());
  EXPECT_EQ(result.refusals[0].why, Why::kExternalTool) << all_words(result);
}

}  // namespace
}  // namespace cellcal::daemon::testing
