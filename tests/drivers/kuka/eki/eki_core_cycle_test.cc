// Functions called every two milliseconds must not wait for memory.

#include "tests/drivers/kuka/allocation_count.h"
#include "tests/drivers/kuka/eki/eki_rig.h"

namespace cellcal::drivers {
namespace {

/// As EkiRig::cycle(), with the adapter's own allocations counted.
class CountedRig : public EkiRig {
 public:
  void counted_cycle() {
    now += krc.cycle();
    krc.tick(now);
    std::string bytes = krc.drain_output();
    // Every third state contains no number, and is preceded by garbage.
    if (damage && !bytes.empty() && ++states % 3 == 0) {
      bytes.replace(bytes.find("A1=\""), 4, "A1=\"x");
      bytes = "?>\"" + bytes;
    }
    const long before = allocation_count();
    core.on_bytes(bytes, now + 300us);
    core.on_tick(now + 300us);
    const std::string_view out = core.output();
    const auto done = core.next_result();
    allocated += allocation_count() - before;
    if (done) result = *done;
    krc.receive(std::string(out));
    sent_bytes += out.size();
    const long before_sent = allocation_count();
    core.sent(out.size());
    allocated += allocation_count() - before_sent;
    ++cycles;
  }
  template <typename Done>
  bool counted_until(Done done) {
    for (int i = 0; i < 3000; ++i) {
      counted_cycle();
      if (done()) return true;
    }
    return false;
  }

  std::optional<CoreResult> result;
  long allocated = 0;
  std::size_t sent_bytes = 0;
  int cycles = 0, states = 0;
  bool damage = false;
};

TEST(EkiCycle, DoesNotAllocate) {
  CountedRig rig;
  rig.make_ready();
  // A search stopped by the input.
  rig.guard.arm(1);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 2), 5.0, 1);
  for (int i = 0; i < 200; ++i) rig.counted_cycle();
  ASSERT_FALSE(rig.result);
  rig.krc.input(rig.now, true);
  rig.guard.trip(1, rig.now);
  rig.guard.push(ContactEventKind::kContact, 1, rig.now);
  ASSERT_TRUE(rig.counted_until([&] { return rig.result.has_value(); }));
  EXPECT_EQ(rig.result->outcome, MoveOutcome::kContact) << to_move_result(*rig.result).detail;

  // A transit that is stopped, with damaged states.
  rig.krc.input(rig.now, false);
  rig.result.reset();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, -40));
  rig.damage = true;
  for (int i = 0; i < 100; ++i) rig.counted_cycle();
  rig.damage = false;
  rig.core.stop();
  ASSERT_TRUE(rig.counted_until([&] { return rig.result.has_value(); }));
  EXPECT_EQ(rig.result->outcome, MoveOutcome::kStopped);
  EXPECT_GT(rig.core.core_state().bad_documents, 0U);
  EXPECT_GT(rig.sent_bytes, 5000U) << "beats, moves and stops went out";
  EXPECT_EQ(rig.allocated, 0) << rig.cycles;
}

}  // namespace
}  // namespace cellcal::drivers
