// Temperature range of a result.

#include <gtest/gtest.h>

#include <algorithm>

#include "calib/identify/identify.h"
#include "calib/verdict/judge.h"
#include "calib/verdict/verdict.h"
#include "tests/calib/findings.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

using testing::found;
using testing::the;

TEST(Temperature, IsToldAsARangeWithHowManyTouchesStateIt) {
  std::vector<Touch> touches(4);
  EXPECT_FALSE(temperature_finding(touches));
  touches[1].temperature_c = -1.25;
  touches[3].temperature_c = 21.5;
  const auto finding = temperature_finding(touches);
  ASSERT_TRUE(finding);
  EXPECT_EQ(value(finding->evidence, "coldest"), -1.25);
  EXPECT_EQ(value(finding->evidence, "hottest"), 21.5);
  EXPECT_EQ(value(finding->evidence, "stated"), 2.0);
  EXPECT_EQ(value(finding->evidence, "touches"), 4.0);
}

TEST(Temperature, IsANoteOfTheVerdictAndChangesNothingElse) {
  testing::Making making;
  making.fit = 40;
  making.check = 8;
  auto touches = testing::make_touches(testing::demo_cell(),
                                       testing::plain_truth(testing::demo_cell(), 5), making)
                     .touches;
  const Calibration without = identify(testing::demo_cell(), touches);
  for (std::size_t i = 0; i < touches.size(); ++i)
    touches[i].temperature_c = 20.0 + 0.1 * static_cast<double>(i);
  const Calibration with = identify(testing::demo_cell(), touches);
  EXPECT_EQ(with.verdict.publish(), without.verdict.publish());
  EXPECT_EQ(with.verdict.findings.size(), without.verdict.findings.size() + 1);
  ASSERT_TRUE(found(with, FindingKind::kTemperature));
  EXPECT_FALSE(the(with, FindingKind::kTemperature).withholds());
  for (std::size_t i = 0; i < with.parameters.size(); ++i)
    EXPECT_EQ(with.parameters[i].correction, without.parameters[i].correction);
}

}  // namespace
}  // namespace cellcal::calib
