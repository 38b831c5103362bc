// Tools and bases set by the parameters of a called routine.

#include <gtest/gtest.h>

#include "daemon/krl/krl_inline.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

const std::string kInlineConfig =
    "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
    "TOOL_DATA[2]={X 0.0,Y 0.0,Z 250.0,A 0.0,B 0.0,C 0.0}\n"
    "BASE_DATA[3]={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n"
    "DECL GLOBAL FDAT FDEFAULT={TOOL_NO 2,BASE_NO 3,IPO_FRAME #BASE}\n";

/// A program that moves after the call, with the routine in its module or in another.
krl::CorrectedProgram after_call(const std::string& call, const std::string& routine,
                                 bool other_module = false) {
  const std::string src =
      "DEF P()\n" + call + "\nPTP XN\nEND\n" + (other_module ? "" : "DEF " + routine + "\nEND\n");
  const std::string dat =
      "DEFDAT P\nDECL E6POS XN=" + pose_text({0.2, -1.4, 1.5, 0.3, 0.8, 0.1}) + "\nENDDAT\n";
  krl::ProgramFiles all{
      {"p.src", src}, krl::KrlFile{"p.dat", dat}, {{"$config.dat", kInlineConfig}}};
  if (other_module)
    all.modules.push_back(
        {routine.substr(0, routine.find('(')) + ".src", "DEF " + routine + "\nEND\n"});
  return krl::correct_program(calibration(), all, {.anywhere = true});
}

/// Typical settings; the rest of the line are the parameters' declarations.
constexpr const char* kSettings =
    "SETTINGS(NBASE :IN,NTOOL :IN,NVEL :IN)\nINT NBASE\nINT NTOOL\nREAL NVEL\nFDAT_ACT=FDEFAULT\n"
    "FDAT_ACT.BASE_NO=NBASE\nFDAT_ACT.TOOL_NO=NTOOL\nBAS(#FRAMES)\nIF NVEL<1.0 THEN\nPDAT_ACT.VEL=1\n"
    "ELSE\nPDAT_ACT.VEL=NVEL\nENDIF\nBAS(#CP_DAT)\nIF NBASE==0 THEN\n$BASE=$NULLFRAME\nENDIF\n"
    "IF (NTOOL==0) THEN\n$TOOL=$NULLFRAME\nENDIF\nBAS(#TOOL,NTOOL)";

TEST(ARoutinesParameters, DecideOnToolAndBase) {
  for (const bool other : {false, true})
    for (const auto& [call, routine] : std::vector<std::pair<std::string, std::string>>{
             {"SETTINGS(3,1,0.5)", kSettings},
             {"SETTINGS(0,1,200)", kSettings},
             {"TOOLS(1)", "TOOLS(N :IN)\n$TOOL=TOOL_DATA[N]\n$BASE=BASE_DATA[3]"},
             {"TOOLS(1)",
              "TOOLS(N :IN)\nIF N<>2 THEN\nBAS(#TOOL,1)\nELSE\nBAS(#TOOL,2)\nENDIF\n"
              "BAS(#BASE,0)\nRETURN"}}) {
      const auto result = after_call(call, routine, other);
      EXPECT_EQ(all_words(result), "") << call;
      ASSERT_EQ(result.points.size(), 1U) << call;
      EXPECT_EQ(result.points[0].tool, 1) << call;
    }
  EXPECT_EQ(after_call("SETTINGS(3,1,0.5)", kSettings).points.at(0).base, 3);
  EXPECT_EQ(after_call("SETTINGS(0,1,0.5)", kSettings).points.at(0).base, 0);
}

TEST(ARoutinesParameters, DecideThroughAnotherRoutine) {
  EXPECT_EQ(all_words(after_call("OUTER()",
                                 "OUTER()\nINNER(1)\nEND\nDEF INNER(N :IN)\nBAS(#TOOL,N)\n"
                                 "BAS(#BASE,0)")),
            "");
}

TEST(ARoutinesParameters, DecideNothingWhereItsLinesDoNot) {
  for (const auto& [call, routine] : std::vector<std::pair<std::string, std::string>>{
           {"TOOLS(K)", "TOOLS(N :IN)\nBAS(#TOOL,N)\nBAS(#BASE,0)"},
           {"TOOLS(K+1)", "TOOLS(N :IN)\nBAS(#TOOL,N)\nBAS(#BASE,0)"},
           {"TOOLS(1)", "TOOLS(N :IN)\nN=2\nBAS(#TOOL,N)\nBAS(#BASE,0)"},
           {"TOOLS(1)", "TOOLS(N :OUT)\nOTHER(N)\nBAS(#TOOL,N)\nBAS(#BASE,0)"},
           {"TOOLS(1)", "TOOLS(N :IN)\nIF $IN[1] THEN\nBAS(#TOOL,N)\nENDIF\nBAS(#BASE,0)"},
           {"TOOLS(1)", "TOOLS(N :IN)\nIF $IN[1] THEN\nRETURN\nENDIF\nBAS(#TOOL,N)\nBAS(#BASE,0)"},
           {"TOOLS(1)", "TOOLS(N :IN)\nGOTO OVER\nBAS(#TOOL,N)\nOVER:\nBAS(#BASE,0)"},
           {"TOOLS(1)", "TOOLS(N :IN)\nFOR N=1 TO 2\nBAS(#TOOL,N)\nENDFOR\nBAS(#BASE,0)"},
           {"TOOLS(1)", "TOOLS(N :IN)\nBAS(#TOOL,N)\nBAS(#BASE,0)\nUNKNOWN()"},
           {"TOOLS(1,2)", "TOOLS(N :IN)\nBAS(#TOOL,N)\nBAS(#BASE,0)"},
           {"TOOLS()", "TOOLS(N :IN)\nBAS(#TOOL,N)\nBAS(#BASE,0)"},
           {"IF $IN[1] THEN\nTOOLS(1)\nENDIF", "TOOLS(N :IN)\nBAS(#TOOL,N)\nBAS(#BASE,0)"},
           {"TOOLS(1)", "TOOLS(N :IN)\n$TOOL=XFRAME\n$BASE=$NULLFRAME"}}) {
    const auto result = after_call(call, routine);
    ASSERT_FALSE(result.refusals.empty()) << call << "\n" << routine;
    EXPECT_TRUE(result.refusals[0].why == krl::Why::kToolNotKnown ||
                result.refusals[0].why == krl::Why::kBaseNotKnown)
        << routine << all_words(result);
  }
}

TEST(ARoutineOfAnotherModule, HasFramesOfItsOwnNames) {
  const auto result =
      after_call("TOOLS(1)", "TOOLS(N :IN)\nFDAT_ACT=FMINE\nBAS(#FRAMES)\nBAS(#TOOL,N)", true);
  ASSERT_FALSE(result.refusals.empty());
  EXPECT_NE(all_words(result).find("TOOLS"), std::string::npos) << all_words(result);
}

}  // namespace
}  // namespace cellcal::daemon::testing
