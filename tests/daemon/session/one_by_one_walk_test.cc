// A session step by step whose touches are chosen one by one.

#include "walk.h"

namespace cellcal::daemon::testing {
namespace {

using drivers::MoveKind;

struct one_by_one_walk : ::testing::Test {
  one_by_one_walk() { walk.state.one_by_one = true; }
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

TEST_F(one_by_one_walk, counts_what_is_done_and_what_is_foreseen) {
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
  EXPECT_EQ(walk.state.total(), 7u);
  walk.the<Assess>();
  EXPECT_FALSE(walk.the<ChooseTouch>().failed);
  EXPECT_NEAR(walk.the<ChooseTouch>().from_rad.at(0), 0.09, 1e-12);
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.state.phase, Phase::kChoosing);
  EXPECT_EQ(walk.find<TakeAnswer>(), nullptr);
  EXPECT_EQ(walk.timeout_s(), 300.0);
  walk.on(EventKind::kRouted, [](Event& event) { event.stage = "another"; });
  EXPECT_EQ(walk.state.stage, "another");
}

TEST_F(one_by_one_walk, chooses_the_next_while_the_arm_leaves_and_goes_there_from_the_clear_point) {
  walk.to_routing();
  next();
  touch();
  walk.on(EventKind::kRouted, [&](Event& event) {
    event.route_id = walk.state.route_id;
    event.stage = "another";
  });
  EXPECT_EQ(walk.state.phase, Phase::kRetreat);
  EXPECT_TRUE(walk.actions.empty());
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.state.phase, Phase::kChoosing);
  ASSERT_NE(walk.the<TakeAnswer>().answer, nullptr);
  EXPECT_EQ(walk.the<TakeAnswer>().answer->stage, "another");
  walk.on(EventKind::kRouted, [](Event& event) { event.stage = "another"; });
  EXPECT_EQ(walk.state.phase, Phase::kTransit);
}

TEST_F(one_by_one_walk, says_that_nothing_can_be_chosen_only_when_the_arm_has_left) {
  walk.to_routing();
  next();
  touch();
  walk.on(EventKind::kWorkFailed, [&](Event& event) {
    event.route_id = walk.state.route_id;
    event.words = "no way";
  });
  EXPECT_EQ(walk.state.phase, Phase::kRetreat);
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.the<TakeAnswer>().answer->kind, EventKind::kWorkFailed);
  walk.on(EventKind::kWorkFailed);
  EXPECT_EQ(walk.state.phase, Phase::kFailed);
  EXPECT_EQ(walk.state.failure->kind, FailureKind::kPlan);
}

TEST_F(one_by_one_walk, drops_a_choice_that_comes_when_it_is_being_stopped) {
  walk.to_routing();
  next();
  touch();
  walk.on(EventKind::kAbort);
  EXPECT_EQ(walk.state.phase, Phase::kStopping);
  walk.on(EventKind::kRouted, [&](Event& event) { event.route_id = walk.state.route_id; });
  EXPECT_EQ(walk.state.phase, Phase::kStopping);
  EXPECT_TRUE(walk.actions.empty());
  EXPECT_FALSE(walk.state.failure);
  walk.on(EventKind::kStopped);
  EXPECT_EQ(walk.state.phase, Phase::kAborted);
}

TEST_F(one_by_one_walk, ends_when_nothing_is_left_to_choose) {
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
      event.plan = none;
      event.progress = {};
      event.stage = "home";
    });
    EXPECT_EQ(walk.the<RecordPlan>().touches, 1u);
    EXPECT_EQ(walk.the<RecordPlan>().hash, "hash");
    EXPECT_EQ(walk.state.stage, "home");
    EXPECT_EQ(walk.state.plan, none);
    EXPECT_EQ(walk.state.phase, home ? Phase::kReturning : Phase::kIdentifying);
    if (home) expect_move(walk, MoveKind::kTransit, 0.05, 0.0, kWaypointS);
  }
}

TEST_F(one_by_one_walk, leaves_a_sphere_that_cannot_be_found_before_it_ends) {
  for (const bool home : {true, false}) {
    Walk lost(1);
    lost.state.one_by_one = true;
    walk = lost;
    walk.to_routing();
    next();
    walk.on(EventKind::kArrived);  // end of travel: nothing met
    walk.on(EventKind::kArrived);
    walk.on(EventKind::kLinks);
    auto none = std::make_shared<calib::Plan>(line_plan(0));
    if (!home) none->home.clear();
    walk.on(EventKind::kRouted, [&](Event& event) {
      event.plan = none;
      event.not_found = true;
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

TEST_F(one_by_one_walk, identifies_nothing_where_a_sphere_was_not_found_behind_an_interruption) {
  walk.to_routing();
  walk.state.interruptions.count(drivers::Interruption::kPacketsStopped);
  auto none = std::make_shared<calib::Plan>(line_plan(0));
  walk.on(EventKind::kRouted, [&](Event& event) {
    event.plan = none;
    event.not_found = true;
  });
  EXPECT_EQ(walk.state.phase, Phase::kReturning);
  walk.on(EventKind::kContact);
  EXPECT_NE(walk.state.phase, Phase::kIdentifying);
}

TEST_F(one_by_one_walk, replaces_touches_that_could_not_be_made_but_not_for_ever) {
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
    walk.on(EventKind::kLinks, [](Event& event) { event.links.self_test_ok = false; });
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

TEST_F(one_by_one_walk, forgets_failures_in_a_row_with_each_touch_that_was_made) {
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

TEST_F(one_by_one_walk, says_of_what_it_met_that_the_touch_failed_and_not_that_nothing_is_there) {
  walk.to_routing();
  next();
  walk.contact(0.110, 0.1102);
  walk.on(EventKind::kArrived);
  walk.on(EventKind::kArmed);
  walk.on(EventKind::kArrived);  // behind a first contact
  EXPECT_EQ(walk.state.touch_failed, calib::NotMade::kFailed);
  Walk noisy(1);
  noisy.state.one_by_one = true;
  noisy.state.policy.max_revoked = 0;
  walk = noisy;
  walk.to_routing();
  next();
  walk.on(EventKind::kRevoked, [](Event& event) { event.at_rad = {0.105}; });
  EXPECT_EQ(walk.state.touch_failed, calib::NotMade::kFailed);
  EXPECT_EQ(walk.state.phase, Phase::kRetreat);
}

TEST_F(one_by_one_walk, leaves_a_place_where_it_was_only_looking) {
  walk.plan->touches[0].may_miss = true;
  walk.to_routing();
  next();
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.state.phase, Phase::kRetreat);
  EXPECT_EQ(walk.state.touch_failed, calib::NotMade::kMissed);
  EXPECT_EQ(walk.state.failed_touches, 0);
}

TEST_F(one_by_one_walk, that_is_resumed_at_a_sphere_says_so_when_it_chooses) {
  walk.state.resumed = true;
  walk.on(EventKind::kRun);
  walk.on(EventKind::kPlanned);
  const auto touching = [](Event& event) {
    event.links.in_contact = true;
    event.links.can_guard_retreat = true;
  };
  walk.on(EventKind::kLinks, touching);
  walk.on(EventKind::kLinks, touching);
  EXPECT_TRUE(walk.the<ChooseTouch>().in_contact);
}

TEST_F(one_by_one_walk, ends_at_once_where_all_is_done) {
  walk.on(EventKind::kRun);
  walk.on(EventKind::kPlanned, [](Event& event) { event.progress.done = true; });
  EXPECT_EQ(walk.state.phase, Phase::kIdentifying);
}

}  // namespace
}  // namespace cellcal::daemon::testing
