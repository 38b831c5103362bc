#include <gtest/gtest.h>

#include "drivers/kuka/rsi/rsi_stream.h"

namespace cellcal::drivers {
namespace {

using std::chrono::milliseconds;

constexpr TimePoint kLeft{std::chrono::hours(1)};
constexpr double kMillisecond = 0.001;

PauseWatch left_at(std::uint32_t ipoc, std::optional<std::uint32_t> delay) {
  PauseWatch pause;
  pause.begin(ipoc, kMillisecond, delay, kLeft);
  return pause;
}

TEST(APause, OfTheSameSessionIsOneInWhichIpocWentOnWithTheClock) {
  const PauseWatch pause = left_at(5000, 3);
  EXPECT_TRUE(pause.is_over(5016, 7, kLeft + milliseconds(16)));
  EXPECT_TRUE(pause.is_over(5400, 90, kLeft + milliseconds(400)));
  EXPECT_TRUE(pause.is_over(5016, 3, kLeft + milliseconds(40))) << "waited in a queue";
}

TEST(APause, ThatCanHideAnotherSessionIsNone) {
  const PauseWatch pause = left_at(5000, 3);
  EXPECT_FALSE(pause.is_over(5600, 100, kLeft + milliseconds(600))) << "too long";
  EXPECT_FALSE(pause.is_over(5400, 90, kLeft + milliseconds(16))) << "IPOC jumped";
  EXPECT_FALSE(pause.is_over(4, 7, kLeft + milliseconds(16))) << "IPOC began anew";
  EXPECT_FALSE(pause.is_over(5016, 0, kLeft + milliseconds(16))) << "Delay began anew";
  EXPECT_FALSE(pause.is_over(5016, std::nullopt, kLeft + milliseconds(16))) << "another file";
  EXPECT_FALSE(PauseWatch().is_over(5016, 7, kLeft + milliseconds(16))) << "none was begun";
}

TEST(APause, AcrossTheWrapOfIpocIsOne) {
  EXPECT_TRUE(left_at(0xFFFFFFF8u, 3).is_over(8, 7, kLeft + milliseconds(16)));
}

TEST(APause, BeforeTheCycleWasLearntOrThatWasForgottenIsNone) {
  PauseWatch pause;
  pause.begin(5000, 0.0, 3, kLeft);
  EXPECT_FALSE(pause.is_over(5016, 7, kLeft + milliseconds(16)));
  pause.begin(5000, kMillisecond, 3, kLeft);
  pause.forget();
  EXPECT_FALSE(pause.is_over(5016, 7, kLeft + milliseconds(16)));
}

}  // namespace
}  // namespace cellcal::drivers
