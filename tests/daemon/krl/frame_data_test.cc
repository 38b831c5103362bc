// Tools, bases and loads by the number that a FDAT has, or that a reading function is given.

#include <gtest/gtest.h>

#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

/// "1.3" of the last point, with its load where the program sets another than the tool's; or the refusals.
std::string read_as(const std::string& body, const std::string& dat = {}) {
  const std::string pose = pose_text({0.2, -1.4, 1.5, 0.3, 0.8, 0.1});
  const krl::ProgramFiles files = {
      {"p.src", "DEF P()\nBAS(#TOOL,2)\nBAS(#BASE,2)\n" + body + "END\n"},
      krl::KrlFile{"p.dat", "DEFDAT P\nDECL E6POS XN=" + pose + "\n" + dat +
                                "DECL FDAT FP={TOOL_NO 1,BASE_NO 3,IPO_FRAME #BASE}\nENDDAT\n"},
      {{"$config.dat",
        "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
        "TOOL_DATA[2]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
        "BASE_DATA[2]={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n"
        "BASE_DATA[3]={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n"
        "LOAD_DATA[4]={M 5.0,CM {X 0.0,Y 0.0,Z 100.0,A 0.0,B 0.0,C 0.0}}\n"}}};
  const auto result = krl::correct_program(calibration(), files, {.anywhere = true});
  if (!result.refusals.empty()) return all_words(result);
  const krl::CorrectedPoint& point = result.points.back();
  const int load = result.tools.back().load;
  return std::to_string(point.tool) + "." + std::to_string(point.base) +
         (load < 0 ? "" : " load " + std::to_string(load));
}

TEST(FrameData, AreReadByTheirNumbersInEveryForm) {
  for (const char* body :
       {"SPTP XN WITH $TOOL=STOOL2(FP),$BASE=SBASE(FP.BASE_NO) C_SPL\n",
        "SPTP XN WITH $TOOL=STOOL(FP.TOOL_NO),$BASE=SBASE(FP.BASE_NO),$LOAD=SLOAD(FP.TOOL_NO)\n",
        "SPTP XN WITH $VEL_AXIS[1]=SVEL_JOINT(1.0),$TOOL=STOOL2(FP),$BASE=EK(K_ROOT(FP.BASE_NO),"
        "K_TYPE(FP.BASE_NO),K_OFFS(FP.BASE_NO)),$IPO_MODE=SIPO_MODE(FP.IPO_FRAME),"
        "$LOAD=SLOAD(FP.TOOL_NO) C_SPL\n",
        "$TOOL=TOOL_DATA[FP.TOOL_NO]\n$BASE=BASE_DATA[FP.BASE_NO]\nPTP XN\n",
        "$LOAD=LOAD_DATA[FP.TOOL_NO]\n$TOOL=TOOL_DATA[FP.TOOL_NO]\n$BASE=BASE_DATA[FP.BASE_NO]\n"
        "PTP XN\n",
        "IF FP.TOOL_NO==1 THEN\nN=FP.BASE_NO\nENDIF\nFDAT_ACT=FP\nBAS(#PTP_PARAMS,100)\n"
        "PTP XN\n"})
    EXPECT_EQ(read_as(body), "1.3") << body;
}

TEST(FrameData, OfANumberOrAConstantAreThoseOfTheController) {
  const std::string names = "DECL CONST INT TORCH=1,TABLE=3,HEAVY=4\n";
  for (const char* with :
       {"$TOOL=STOOL(1),$BASE=SBASE(3)", "$TOOL=STOOL(TORCH),$BASE=SBASE(TABLE)",
        "$TOOL=STOOL2(FP),$BASE=EK(K_ROOT(3),K_TYPE(3),K_OFFS(3)),$LOAD=SLOAD(1)"})
    EXPECT_EQ(read_as(std::string("SPTP XN WITH ") + with + "\n", names), "1.3") << with;
  for (const char* load : {"SLOAD(4)", "SLOAD(HEAVY)"})
    EXPECT_EQ(
        read_as(std::string("SPTP XN WITH $TOOL=STOOL(1),$BASE=SBASE(3),$LOAD=") + load + "\n",
                names),
        "1.3 load 4");
}

TEST(FrameData, AreUnknownWhereTheyAreComputedOrChanged) {
  const auto refused = [](const std::string& body, const char* why) {
    const std::string words = read_as(body);
    EXPECT_NE(words.find(why), std::string::npos) << body << words;
  };
  refused("SPTP XN WITH $BASE=SBASE(N)\n", "active base unknown");
  refused("SPTP XN WITH $BASE=SBASE(FP.TOOL_NO)\n", "active base unknown");
  refused("SPTP XN WITH $BASE=SBASE(3):XN\n", "active base unknown");
  refused("SPTP XN WITH $BASE=EK(K_ROOT(3),K_TYPE(2),K_OFFS(3))\n", "active base unknown");
  refused("$TOOL=TOOL_DATA[FQ.TOOL_NO]\nPTP XN\n", "active tool unknown");
  for (const char* change : {"FP.TOOL_NO=2\n", "FP={TOOL_NO 2,BASE_NO 3,IPO_FRAME #BASE}\n",
                             "IF B THEN\nFP.TOOL_NO=FP.TOOL_NO+1\nENDIF\n",
                             "TRIGGER WHEN DISTANCE=0 DELAY=0 DO FP.TOOL_NO=2\n"})
    for (const char* use : {"$TOOL=TOOL_DATA[FP.TOOL_NO]\n$BASE=BASE_DATA[3]\nPTP XN\n",
                            "SPTP XN WITH $TOOL=STOOL2(FP),$BASE=SBASE(3)\n"})
      refused(std::string(change) + use, "or changed by the program");
}

}  // namespace
}  // namespace cellcal::daemon::testing
