// Posture at the start of a motion, through branches, loops, GOTO and calls.

#include <gtest/gtest.h>

#include "calib/model/units.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using krl::Why;

/// Elbow and wrist as at `near`; and with the wrist flipped.
const calib::JointVector kFlowNear = {0.2, -1.4, 1.5, 0.3, 0.8, 0.1};
const calib::JointVector kFlowOver = {0.2, -1.4, 1.5, 0.3, -0.8, 0.1};
constexpr const char* kFlowFrames = "BAS(#TOOL,1)\nBAS(#BASE,0)\n";
constexpr const char* kFlowConfig = "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n";

std::string flow_statements(const std::string& body) {
  std::string text;
  for (const std::string& part :
       {std::string("DEF P()\n") + kFlowFrames, body, std::string("END\n")})
    text += part;
  return text;
}

krl::CorrectedProgram flow_corrected(const std::string& body, const std::string& behind = {}) {
  const std::string dat = "DEFDAT P\nDECL E6POS XN=" + pose_text(kFlowNear) +
                          "\nDECL E6POS XO=" + pose_text(kFlowOver) +
                          "\nDECL E6POS XL=" + pose_text({0.25, -1.3, 1.4, 0.3, 0.7, 0.1}) +
                          "\nDECL FRAME XF=" + pose_text({0.1, -1.3, 1.4, 0.3, 0.7, 0.1}, false) +
                          "\nENDDAT\n";
  return krl::correct_program(calibration(), {{"p.src", flow_statements(body) + behind},
                                              krl::KrlFile{"p.dat", dat},
                                              {{"$config.dat", kFlowConfig}}});
}

TEST(ALinearMotion, IsCorrectedWhereAllWaysToItEndInItsPosture) {
  for (const char* body : {
           "PTP XN\nIF $IN[1] THEN\n$OUT[1]=TRUE\nENDIF\nLIN XL\n",
           "PTP XN\nIF A THEN\nPTP XL\nELSE\n$OUT[1]=TRUE\nENDIF\nLIN XL\n",
           "IF A THEN\nPTP XN\nELSE\nPTP XL\nENDIF\nLIN XL\n",
           "PTP XN\nSWITCH I\nCASE 1\nPTP XL\nCASE 2,3\nGOTO DONE\nDEFAULT\nPTP XN\nENDSWITCH\n"
           "DONE:\nLIN XL\n",
           "PTP XN\nFOR I=1 TO 3\nLIN XL\nLIN XN\nENDFOR\nLIN XL\n",
           "PTP XN\nLOOP\nLIN XL\nIF B THEN\nEXIT\nENDIF\nENDLOOP\nLIN XN\n",
           "REPEAT\nPTP XN\nUNTIL B\nLIN XL\n",
           "PTP XN\nWHILE B\nPTP XO\nPTP XN\nENDWHILE\nLIN XL\n",
           "PTP XN\nAGAIN:\nLIN XL\nIF B THEN\nGOTO AGAIN\nENDIF\n",
           "PTP XN\nPTP $POS_ACT\nLIN XL\n",
           "PTP XN\nLOOP\nLIN XF\nENDLOOP\n",
           "IF A THEN\nPTP XO\nRETURN\nENDIF\nPTP XN\nLIN XL\n",
       }) {
    const auto result = flow_corrected(body);
    EXPECT_EQ(all_words(result), "") << body;
    EXPECT_FALSE(result.points.empty()) << body;
  }
}

TEST(ALinearMotion, IsRefusedWhereAWayToItEndsElsewhere) {
  const struct {
    const char* body;
    Why why;
  } cases[] = {
      {"PTP XN\nIF A THEN\nPTP XO\nENDIF\nLIN XL\n", Why::kOtherPosture},
      {"PTP XN\nSWITCH I\nCASE 1\nPTP XO\nENDSWITCH\nLIN XL\n", Why::kOtherPosture},
      {"PTP XN\nFOR I=1 TO 3\nLIN XL\nPTP XO\nENDFOR\n", Why::kOtherPosture},
      {"PTP XN\nWHILE B\nPTP XO\nENDWHILE\nLIN XL\n", Why::kOtherPosture},
      {"PTP XL\nLOOP\nPTP XO\nIF B THEN\nEXIT\nENDIF\nPTP XN\nENDLOOP\nLIN XL\n",
       Why::kOtherPosture},
      {"PTP XN\nAGAIN:\nLIN XL\nPTP XO\nGOTO AGAIN\n", Why::kOtherPosture},
      {"PTP XN\nIF A THEN\nUNKNOWN()\nBAS(#TOOL,1)\nBAS(#BASE,0)\nENDIF\n"
       "BAS(#TOOL,1)\nBAS(#BASE,0)\nLIN XL\n",
       Why::kPostureNotKnown},
      {"IF A THEN\nPTP XN\nENDIF\nLIN XL\n", Why::kPostureNotKnown},
      {"PTP XN\nIF A THEN\nPTP XO\nENDIF\nPTP XF\n", Why::kNoConfiguration},
      {"PTP XN\nENDIF\nBAS(#TOOL,1)\nBAS(#BASE,0)\nLIN XL\n", Why::kPostureNotKnown},
  };
  for (const auto& one : cases) {
    const auto result = flow_corrected(one.body);
    ASSERT_FALSE(result.refusals.empty()) << one.body;
    EXPECT_EQ(result.refusals[0].why, one.why) << one.body << all_words(result);
    EXPECT_TRUE(result.files.empty());
  }
}

