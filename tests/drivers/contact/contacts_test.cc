// Many contacts in virtual time, with bounces, drift and the wrap of the sensor's clock. A hundred
// thousand by CELLCAL_CONTACTS=100000.

#include <algorithm>
#include <cstdlib>
#include <random>

#include "rig.h"

namespace cellcal::drivers {
namespace {

constexpr int kContacts = 3000;
/// A stated sigma is one of many that may be wrong: none may be by more than so many.
constexpr double kSigmas = 4.0;

class Contacts : public testing::TestWithParam<double> {
 protected:
  int draw(int from, int to) { return std::uniform_int_distribution<int>(from, to)(random_); }

  /// Settles at `closed` after up to eight bounces, none of them five samples long. Returns when.
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

INSTANTIATE_TEST_SUITE_P(Drift, Contacts, testing::Values(-200.0, 0.0, 200.0));

}  // namespace
}  // namespace cellcal::drivers
