// Unattended sessions, with CELL.SRC in EXT and its PLC: the program is called, returns at the end of the session,
// is left for a brake test and called again.

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "cells.h"
#include "daemon/unattended/decision.h"
#include "session.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::faults {
namespace {

using namespace std::chrono_literals;
using daemon::FailureKind;
using daemon::Phase;

struct UnattendedSession : ::testing::TestWithParam<Wire> {
  UnattendedSession() {
    CellOptions options;
    options.wire = GetParam();
    options.cell_src = true;
    cell = make_cell(job.cell, options);
  }
  bool eki() const { return !over_rsi(GetParam()); }
  Ending run(bool resumed, bool unattended = true) {
    if (resumed) cell->new_adapters();
    if (!resumed) session = journal.begin(job.inputs, "t0");
    return run_session(*cell, job, journal, session, resumed, {}, 0, {}, unattended);
  }
  /// During the slow search of the first of two touches.
  void in_first_search(const std::function<void()>& act) {
    CellOptions options;
    options.wire = GetParam();
    options.cell_src = true;
    const std::unique_ptr<FaultyCell> twin = make_cell(job.cell, options);
    daemon::Journal other{dir / "twin.db"};
    const std::int64_t id = other.begin(job.inputs, "t0");
    const Ending all = run_session(*twin, job, other, id, false, {}, 0, {}, true);
    for (const Mark& mark : all.marks) {
      if (mark.phase != Phase::kSlowSearch || mark.done != 0) continue;
      cell->at(mark.t + 50ms, act);
      return;
    }
    FAIL() << "no slow search: " << all.hung;
  }
  void expect_right_touches(std::size_t count) {
    const std::vector<calib::Touch> touches = journal.touches(session);
    ASSERT_EQ(touches.size(), count);
    for (const calib::Touch& touch : touches) {
      double nearest_m = std::numeric_limits<double>::infinity();
      for (const Edge& edge : cell->edges()) {
        const Eigen::Vector3d apart =
            cell->physical().tip_m(edge.joint_rad) - cell->physical().tip_m(touch.joint_rad);
        if (edge.closed) nearest_m = std::min(nearest_m, apart.norm());
      }
      EXPECT_LT(nearest_m, 0.03e-3);
    }
  }

  const Job job = make_job(CELLCAL_DEMO_CELL);
  daemon::testing::TemporaryDirectory dir;
  daemon::Journal journal{dir / "j.db"};
  std::unique_ptr<FaultyCell> cell;
  std::int64_t session = 0;
};

TEST_P(UnattendedSession, MeasuresThoughTheSelectedProgramIsCell) {
  const Ending ending = run(false);
  EXPECT_EQ(ending.state.phase, Phase::kDone) << ending.hung;
  expect_right_touches(2);
  cell->live(2s);
  EXPECT_TRUE(eki() || cell->cell_src().asks()) << "CELLCAL_RSI has returned with Stop";
}

TEST_P(UnattendedSession, BeginsOneSessionAfterTheOtherWithoutAPerson) {
  EXPECT_EQ(run(false).state.phase, Phase::kDone);
  cell->live(5s);
  cell->new_adapters();
  const Ending second = run(false);
  EXPECT_EQ(second.state.phase, Phase::kDone) << second.hung;
  expect_right_touches(2);
}

TEST_P(UnattendedSession, LeavesTheControllerToItsBrakeTestAndGoesOnBehindIt) {
  in_first_search([this] {
    cell->cell_src().request_brake_test();
    // RSI's packets do not report it: the PLC stops CELL for the test.
    if (!eki()) {
      cell->cancel_program();
      cell->at(cell->now() + 1s, [this] { cell->cell_src().start(); });
    }
  });
  const Ending left = run(false);
  ASSERT_TRUE(left.state.failure) << left.hung;
  EXPECT_EQ(left.state.failure->kind,
            eki() ? FailureKind::kControllerTest : FailureKind::kRobotSilent)
      << describe(*left.state.failure);
  EXPECT_TRUE(daemon::aftermath(left.state.failure->kind, left.state.failure->by).resume)
      << describe(*left.state.failure);
  if (eki()) {
    EXPECT_NE(words(left.state.failure->detail).find("brake test requested by the controller"),
              std::string::npos)
        << words(left.state.failure->detail);
    expect_right_touches(1);
  }
  cell->live(3s);
  EXPECT_EQ(cell->cell_src().brake_tests(), 0) << "it is under way";
  const auto rested = cell->last_motion();
  const Ending resumed = run(true);
  EXPECT_EQ(cell->cell_src().brake_tests(), 1);
  EXPECT_EQ(resumed.state.phase, Phase::kDone)
      << resumed.hung << (resumed.state.failure ? describe(*resumed.state.failure) : "");
  EXPECT_GT(cell->last_motion(), rested);
  expect_right_touches(2);
}

TEST_P(UnattendedSession, IsNotEndedByTheRequestWhereAPersonBeganTheSession) {
  in_first_search([this] { cell->cell_src().request_brake_test(); });
  EXPECT_EQ(run(false, false).state.phase, Phase::kDone);
  expect_right_touches(2);
}

INSTANTIATE_TEST_SUITE_P(Wires, UnattendedSession,
                         ::testing::Values(Wire::kRsi, Wire::kRsi6, Wire::kEkiInput,
                                           Wire::kEkiFlag),
                         [](const auto& one) {
                           std::string name = to_string(one.param);
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

/// The request persists: nothing moves, and the session reports it.
TEST(PendingControllerTest, IsWaitedForAndNothingMoves) {
  const Job job = make_job(CELLCAL_DEMO_CELL);
  CellOptions options;
  options.wire = Wire::kEkiInput;
  options.cell_src = true;
  const std::unique_ptr<FaultyCell> cell = make_cell(job.cell, options);
  cell->live(1s);  // CELL has called cellcal's program by then, and it waits
  cell->cell_src().request_brake_test();
  daemon::testing::TemporaryDirectory dir;
  daemon::Journal journal{dir / "j.db"};
  const std::int64_t session = journal.begin(job.inputs, "t0");
  const auto start = cell->position_rad();
  const Ending ending = run_session(*cell, job, journal, session, false, {}, 0, {}, true);
  ASSERT_TRUE(ending.state.failure) << ending.hung;
  EXPECT_EQ(ending.state.failure->kind, FailureKind::kControllerTest)
      << describe(*ending.state.failure);
  EXPECT_EQ(cell->position_rad(), start);
}

}  // namespace
}  // namespace cellcal::faults
