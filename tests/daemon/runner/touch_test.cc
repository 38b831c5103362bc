// One touch: what counts as a touch, and what does not.

#include <gtest/gtest.h>

#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

using drivers::MoveOutcome;

TEST(ATouch, ThatComesTooEarlyIsRefusedByName) {
  Session session({.late_m = {{3, -0.0095}}}, 1);
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kContactTooEarly);
  EXPECT_NE(words(end.failure->detail).find("9.5 mm before the expected surface of S1"),
            std::string::npos)
      << words(end.failure->detail);
  EXPECT_EQ(session.backend.world.moves.size(), 3u) << "the arm must hold still";
}

TEST(ATouch, ThatNeverComesNamesTheTargetAndTheCellFile) {
  Session session({.outcome = {{3, MoveOutcome::kArrived}}});
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kNoContact);
  EXPECT_EQ(words(end.failure->detail).find("touch 1 of 3 (S1): no contact up to "), 0u)
      << words(end.failure->detail);
  EXPECT_NE(words(end.failure->detail).find("Check centre_mm"), std::string::npos);
}

TEST(ATouch, ThatNeverComesIsBelievedOnlyOfASensorThatProvesItself) {
  Session well({.outcome = {{3, MoveOutcome::kArrived}}});
  EXPECT_EQ(well.run().failure->kind, FailureKind::kNoContact);
  EXPECT_EQ(well.backend.world.self_tests, 1);

  // Its input failed after the arming, so that it cannot detect a contact.
  Session blind({.outcome = {{3, MoveOutcome::kArrived}}, .sensor_fault_at_self_test = 1});
  const State end = blind.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kContactFault) << words(end.failure->detail);
  EXPECT_EQ(blind.backend.world.moves.size(), 3u) << "the arm must hold still";
}

TEST(ATouch, ThatTheSlowSearchDoesNotFindAgainIsNoMatterOfTheCellFile) {
  Session session({.outcome = {{5, MoveOutcome::kArrived}}}, 1);
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kReadingsDisagree);
  EXPECT_NE(words(end.failure->detail).find("contact on S1 after 10.000 mm in the fast search"),
            std::string::npos)
      << words(end.failure->detail);
  EXPECT_NE(words(end.failure->detail).find("up to 3.0 mm beyond it"), std::string::npos);
}

TEST(ATouch, WhoseContactIsToldWronglyNeverLeadsTheArmFartherIn) {
  Session session({.latch_off_m = {{3, 0.005}}}, 1);
  session.run();
  ASSERT_GE(session.backend.world.moves.size(), 4u);
  // Contact after 10 mm, at rest after 10.2 mm, reported at 15 mm: back by 1 mm from the rest.
  EXPECT_NEAR(session.backend.world.moves[3].target_rad[0], 0.1092, 1e-9);
}

TEST(ATouch, WhoseReadingsNeverAgreeIsGivenUpWithAllOfThem) {
  Session session({.late_m = {{5, 0.0}, {7, 0.0002}, {9, 0.0004}, {11, 0.0006}, {13, 0.0008}}}, 1);
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kReadingsDisagree);
  EXPECT_NE(words(end.failure->detail).find("10.000, 10.200, 10.400, 10.600, 10.800 mm"),
            std::string::npos)
      << words(end.failure->detail);
  EXPECT_TRUE(session.recorder.touches.empty());
}

TEST(ATouch, OfNoiseAloneIsGivenUpAfterABoundedNumberOfTries) {
  Script script;
  for (int move = 3; move < 60; move += 2) script.outcome[move] = MoveOutcome::kRevoked;
  Session session(script, 1);
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kTooManyRevoked);
  EXPECT_EQ(end.total_revoked, 5u);
}

TEST(ATouch, CountsNoiseForItselfAlone) {
  Script script;
  // Three false trips in each of two touches, four moves later each time.
  for (int move : {3, 5, 7}) script.outcome[move] = MoveOutcome::kRevoked;
  Session session(script, 2);
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone) << words(end.failure->detail);
  EXPECT_EQ(end.revoked, 0);
  EXPECT_EQ(end.total_revoked, 3u);
}

TEST(ATouch, StaysOnDiskWhenTheContactDoesNotOpenBehindIt) {
  Session session({.outcome = {{8, MoveOutcome::kStillInContact}}}, 2);
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kStillInContact);
  EXPECT_EQ(words(end.failure->detail).find("touch 1 of 2 (S1): "), 0u)
      << words(end.failure->detail);
  EXPECT_EQ(session.recorder.touches.size(), 1u);
}

}  // namespace
}  // namespace cellcal::daemon::testing
