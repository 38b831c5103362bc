// A few touches restore a cell whose positioner was moved or has another zero; after a change of the tool the
// positioner is unchanged.

#include <gtest/gtest.h>

#include "calib/files/calibration_json.h"
#include "calib/identify/update.h"
#include "calib/plan/check_plan.h"
#include "tests/calib/findings.h"
#include "tests/calib/positioner_session.h"

namespace cellcal::calib {
namespace {

using testing::StandingCell;

constexpr double kTouchNoiseM = 2e-5;
const UpdateFacts kSinceThen{"session 3 of 2026-11-20", 1.0, {}, 60};

const testing::PositionerSession& session_before() {
  static const testing::PositionerSession one(CELLCAL_POSITIONER_ROBOT, kTouchNoiseM);
  return one;
}

const Calibration& calibration_before() {
  static const Calibration found = identify(session_before().cell, session_before().touches);
  return found;
}

/// The touches of a check, then of what these leave open.
Calibration updated_by(const StandingCell& now) {
  static const Plan first = make_check_plan(calibration_before(), {}, first_update_touches());
  Random random(7);
  std::vector<Touch> touches;
  const auto make = [&](const Plan& plan) {
    for (const PlannedTouch& planned : plan.touches)
      if (auto touch = now.contact(planned, {}, kTouchNoiseM * random.normal()))
        touches.push_back(std::move(*touch));
  };
  make(first);
  const Calibration so_far = update(calibration_before(), touches, kSinceThen);
  if (!further_touches_pay(*so_far.update)) return so_far;
  CheckPlanOptions how = further_update_touches(static_cast<int>(touches.size()), 20.0);
  how.positioner_rad = first.touches.back().positioner_rad;
  make(make_update_plan(so_far, {}, how, first.touches.back().clear));
  EXPECT_LE(touches.size(), 15u);
  return update(calibration_before(), touches, kSinceThen);
}

/// As accurate as before, at all settings of the last session.
void expect_restored(const Calibration& c, const StandingCell& now, ChangeKind kind) {
  EXPECT_TRUE(c.verdict.publish()) << testing::words_of(c);
  ASSERT_EQ(c.update->outcome, UpdateOutcome::kUpdated);
  EXPECT_EQ(c.update->explanations.front().kind, kind);
  const double before_m = testing::off_carried_m(calibration_before(), session_before().standing(),
                                                 session_before().touches);
  const double spoilt_m =
      testing::off_carried_m(calibration_before(), now, session_before().touches);
  const double after_m = testing::off_carried_m(c, now, session_before().touches);
  EXPECT_GT(spoilt_m, 4e-4);
  EXPECT_LT(after_m, 2.0 * before_m + 3e-5) << "before " << before_m << ", spoilt " << spoilt_m;
}

TEST(UpdateWithPositioner, OfOneThatWasMovedItsFootIsFoundAnew) {
  const StandingCell now = testing::with_moved_positioner(session_before().standing(),
                                                          {2e-3, -1.5e-3, 1e-3}, {0, 0, 2e-3});
  const Calibration c = updated_by(now);
  expect_restored(c, now, ChangeKind::kPositioner);
  EXPECT_EQ(c.verdict.findings.front().about.of, Subject::Of::kPositioner);
  const Calibration again = calibration_from_json(calibration_to_json(c), "c.json");
  const Explanation &one = c.update->explanations.front(),
                    &two = again.update->explanations.front();
  EXPECT_EQ(two.kind, ChangeKind::kPositioner);
  EXPECT_NEAR(two.amount, one.amount, 1e-12);
  EXPECT_NEAR(two.turn_sigma, one.turn_sigma, 1e-12);
  EXPECT_EQ(again.positioner.size(), 2u);
}

TEST(UpdateWithPositioner, OfAnAxisWithAnotherZeroWhatItCarriesTurns) {
  for (const std::size_t axis : {0u, 1u}) {
    const StandingCell now = testing::with_zero_off(session_before().standing(), axis, 4e-3);
    const Calibration c = updated_by(now);
    expect_restored(c, now, ChangeKind::kJoint);
    EXPECT_EQ(c.update->explanations.front().name, now.cell.robot.positioner[axis].name);
  }
}

TEST(UpdateWithPositioner, AfterAChangeOfTheToolTheAxesStay) {
  const StandingCell now =
      testing::with_knocked_tool(session_before().standing(), {1.5e-3, 1e-3, -1e-3});
  const Calibration c = updated_by(now);
  expect_restored(c, now, ChangeKind::kTool);
  ASSERT_EQ(c.positioner.size(), 2u);
  for (std::size_t j = 0; j < 2; ++j) {
    const PositionerLine &is = c.positioner[j], &was = calibration_before().positioner[j];
    EXPECT_LT((is.point_m - was.point_m).norm(), 3e-5);
    EXPECT_LT((is.direction - was.direction).norm(), 5e-5);
    EXPECT_EQ(is.touched_rad, was.touched_rad);
  }
}

TEST(UpdateWithPositioner, WhereNothingChangedNothingIsPublished) {
  EXPECT_EQ(updated_by(session_before().standing()).update->outcome,
            UpdateOutcome::kNothingChanged);
}

}  // namespace
}  // namespace cellcal::calib
