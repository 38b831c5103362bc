#include <gtest/gtest.h>

#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

std::vector<calib::Touch> touches(std::size_t count) {
  std::vector<calib::Touch> result(count);
  for (std::size_t i = 0; i < count; ++i) result[i].target = "S" + std::to_string(i + 1);
  return result;
}

TEST(AResumedSession, MakesOnlyTheTouchesThatAreMissing) {
  Session session;
  session.start.resumed = true;
  session.start.expected_hash = "hash of 3";
  session.done = touches(2);
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone);
  ASSERT_EQ(session.recorder.touches.size(), 1u);
  EXPECT_EQ(session.recorder.touches[0].index, 2u);
  EXPECT_EQ(session.recorder.touches[0].touch.target, "S3");
  EXPECT_EQ(end.result->calibration()->after.count, 3);
}

TEST(AResumedSession, AsksForAWayFromWhereTheArmStands) {
  Session session;
  session.start.resumed = true;
  session.done = touches(1);
  session.backend.world.at_rad = 0.1234;
  std::size_t next = 99;
  calib::JointVector from;
  session.tasks.route = [&](const calib::Plan& plan, const FindRoute& how,
                            const calib::JointVector& f) {
    next = how.next;
    from = f;
    return plan;
  };
  session.run();
  EXPECT_EQ(next, 1u);
  EXPECT_EQ(from, calib::JointVector{0.1234});
}

TEST(AResumedSession, WithNothingLeftIdentifiesWithoutOpeningADevice) {
  Session session;
  session.start.resumed = true;
  session.done = touches(3);
  EXPECT_EQ(session.run().phase, Phase::kDone);
  EXPECT_EQ(session.backend.world.opened, 0);
  EXPECT_TRUE(session.backend.world.moves.empty());
}

TEST(AResumedSession, WhosePlanHasChangedIsRefused) {
  Session session;
  session.start.resumed = true;
  session.start.expected_hash = "hash of another";
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kPlanChanged);
  EXPECT_EQ(session.backend.world.opened, 0);
}

TEST(AResumedSession, ThatStandsInContactLeavesItAndProvesTheSensorFirst) {
  Session session({.contact_closed = true});
  session.start.resumed = true;
  session.done = touches(1);
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone) << words(end.failure->detail);
  EXPECT_EQ(session.backend.world.moves.at(0).kind, drivers::MoveKind::kRetreat);
  EXPECT_EQ(session.backend.world.moves.at(1).kind, drivers::MoveKind::kTransit);
  EXPECT_GE(session.backend.world.self_tests, 1);
}

TEST(AResumedSession, ArmsAtOnceWhenTheWayOutOfContactEndsAtTheStandOff) {
  Session session({.contact_closed = true}, 1);
  session.start.resumed = true;
  session.tasks.route = [](calib::Plan plan, const FindRoute& how, const calib::JointVector&) {
    EXPECT_TRUE(how.in_contact);
    plan.touches[0].transit = {plan.touches[0].standoff};
    return plan;
  };
  EXPECT_EQ(session.run().phase, Phase::kDone);
  EXPECT_EQ(session.backend.world.moves.at(1).kind, drivers::MoveKind::kSearch);
}

TEST(AResumedSession, ThatCannotLeaveTheContactSaysSo) {
  Session session(
      {.outcome = {{1, drivers::MoveOutcome::kStillInContact}}, .contact_closed = true});
  session.start.resumed = true;
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kStillInContact);
}

}  // namespace
}  // namespace cellcal::daemon::testing
