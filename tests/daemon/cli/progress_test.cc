#include "daemon/cli/progress.h"

#include <gtest/gtest.h>

namespace cellcal::daemon {
namespace {

TEST(the_progress_line, shows_touches_residual_and_time_left) {
  EXPECT_EQ(progress_line({"slow search", "S2", 12, 48, 0.0341, 200.4}, 200),
            "[######..................] 12/48 S2 slow search  residual 0.034 mm  3 min 20 s left");
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

}  // namespace
}  // namespace cellcal::daemon
