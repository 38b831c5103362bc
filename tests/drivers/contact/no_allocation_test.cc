// The functions on the robot's cycle do not allocate in any state of a session.

#include <gtest/gtest.h>

#include "rig.h"
#include "tests/drivers/kuka/allocation_count.h"

namespace cellcal::drivers {
namespace {

/// Adds the allocations of its lifetime.
class Counted {
 public:
  explicit Counted(long& sum) : sum_(sum) { sum_ -= allocations_of_this_thread(); }
  ~Counted() { sum_ += allocations_of_this_thread(); }

 private:
  long& sum_;
};

TEST(ContactCore, DoesNotAllocateOnTheCycle) {
  sim::Microcontroller mcu({}, kStart);
  TimePoint now = kStart;
  long in_core = 0, in_sensor = 0;  // the emulated sensor, called by the core, may allocate
  ContactCore core({}, [&](std::span<const std::uint8_t> bytes) {
    const Counted sensor(in_sensor);
    mcu.receive(bytes, now);
  });
  {
    const Counted here(in_core);
    core.connect(now);
  }
  int contacts = 0, revoked = 0, armed = 0, answered = 0;
  std::uint16_t id = 0;
  for (int ms = 0; ms < 20'000; ++ms) {
    now += milliseconds{1};
    mcu.advance(now);
    if (ms == 9000) mcu.reset(now);
    if (ms % 200 == 0) mcu.edge(now + microseconds{300}, true);
    if (ms % 400 == 0) mcu.edge(now + microseconds{350}, false);  // noise
    if (ms % 400 == 250) mcu.edge(now, false);
    while (auto out = mcu.next_output()) {
      if (ms % 97 == 0) out->frame.data[1] ^= 4;
      const Counted here(in_core);
      core.on_bytes(out->frame.bytes(), out->t);
    }
    const Counted here(in_core);
    core.on_tick(now);
    core.snapshot(now);
    if (ms % 200 == 180) core.arm(++id, milliseconds{1000}, now);
    if (ms % 5000 == 4000) core.self_test(now);
    while (const auto a = core.poll_arm()) {
      ++answered;
      armed += a->refusal == ArmRefusal::kNone ? 1 : 0;
    }
    while (const auto e = core.pop_event()) {
      contacts += e->kind == ContactEventKind::kContact ? 1 : 0;
      revoked += e->kind == ContactEventKind::kRevoked ? 1 : 0;
    }
  }
  EXPECT_EQ(in_core, in_sensor);
  EXPECT_GT(contacts, 10);
  EXPECT_GT(revoked, 5);
  EXPECT_GT(armed, 10);
  EXPECT_GT(answered, armed) << "refusals as well";
}

}  // namespace
}  // namespace cellcal::drivers
