// CELL.SRC under a PLC: requests, programs, and repetition of requests.

#include "tests/sim/faults/cell_src.h"

#include <gtest/gtest.h>

namespace cellcal::sim {
namespace {

using namespace std::chrono_literals;

struct CellProgram : ::testing::Test {
  int calls = 0, tested = 0;
  bool under_way = false, with_message = false, requested = false;
  drivers::TimePoint now{1h};
  CellSrc cell{{[this] {
                  ++calls;
                  under_way = true;
                },
                [this] { return !under_way; }, [this] { return with_message; },
                [this](bool on) { requested = on; }, [this] { ++tested; }},
               60s};
  void pass(drivers::Duration d) { cell.tick(now += d); }
};

TEST_F(CellProgram, AsksOnceItIsStartedAndAgainWhenWhatItCalledHasReturned) {
  EXPECT_FALSE(cell.number(CellSrc::kCellcal, now)) << "not started";
  cell.start();
  EXPECT_TRUE(cell.number(CellSrc::kCellcal, now));
  EXPECT_FALSE(cell.asks());
  pass(1s);
  EXPECT_FALSE(cell.number(CellSrc::kCellcal, now)) << "it runs";
  under_way = false;
  pass(1s);
  EXPECT_TRUE(cell.number(CellSrc::kCellcal, now));
  EXPECT_EQ(calls, 2);
}

TEST_F(CellProgram, RunsABrakeTestForItsTimeAndTheRequestIsOver) {
  cell.start();
  cell.request_brake_test();
  EXPECT_TRUE(requested && cell.brake_test_requested());
  EXPECT_TRUE(cell.number(CellSrc::kBrakeTest, now));
  pass(59s);
  EXPECT_TRUE(requested && !cell.asks());
  pass(1s);
  EXPECT_TRUE(!requested && cell.asks());
  EXPECT_EQ(tested, 1);
  EXPECT_EQ(calls, 0);
}

TEST_F(CellProgram, StandsWhereWhatItCalledStandsUntilItIsStartedAgain) {
  cell.start();
  cell.number(CellSrc::kCellcal, now);
  with_message = true;
  pass(1s);
  with_message = under_way = false;
  pass(1s);
  EXPECT_FALSE(cell.asks());
  cell.start();
  EXPECT_TRUE(cell.asks());
}

TEST_F(CellProgram, KnowsNoOtherNumber) {
  cell.start();
  EXPECT_FALSE(cell.number(1, now));
  EXPECT_TRUE(cell.asks());
}

}  // namespace
}  // namespace cellcal::sim
