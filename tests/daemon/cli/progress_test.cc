#include "daemon/cli/progress.h"

#include <gtest/gtest.h>

namespace cellcal::daemon {
namespace {

TEST(the_progress_line, shows_touches_residual_and_time_left) {
  EXPECT_EQ(progress_line({"slow search", "S2", 12, 48, 0.0341, 200.4}, 200),
            "[######..................] 12/48 S2 slow search  residual 0.034 mm  3 min 20 s left");
}

TEST(the_progress_line, says_how_far_a_plan_is) {
  Progress planning{"planning", "", 0, 0, {}, {}};
  planning.share = 0.5;
  EXPECT_EQ(progress_line(planning, 200), "[############............] planning 50 %");
}

TEST(the_progress_line, leaves_out_what_is_not_known) {
  EXPECT_EQ(progress_line({"planning", "", 0, 0, {}, {}}, 200),
            "[........................] planning");
}

TEST(the_progress_line, fits_the_terminal) {
  for (std::size_t width : {0u, 1u, 20u, 79u}) {
    EXPECT_LE(progress_line({"slow search", "S2", 12, 48, 0.0341, 200.4}, width).size(), width);
  }
}

TEST(the_progress_line, does_not_run_over_or_below_zero) {
  EXPECT_EQ(progress_line({"done", "", 60, 48, {}, -3.0}, 200),
            "[########################] 60/48 done  0 s left");
}

TEST(a_sparkline, has_the_newest_values_against_the_largest_of_them) {
  const std::vector<double> values{9.0, 0.0, 0.5, 1.0};
  EXPECT_EQ(sparkline(values, 3, false), "_+@");
  EXPECT_EQ(sparkline(values, 3, true), "\u2581\u2585\u2588");
  EXPECT_EQ(sparkline(std::vector<double>{0.0, 0.0}, 9, false), "__");
  EXPECT_EQ(sparkline({}, 9, false), "");
}

TEST(the_view, has_progress_residuals_and_links_and_fits_the_terminal) {
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

TEST(the_view, is_the_line_alone_before_the_first_touch) {
  EXPECT_EQ(view_lines({"planning", "", 0, 0, {}, {}}, {}, 60, true).size(), 1u);
}

}  // namespace
}  // namespace cellcal::daemon
