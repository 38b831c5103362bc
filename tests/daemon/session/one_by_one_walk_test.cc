// A step-by-step session whose touches are chosen one by one.

#include "walk.h"

namespace cellcal::daemon::testing {
namespace {

using drivers::MoveKind;

struct OneByOneWalk : ::testing::Test {
  OneByOneWalk() { walk.state.one_by_one = true; }
  void touch() {
    walk.contact(0.110, 0.1102);
    for (int i = 0; i < 2; ++i) {
      walk.on(EventKind::kArrived);
      walk.on(EventKind::kArmed);
      walk.contact(0.110, 0.1102);
    }
    walk.on(EventKind::kRecorded);
  }
  void next() {
    walk.on(EventKind::kRouted);
    walk.on(EventKind::kArrived);
    walk.on(EventKind::kArmed);
  }
  Walk walk{1};
};

TEST_F(OneByOneWalk, CountsWhatIsDoneAndWhatIsForeseen) {
  walk.on(EventKind::kRun);
  walk.on(EventKind::kPlanned);
  EXPECT_EQ(walk.the<RecordPlan>().touches, 6u);
  walk.on(EventKind::kLinks);
  walk.on(EventKind::kLinks);
  EXPECT_FALSE(walk.the<ChooseTouch>().failed);
  EXPECT_FALSE(walk.the<ChooseTouch>().in_contact);
  EXPECT_EQ(walk.timeout_s(), 300.0);
  next();
  touch();
  EXPECT_EQ(walk.state.done, 1u);
  EXPECT_EQ(walk.state.total(), 6u) << "the touch made is among those foreseen";
  EXPECT_EQ(walk.state.at_hand(), &walk.state.plan->touches[0]) << "the arm leaves it";
  walk.the<Assess>();
  EXPECT_FALSE(walk.the<ChooseTouch>().failed);
  EXPECT_NEAR(walk.the<ChooseTouch>().from_rad.at(0), 0.09, 1e-12);
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.state.phase, Phase::kChoosing);
  EXPECT_EQ(walk.find<TakeAnswer>(), nullptr);
  EXPECT_EQ(walk.timeout_s(), 300.0);
  walk.on(EventKind::kRouted, [](Event& event) { offer(event).stage = "another"; });
  EXPECT_EQ(walk.state.stage, "another");
  EXPECT_EQ(walk.state.total(), 7u);
}

TEST_F(OneByOneWalk, ChoosesTheNextWhileTheArmLeavesAndGoesThereFromTheClearPoint) {
  walk.to_routing();
  next();
  touch();
  walk.on(EventKind::kRouted, [&](Event& event) {
    routed(event).route_id = walk.state.route_id;
    offer(event).stage = "another";
  });
  EXPECT_EQ(walk.state.phase, Phase::kRetreat);
  EXPECT_TRUE(walk.actions.empty());
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.state.phase, Phase::kChoosing);
  ASSERT_NE(walk.the<TakeAnswer>().answer, nullptr);
  EXPECT_EQ(walk.the<TakeAnswer>().answer->offer().stage, "another");
  walk.on(EventKind::kRouted, [](Event& event) { offer(event).stage = "another"; });
  EXPECT_EQ(walk.state.phase, Phase::kTransit);
}

TEST_F(OneByOneWalk, SaysThatNothingCanBeChosenOnlyWhenTheArmHasLeft) {
  walk.to_routing();
  next();
  touch();
  walk.on(EventKind::kWorkFailed, [&](Event& event) {
    std::get<WorkFailed>(event.evidence).route_id = walk.state.route_id;
    event.words = "no way";
  });
  EXPECT_EQ(walk.state.phase, Phase::kRetreat);
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.the<TakeAnswer>().answer->kind(), EventKind::kWorkFailed);
  walk.on(EventKind::kWorkFailed);
  EXPECT_EQ(walk.state.phase, Phase::kFailed);
  EXPECT_EQ(walk.state.failure->kind, FailureKind::kPlan);
}

TEST_F(OneByOneWalk, DropsAChoiceThatComesWhenItIsBeingStopped) {
  walk.to_routing();
  next();
  touch();
  walk.on(EventKind::kAbort);
  EXPECT_EQ(walk.state.phase, Phase::kStopping);
  walk.on(EventKind::kRouted, [&](Event& event) { routed(event).route_id = walk.state.route_id; });
  EXPECT_EQ(walk.state.phase, Phase::kStopping);
  EXPECT_TRUE(walk.actions.empty());
  EXPECT_FALSE(walk.state.failure);
  walk.on(EventKind::kStopped);
  EXPECT_EQ(walk.state.phase, Phase::kAborted);
}

