// A session that chooses each touch based on the preceding ones.

#include <gtest/gtest.h>

#include "tests/daemon/runner/fakes.h"
#include "tests/daemon/session/events.h"

namespace cellcal::daemon::testing {
namespace {

using drivers::MoveKind;
using drivers::MoveOutcome;

/// Offers the touches of a line plan in turn until this many are made.
struct Offers {
  std::size_t wanted = 3;
  std::size_t offered = 0;
  int failed = 0;
  std::vector<ChooseTouch> asked{};
  std::vector<std::size_t> seen{};  ///< touches made, each time
  bool without_way_home = false;
  bool may_miss = false;
};

struct Choosing : Session {
  explicit Choosing(Offers& offers, Script script = {}) : Session(std::move(script)) {
    start.one_by_one = true;
    tasks.plan = [] { return Tasks::Planned{}; };
    tasks.route = nullptr;
    tasks.choose = [&offers](const ChooseTouch& how, const std::vector<calib::Touch>& made,
                             const calib::JointVector&) {
      const calib::Plan line = line_plan(40);
      offers.asked.push_back(how);
      offers.seen.push_back(made.size());
      offers.failed += how.failed.has_value() ? 1 : 0;
      Tasks::Chosen chosen;
      chosen.progress.touches_left = static_cast<int>(offers.wanted - made.size());
      const bool more = made.size() < offers.wanted;
      if (more) chosen.plan.touches = {line.touches.at(offers.offered++)};
      for (calib::PlannedTouch& touch : chosen.plan.touches) touch.may_miss = offers.may_miss;
      if (!more && !offers.without_way_home) chosen.plan.home = line.home;
      return chosen;
    };
  }
};

int retreats_to(const Session& session, double rad) {
  int found = 0;
  for (const drivers::Move& move : session.backend.world.moves)
    found += move.kind == MoveKind::kRetreat && std::abs(move.target_rad[0] - rad) < 1e-9;
  return found;
}

TEST(TouchesChosenOneByOne, AreMadeUntilNoneIsChosenAnyMore) {
  Offers offers;
  Choosing session(offers);
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone) << (end.failure ? words(end.failure->detail) : "");
  ASSERT_EQ(session.recorder.touches.size(), 3u);
  for (std::size_t i = 0; i < 3; ++i) {
    EXPECT_EQ(session.recorder.touches[i].index, i);
    EXPECT_EQ(session.recorder.touches[i].touch.target, "S" + std::to_string(i + 1));
  }
  EXPECT_EQ(offers.seen, (std::vector<std::size_t>{0, 1, 2, 3}));
  EXPECT_NEAR(session.backend.world.moves.back().target_rad[0], 0.0, 1e-12) << "the way home";
}

TEST(TouchesChosenOneByOne, GoThroughChoosingBehindEach) {
  Offers offers{.wanted = 1};
  Choosing session(offers);
  session.run();
  using enum Phase;
  const std::vector<Phase> expected{
      kIdle,       kPlanning,   kConnecting, kReferencing, kRouting,     kTransit,    kArmingFast,
      kFastSearch, kBackingOff, kArmingSlow, kSlowSearch,  kBackingOff,  kArmingSlow, kSlowSearch,
      kRecording,  kRetreat,    kChoosing,   kReturning,   kIdentifying, kReporting,  kDone};
  EXPECT_EQ(session.phases, expected);
}

TEST(TouchesChosenOneByOne, AreChosenWithTheNewestOneOnDisk) {
  Offers offers;
  Choosing session(offers);
  std::vector<std::size_t> on_disk;
  const auto choose = session.tasks.choose;
  session.tasks.choose = [&](const ChooseTouch& how, const std::vector<calib::Touch>& made,
                             const calib::JointVector& from) {
    on_disk.push_back(session.recorder.touches.size());
    EXPECT_FALSE(session.backend.world.moving);
    return choose(how, made, from);
  };
  session.run();
  EXPECT_EQ(on_disk, offers.seen);
}

TEST(TouchesChosenOneByOne, StayWhereTheyAreWhereNoWayHomeIsClear) {
  Offers offers{.wanted = 1, .without_way_home = true};
  Choosing session(offers);
  EXPECT_EQ(session.run().phase, Phase::kDone);
  EXPECT_EQ(session.backend.world.moves.back().kind, MoveKind::kRetreat);
}

TEST(ATouchChosenOneByOne, ThatMeetsNothingIsLeftProvenAndReplaced) {
  Offers offers;
  Choosing session(offers, {.outcome = {{3, MoveOutcome::kArrived}}});
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone) << (end.failure ? words(end.failure->detail) : "");
  EXPECT_EQ(end.failed_touches, 1);
  EXPECT_EQ(offers.failed, 1);
  ASSERT_EQ(session.recorder.touches.size(), 3u);
  EXPECT_EQ(session.recorder.touches[0].touch.target, "S2");
  EXPECT_EQ(session.recorder.touches[0].index, 0u);
  EXPECT_EQ(retreats_to(session, 0.09), 1) << "out to the clear point of the touch that failed";
  EXPECT_GE(session.backend.world.self_tests, 1) << "the sensor may be what failed";
}

