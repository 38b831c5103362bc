// Sessions with a controller that reports its mode and override: unattended over RSI, which the override does not slow
// down, and over EKI, which it does.

#include <gtest/gtest.h>

#include "cells.h"
#include "session.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::faults {
namespace {

struct SessionWithAnOverride : ::testing::Test {
  Ending run(const CellOptions& options, bool unattended) {
    const Job job = make_job(CELLCAL_DEMO_CELL);
    const std::unique_ptr<FaultyCell> cell = make_cell(job.cell, options);
    const auto start = cell->position_rad();
    daemon::Journal journal{dir / "j.db"};
    const std::int64_t session = journal.begin(job.inputs, "t0");
    Ending ending = run_session(*cell, job, journal, session, false, {}, 0, {}, unattended);
    stood_still = cell->position_rad() == start;
    return ending;
  }
  daemon::testing::TemporaryDirectory dir;
  bool stood_still = false;
};

struct RsiUnattended : SessionWithAnOverride {};

TEST_F(RsiUnattended, WithoutAPersonEndsBeforeItsFirstMotionInT1) {
  CellOptions options;
  options.t1 = true;
  const Ending ending = run(options, true);
  ASSERT_TRUE(ending.state.failure) << ending.hung;
  EXPECT_EQ(ending.state.failure->kind, daemon::FailureKind::kAttended)
      << describe(*ending.state.failure);
  EXPECT_TRUE(stood_still);
}

TEST_F(RsiUnattended, WithoutAPersonEndsWithAnotherOverrideThoughItSlowsNothing) {
  CellOptions options;
  options.override_percent = 30;
  const Ending ending = run(options, true);
  ASSERT_TRUE(ending.state.failure) << ending.hung;
  EXPECT_EQ(ending.state.failure->kind, daemon::FailureKind::kAttended)
      << describe(*ending.state.failure);
  EXPECT_TRUE(stood_still);
}

TEST_F(RsiUnattended, WithAPersonGoesOnWithAnotherOverrideAndWithoutOneInAut) {
  CellOptions options;
  EXPECT_EQ(run(options, true).state.phase, daemon::Phase::kDone);
  options.override_percent = 30;
  EXPECT_EQ(run(options, false).state.phase, daemon::Phase::kDone);
}

struct EkiOverride : SessionWithAnOverride {};

TEST_F(EkiOverride, SlowsASessionDownThatEndsWellAllTheSame) {
  CellOptions options;
  options.wire = Wire::kEkiInput;
  options.override_percent = 10;
  const Ending ending = run(options, false);
  EXPECT_EQ(ending.state.phase, daemon::Phase::kDone)
      << (ending.state.failure ? describe(*ending.state.failure) : ending.hung);
}

}  // namespace
}  // namespace cellcal::faults