TEST_F(OneByOneWalk, EndsWhenNothingIsLeftToChoose) {
  for (const bool home : {true, false}) {
    Walk last(1);
    last.state.one_by_one = true;
    walk = last;
    walk.to_routing();
    next();
    touch();
    walk.on(EventKind::kArrived);
    auto none = std::make_shared<calib::Plan>(line_plan(0));
    if (!home) none->home.clear();
    walk.on(EventKind::kRouted, [&](Event& event) {
      offer(event).plan = none;
      offer(event).progress = {};
      offer(event).stage = "home";
    });
    EXPECT_EQ(walk.the<RecordPlan>().touches, 1u);
    EXPECT_EQ(walk.the<RecordPlan>().hash, "hash");
    EXPECT_EQ(walk.state.stage, "home");
    EXPECT_EQ(walk.state.plan, none);
    EXPECT_EQ(walk.state.phase, home ? Phase::kReturning : Phase::kIdentifying);
    if (home) expect_move(walk, MoveKind::kTransit, 0.05, 0.0, kWaypointS);
  }
}

TEST_F(OneByOneWalk, LeavesASphereThatCannotBeFoundBeforeItEnds) {
  for (const bool home : {true, false}) {
    Walk lost(1);
    lost.state.one_by_one = true;
    walk = lost;
    walk.to_routing();
    next();
    walk.on(EventKind::kArrived);  // end of travel without contact
    walk.on(EventKind::kArrived);
    walk.on(EventKind::kLinks);
    auto none = std::make_shared<calib::Plan>(line_plan(0));
    if (!home) none->home.clear();
    walk.on(EventKind::kRouted, [&](Event& event) {
      offer(event).plan = none;
      routed(event).not_found = true;
      event.words = "S1 is in none of the places searched";
    });
    if (home) {
      EXPECT_EQ(walk.state.phase, Phase::kReturning);
      EXPECT_FALSE(walk.state.failure);
      expect_move(walk, MoveKind::kTransit, 0.05, 0.0, kWaypointS);
      while (walk.state.phase == Phase::kReturning) walk.on(EventKind::kArrived);
    }
    ASSERT_EQ(walk.state.phase, Phase::kFailed);
    EXPECT_EQ(walk.state.failure->kind, FailureKind::kNotFound);
    EXPECT_NE(words(walk.state.failure->detail).find("none of the places"), std::string::npos);
    EXPECT_EQ(walk.the<RecordEnd>().ending, Ending::kFailed);
  }
}

TEST_F(OneByOneWalk, IdentifiesNothingWhereASphereWasNotFoundBehindAnInterruption) {
  walk.to_routing();
  walk.state.interruptions.count(drivers::Interruption::kPacketsStopped);
  auto none = std::make_shared<calib::Plan>(line_plan(0));
  walk.on(EventKind::kRouted, [&](Event& event) {
    offer(event).plan = none;
    routed(event).not_found = true;
  });
  EXPECT_EQ(walk.state.phase, Phase::kReturning);
  walk.on(EventKind::kContact);
  EXPECT_NE(walk.state.phase, Phase::kIdentifying);
}

TEST_F(OneByOneWalk, TakesEveryWayPointOutWhereverItWasInterrupted) {
  walk.to_routing();
  walk.state.waypoint = 2;  // of the way on which it was interrupted
  auto none = std::make_shared<calib::Plan>(line_plan(0));
  none->home = {{0.05}, {0.04}, {0.03}};
  walk.on(EventKind::kRouted, [&](Event& event) {
    offer(event).plan = none;
    routed(event).not_found = true;
  });
  for (const double at_rad : {0.05, 0.04, 0.03}) {
    ASSERT_EQ(walk.state.phase, Phase::kReturning);
    expect_move(walk, MoveKind::kTransit, at_rad, 0.0, kWaypointS);
    walk.on(EventKind::kArrived);
  }
  EXPECT_EQ(walk.state.failure->kind, FailureKind::kNotFound);
}

TEST_F(OneByOneWalk, IdentifiesNothingWhereThisComputerIsLateOnTheWayOut) {
  walk.state.repeats = BusyRepeats{};
  walk.to_routing();
  auto none = std::make_shared<calib::Plan>(line_plan(0));
  walk.on(EventKind::kRouted, [&](Event& event) {
    offer(event).plan = none;
    routed(event).not_found = true;
  });
  ASSERT_EQ(walk.state.phase, Phase::kReturning);
  walk.on(EventKind::kContactSilent,
          [](Event& event) { move(event).interruption = drivers::Interruption::kLateBytes; });
  EXPECT_EQ(walk.state.phase, Phase::kRecovering);
}

