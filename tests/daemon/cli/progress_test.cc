#include "daemon/cli/progress.h"

#include <gtest/gtest.h>

namespace cellcal::daemon {
namespace {

TEST(TheProgressLine, ShowsTouchesResidualAndTimeLeft) {
  EXPECT_EQ(progress_line({"slow search", "S2", 12, 48, 0.0341, 200.4}, 200),
            "[######..................] 12/48 S2 slow search  residual 0.034 mm  3 min 20 s left");
}

TEST(TheProgressLine, SaysHowFarAPlanIs) {
  Progress planning{"planning", "", 0, 0, {}, {}};
  planning.share = 0.5;
  EXPECT_EQ(progress_line(planning, 200), "[############............] planning 50 %");
}

TEST(TheProgressLine, LeavesOutWhatIsNotKnown) {
  EXPECT_EQ(progress_line({"planning", "", 0, 0, {}, {}}, 200),
            "[........................] planning");
}

TEST(TheProgressLine, FitsTheTerminal) {
  for (std::size_t width : {0u, 1u, 20u, 79u}) {
    EXPECT_LE(progress_line({"slow search", "S2", 12, 48, 0.0341, 200.4}, width).size(), width);
  }
}

TEST(TheProgressLine, DoesNotRunOverOrBelowZero) {
  EXPECT_EQ(progress_line({"done", "", 60, 48, {}, -3.0}, 200),
            "[########################] 60/48 done  0 s left");
}

TEST(ASparkline, HasTheNewestValuesAgainstTheLargestOfThem) {
  const std::vector<double> values{9.0, 0.0, 0.5, 1.0};
  EXPECT_EQ(sparkline(values, 3, false), "_+@");
  EXPECT_EQ(sparkline(values, 3, true), "\u2581\u2585\u2588");
  EXPECT_EQ(sparkline(std::vector<double>{0.0, 0.0}, 9, false), "__");
  EXPECT_EQ(sparkline({}, 9, false), "");
}

TEST(TheView, HasProgressResidualsAndLinksAndFitsTheTerminal) {
  Progress progress{"slow search", "S2", 12, 48, 0.0341, 200.4};
  progress.links = "controller: 99 packets\nsensor: fine\n";
  const std::vector<double> residuals(300, 0.05);
  const auto lines = view_lines(progress, residuals, 60, false);
  ASSERT_EQ(lines.size(), 4u);
  EXPECT_EQ(lines[1].substr(0, 30), "residuals, worst 0.050 mm  @@@");
  EXPECT_EQ(lines[3], "sensor: fine");
  for (const std::size_t width : {1u, 20u, 79u})
    for (const std::string& line : view_lines(progress, residuals, width, false))
      EXPECT_LE(line.size(), width);
}

TEST(TheView, IsTheLineAloneBeforeTheFirstTouch) {
  EXPECT_EQ(view_lines({"planning", "", 0, 0, {}, {}}, {}, 60, true).size(), 1u);
}

}  // namespace
}  // namespace cellcal::daemon