TEST(ASearchForASphere, ThatMeetsNothingIsAnAnswerAndNoFailure) {
  Offers offers{.wanted = 1, .may_miss = true};
  Script script;
  for (int move = 3; move < 23; move += 4) script.outcome[move] = MoveOutcome::kArrived;
  Choosing session(offers, script);
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone) << (end.failure ? words(end.failure->detail) : "");
  EXPECT_EQ(offers.failed, 5);
  EXPECT_EQ(end.failed_touches, 0);
  EXPECT_EQ(offers.asked[1].failed, calib::NotMade::kMissed);
  EXPECT_EQ(session.recorder.touches.size(), 1u);
}

TEST(ASearchForASphere, ThatLostItBehindTheFirstContactIsAFailedTouch) {
  Offers offers{.wanted = 1, .may_miss = true};
  Choosing session(offers, {.outcome = {{5, MoveOutcome::kArrived}}});
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone) << (end.failure ? words(end.failure->detail) : "");
  EXPECT_EQ(end.failed_touches, 1);
  ASSERT_GE(offers.asked.size(), 2u);
  EXPECT_EQ(offers.asked[1].failed, calib::NotMade::kFailed)
      << "it does not say that nothing is there";
}

TEST(ASessionOfChosenTouches, FailsByNameWhereNothingCanBeChosenToBeginWith) {
  Offers offers{.wanted = 0};
  Choosing session(offers);
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kPlan);
  EXPECT_NE(words(end.failure->detail).find("no touch can be reached"), std::string::npos)
      << words(end.failure->detail);
}

TEST(ATouchChosenOneByOne, OfReadingsThatDisagreeIsReplaced) {
  Offers offers;
  Choosing session(offers,
                   {.late_m = {{5, 0.0}, {7, 0.0002}, {9, 0.0004}, {11, 0.0006}, {13, 0.0008}}});
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone) << (end.failure ? words(end.failure->detail) : "");
  EXPECT_EQ(session.recorder.touches.size(), 3u);
  EXPECT_EQ(end.failed_touches, 1);
}

TEST(TouchesChosenOneByOne, ThatFailOneAfterTheOtherEndTheSessionWhereTheArmIs) {
  // Two are skipped (moves 3, then 7 after the retreat and the two waypoints), the third is not.
  Offers offers;
  Choosing session(offers, {.outcome = {{3, MoveOutcome::kArrived},
                                        {7, MoveOutcome::kArrived},
                                        {11, MoveOutcome::kArrived}}});
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kNoContact);
  EXPECT_EQ(words(end.failure->detail).find("touch 1 of about 3 (S3): no contact"), 0u)
      << words(end.failure->detail);
  EXPECT_EQ(session.backend.world.moves.size(), 11u) << "the arm must hold still";
}

TEST(ATouchChosenOneByOne, ThatComesTooEarlyIsNeverReplaced) {
  Offers offers;
  Choosing session(offers, {.late_m = {{3, -0.0095}}});
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kContactTooEarly);
  EXPECT_EQ(session.backend.world.moves.size(), 3u);
}

TEST(ASessionOfChosenTouches, FailsWhereNothingCanBeChosenAndHoldsStill) {
  Offers offers;
  Choosing session(offers);
  const auto choose = session.tasks.choose;
  session.tasks.choose = [&](const ChooseTouch& how, const std::vector<calib::Touch>& made,
                             const calib::JointVector& from) {
    if (made.size() == 1) throw std::runtime_error("no way out of here");
    return choose(how, made, from);
  };
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kPlan);
  EXPECT_NE(words(end.failure->detail).find("no way out of here"), std::string::npos);
  EXPECT_EQ(session.recorder.touches.size(), 1u);
}

TEST(ASessionOfChosenTouches, MovesNoFurtherAfterAFailedTouchBeforeTheSensorIsProven) {
  State state;
  state.one_by_one = true;
  state.phase = Phase::kProving;
  state.plan = std::make_shared<const calib::Plan>(line_plan(1));
  state.touch_failed = calib::NotMade::kMissed;
  Event event{Links{}};
  links(event).robot = drivers::RobotLink::kReady;
  links(event).contact = drivers::ContactLink::kReady;
  EXPECT_EQ(step(state, event).state.phase, Phase::kProving);
  links(event).self_test_ok = true;
  EXPECT_EQ(step(state, event).state.phase, Phase::kChoosing);
}

