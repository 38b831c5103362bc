#include "daemon/fleet/judge.h"

#include <gtest/gtest.h>

#include "daemon/plant/messages/fact.h"

namespace cellcal::daemon::fleet {
namespace {

using namespace std::chrono_literals;

const plant::CellName kWeld{"graz", "weld-3"}, kPaint{"graz", "paint-1"};
const Meters::Time kNow{};

Batch judged(const std::string& topic, const std::string& payload, Allowance allowance = {}) {
  Meters meters(allowance);
  Batch batch;
  judge({topic, payload}, meters, kNow, batch);
  return batch;
}

TEST(Judge, AFactIsAFact) {
  const plant::Fact fact{
      kWeld, "j1", 1, "2026-11-22T20:51:17Z", 0, plant::AlarmFact{"done", "s", "t"}};
  const Batch batch = judged("cellcal/graz/weld-3/fact/alarm", plant::to_json(fact));
  ASSERT_EQ(batch.facts.size(), 1u);
  EXPECT_EQ(batch.facts[0], fact);
  EXPECT_TRUE(batch.refused.empty());
}

TEST(Judge, WhatItCannotTakeIsRefusedForItsKindOfReason) {
  EXPECT_EQ(judged("cellcal/graz/weld-3/fact/alarm", "").refused.at(0).why, Refusal::kMessage);
  EXPECT_EQ(judged("cellcal/graz/weld-3/proposal", "{}").refused.at(0).why, Refusal::kTopic);
  EXPECT_EQ(judged("somewhere", "{}").refused.at(0).why, Refusal::kTopic);
  EXPECT_EQ(judged("cellcal/graz/weld-3/fact/alarm", std::string(plant::kLargestMessage + 1, '['))
                .refused.at(0)
                .why,
            Refusal::kSize);
}

TEST(Judge, WhatIsTooMuchIsCountedAndNotKept) {
  const Batch batch =
      judged("cellcal/graz/weld-3/fact/alarm", std::string(1000, '['), {.bytes_per_day = 999.0});
  EXPECT_TRUE(batch.refused.empty());
  EXPECT_EQ(batch.too_many.at(kWeld), 1u);
  EXPECT_FALSE(batch.empty());
}

TEST(Judge, OnlyADayThatThereIsIsATime) {
  for (const char* good :
       {"2026-11-22T20:51:17Z", "2026-11-22T20:51:17.123Z", "2024-02-29T00:00:00.000000001Z"})
    EXPECT_TRUE(is_time(good)) << good;
  for (const char* bad :
       {"", "now", "2026-02-30T00:00:00Z", "2026-13-01T00:00:00Z", "2026-11-22T24:00:00Z",
        "2026-11-22T20:51:17", "2026-11-22T20:51:17.Z", "2026-11-22T20:51:17+01:00",
        "0000-01-01T00:00:00Z", "2026-11-22 20:51:17Z", "infinityyyyyyyyyyyyZ",
        "2026-11-22T20:51:17.0000000000000Z"})
    EXPECT_FALSE(is_time(bad)) << bad;
}

TEST(Meters, ACellHasItsBurstAndThenWhatTimeGives) {
  Meters meters({2.0, 3.0, 1e9});
  for (int i = 0; i < 3; ++i) EXPECT_TRUE(meters.allows(kWeld, 10, kNow));
  EXPECT_FALSE(meters.allows(kWeld, 10, kNow));
  EXPECT_TRUE(meters.allows(kPaint, 10, kNow));  // the others have their own
  EXPECT_TRUE(meters.allows(kWeld, 10, kNow + 500ms));
  EXPECT_FALSE(meters.allows(kWeld, 10, kNow + 500ms));
}

TEST(Meters, AClockThatStandsOrGoesBackGivesNothing) {
  Meters meters({1000.0, 1.0, 1e9});
  EXPECT_TRUE(meters.allows(kWeld, 10, kNow));
  EXPECT_FALSE(meters.allows(kWeld, 10, kNow - 1h));
}

}  // namespace
}  // namespace cellcal::daemon::fleet
