// Limits at which the latch delay is determined, and reported.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "daemon/result/contact_delay.h"

namespace cellcal::daemon {
namespace {

std::vector<FastAndSlow> of_delays(const std::vector<double>& delays_s, double fast_m_s = 0.010,
                                   double slow_m_s = 0.002) {
  std::vector<FastAndSlow> touches;
  for (const double delay_s : delays_s) {
    touches.push_back({0.012 + fast_m_s * delay_s, 0.012 + slow_m_s * delay_s});
  }
  return touches;
}

TEST(TheDelayOfTheLatch, IsTheMiddleOfFiveAndMore) {
  const auto five = contact_delay(of_delays({0.004, 0.001, 0.003, 0.009, 0.002}), 0.010, 0.002);
  ASSERT_TRUE(five);
  EXPECT_EQ(five->touches, 5);
  EXPECT_NEAR(five->delay_s, 0.003, 1e-12);
  // The median deviation of 1, 2, 0, 6, 1 ms, as sigma of a normal distribution, and of its median, twice that of many.
  EXPECT_NEAR(five->sigma_s, 2.0 * 1.4826 * 0.001 * std::sqrt(std::numbers::pi / 2.0 / 5.0), 1e-9);
  EXPECT_FALSE(contact_delay(of_delays({0.004, 0.001, 0.003, 0.002}), 0.010, 0.002));
}

TEST(TheDelayOfTheLatch, NeedsSpeedsAMillimetrePerSecondApart) {
  const std::vector<double> delays(6, 0.001);
  EXPECT_TRUE(contact_delay(of_delays(delays, 0.0031, 0.002), 0.0031, 0.002));
  EXPECT_FALSE(contact_delay(of_delays(delays, 0.0029, 0.002), 0.0029, 0.002));
  EXPECT_FALSE(contact_delay(of_delays(delays, 0.002, 0.010), 0.002, 0.010)) << "slower than slow";
  EXPECT_FALSE(contact_delay(of_delays(delays), NAN, 0.002));
}

TEST(AComplaint, IsMadeBeyond20MsAndFourSigmasOfEitherSign) {
  for (const double sign : {1.0, -1.0}) {
    EXPECT_EQ(complaint({sign * 0.0239, 0.001, 30}, std::nullopt), "");
    EXPECT_NE(complaint({sign * 0.0241, 0.001, 30}, std::nullopt), "");
    EXPECT_EQ(complaint({sign * 0.0199, 0.0, 30}, std::nullopt), "");
    EXPECT_NE(complaint({sign * 0.0201, 0.0, 30}, std::nullopt), "");
  }
}

TEST(AComplaint, IsMadeOfAChangeBeyond2MsAndFourSigmasOfBoth) {
  const ContactDelay now{0.005, 0.0003, 30};
  for (const double sign : {1.0, -1.0}) {  // sigma of the difference: 0.5 ms
    EXPECT_EQ(complaint(now, ContactDelay{0.005 + sign * 0.0039, 0.0004, 30}), "");
    EXPECT_NE(complaint(now, ContactDelay{0.005 + sign * 0.0041, 0.0004, 30}), "");
  }
}

}  // namespace
}  // namespace cellcal::daemon
