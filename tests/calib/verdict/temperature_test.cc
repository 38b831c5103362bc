// Over which temperatures a result was made.

#include "calib/verdict/temperature.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "calib/identify/identify.h"
#include "calib/verdict/verdict.h"
#include "tests/calib/simulate.h"

namespace cellcal::calib {
namespace {

TEST(Temperature, IsToldAsARangeWithHowManyTouchesStateIt) {
  std::vector<Touch> touches(4);
  EXPECT_EQ(temperature_words(touches), "");
  touches[1].temperature_c = -1.25;
  touches[3].temperature_c = 21.5;
  EXPECT_EQ(
      temperature_words(touches).find("temperature: -1.2 to 21.5 degrees C at 2 of 4 touches"), 0u)
      << temperature_words(touches);
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
  EXPECT_EQ(with.verdict.publish, without.verdict.publish);
  EXPECT_EQ(with.verdict.reasons.size(), without.verdict.reasons.size() + 1);
  const auto note =
      std::find_if(with.verdict.reasons.begin(), with.verdict.reasons.end(),
                   [](const std::string& r) { return r.starts_with("temperature: "); });
  ASSERT_NE(note, with.verdict.reasons.end());
  EXPECT_TRUE(is_note(*note));
  for (std::size_t i = 0; i < with.parameters.size(); ++i)
    EXPECT_EQ(with.parameters[i].correction, without.parameters[i].correction);
}

}  // namespace
}  // namespace cellcal::calib
