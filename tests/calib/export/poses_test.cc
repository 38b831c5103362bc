#include <gtest/gtest.h>

#include "calib/files/touches.h"
#include "calib/model/error.h"
#include "calib/model/units.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

std::vector<PoseRow> parse(std::string_view text) {
  return parse_poses(text, "p.csv", testing::demo_cell().robot);
}

std::string refusal(std::string_view text) {
  try {
    parse(text);
  } catch (const FileError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(Poses, HaveTheBaseFramesMillimetresAndDegrees) {
  const auto rows =
      parse("# made by hand\nx_mm,y_mm,z_mm,a_deg,b_deg,c_deg\n1000,-20,30.5,90,0,0\n");
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].line, 3);
  EXPECT_TRUE(rows[0].seed_rad.empty());
  EXPECT_NEAR(rows[0].tcp.translation().x(), 1.0, 1e-15);
  EXPECT_NEAR(rows[0].tcp.linear()(1, 0), 1.0, 1e-15);
}

TEST(Poses, MayBringSeedsOfAllJoints) {
  const auto rows = parse(
      "A1,A2,A3,A4,A5,A6,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\n10,-90,90,0,45,0,1000,0,900,0,90,0\n");
  ASSERT_EQ(rows.size(), 1U);
  ASSERT_EQ(rows[0].seed_rad.size(), 6U);
  EXPECT_NEAR(rows[0].seed_rad[4], 45.0 * kRadPerDeg, 1e-15);
}

TEST(Poses, OfBadFilesNameLineAndColumn) {
  const std::string head = "x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\n";
  EXPECT_NE(refusal("x_mm,y_mm\n1,2\n").find("p.csv:1: no column \"z_mm\""), std::string::npos);
  EXPECT_NE(refusal("A1,x_mm,y_mm,z_mm,a_deg,b_deg,c_deg\n1,2,3,4,5,6,7\n")
                .find("p.csv:1: no column \"A2\""),
            std::string::npos);
  EXPECT_NE(refusal(head + "1,2,3,4,5,6\n1,2,zwei,4,5,6\n").find("p.csv:3: z_mm"),
            std::string::npos);
  EXPECT_NE(refusal(head + "1,2,nan,4,5,6\n").find("p.csv:2: z_mm"), std::string::npos);
  EXPECT_NE(refusal(head + "1,2,1e9,4,5,6\n").find("p.csv:2: z_mm"), std::string::npos);
  EXPECT_NE(refusal(head + "1,2,3,4,5,6e4\n").find("p.csv:2: c_deg"), std::string::npos);
  EXPECT_NE(refusal(head + "1,2,3,4,5\n").find("p.csv:2: 5 fields"), std::string::npos);
  EXPECT_NE(refusal("x_mm,y_mm,z_mm,a_deg,b_deg,c_deg,speed\n").find("unknown column"),
            std::string::npos);
}

}  // namespace
}  // namespace cellcal::calib