TEST(ACall, EndsWhereItsBodyDoes) {
  const auto corrected_sub = [](const std::string& body, const std::string& called) {
    return flow_corrected(body, "DEF SUB()\n" + called + "\nEND\n");
  };
  const std::string again = kFlowFrames;
  const std::string sub = std::string(kFlowFrames) + "PTP XN\n";
  EXPECT_EQ(all_words(corrected_sub("SUB()\n" + again + "LIN XL\n", sub)), "");
  EXPECT_EQ(all_words(corrected_sub("PTP XN\nSUB()\n" + again + "LIN XL\n",
                                    "IF A THEN\n" + sub + "ENDIF")),
            "");
  for (const std::string& called : {"IF A THEN\n" + std::string(kFlowFrames) + "PTP XO\nENDIF",
                                    sub + "SUB()\n" + again + "PTP XO"}) {
    const auto bad = corrected_sub("PTP XL\nSUB()\n" + again + "LIN XL\n", called);
    ASSERT_FALSE(bad.refusals.empty()) << called;
    EXPECT_EQ(bad.refusals[0].why, Why::kOtherPosture) << all_words(bad);
  }
  const auto alone = corrected_sub("PTP XN\n", std::string(kFlowFrames) + "LIN XL");
  ASSERT_FALSE(alone.refusals.empty());
  EXPECT_EQ(alone.refusals[0].why, Why::kPostureNotKnown);
}

TEST(ARoutineOfTheFileAlone, BeginsWhereItsCallsAre) {
  const std::string frames = kFlowFrames, sub = "DEF SUB()\n" + frames + "LIN XL\nEND\n";
  EXPECT_EQ(all_words(flow_corrected("PTP XN\nSUB()\n", sub)), "");
  EXPECT_EQ(all_words(flow_corrected(
                "PTP XN\nIF A THEN\nSUB()\nENDIF\n" + frames + "LIN XL\nSUB()\n", sub)),
            "");
  EXPECT_EQ(all_words(flow_corrected("PTP XN\nTHROUGH()\n", "DEF THROUGH()\nSUB()\nEND\n" + sub)),
            "");
  const struct {
    std::string body, behind;
    Why why;
  } cases[] = {
      {"PTP XN\nSUB()\n" + frames + "PTP XO\nSUB()\n", sub, Why::kOtherPosture},
      {"SUB()\n", sub, Why::kPostureNotKnown},
      {"PTP XN\nSUB()\n", "GLOBAL " + sub, Why::kPostureNotKnown},
      {"PTP XN\nSUB()\nINTERRUPT DECL 3 WHEN $IN[1] DO SUB()\n", sub, Why::kToolNotKnown},
      {"PTP XN\nSUB()\nTRIGGER WHEN DISTANCE=0 DELAY=0 DO SUB() PRIO=-1\n", sub,
       Why::kToolNotKnown},
      {"PTP XN\nSUB()\nIF SUB() THEN\nENDIF\n", sub, Why::kPostureNotKnown},
      {"PTP XN\nSUB()\n", "DEF THROUGH()\nSUB()\nEND\n" + sub, Why::kPostureNotKnown},
      {"PTP XN\nP()\n", "DEF OTHER()\n" + frames + "PTP XN\nEND\n" + sub, Why::kPostureNotKnown},
  };
  for (const auto& one : cases) {
    const auto result = flow_corrected(one.body, one.behind);
    ASSERT_FALSE(result.refusals.empty()) << one.body;
    EXPECT_EQ(result.refusals[0].why, one.why) << one.body << all_words(result);
  }
}

TEST(WaysWithoutEnd, AreRefusedOrCorrectedInLittleTime) {
  std::string deep = "PTP XN\n", calls, bodies;
  for (int i = 0; i < 6000; ++i) deep += "IF A THEN\nGOTO L" + std::to_string(i) + "\nENDIF\n";
  for (int i = 0; i < 6000; ++i) deep += "L" + std::to_string(i) + ":\n";
  EXPECT_FALSE(flow_corrected(deep + "LIN XL\n").refusals.empty());
  for (int i = 0; i < 40; ++i)
    bodies += "DEF S" + std::to_string(i) + "()\nIF A THEN\nPTP XN\nENDIF\nS" +
              std::to_string(i + 1) + "()\nS" + std::to_string(i + 1) + "()\nEND\n";
  EXPECT_FALSE(
      flow_corrected("S0()\n" + std::string(kFlowFrames) + "LIN XL\n", bodies).refusals.empty());
  for (const char* body :
       {"ENDIF\nENDLOOP\nELSE\nEXIT\nGOTO\n:\nPTP XN\n", "IF\nIF\nLOOP\nPTP XN\n",
        "GOTO A\nA:\nA:\nGOTO A\nPTP XN\n", "RETURN\nRETURN\nDEF\nDEF\nPTP XN\n"})
    EXPECT_NO_THROW(flow_corrected(body)) << body;
}

}  // namespace
}  // namespace cellcal::daemon::testing