TEST_F(OneByOneWalk, IdentifiesNothingWhereThisComputerIsLateBeforeTheFirstChoice) {
  walk.state.repeats = BusyRepeats{};
  walk.on(EventKind::kRun);
  walk.on(EventKind::kPlanned,
          [](Event& event) { offer(event).plan = std::make_shared<calib::Plan>(); });
  walk.on(EventKind::kLinks);
  walk.on(EventKind::kLinks);
  ASSERT_EQ(walk.state.phase, Phase::kRouting);
  walk.on(EventKind::kLinks, [](Event& event) {
    links(event).contact = drivers::ContactLink::kFault;
    links(event).fault = drivers::ContactFault::kSilent;
    links(event).delivery.open = true;
  });
  EXPECT_EQ(walk.state.phase, Phase::kRecovering);
  walk.on(EventKind::kLinks, [](Event& event) {
    links(event).contact = drivers::ContactLink::kIdentifying;
    ++links(event).delivery.late;
  });
  EXPECT_EQ(walk.state.phase, Phase::kRecovering);
}

TEST_F(OneByOneWalk, ReplacesTouchesThatCouldNotBeMadeButNotForEver) {
  walk.to_routing();
  next();
  for (int failed = 1; failed <= 2; ++failed) {
    walk.on(EventKind::kArrived);  // end of travel, no contact
    expect_move(walk, MoveKind::kRetreat, 0.09, 0.0, kWaypointS);
    EXPECT_EQ(walk.state.touch_failed, calib::NotMade::kMissed);
    EXPECT_EQ(walk.state.failed_in_a_row, failed);
    EXPECT_EQ(walk.state.failed_touches, failed);
    walk.on(EventKind::kArrived);
    walk.the<SelfTest>();
    walk.on(EventKind::kLinks, [](Event& event) { links(event).self_test_ok = false; });
    EXPECT_EQ(walk.state.phase, Phase::kProving);
    walk.on(EventKind::kLinks);
    EXPECT_EQ(walk.the<ChooseTouch>().failed, calib::NotMade::kMissed);
    EXPECT_EQ(walk.find<Assess>(), nullptr) << "there is nothing new to assess";
    EXPECT_FALSE(walk.state.touch_failed);
    next();
  }
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.state.phase, Phase::kProving) << "two in a row are no accident";
}

TEST_F(OneByOneWalk, ForgetsFailuresInARowWithEachTouchThatWasMade) {
  walk.to_routing();
  next();
  for (int failed = 1; failed <= 8; ++failed) {
    walk.on(EventKind::kArrived);
    EXPECT_EQ(walk.state.failed_in_a_row, 1);
    walk.on(EventKind::kArrived);
    walk.on(EventKind::kLinks);
    next();
    touch();
    EXPECT_EQ(walk.state.failed_in_a_row, 0);
    walk.on(EventKind::kArrived);
    next();
  }
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.state.phase, Phase::kProving) << "nor are eight in all";
}

TEST_F(OneByOneWalk, SaysOfWhatItMetThatTheTouchFailedAndNotThatNothingIsThere) {
  walk.to_routing();
  next();
  walk.to_next_search();
  walk.on(EventKind::kArrived);  // after a first contact
  EXPECT_EQ(walk.state.touch_failed, calib::NotMade::kFailed);
  Walk noisy(1);
  noisy.state.one_by_one = true;
  noisy.state.policy.max_revoked = 0;
  walk = noisy;
  walk.to_routing();
  next();
  walk.on(EventKind::kRevoked, [](Event& event) { move(event).at_rad = {0.105}; });
  EXPECT_EQ(walk.state.touch_failed, calib::NotMade::kFailed);
  EXPECT_EQ(walk.state.phase, Phase::kRetreat);
}

TEST_F(OneByOneWalk, LeavesAPlaceWhereItWasOnlyLooking) {
  walk.plan->touches[0].may_miss = true;
  walk.to_routing();
  next();
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.state.phase, Phase::kRetreat);
  EXPECT_EQ(walk.state.touch_failed, calib::NotMade::kMissed);
  EXPECT_EQ(walk.state.failed_touches, 0);
}

TEST_F(OneByOneWalk, ThatIsResumedAtASphereSaysSoWhenItChooses) {
  walk.state.resumed = true;
  walk.on(EventKind::kRun);
  walk.on(EventKind::kPlanned);
  const auto touching = [](Event& event) {
    links(event).in_contact = true;
    links(event).can_guard_retreat = true;
  };
  walk.on(EventKind::kLinks, touching);
  walk.on(EventKind::kLinks, touching);
  EXPECT_TRUE(walk.the<ChooseTouch>().in_contact);
}

TEST_F(OneByOneWalk, EndsAtOnceWhereAllIsDone) {
  walk.on(EventKind::kRun);
  walk.on(EventKind::kPlanned, [](Event& event) { offer(event).progress.done = true; });
  EXPECT_EQ(walk.state.phase, Phase::kIdentifying);
}

}  // namespace
}  // namespace cellcal::daemon::testing
