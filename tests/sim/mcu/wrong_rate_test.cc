#include <gtest/gtest.h>

#include <numeric>

#include "sim/mcu/mcu_line.h"

namespace cellcal::sim {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes all_bytes() {
  Bytes bytes(256);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

TEST(WrongRate, TheSameRateAndOneThatIsNearlyTheSameAreHeardAsSent) {
  EXPECT_EQ(received_as(all_bytes(), 115'200, 115'200), all_bytes());
  for (const std::uint8_t byte : all_bytes()) {  // 115 200 from 16 MHz is 2 % fast
    EXPECT_EQ(received_as(Bytes{byte}, 117'647, 115'200), Bytes{byte});
  }
}

TEST(WrongRate, AFasterListenerHearsEveryBitSeveralTimes) {
  // 0xFF is low for one of the sender's bits: the listener's start and three of its zeros.
  EXPECT_EQ(received_as(Bytes{0xFF}, 250'000, 1'000'000), Bytes{0xF8});
  // 0xF0 is low for five, at the listener's stop bit: an error, which reads as 0.
  EXPECT_EQ(received_as(Bytes{0xF0}, 250'000, 1'000'000), Bytes{0x00});
}

TEST(WrongRate, ASlowerListenerHearsFewerBytes) {
  const Bytes heard = received_as(all_bytes(), 1'000'000, 115'200);
  EXPECT_GT(heard.size(), 10u);
  EXPECT_LT(heard.size(), 40u);
}

TEST(WrongRate, NothingIsHeardOfNothing) { EXPECT_TRUE(received_as({}, 9600, 115'200).empty()); }

}  // namespace
}  // namespace cellcal::sim
