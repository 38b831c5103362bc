// The actual firmware image on a simulated ATmega328P, in virtual time, with the unmodified core of
// the driver.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <random>

#include "simavr_bench.h"

namespace cellcal::test {
namespace {

using namespace drivers;  // NOLINT: a test's own file
using std::chrono::microseconds;
using std::chrono::milliseconds;

using Bench = SimavrBench;

TEST(SimavrSensor, IsIdentifiedAndReadyAtEveryBaudRate) {
  for (const int baud : {1'000'000, 250'000, 115'200}) {
    Bench bench(baud);
    ASSERT_TRUE(bench.get_ready()) << baud << ": " << bench.contact.status().words;
    const ContactStatus s = bench.contact.status();
    EXPECT_EQ(s.loop_ok, true);
    EXPECT_TRUE(s.self_test_ok);
    EXPECT_EQ(s.quality.crc_errors, 0u);
    EXPECT_TRUE(bench.events.empty()) << "the self-test's own edge must not be reported";
  }
}

TEST(SimavrSensor, TellsHowItsChipIsSetUpBehindItsIdentity) {
  Bench bench;
  ASSERT_TRUE(bench.get_ready());
  const auto sent = bench.board.drain_sent();
  EXPECT_EQ(std::count_if(sent.begin(), sent.end(),
                          [](const auto& s) { return s.frame.type == CTP_BOARD; }),
            1);
  // The simulator reads flash where the chip has its fuses; beyond the program it is empty.
  EXPECT_TRUE(bench.contact.status().identity.board.known);
}

TEST(SimavrSensor, ATouchGivesTripContactAndRelease) {
  Bench bench;
  ASSERT_TRUE(bench.get_ready());
  ASSERT_TRUE(bench.arm(7).armed);
  const TimePoint touch = bench.now() + microseconds{3217};
  bench.board.touch(touch, true);
  bench.run(milliseconds{10});
  ASSERT_EQ(bench.events.size(), 2u);
  EXPECT_EQ(bench.events[0].kind, ContactEventKind::kTrip);
  EXPECT_EQ(bench.events[1].kind, ContactEventKind::kContact);
  EXPECT_EQ(bench.events[1].arm_id, 7);
  const double off_us =
      std::chrono::duration<double, std::micro>(bench.events[0].first_edge - touch).count();
  EXPECT_LT(std::abs(off_us), 10.0);
  EXPECT_LT(std::abs(off_us) * 1e-6, 3.0 * bench.events[0].time_sigma_s);
  bench.board.touch(bench.now(), false);
  bench.run(milliseconds{10});
  EXPECT_EQ(bench.count(ContactEventKind::kRelease), 1);
}

struct Break {
  const char* name;
  bool feed, sense, touching;
  bool fault_detected;
};

void PrintTo(const Break& b, std::ostream* out) { *out << b.name; }

class SimavrLoop : public testing::TestWithParam<Break> {};

TEST_P(SimavrLoop, TheSelfTestTellsABreakFromATouch) {
  Bench bench;
  ASSERT_TRUE(bench.get_ready());
  ASSERT_TRUE(bench.arm(3).armed);
  TouchCircuit circuit = bench.board.circuit();
  if (GetParam().feed) circuit.feed_wire = TouchCircuit::kOpen;
  if (GetParam().sense) circuit.sense_wire = TouchCircuit::kOpen;
  circuit.touching = GetParam().touching;
  bench.board.change(circuit);
  bench.run(milliseconds{5});
  ASSERT_FALSE(bench.events.empty()) << "it must stop the arm in any case";
  EXPECT_EQ(bench.events[0].kind, ContactEventKind::kTrip);
  bench.contact.self_test();
  bench.run(milliseconds{200});
  const ContactStatus s = bench.contact.status();
  EXPECT_EQ(s.in_contact, true);
  EXPECT_EQ(s.loop_ok, !GetParam().fault_detected) << s.words;
}

INSTANTIATE_TEST_SUITE_P(Wires, SimavrLoop,
                         testing::Values(Break{"Touch", false, false, true, false},
                                         Break{"FeedWire", true, false, false, true},
                                         Break{"SenseWire", false, true, false, true},
                                         Break{"BothWires", true, true, false, true},
                                         Break{"FeedWireWhileTouching", true, false, true, true},
                                         Break{"SenseWireWhileTouching", false, true, true, true}),
                         [](const auto& instance) { return std::string(instance.param.name); });

TEST(SimavrSensor, AHungProgramIsRestartedByTheWatchdogAndSaysSo) {
  Bench bench;
  ASSERT_TRUE(bench.get_ready());
  ASSERT_TRUE(bench.arm(1).armed);
  bench.board.drain_sent();
  bench.board.hang();
  bench.run(milliseconds{40});
  EXPECT_FALSE(bench.contact.guard().snapshot(bench.now()).armed) << "25 ms of silence";
  bench.run(milliseconds{200});
  const auto sent = bench.board.drain_sent();
  const auto ident = std::find_if(sent.begin(), sent.end(),
                                  [](const auto& s) { return s.frame.type == CTP_IDENT; });
  ASSERT_NE(ident, sent.end());
  EXPECT_EQ(ctp::read<ctp::Ident>(ident->frame).reset_cause & CTP_RESET_WATCHDOG,
            CTP_RESET_WATCHDOG);
  EXPECT_EQ(bench.contact.status().link, ContactLink::kFault) << "lost state holds";
}

TEST(SimavrSensor, PoweredOnInContactItGuardsTheWayOut) {
  Bench bench;
  bench.board.touch(bench.now(), true);
  bench.contact.open();
  ASSERT_TRUE(bench.run_until([&] { return bench.contact.status().can_guard_retreat; }))
      << bench.contact.status().words;
  EXPECT_EQ(bench.contact.status().in_contact, true);
  EXPECT_FALSE(bench.arm(1).armed);
  bench.board.touch(bench.now(), false);
  EXPECT_TRUE(bench.run_until([&] { return bench.contact.status().link == ContactLink::kReady; }));
  EXPECT_TRUE(bench.arm(2).armed);
}

TEST(SimavrSensor, EveryResetHasAnotherBootId) {
  Bench bench;
  std::vector<std::uint32_t> ids;
  for (int i = 0; i < 5; ++i) {
    bench.board.advance(bench.board.now() + milliseconds{60});
    for (const auto& sent : bench.board.drain_sent()) {
      if (sent.frame.type == CTP_IDENT) ids.push_back(ctp::read<ctp::Ident>(sent.frame).boot_id);
    }
    bench.board.reset();
  }
  ASSERT_EQ(ids.size(), 5u);
  for (std::size_t i = 1; i < ids.size(); ++i) EXPECT_EQ(ids[i], ids[i - 1] + 1);
}

TEST(SimavrSensor, ALineThatChattersFasterThanTheProgramDoesNotSilenceIt) {
  Bench bench;
  ASSERT_TRUE(bench.get_ready());
  ASSERT_TRUE(bench.arm(1).armed);
  bench.board.drain_sent();
  std::mt19937 random(7);
  std::uniform_int_distribution<int> ns(300, 2500);
  const TimePoint begin = bench.now();
  const TimePoint end = begin + milliseconds{100};
  TimePoint t = begin;
  while (t < end) {  // some 350 kHz, irregular
    bench.board.touch(t += std::chrono::nanoseconds{ns(random)}, true);
    bench.board.touch(t += std::chrono::nanoseconds{ns(random)}, false);
  }
  bench.run(milliseconds{100});
  EXPECT_EQ(bench.count(ContactEventKind::kTrip), 1);
  Duration silence{};
  TimePoint last = begin;
  for (const auto& sent : bench.board.drain_sent()) {
    silence = std::max(silence, sent.t - last);
    last = sent.t;
    EXPECT_NE(sent.frame.type, CTP_IDENT) << "the watchdog must not have to help";
  }
  EXPECT_LT(silence, kHeartbeatLimit);
  bench.run(milliseconds{50});
  EXPECT_EQ(bench.contact.status().link, ContactLink::kReady);
  EXPECT_EQ(bench.contact.status().in_contact, false);
  EXPECT_TRUE(bench.arm(2).armed) << "when it is over, it works as before";
}

TEST(SimavrSensor, MemoryIsLeftAtTheDeepestStack) {
  Bench bench;
  ASSERT_TRUE(bench.get_ready());
  for (std::uint16_t id = 1; id <= 20; ++id) {
    ASSERT_TRUE(bench.arm(id).armed);
    bench.board.touch(bench.now(), true);
    bench.run(milliseconds{3});
    bench.board.touch(bench.now(), false);
    bench.run(milliseconds{3});
  }
  std::printf("memory never used: %zu of 2048 bytes\n", bench.board.untouched_memory());
  EXPECT_GT(bench.board.untouched_memory(), 512u);
}

}  // namespace
}  // namespace cellcal::test
