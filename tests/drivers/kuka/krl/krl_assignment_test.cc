#include "tests/drivers/kuka/krl/krl_assignment.h"

#include <gtest/gtest.h>

namespace cellcal::drivers::krl {
namespace {

/// The body of a sub-program with the locals N, M, F (frame) and RET.
std::vector<std::string> complaints(const std::string& body) {
  return check_assignments("DEF A (GIVEN :IN )\nDECL EKI_STATUS RET\nDECL INT GIVEN\nINT N, M\n" +
                           ("DECL FRAME F\n" + body) + "\nEND\n");
}

TEST(KrlAssignment, RefusesALocalThatAFunctionFillsWithoutAValue) {
  const auto found = complaints("RET=EKI_GetInt(\"C\",\"Root/@N\",N)");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found.front(), "line 6: N has no value");
  EXPECT_TRUE(complaints("N=0\nRET=EKI_GetInt(\"C\",\"Root/@N\",N)").empty());
  EXPECT_EQ(complaints("F.X=0.0\nRET=EKI_GetReal(\"C\",\"Root/@Y\",F.Y)").size(), 1u);
  EXPECT_TRUE(complaints("F=$NULLFRAME\nRET=EKI_GetReal(\"C\",\"Root/@Y\",F.Y)").empty());
}

TEST(KrlAssignment, KnowsWhatHasAValueByItself) {
  EXPECT_TRUE(complaints("M=GIVEN+GLOBAL_ONE").empty()) << "parameters and globals";
  EXPECT_TRUE(complaints("RET=RSI_CREATE(\"N\",N,TRUE)\nM=N").empty());
  EXPECT_TRUE(complaints("CWRITE ($CMD,N,GIVEN,\"M\")\nM=N").empty());
  EXPECT_EQ(complaints("CWRITE ($CMD,N,M,\"X\")").size(), 1u);
  EXPECT_EQ(complaints("IF RET.Buff>0 THEN\nENDIF").size(), 1u);
}

TEST(KrlAssignment, FollowsEveryPath) {
  const std::pair<const char*, std::size_t> cases[] = {
      {"IF GIVEN==1 THEN\nN=1\nENDIF\nM=N", 1},
      {"IF GIVEN==1 THEN\nN=1\nELSE\nN=2\nENDIF\nM=N", 0},
      {"IF GIVEN==1 THEN\nRETURN\nELSE\nN=2\nENDIF\nM=N", 0},
      {"SWITCH GIVEN\nCASE 1\nN=1\nENDSWITCH\nM=N", 1},
      {"SWITCH GIVEN\nCASE 1\nN=1\nCASE 2\nM=N\nDEFAULT\nN=1\nENDSWITCH", 1},
      {"SWITCH GIVEN\nCASE 1\nN=1\nDEFAULT\nN=2\nENDSWITCH\nM=N", 0},
      {"WHILE GIVEN>0\nN=1\nENDWHILE\nM=N", 1},
      {"REPEAT\nN=1\nUNTIL N==1\nM=N", 0},
      {"REPEAT\nM=1\nUNTIL N==1", 1},
      {"FOR N=1 TO 6\nM=N\nENDFOR\nM=M", 1},
      {"LOOP\nN=1\nEXIT\nENDLOOP\nM=N", 0},
      {"LOOP\nIF GIVEN==1 THEN\nEXIT\nENDIF\nN=1\nENDLOOP\nM=N", 1},
      {"IF GIVEN==1 THEN\nLOOP\nHALT\nENDLOOP\nELSE\nN=1\nENDIF\nM=N", 0},
      {"N=1\nM=N[M]", 1},
      {"RETURN\nM=N", 0},
  };
  for (const auto& [body, count] : cases) EXPECT_EQ(complaints(body).size(), count) << body;
}

}  // namespace
}  // namespace cellcal::drivers::krl