TEST(ASessionOfChosenTouches, CanBeAbortedWhileItChooses) {
  Offers offers;
  Choosing session(offers);
  EXPECT_EQ(session.run_and_abort_in(Phase::kChoosing).phase, Phase::kAborted);
  EXPECT_EQ(session.recorder.touches.size(), 1u);
  EXPECT_FALSE(session.backend.world.robot_open);
}

TEST(ASessionOfChosenTouches, GoesOnWithThoseOnDisk) {
  Offers offers;
  Choosing first(offers);
  first.run_and_abort_in(Phase::kChoosing);
  Offers later;
  Choosing second(later);
  second.done = first.done;
  second.start.resumed = true;
  const State end = second.run();
  EXPECT_EQ(end.phase, Phase::kDone) << (end.failure ? words(end.failure->detail) : "");
  EXPECT_EQ(later.seen.front(), 1u);
  EXPECT_EQ(second.recorder.touches.size(), 2u);
  EXPECT_EQ(second.recorder.touches.front().index, 1u);
}

TEST(ASessionOfChosenTouches, ResumedInContactFreesTheTipBeforeAnythingElse) {
  Offers offers{.wanted = 1};
  Choosing session(offers, {.contact_closed = true});
  session.start.resumed = true;
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone) << (end.failure ? words(end.failure->detail) : "");
  EXPECT_TRUE(offers.asked.front().in_contact);
  EXPECT_EQ(session.backend.world.moves.front().kind, MoveKind::kRetreat);
}

std::shared_ptr<const calib::SearchUnderWay> left_at(double rad) {
  return std::make_shared<const calib::SearchUnderWay>(calib::SearchUnderWay{
      "S1", {{rad + 0.1}, {rad + 0.05}}, {rad - 0.05}, {{rad + 0.06}, {rad + 0.2}}});
}

TEST(ASessionOfChosenTouches, ThatBeginsInContactWhereASearchWasLeftFreesTheTip) {
  Offers offers{.wanted = 1};
  Choosing session(offers, {.contact_closed = true});
  session.start.left = left_at(session.backend.world.at_rad);
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone) << (end.failure ? words(end.failure->detail) : "");
  EXPECT_TRUE(offers.asked.front().in_contact);
  EXPECT_EQ(session.backend.world.moves.front().kind, MoveKind::kRetreat);
}

TEST(ASessionOfChosenTouches, ThatBeginsInContactBesideTheSearchThatWasLeftIsRefused) {
  Offers offers{.wanted = 1};
  Choosing session(offers, {.contact_closed = true});
  session.start.left = left_at(session.backend.world.at_rad + 1.0);
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kContactClosed);
  EXPECT_TRUE(session.backend.world.moves.empty());
}

TEST(ASearchForASphere, IsRecordedWithItsWayOutBeforeTheArmGoesThere) {
  Offers offers{.wanted = 1, .may_miss = true};
  Choosing session(offers);
  const auto choose = session.tasks.choose;
  std::size_t moves_then = 0, recorded_then = 0;
  session.tasks.choose = [&](const ChooseTouch& how, const std::vector<calib::Touch>& made,
                             const calib::JointVector& from) {
    Tasks::Chosen chosen = choose(how, made, from);
    chosen.search = *left_at(static_cast<double>(made.size()));
    moves_then = session.backend.world.moves.size();
    recorded_then = session.recorder.searches.size();
    return chosen;
  };
  const State end = session.run();
  EXPECT_EQ(end.phase, Phase::kDone) << (end.failure ? words(end.failure->detail) : "");
  ASSERT_EQ(session.recorder.searches.size(), 2u) << "the search, and the way home";
  EXPECT_EQ(*session.recorder.searches.front().search, *left_at(0.0));
  EXPECT_EQ(*session.recorder.searches.back().search, *left_at(1.0));
  EXPECT_EQ(recorded_then, 1u);
  EXPECT_GT(moves_then, 0u);
}

TEST(ASearchForASphere, ThatCannotBeRecordedIsNotBegun) {
  Offers offers{.wanted = 1, .may_miss = true};
  Choosing session(offers);
  const auto choose = session.tasks.choose;
  session.tasks.choose = [&](const ChooseTouch& how, const std::vector<calib::Touch>& made,
                             const calib::JointVector& from) {
    Tasks::Chosen chosen = choose(how, made, from);
    chosen.search = *left_at(0.0);
    return chosen;
  };
  session.recorder.fails_at = 2;  // after the plan
  const State end = session.run();
  ASSERT_EQ(end.phase, Phase::kFailed);
  EXPECT_EQ(end.failure->kind, FailureKind::kJournal);
  EXPECT_TRUE(session.backend.world.moves.empty());
}

}  // namespace
}  // namespace cellcal::daemon::testing
