// Many contacts in virtual time, with bounces, drift and the wrap of the sensor's clock. A hundred
// thousand with CELLCAL_CONTACTS=100000.

#include <algorithm>
#include <cstdlib>
#include <random>

#include "rig.h"

namespace cellcal::drivers {
namespace {

constexpr int kContacts = 3000;
/// Maximum error in stated sigmas, over many contacts.
constexpr double kSigmas = 4.0;

class Contacts : public testing::TestWithParam<double> {
 protected:
  int draw(int from, int to) { return std::uniform_int_distribution<int>(from, to)(random_); }

  /// Settles at `closed` after up to eight bounces, none of them five samples long. Returns the
  /// time.
  TimePoint bounce(Rig& rig, TimePoint t, bool closed) {
    rig.mcu.edge(t, closed);
    for (int n = draw(0, 8); n > 0; --n) {
      rig.mcu.edge(t += microseconds{draw(101, 200)}, !closed);
      rig.mcu.edge(t += microseconds{draw(1, 150)}, closed);
    }
    return t;
  }

  std::mt19937 random_{1};
};

TEST_P(Contacts, AreNeitherMissedNorFalseNorWrongByMoreThanTheyState) {
  const char* asked = std::getenv("CELLCAL_CONTACTS");
  const int contacts = asked != nullptr ? std::atoi(asked) : kContacts;
  sim::McuOptions mcu;
  mcu.drift_ppm = GetParam();
  mcu.first_ticks = 0u - 5u * CTP_TICKS_PER_S;  // wraps after five seconds
  Rig rig(mcu);
  ASSERT_TRUE(rig.get_ready());
  double worst = 0.0;
  for (int i = 0; i < contacts; ++i) {
    const auto id = static_cast<std::uint16_t>(i % 60'000 + 1);
    rig.events.clear();
    const ArmResult armed = rig.arm(id);
    ASSERT_TRUE(armed.armed) << i << ": " << armed.why_not;
    rig.run(microseconds{draw(0, 12'000)});
    ASSERT_TRUE(rig.events.empty()) << i << ": a false trip";
    const TimePoint touch = rig.now() + std::chrono::nanoseconds{draw(0, 900'000)};
    rig.run(bounce(rig, touch, true) - rig.now() + milliseconds{3});
    ASSERT_EQ(rig.events.size(), 2u) << i;
    ASSERT_EQ(rig.events[0].kind, ContactEventKind::kTrip) << i;
    ASSERT_EQ(rig.events[1].kind, ContactEventKind::kContact) << i;
    ASSERT_EQ(rig.events[1].arm_id, id) << i;
    for (const ContactEvent& e : rig.events) {
      const double off_s = std::chrono::duration<double>(e.first_edge - touch).count();
      worst = std::max(worst, std::abs(off_s) / e.time_sigma_s);
    }
    rig.run(bounce(rig, rig.now() + microseconds{draw(0, 900)}, false) - rig.now() +
            milliseconds{3});
    ASSERT_EQ(rig.events.size(), 3u) << i;
    ASSERT_EQ(rig.events[2].kind, ContactEventKind::kRelease) << i;
  }
  EXPECT_LT(worst, kSigmas);
}

std::vector<ContactRecord> taken(Rig& rig) {
  std::vector<ContactRecord> records;
  while (const auto record = rig.contact.next_record()) records.push_back(*record);
  return records;
}

TEST(Records, AreTheEventsAsTheSensorGaveThem) {
  sim::McuOptions mcu;
  mcu.first_ticks = 4'000'000'000u;
  Rig rig(mcu);
  ASSERT_TRUE(rig.get_ready());
  taken(rig);
  ASSERT_TRUE(rig.arm(7).armed);
  rig.mcu.edge(rig.now() + milliseconds{1}, true);
  rig.run(milliseconds{5});
  rig.mcu.edge(rig.now() + milliseconds{1}, false);
  rig.run(milliseconds{5});
  const std::vector<ContactRecord> records = taken(rig);
  ASSERT_EQ(records.size(), 3u);
  EXPECT_EQ(records[0].kind, ContactEventKind::kTrip);
  EXPECT_EQ(records[1].kind, ContactEventKind::kContact);
  EXPECT_EQ(records[2].kind, ContactEventKind::kRelease);
  EXPECT_EQ(records[0].arm_id, 7);
  EXPECT_EQ(records[1].ticks, records[0].ticks) << "the same first edge";
  EXPECT_GT(records[0].ticks, 4'000'000'000u);
  EXPECT_GT(records[2].ticks - records[1].ticks, 4u * 1000 * CTP_TICKS_PER_US);
  EXPECT_GT(records[1].confirmed_after_us, 0);
  EXPECT_EQ(records[0].event, 0);
  EXPECT_EQ(static_cast<std::uint16_t>(records[1].event + 1), records[2].event);
  EXPECT_NE(records[0].sequence, records[1].sequence);
  EXPECT_LT(records[1].sense_v, 1.0) << "closed";
  EXPECT_GT(records[2].sense_v, 2.0) << "open";
  ASSERT_EQ(rig.events.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(records[i].first_edge, rig.events[i].first_edge);
    EXPECT_LT(records[i].first_edge, records[i].heard);
    EXPECT_EQ(records[i].lost, 0u);
  }
}

TEST(Records, ThatNobodyTakesAreCountedAndDisturbNothing) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  taken(rig);
  constexpr int kMany = 100;
  for (int i = 0; i < kMany; ++i) {
    rig.mcu.edge(rig.now() + milliseconds{1}, i % 2 == 0);
    rig.run(milliseconds{6});
  }
  EXPECT_GE(rig.events.size(), std::size_t{kMany / 2}) << "the cycle has had its own";
  const std::vector<ContactRecord> records = taken(rig);
  ASSERT_EQ(records.size(), 64u);
  EXPECT_EQ(records.back().lost + 65, rig.events.size());
}

INSTANTIATE_TEST_SUITE_P(Drift, Contacts, testing::Values(-200.0, 0.0, 200.0));

}  // namespace
}  // namespace cellcal::drivers
