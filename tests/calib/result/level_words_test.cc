// Sentences on the selection of a model level.

#include <gtest/gtest.h>

#include "calib/result/calibration.h"
#include "calib/result/finding_phrase.h"
#include "calib/result/level.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

Calibration with(LevelChoice choice) {
  Calibration c;
  c.cell = testing::demo_cell();
  c.level = ModelLevel{1.0, 0.0, 0.0, 1.0};
  c.levels = {{c.level, 0.0, 0.75}, {ModelLevel{0.0, 0.0, 0.0, 0.0}, -1.1, 0.25}};
  c.level_reason = {choice, "as that file said"};
  return c;
}

TEST(LevelWords, SayHowTheLevelWasTaken) {
  const std::string level = "geometry, tool bending, joint compliance, play";
  EXPECT_EQ(words(reason_phrase(with(LevelChoice::kMeanByEvidence))),
            "mean over 2 levels, weighted by evidence. Joint compliance: 0 x prior (25 %), "
            "1 x prior (75 %); play (75 %). Likeliest level (75 %): " +
                level);
  EXPECT_EQ(level_and_reason_words(with(LevelChoice::kAskedFor)), level + "; as requested");
  EXPECT_EQ(level_and_reason_words(with(LevelChoice::kNothingIdentified)),
            "nothing was identified; the nominal arm");
  EXPECT_EQ(level_and_reason_words(with(LevelChoice::kRecorded)), "as that file said");
  EXPECT_EQ(level_and_reason_words(with(LevelChoice::kNone)), "");
}

TEST(LevelWords, HaveTheSizeOfAComplianceThatIsNotThePriors) {
  const Cell cell = testing::demo_cell();
  EXPECT_EQ(words(cell, ModelLevel{3.0, 0.0, 0.0}),
            "geometry, tool bending, joint compliance 3 x prior");
  EXPECT_EQ(words(cell, ModelLevel{1.0 + 1e-12, 0.0, 0.0}),
            "geometry, tool bending, joint compliance");
}

TEST(LevelWords, OfAMeanOverNothingAreASentenceStill) {
  Calibration c = with(LevelChoice::kMeanByEvidence);
  c.levels.clear();
  EXPECT_EQ(words(reason_phrase(c)), "mean over levels, weighted by evidence");
}

}  // namespace
}  // namespace cellcal::calib
