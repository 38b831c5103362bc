// Latch delay from touches at two speeds.

#include "daemon/result/contact_delay.h"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "calib/model/linear.h"

namespace cellcal::daemon {
namespace {

constexpr double kFast = 0.010, kSlow = 0.002;

/// Contacts with a latch delay of `delay_s`, scattered by `noise_m`.
std::vector<FastAndSlow> touches(int count, double delay_s, double noise_m) {
  std::vector<FastAndSlow> made;
  for (int i = 0; i < count; ++i) {
    const double surface = 0.012 + 1e-4 * i;
    const double noise = noise_m * std::sin(12.9 * i + 1.0);
    made.push_back({surface + kFast * delay_s + noise, surface + kSlow * delay_s});
  }
  return made;
}

TEST(TheDelayOfTheLatch, IsTheSlopeOfDepthOverSpeed) {
  const auto delay = contact_delay(touches(20, 0.0123, 0.0), kFast, kSlow);
  ASSERT_TRUE(delay);
  EXPECT_NEAR(delay->delay_s, 0.0123, 1e-12);
  EXPECT_NEAR(delay->sigma_s, 0.0, 1e-12);
  EXPECT_EQ(delay->touches, 20);
  EXPECT_EQ(in_words(*delay), "12.30 ± 0.00 ms (k=2) of 20 touches");
}

TEST(TheDelayOfTheLatch, IsSaidWithItsExpandedUncertainty) {
  EXPECT_EQ(in_words({0.00384, 0.00249, 12}), "3.84 ± 4.98 ms (k=2) of 12 touches");
}

TEST(TheDelayOfTheLatch, OfFewTouchesIsUnbiasedAndWithinItsExpandedUncertainty) {
  calib::Random random(3);
  for (const int count : {5, 6, 8, 12, 13, 40}) {
    SCOPED_TRACE(count);
    constexpr int kRuns = 4000;
    double sum_s = 0.0, inside = 0.0;
    for (int run = 0; run < kRuns; ++run) {
      std::vector<FastAndSlow> made = touches(count, 0.0, 0.0);
      for (FastAndSlow& touch : made) touch.fast_m += 8e-6 * random.normal();  // 1 ms
      const auto delay = contact_delay(made, kFast, kSlow);
      sum_s += delay->delay_s / kRuns;
      inside += std::abs(delay->delay_s) < 2.0 * delay->sigma_s ? 1.0 / kRuns : 0.0;
    }
    EXPECT_NEAR(sum_s, 0.0, 0.04e-3);
    EXPECT_GT(inside, 0.915);
    EXPECT_LT(inside, 0.985);
  }
}

TEST(TheDelayOfTheLatch, IsNoWorseThanItSaysWithNoiseAndATouchThatSlipped) {
  std::vector<FastAndSlow> made = touches(41, -0.001, 30e-6);
  made[7].fast_m += 0.005;
  const auto delay = contact_delay(made, kFast, kSlow);
  ASSERT_TRUE(delay);
  EXPECT_NEAR(delay->delay_s, -0.001, 4.0 * delay->sigma_s);
  EXPECT_LT(delay->sigma_s, 0.0015);
  EXPECT_GT(delay->sigma_s, 0.0001);
}

TEST(TheDelayOfTheLatch, IsNotKnownOfFewTouchesOrOfOneSpeed) {
  EXPECT_FALSE(contact_delay(touches(4, 0.001, 0.0), kFast, kSlow));
  EXPECT_FALSE(contact_delay(touches(20, 0.001, 0.0), kSlow, kSlow));
  EXPECT_FALSE(contact_delay(touches(20, 0.001, 0.0), 0.0025, kSlow));
  EXPECT_FALSE(contact_delay({}, kFast, kSlow));
}

TEST(AComplaint, IsMadeOfADelayThatIsLargeOrHasChanged) {
  const ContactDelay fine{0.001, 0.0001, 30};
  EXPECT_EQ(complaint(fine, std::nullopt), "");
  EXPECT_EQ(complaint(fine, ContactDelay{0.0012, 0.0001, 30}), "");
  EXPECT_NE(complaint(fine, ContactDelay{0.0080, 0.0001, 30}).find("8.00"), std::string::npos);
  EXPECT_EQ(complaint(fine, ContactDelay{0.0080, 0.0030, 30}), "") << "within its uncertainty";
  const std::string large = complaint({0.055, 0.001, 30}, std::nullopt);
  EXPECT_NE(large.find("55 ms after"), std::string::npos) << large;
  EXPECT_NE(large.find("latch_delay_ms"), std::string::npos) << large;
  EXPECT_NE(complaint({-0.055, 0.001, 30}, std::nullopt).find("before the contact"),
            std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon
