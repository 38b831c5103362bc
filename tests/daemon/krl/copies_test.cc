// XP2=XP1: points assigned from others.

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using krl::Why;

const calib::JointVector kFirstPoint = {0.2, -1.4, 1.5, 0.3, 0.8, 0.1},
                         kSecondPoint = {0.3, -1.3, 1.4, 0.2, 0.7, 0.2};

krl::CorrectedProgram copied(const std::string& body, const std::string& two,
                             const std::string& type = "E6POS") {
  return krl::correct_program(
      calibration(), {{"p.src", "DEF P()\nBAS(#TOOL,1)\nBAS(#BASE,0)\n" + body + "END\n"},
                      krl::KrlFile{"p.dat", "DEFDAT P\nDECL E6POS X1=" + pose_text(kFirstPoint) +
                                                "\nDECL " + type + " X2=" + two + "\nENDDAT\n"},
                      {{"$config.dat",
                        "TOOL_DATA[1]={X 59.9,Y 50.5,Z 410.3,A 38.84,B 3.59,C 0.0}\n"
                        "TOOL_DATA[2]={X 0.0,Y 0.0,Z 100.0,A 0.0,B 0.0,C 0.0}\n"}}});
}

bool has_point(const krl::CorrectedProgram& result, const std::string& name) {
  return std::ranges::any_of(result.points, [&](const auto& one) { return one.name == name; });
}

TEST(ACopiedPoint, IsCorrectedWithTheOneThatItIsCopiedFrom) {
  for (const char* body :
       {"PTP X1\nX2=X1\nPTP X2\n", "X2=X1\nPTP X2\n", "X2=X1\nPTP X1\nLIN X2\n"}) {
    const auto result = copied(body, pose_text(kSecondPoint));
    EXPECT_EQ(all_words(result), "") << body;
    EXPECT_TRUE(has_point(result, "X1") && has_point(result, "X2")) << body;
  }
}

TEST(ACopiedPoint, IsRefusedWhereOneCorrectionDoesNotFitBoth) {
  const struct {
    const char* body;
    std::string two;
    const char* type;
    Why why;
  } cases[] = {
      {"PTP X1\nX2=X1\nBAS(#TOOL,2)\nPTP X2\n", pose_text(kSecondPoint), "E6POS", Why::kTwoFrames},
      {"PTP X1\nX2=X1\nX2.Z=X2.Z+5\nPTP X2\n", pose_text(kSecondPoint), "E6POS", Why::kComputed},
      {"PTP X1\nX2=X1\nPTP X2\nX1.Z=5\n", pose_text(kSecondPoint), "E6POS", Why::kComputed},
      {"PTP X1\nX2=X1\nPTP X2\n", pose_text(kSecondPoint, false), "FRAME", Why::kComputed},
      {"PTP X1\nX2=X1\nPTP X2\n", "{A1 0,A2 -90,A3 90,A4 0,A5 10,A6 0}", "E6AXIS", Why::kComputed},
      {"PTP X1\nX2=X1\nLIN X2\n", pose_text({0.3, -1.3, 1.4, 0.2, -0.7, 0.2}), "E6POS",
       Why::kOtherPosture},
      {"PTP X1\nX2=X1\nPTP X2\n", "{X 1", "E6POS", Why::kComputed},
  };
  for (const auto& one : cases) {
    const auto result = copied(one.body, one.two, one.type);
    ASSERT_FALSE(result.refusals.empty()) << one.body << one.two;
    EXPECT_EQ(result.refusals[0].why, one.why) << one.body << all_words(result);
    EXPECT_TRUE(result.files.empty());
  }
}

TEST(ACopiedPoint, StaysWhereNoPostureReachesItsOwnValue) {
  const std::string unreachable = "{X 9000.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0,S 2,T 2}";
  const auto result = copied("PTP X1\nX2=X1\nLIN X2\n", unreachable);
  EXPECT_EQ(all_words(result), "");
  EXPECT_TRUE(has_point(result, "X1"));
  EXPECT_FALSE(has_point(result, "X2"));
  EXPECT_TRUE(std::ranges::any_of(result.left, [](const auto& one) { return one.name == "X2"; }));
  // The source of the copy must be reachable.
  EXPECT_FALSE(copied("PTP X1\nX1=X2\nPTP X1\n", unreachable).refusals.empty());
}

TEST(ManyCopiedPoints, AreRefusedInLittleTime) {
  std::string src = "DEF P()\nBAS(#TOOL,1)\nBAS(#BASE,0)\n", dat = "DEFDAT P\n";
  for (int i = 0; i < 2000; ++i) {
    const std::string name = "X" + std::to_string(i);
    dat += "DECL E6POS " + name + "=" + pose_text(kFirstPoint) + "\n";
    src += name + "=X0\nPTP " + name + "\n";
  }
  const auto result = krl::correct_program(
      calibration(), {{"p.src", src + "END\n"}, krl::KrlFile{"p.dat", dat + "ENDDAT\n"}, {}});
  EXPECT_FALSE(result.refusals.empty());
  EXPECT_TRUE(result.files.empty());
}

}  // namespace
}  // namespace cellcal::daemon::testing
