// Single faults of the touch circuit with the actual image: its converter, its interrupts, its main
// loop. And the output for a controller's input, whose timing is the program's.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <random>

#include "simavr_bench.h"
#include "tests/drivers/contact/circuit_faults.h"

namespace cellcal::test {
namespace {

using namespace drivers;  // NOLINT: a test's own file
using std::chrono::microseconds;
using std::chrono::milliseconds;

using Bench = SimavrBench;

class SimavrFmea : public testing::TestWithParam<CircuitFault> {
 protected:
  void spoil(Bench& bench, bool touching) {
    TouchCircuit circuit = GetParam().circuit;
    circuit.touching = touching;
    bench.board.change(circuit);
  }
};

TEST_P(SimavrFmea, IsFoundByNameBeforeASearchOrDoesNotHideATouch) {
  const CircuitFault& fault = GetParam();
  Bench bench;
  ASSERT_TRUE(bench.get_ready());
  spoil(bench, false);
  bench.run(milliseconds{1500});
  const ArmResult armed = bench.arm(1);
  EXPECT_EQ(armed.armed, !fault.refused()) << armed.why_not;
  EXPECT_EQ(bench.contact.status().loop_flaw, fault.flaw) << bench.contact.status().words;
  if (fault.refused()) return;
  spoil(bench, true);
  bench.run(milliseconds{3});
  EXPECT_EQ(bench.count(ContactEventKind::kTrip), fault.touch_is_lost ? 0 : 1);
}

TEST_P(SimavrFmea, InMidSearchItStopsTheArmOrATouchStillDoes) {
  const CircuitFault& fault = GetParam();
  Bench bench;
  ASSERT_TRUE(bench.get_ready());
  ASSERT_TRUE(bench.arm(1).armed);
  spoil(bench, false);
  bench.run(milliseconds{3});
  EXPECT_EQ(bench.count(ContactEventKind::kTrip), fault.trips ? 1 : 0);
  if (fault.trips) return;
  spoil(bench, true);
  bench.run(milliseconds{3});
  EXPECT_EQ(bench.count(ContactEventKind::kTrip), fault.touch_is_lost ? 0 : 1);
}

INSTANTIATE_TEST_SUITE_P(Circuit, SimavrFmea, testing::ValuesIn(circuit_faults()),
                         [](const auto& row) { return std::string(row.param.name); });

TEST(SimavrSensor, ATripByVoltageTakesTwoRoundsOfTheConverter) {
  Bench bench;
  ASSERT_TRUE(bench.get_ready());
  TouchCircuit film;
  film.touch_ohm = 1000.0;
  bench.board.change(film);
  std::mt19937 random(11);
  double worst_ms = 0.0;
  for (std::uint16_t id = 1; id <= 40; ++id) {
    const ArmResult armed = bench.arm(id);
    ASSERT_TRUE(armed.armed) << id << armed.why_not;
    bench.board.drain_sent();
    const TimePoint touch = bench.now() + microseconds{100 + random() % 1000};
    bench.board.touch(touch, true);
    bench.run(milliseconds{5});
    const auto sent = bench.board.drain_sent();
    const auto trip = std::find_if(sent.begin(), sent.end(),
                                   [](const auto& s) { return s.frame.type == CTP_TRIP; });
    ASSERT_NE(trip, sent.end());
    worst_ms =
        std::max(worst_ms, std::chrono::duration<double, std::milli>(trip->t - touch).count());
    bench.board.touch(bench.now(), false);
    bench.run(milliseconds{5});
  }
  std::printf("touch through 1 kiloohm to TRIP complete: %.2f ms at most\n", worst_ms);
  EXPECT_LT(worst_ms, 2.0);
}

// The output for a controller's input ------------------------------------------------------------

class SimavrOutput : public testing::Test {
 protected:
  bool free() { return bench.board.output_high(); }
  /// From the change of the pin to that of the output.
  double delay_us(bool to_free) {
    const auto pins = bench.board.drain_pin_edges();
    const auto outputs = bench.board.drain_output_edges();
    if (pins.empty() || outputs.empty() || outputs.front().high != to_free) return -1.0;
    return static_cast<double>(outputs.front().cycle - pins.front().cycle) * 1e6 /
           static_cast<double>(SimavrBoard::kHz);
  }
  Bench bench;
};

TEST_F(SimavrOutput, SaysContactUntilTheSensorHasProvedItself) {
  bench.board.advance(bench.board.now() + milliseconds{50});
  EXPECT_FALSE(free());
  ASSERT_TRUE(bench.get_ready());
  EXPECT_TRUE(free());
}

TEST_F(SimavrOutput, FollowsTheFirstEdgeWithoutWaitingForTheMainLoop) {
  ASSERT_TRUE(bench.get_ready());
  std::mt19937 random(5);
  std::vector<double> delays;
  for (int i = 0; i < 200; ++i) {
    bench.board.drain_pin_edges();
    bench.board.drain_output_edges();
    bench.board.touch(bench.now() + microseconds{random() % 3000}, true);
    bench.run(milliseconds{6});
    delays.push_back(delay_us(false));
    EXPECT_FALSE(free());
    bench.board.drain_pin_edges();
    bench.board.touch(bench.now(), false);
    bench.run(milliseconds{6});
    EXPECT_GT(delay_us(true), 400.0) << "free again only when it is confirmed";
    EXPECT_TRUE(free());
  }
  std::sort(delays.begin(), delays.end());
  std::printf("edge to output: p50 %.1f us, worst %.1f us\n", delays[delays.size() / 2],
              delays.back());
  EXPECT_GT(delays.front(), 0.0);
  EXPECT_LT(delays.back(), 60.0);
}

TEST_F(SimavrOutput, HoldsStillDuringSelfTests) {
  ASSERT_TRUE(bench.get_ready());
  bench.board.drain_output_edges();
  for (int i = 0; i < 20; ++i) {
    bench.contact.self_test();
    bench.run(milliseconds{17});
  }
  EXPECT_TRUE(bench.board.drain_output_edges().empty());
  EXPECT_TRUE(bench.contact.status().self_test_ok);
}

TEST_F(SimavrOutput, SaysContactAtEachFaultThatIsKnown) {
  for (const CircuitFault& fault : circuit_faults()) {
    Bench one;
    ASSERT_TRUE(one.get_ready());
    one.board.change(fault.circuit);
    one.run(milliseconds{1500});
    one.arm(1);
    EXPECT_EQ(one.board.output_high(), !fault.refused()) << fault.name;
  }
}

TEST_F(SimavrOutput, SaysContactWhenTheProgramHangsAndTheWatchdogHasActed) {
  ASSERT_TRUE(bench.get_ready());
  bench.board.hang();
  bench.run(milliseconds{100});
  EXPECT_FALSE(free());
}

}  // namespace
}  // namespace cellcal::test
