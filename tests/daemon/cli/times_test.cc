#include <gtest/gtest.h>

#include <vector>

#include "daemon/cli/progress.h"

namespace cellcal::daemon {
namespace {

TEST(TheTimes, AreATableOfWhatTookPlaceTheLargestFirst) {
  const std::vector<ActivityRow> rows{{"transit and retreat", "axis limits", 4, 6.0, 2.5},
                                      {"fast search", "search speed", 5, 10.0, 4.0},
                                      {"choosing", "processor", 0, 0.0, 0.0}};
  EXPECT_EQ(
      times_words(4, rows),
      "time                     s/touch  count   mean s  worst s  total s  share  depends on\n"
      "fast search                2.500      5    2.000    4.000     10.0   62 %  search speed\n"
      "transit and retreat        1.500      4    1.500    2.500      6.0   38 %  axis limits\n"
      "all                        4.000      4                       16.0\n");
}

TEST(TheTimes, OfASessionWithoutATouchOrWithoutAnythingDivideByNothing) {
  EXPECT_EQ(times_words(0, {}).find("nan"), std::string::npos);
  const std::vector<ActivityRow> waiting{{"other", "links", 1, 3.0, 3.0}};
  EXPECT_NE(times_words(0, waiting).find("other                      0.000      1    3.000"),
            std::string::npos)
      << times_words(0, waiting);
}

}  // namespace
}  // namespace cellcal::daemon
