// A session step by step: commands to the devices, travels, speeds and timeouts.

#include "walk.h"

#include <cmath>

#include "daemon/result/outcome.h"

namespace cellcal::daemon::testing {
namespace {

using drivers::MoveKind;
using std::chrono::milliseconds;

void expect_arming(const Walk& walk, std::uint16_t id, int lifetime_ms) {
  EXPECT_EQ(walk.the<ArmSensor>().arm_id, id);
  EXPECT_NEAR(static_cast<double>(walk.the<ArmSensor>().lifetime.count()), lifetime_ms, 1.0);
  EXPECT_NEAR(walk.timeout_s(), 2.0, 1e-9);
}

struct ViaOf {
  double at_rad, in_share, out_share;
};

void expect_vias(const Walk& walk, const std::vector<ViaOf>& expected) {
  const drivers::Vias& vias = walk.the<BeginMove>().move.via;
  ASSERT_EQ(vias.size(), expected.size());
  for (std::size_t k = 0; k < vias.size(); ++k) {
    EXPECT_NEAR(vias[k].at_rad.at(0), expected[k].at_rad, 1e-12) << k;
    EXPECT_EQ(vias[k].in_share, expected[k].in_share) << k;
    EXPECT_EQ(vias[k].out_share, expected[k].out_share) << k;
  }
}

TEST(AWalk, ThroughOneTouchAndHome) {
  Walk walk;
  const Timeouts timeouts;
  walk.on(EventKind::kRun);
  walk.the<MakePlan>();
  EXPECT_EQ(walk.timeout_s(), 300.0);
  walk.on(EventKind::kPlanned);
  EXPECT_EQ(walk.the<RecordPlan>().hash, "hash");
  EXPECT_EQ(walk.the<RecordPlan>().touches, 2u);
  walk.the<OpenDevices>();
  EXPECT_EQ(walk.state.plan_hash, "hash");
  EXPECT_EQ(walk.state.stage, "stage");
  EXPECT_EQ(walk.state.progress.touches_left, 4);
  EXPECT_EQ(walk.timeout_s(), std::chrono::duration<double>(timeouts.connecting).count());
  walk.on(EventKind::kLinks);
  walk.the<Rereference>();
  EXPECT_EQ(walk.timeout_s(), std::chrono::duration<double>(timeouts.referencing).count());
  walk.on(EventKind::kLinks);
  EXPECT_EQ(walk.the<FindRoute>().next, 0u);
  EXPECT_EQ(walk.timeout_s(), 300.0);

  walk.on(EventKind::kRouted);
  expect_move(walk, MoveKind::kTransit, 0.10, 0.0, 2 * kWaypointS);
  expect_vias(walk, {{0.05, 0.1, 0.2}});
  walk.on(EventKind::kArrived);
  expect_arming(walk, 1, 4700);  // one and a half times 18 mm at 10 mm/s, and 2 s
  walk.on(EventKind::kArmed);
  expect_move(walk, MoveKind::kSearch, 0.118, 1.8, 3 * 1.8 + 10);

  walk.contact(0.110, 0.1102);
  EXPECT_EQ(walk.the<RecordReading>().touch, 0u);
  EXPECT_EQ(walk.the<RecordReading>().number, 0);
  const Reading& first = walk.the<RecordReading>().reading;
  EXPECT_FALSE(first.slow);
  EXPECT_NEAR(first.along_m, 0.010, 1e-12);
  EXPECT_EQ(first.contact_rad, (drivers::AxisAngles{0.110}));
  EXPECT_EQ(first.settled_rad, (drivers::AxisAngles{0.1102}));
  EXPECT_EQ(first.time_sigma_s, 2e-5);
  EXPECT_EQ(first.reaction_s, 0.003);
  EXPECT_EQ(first.bounces, 6);
  EXPECT_EQ(first.utc, "2026-01-02T03:04:05.000Z");
  expect_move(walk, MoveKind::kRetreat, 0.109, 0.1, 3 * 0.1 + 10);
  walk.on(EventKind::kArrived);
  expect_arming(walk, 2, 3500);  // from 9 mm to 13 mm at 4 mm/s
  walk.on(EventKind::kArmed);
  expect_move(walk, MoveKind::kSearch, 0.113, 1.0, 3 * 1.0 + 10);
  walk.contact(0.11, 0.11005);
  EXPECT_EQ(walk.the<RecordReading>().number, 1);
  EXPECT_TRUE(walk.the<RecordReading>().reading.slow);
  expect_move(walk, MoveKind::kRetreat, 0.1094, 0.06, 3 * 0.06 + 10);
  walk.on(EventKind::kArrived);
  expect_arming(walk, 3, 3350);
  walk.on(EventKind::kArmed);
  expect_move(walk, MoveKind::kSearch, 0.113, 0.9, 3 * 0.9 + 10);
  walk.contact(0.11002, 0.1101);
  EXPECT_EQ(walk.state.phase, Phase::kRecording);
  EXPECT_EQ(walk.the<RecordReading>().number, 2);
  EXPECT_EQ(walk.the<RecordTouch>().index, 0u);
  EXPECT_NEAR(walk.the<RecordTouch>().touch.joint_rad.at(0), 0.11001, 1e-12);
  EXPECT_EQ(walk.the<RecordTouch>().touch.speed_m_s, TouchPolicy().slow_m_s);
  EXPECT_EQ(walk.the<RecordTouch>().touch.readings, 2);
  EXPECT_EQ(walk.timeout_s(), 10.0);

  walk.on(EventKind::kRecorded);
  walk.the<Assess>();
  expect_move(walk, MoveKind::kRetreat, 0.20, 0.0, 3 * kWaypointS);
  expect_vias(walk, {{0.09, 0.15, 0.25}, {0.15, 0.1, 0.2}});
  EXPECT_EQ(walk.state.done, 1u);
  EXPECT_EQ(walk.state.at_hand(), &walk.state.plan->touches[0]) << "the arm leaves it";
  EXPECT_FALSE(walk.state.first);
  EXPECT_TRUE(walk.state.slow.empty());

  // The second one, and the return.
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.state.at_hand(), &walk.state.plan->touches[1]);
  walk.on(EventKind::kArmed);
  expect_move(walk, MoveKind::kSearch, 0.218, 1.8, 3 * 1.8 + 10);
  walk.contact(0.21, 0.2102);
  for (int i = 0; i < 2; ++i) {
    walk.on(EventKind::kArrived);
    walk.on(EventKind::kArmed);
    walk.contact(0.21, 0.2102);
  }
  EXPECT_EQ(walk.the<RecordTouch>().index, 1u);
  walk.on(EventKind::kRecorded);
  walk.the<Assess>();
  expect_move(walk, MoveKind::kRetreat, 0.19, 0.0, kWaypointS);
  expect_vias(walk, {});
  walk.on(EventKind::kArrived);
  expect_move(walk, MoveKind::kTransit, 0.05, 0.0, kWaypointS);
  EXPECT_EQ(walk.state.phase, Phase::kReturning);
  walk.on(EventKind::kArrived);
  expect_move(walk, MoveKind::kTransit, 0.0, 0.0, kWaypointS);
  walk.on(EventKind::kArrived);
  walk.the<CloseDevices>();
  walk.the<Identify>();
  EXPECT_EQ(walk.timeout_s(), 300.0);
  const auto result = std::make_shared<const SessionResult>();
  walk.on(EventKind::kIdentified,
          [&](Event& event) { std::get<Identified>(event.evidence).result = result; });
  EXPECT_EQ(walk.the<WriteReport>().result, result);
  EXPECT_EQ(walk.state.result, result);
  EXPECT_EQ(walk.timeout_s(), 60.0);
  walk.on(EventKind::kReported);
  EXPECT_EQ(walk.the<RecordEnd>().ending, Ending::kDone);
  EXPECT_EQ(walk.the<RecordEnd>().failure, "");
  EXPECT_EQ(walk.the<RecordEnd>().result, result) << "its outcome is recorded with its end";
  EXPECT_EQ(walk.timeout_s(), 10.0);
  walk.on(EventKind::kRecorded);
  EXPECT_EQ(walk.state.phase, Phase::kDone);
  EXPECT_FALSE(walk.state.deadline);
}

TEST(AWalk, OfMoreWaypointsThanAMoveHasIsMadeInSeveral) {
  Walk walk;
  constexpr std::size_t kWaypoints = 2 * drivers::kMaxVias + 5;
  for (calib::PlannedTouch& touch : walk.plan->touches) {
    const double standoff = touch.standoff.at(0);
    touch.transit.clear();
    for (std::size_t k = 1; k <= kWaypoints; ++k)
      touch.transit.push_back({standoff - 0.05 + 0.05 * static_cast<double>(k) / kWaypoints});
    touch.corners.resize(3);  // it stops at the others
  }
  const auto follow = [&](double from, double to) {
    double at = from;
    while (walk.state.phase != Phase::kArmingFast) {
      const drivers::Move& move = walk.the<BeginMove>().move;
      for (const drivers::Via& via : move.via) {
        EXPECT_GT(via.at_rad.at(0), at);
        at = via.at_rad.at(0);
      }
      EXPECT_GT(move.target_rad.at(0), at);
      at = move.target_rad.at(0);
      ASSERT_NE(walk.on(EventKind::kArrived).state.phase, Phase::kFailed);
    }
    EXPECT_NEAR(at, to, 1e-12);
  };
  walk.to_routing();
  walk.on(EventKind::kRouted);
  follow(0.05, 0.10);
  walk.on(EventKind::kArmed);
  for (int i = 0; i < 3; ++i) {
    walk.contact(0.11, 0.1102);
    if (i == 2) break;
    walk.on(EventKind::kArrived);
    walk.on(EventKind::kArmed);
  }
  walk.on(EventKind::kRecorded);
  EXPECT_EQ(walk.the<BeginMove>().move.kind, MoveKind::kRetreat);
  EXPECT_EQ(walk.the<BeginMove>().move.via.size(), drivers::kMaxVias);
  follow(0.08, 0.20);
}

TEST(AWalk, WithoutWaypointsLeadsToTheStandoffAndWithoutAWayHomeToTheEnd) {
  Walk walk(1);
  walk.plan->touches[0].transit.clear();
  walk.plan->home.clear();
  walk.to_routing();
  walk.on(EventKind::kRouted);
  expect_move(walk, MoveKind::kTransit, 0.10, 0.0, kWaypointS);
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.state.phase, Phase::kArmingFast);
  walk.on(EventKind::kArmed);
  for (int i = 0; i < 2; ++i) {
    walk.to_next_search();
  }
  walk.contact(0.11, 0.1102);
  walk.on(EventKind::kRecorded);
  walk.on(EventKind::kArrived);
  EXPECT_EQ(walk.state.phase, Phase::kIdentifying);
}

TEST(AWalk, WithEveryTouchOnDiskOpensNoDevice) {
  Walk walk;
  walk.state.done = 2;
  walk.on(EventKind::kRun);
  walk.on(EventKind::kPlanned);
  EXPECT_EQ(walk.find<OpenDevices>(), nullptr);
  walk.the<Identify>();
  EXPECT_EQ(walk.state.plan, walk.plan);
  EXPECT_EQ(walk.state.plan_hash, "hash");
  EXPECT_EQ(walk.state.stage, "stage");
  EXPECT_EQ(walk.state.progress.touches_left, 4);
  Walk one_left;
  one_left.state.done = 1;
  one_left.on(EventKind::kRun);
  one_left.on(EventKind::kPlanned);
  one_left.the<OpenDevices>();
}

TEST(AWalk, WithAnotherPlanThanTheStoredOneIsNone) {
  for (const bool same : {true, false}) {
    Walk walk;
    walk.state.expected_hash = same ? "hash" : "other";
    walk.on(EventKind::kRun);
    walk.on(EventKind::kPlanned);
    EXPECT_EQ(walk.state.phase, same ? Phase::kConnecting : Phase::kFailed);
  }
}

TEST(AWalk, WaitsForBothLinks) {
  const auto with = [](drivers::RobotLink robot, drivers::ContactLink contact) {
    Walk walk;
    walk.on(EventKind::kRun);
    walk.on(EventKind::kPlanned);
    walk.on(EventKind::kLinks, [=](Event& event) {
      links(event).robot = robot;
      links(event).contact = contact;
    });
    return walk.state.phase;
  };
  using R = drivers::RobotLink;
  using C = drivers::ContactLink;
  EXPECT_EQ(with(R::kNotReferenced, C::kReady), Phase::kReferencing);
  EXPECT_EQ(with(R::kLost, C::kReady), Phase::kConnecting);
  EXPECT_EQ(with(R::kDown, C::kReady), Phase::kConnecting);
  EXPECT_EQ(with(R::kReady, C::kIdentifying), Phase::kConnecting);
  EXPECT_EQ(with(R::kReady, C::kDown), Phase::kConnecting) << "it has not come up yet";
  EXPECT_EQ(with(R::kReady, C::kFault), Phase::kFailed);
}

TEST(AWalk, TakesALinkThatGoesDownWhileItStandsForLost) {
  const auto after = [](const std::function<void(Event&)>& change) {
    Walk walk;
    walk.to_arming();
    walk.on(EventKind::kLinks, change);
    return walk.state;
  };
  EXPECT_EQ(after([](Event& e) { links(e).robot = drivers::RobotLink::kLost; }).failure->kind,
            FailureKind::kRobotSilent);
  EXPECT_EQ(after([](Event& e) { links(e).robot = drivers::RobotLink::kDown; }).failure->kind,
            FailureKind::kRobotSilent);
  const State unplugged = after([](Event& e) {
    links(e).contact = drivers::ContactLink::kDown;
    links(e).contact_words = "unplugged";
  });
  EXPECT_EQ(unplugged.failure->kind, FailureKind::kContactSilent);
  EXPECT_EQ(unplugged.failure->by, drivers::Interruption::kOther);
  EXPECT_NE(words(unplugged.failure->detail).find(": unplugged."), std::string::npos)
      << words(unplugged.failure->detail);
  EXPECT_EQ(after([](Event& e) { links(e).contact = drivers::ContactLink::kFault; }).failure->kind,
            FailureKind::kContactFault);
  const State silent = after([](Event& e) {
    links(e).contact = drivers::ContactLink::kFault;
    links(e).fault = drivers::ContactFault::kSilent;
  });
  EXPECT_EQ(silent.failure->kind, FailureKind::kContactSilent);
  EXPECT_EQ(silent.failure->by, drivers::Interruption::kPacketsStopped);
  EXPECT_FALSE(
      after([](Event& e) { links(e).contact = drivers::ContactLink::kIdentifying; }).failure);
}

TEST(AWalk, ResumedInContactLeavesItFirstAndLetsTheSensorProveItself) {
  const auto touching = [](bool guards) {
    return [=](Event& event) {
      links(event).in_contact = true;
      links(event).contact = drivers::ContactLink::kIdentifying;
      links(event).can_guard_retreat = guards;
      links(event).self_test_ok = false;
    };
  };
  Walk walk;
  walk.state.resumed = true;
  walk.on(EventKind::kRun);
  walk.on(EventKind::kPlanned);
  walk.on(EventKind::kLinks, touching(false));
  EXPECT_EQ(walk.state.phase, Phase::kConnecting);
  walk.on(EventKind::kLinks, [&](Event& event) {
    touching(true)(event);
    links(event).robot = drivers::RobotLink::kLost;
  });
  EXPECT_EQ(walk.state.phase, Phase::kConnecting);
  walk.on(EventKind::kLinks, touching(true));
  EXPECT_EQ(walk.state.phase, Phase::kReferencing);
  walk.on(EventKind::kLinks, touching(true));
  EXPECT_EQ(walk.state.phase, Phase::kRouting);
  EXPECT_TRUE(walk.state.routed_in_contact);
  walk.on(EventKind::kRouted);
  EXPECT_EQ(walk.state.phase, Phase::kFreeing);
  EXPECT_EQ(walk.state.stage, "stage");
  expect_move(walk, MoveKind::kRetreat, 0.05, 0.0, kWaypointS);
  walk.on(EventKind::kArrived);
  walk.the<SelfTest>();
  EXPECT_EQ(walk.timeout_s(), std::chrono::duration<double>(Timeouts{}.proving).count());
  walk.on(EventKind::kLinks, touching(true));
  EXPECT_EQ(walk.state.phase, Phase::kProving);
  walk.on(EventKind::kLinks, [](Event& event) { links(event).self_test_ok = false; });
  EXPECT_EQ(walk.state.phase, Phase::kProving) << "the test still runs";
  EXPECT_EQ(walk.find<BeginMove>(), nullptr);
  walk.on(EventKind::kLinks);
  expect_move(walk, MoveKind::kTransit, 0.10, 0.0, kWaypointS);
  // If the first waypoint is the stand-off, it is armed there.
  Walk near;
  near.plan->touches[0].transit = {{0.1}};
  near.state.resumed = true;
  near.on(EventKind::kRun);
  near.on(EventKind::kPlanned);
  near.on(EventKind::kLinks, touching(true));
  near.on(EventKind::kLinks, touching(true));
  near.on(EventKind::kRouted);
  near.on(EventKind::kArrived);
  near.on(EventKind::kLinks);
  EXPECT_EQ(near.state.phase, Phase::kArmingFast);
  // In contact a session begins only if it is resumed, and only with the requested retreat path.
  Walk fresh;
  fresh.on(EventKind::kRun);
  fresh.on(EventKind::kPlanned);
  fresh.on(EventKind::kLinks, touching(true));
  EXPECT_EQ(fresh.state.failure->kind, FailureKind::kContactClosed);
  Walk closed;
  closed.state.resumed = true;
  closed.to_routing();
  closed.on(EventKind::kLinks, touching(true));
  closed.on(EventKind::kRouted);
  EXPECT_EQ(closed.state.failure->kind, FailureKind::kContactClosed);
}

TEST(ASession, ThatWasNotResumedLeavesAContactOfAnEarlierSearchAndNoneOnTheWayThere) {
  const auto begun_at = [](double at_rad) {
    Walk walk;
    walk.state.left = std::make_shared<const calib::SearchUnderWay>(
        calib::SearchUnderWay{"S1", {{0.0}, {1.0}}, {1.2}, {{0.9}, {0.0}}});
    walk.on(EventKind::kRun);
    walk.on(EventKind::kPlanned);
    walk.on(EventKind::kLinks, [&](Event& event) {
      links(event).contact = drivers::ContactLink::kIdentifying;
      links(event).in_contact = links(event).can_guard_retreat = true;
      links(event).actual_rad = {at_rad};
    });
    return walk.state;
  };
  EXPECT_EQ(begun_at(1.1).phase, Phase::kReferencing);
  const State refused = begun_at(0.5);
  ASSERT_TRUE(refused.failure);
  EXPECT_EQ(refused.failure->kind, FailureKind::kContactClosed);
}

TEST(AnArming, OutlivesItsSearchWithinWhatTheWireCanSay) {
  Walk walk;
  walk.state.policy.fast_m_s = 0.018 / 57.9;
  walk.to_arming();
  expect_arming(walk, 1, 60'000);
  Walk wraps;
  wraps.state.arm_id = 65535;
  wraps.to_arming();
  EXPECT_EQ(wraps.the<ArmSensor>().arm_id, 1);
}

TEST(AnArming, OfASearchThatWouldOutlastItIsRefusedBeforeTheSearch) {
  Walk walk;
  walk.state.policy.fast_m_s = 0.018 / 58.1;
  walk.to_arming();
  EXPECT_EQ(walk.find<ArmSensor>(), nullptr);
  EXPECT_EQ(walk.timeout_s(), 0.0);
  walk.on(EventKind::kDeadline);
  EXPECT_EQ(walk.state.failure->kind, FailureKind::kArmRefused);
  EXPECT_NE(
      words(walk.state.failure->detail).find("58 s for a search of 18 mm: the contact sensor"),
      std::string::npos);
  EXPECT_EQ(walk.find<BeginMove>(), nullptr);
}

TEST(AnArming, OfASearchThatTheOverrideSlowsIsLongerAndRefusedByTheOverride) {
  const auto at = [](int percent, bool slows) {
    Walk walk;
    walk.to_routing();
    walk.on(EventKind::kLinks, [=](Event& event) {
      links(event).override_percent = percent;
      links(event).override_slows = slows;
    });
    walk.on(EventKind::kRouted);
    walk.on(EventKind::kArrived);
    return walk;
  };
  expect_arming(at(10, false), 1, 4700);
  Walk slowed = at(10, true);  // 18 s
  expect_arming(slowed, 1, 29'000);
  slowed.on(EventKind::kArmed);
  expect_move(slowed, MoveKind::kSearch, 0.118, 1.8, 64.0);
  slowed.contact(0.110, 0.1102);
  expect_move(slowed, MoveKind::kRetreat, 0.109, 0.1, 13.0);
  Walk refused = at(3, true);
  EXPECT_EQ(refused.find<ArmSensor>(), nullptr);
  refused.on(EventKind::kDeadline);
  EXPECT_EQ(refused.state.failure->kind, FailureKind::kArmRefused);
  const std::string said = words(refused.state.failure->detail);
  EXPECT_NE(
      said.find("60 s for a search of 18 mm at override 3 %: the contact sensor stays armed for "
                "60 s at most. Set the override to 4 % or more"),
      std::string::npos)
      << said;
}

TEST(AnArming, ThatIsRefusedOnceIsAskedForAgainAfterASelfTest) {
  for (const bool slow : {false, true}) {
    Walk walk;
    if (slow) walk.to_slow_search();
    if (slow) walk.contact(0.1105, 0.111);
    if (slow) walk.on(EventKind::kArrived);
    if (!slow) walk.to_arming();
    const auto lifetime = walk.the<ArmSensor>().lifetime;
    const std::uint16_t id = walk.state.arm_id;
    // Reports of a passed self-test while the answer is pending refer to an earlier one.
    walk.on(EventKind::kLinks);
    EXPECT_EQ(walk.find<ArmSensor>(), nullptr);
    walk.on(EventKind::kArmRefused);
    walk.the<SelfTest>();
    EXPECT_EQ(walk.timeout_s(), 2.0);
    walk.on(EventKind::kLinks, [](Event& event) { links(event).self_test_ok = false; });
    EXPECT_EQ(walk.find<ArmSensor>(), nullptr);
    walk.on(EventKind::kLinks,
            [](Event& event) { links(event).contact = drivers::ContactLink::kIdentifying; });
    EXPECT_EQ(walk.find<ArmSensor>(), nullptr);
    walk.on(EventKind::kLinks);
    EXPECT_EQ(walk.the<ArmSensor>().arm_id, id + 1);
    EXPECT_EQ(walk.the<ArmSensor>().lifetime, lifetime);
    walk.on(EventKind::kArmRefused);
    EXPECT_EQ(walk.state.failure->kind, FailureKind::kArmRefused);
    EXPECT_EQ(walk.find<BeginMove>(), nullptr);
  }
}

TEST(AnArming, OfTheNextSearchMayBeRefusedOnceAgain) {
  Walk walk;
  walk.to_arming();
  walk.on(EventKind::kArmRefused);
  walk.on(EventKind::kLinks);
  walk.on(EventKind::kArmed);
  walk.contact(0.11, 0.1102);
  walk.on(EventKind::kArrived);
  walk.on(EventKind::kArmRefused);
  walk.the<SelfTest>();
  EXPECT_FALSE(walk.state.failure);
}

TEST(AContact, LeadsBackFromWhereItWasOrFromWhereTheArmRests) {
  Walk ahead;
  ahead.to_fast_search();
  ahead.contact(0.115, 0.1102);  // reported 5 mm ahead of the arm's position
  expect_move(ahead, MoveKind::kRetreat, 0.1092, 0.1, 10.3);
  Walk early;
  early.state.policy.back_off_m = 0.02;
  early.to_fast_search();
  early.contact(0.11, 0.1102);
  expect_move(early, MoveKind::kRetreat, 0.10, 2.0, 16.0);  // not beyond the stand-off
}

TEST(AContact, CountsFromAMillimetreOfTravelOn) {
  for (const double along_m : {0.00101, 0.00099, std::nan("")}) {
    Walk walk;
    walk.to_fast_search();
    walk.contact(0.1 + along_m, 0.1 + along_m);
    EXPECT_EQ(walk.state.phase, along_m > 0.001 ? Phase::kBackingOff : Phase::kFailed) << along_m;
    if (!walk.state.failure) continue;
    EXPECT_EQ(walk.state.failure->kind, FailureKind::kContactTooEarly);
  }
}

TEST(AContact, WithoutAnglesIsNoTouch) {
  Walk walk;
  walk.to_slow_search();
  walk.on(EventKind::kContact);
  EXPECT_EQ(walk.state.failure->kind, FailureKind::kReadingsDisagree);
}

TEST(Readings, ThatDisagreeAreRepeatedFiveTimes) {
  Walk walk;
  walk.to_slow_search();
  for (int i = 1; i <= 5; ++i) {
    walk.contact(0.110 + 1e-4 * i, 0.112);
    if (i == 5) break;
    EXPECT_EQ(walk.the<RecordReading>().number, i);
    walk.on(EventKind::kArrived);
    walk.on(EventKind::kArmed);
  }
  EXPECT_EQ(walk.state.failure->kind, FailureKind::kReadingsDisagree);
}

TEST(Noise, IsBackedOffFromFiveTimesAndCounted) {
  Walk walk;
  walk.to_fast_search();
  const auto revoked = [](Event& event) { move(event).at_rad = {0.105}; };
  for (int i = 1; i <= 5; ++i) {
    walk.on(EventKind::kRevoked, revoked);
    EXPECT_EQ(walk.state.revoked, i);
    EXPECT_EQ(walk.state.total_revoked, static_cast<std::uint64_t>(i));
    expect_move(walk, MoveKind::kRetreat, 0.104, 0.1, 10.3);
    walk.on(EventKind::kArrived);
    EXPECT_EQ(walk.state.phase, Phase::kArmingFast);
    expect_arming(walk, static_cast<std::uint16_t>(1 + i), 4100);  // 14 mm remain
    walk.on(EventKind::kArmed);
    expect_move(walk, MoveKind::kSearch, 0.118, 1.4, 14.2);
  }
  walk.on(EventKind::kRevoked, revoked);
  EXPECT_EQ(walk.state.failure->kind, FailureKind::kTooManyRevoked);
}

TEST(ASearch, ThatMeetsNothingAsksTheSensorFirst) {
  Walk walk;
  walk.to_fast_search();
  walk.on(EventKind::kArrived);
  ASSERT_EQ(walk.actions.size(), 2u);
  EXPECT_TRUE(std::holds_alternative<Disarm>(walk.actions[0])) << "armed it would not test itself";
  EXPECT_TRUE(std::holds_alternative<SelfTest>(walk.actions[1]));
  EXPECT_TRUE(walk.state.missed);
  walk.on(EventKind::kLinks, [](Event& event) { links(event).self_test_ok = false; });
  EXPECT_EQ(walk.state.phase, Phase::kProving);
  walk.on(EventKind::kLinks, [](Event& event) { links(event).in_contact = true; });
  EXPECT_EQ(walk.state.phase, Phase::kProving);
  walk.on(EventKind::kLinks);
  EXPECT_EQ(walk.state.failure->kind, FailureKind::kNoContact);
  Walk slow;
  slow.to_slow_search();
  slow.on(EventKind::kArrived);
  slow.on(EventKind::kLinks);
  EXPECT_EQ(slow.state.failure->kind, FailureKind::kReadingsDisagree);
}

TEST(AnEnd, StopsWhatMovesAndWaitsFiveSecondsForItsRest) {
  Walk walk;
  walk.to_fast_search();
  walk.on(EventKind::kAbort);
  walk.the<StopArm>();
  EXPECT_EQ(walk.state.phase, Phase::kStopping);
  EXPECT_EQ(walk.timeout_s(), 5.0);
  walk.on(EventKind::kStopped);
  walk.the<CloseDevices>();
  EXPECT_EQ(walk.the<RecordEnd>().ending, Ending::kAborted);
  EXPECT_FALSE(walk.the<RecordEnd>().why);
  Walk late;
  late.to_fast_search();
  late.on(EventKind::kDeadline);
  late.the<StopArm>();
  EXPECT_EQ(late.timeout_s(), 5.0);
  EXPECT_EQ(late.state.failure->kind, FailureKind::kTimeout);
  late.on(EventKind::kDeadline);
  EXPECT_EQ(late.state.failure->kind, FailureKind::kStopUnconfirmed);
  EXPECT_NE(words(late.state.failure->detail).find("before that"), std::string::npos);
  EXPECT_EQ(late.the<RecordEnd>().failure, describe(*late.state.failure));
  EXPECT_EQ(late.the<RecordEnd>().ending, Ending::kFailed);
}

TEST(AnEnd, ByTheDaemonItselfIsRecordedWithItsCauseUnlessAPersonAborted) {
  for (const bool by_person : {false, true}) {
    Walk walk;
    walk.to_fast_search();
    const auto abort = [&](std::optional<FailureKind> why) {
      walk.on(EventKind::kAbort, [&](Event& event) { event.evidence = Aborted{why}; });
    };
    abort(FailureKind::kWindowOver);
    if (by_person) abort({});
    abort(FailureKind::kDaemonStopped);
    walk.on(EventKind::kStopped);
    EXPECT_EQ(walk.state.phase, Phase::kAborted);
    const RecordEnd end = walk.the<RecordEnd>();
    EXPECT_EQ(end.why.has_value(), !by_person);
    if (!by_person) {
      EXPECT_EQ(end.why->kind, FailureKind::kWindowOver);
    }
    EXPECT_EQ(walk.state.failure, end.why);
  }
}

TEST(AnEnd, ThatNobodyThoughtOfStopsTheArmWhereverItMayBe) {
  Walk moving;
  moving.to_fast_search();
  moving.on(EventKind::kRecorded);
  EXPECT_EQ(moving.state.phase, Phase::kStopping);
  moving.the<StopArm>();
  EXPECT_EQ(moving.timeout_s(), 5.0);
  Walk standing;
  standing.to_arming();
  standing.on(EventKind::kRecorded);
  EXPECT_EQ(standing.state.phase, Phase::kFailed);
  standing.the<StopArm>();
  EXPECT_FALSE(standing.state.deadline);
  Walk rested;  // the result of a move: at rest
  rested.to_fast_search();
  rested.on(EventKind::kArmed);
  EXPECT_EQ(rested.state.phase, Phase::kStopping);
}

TEST(AnEnd, KeepsItsCauseWhereTheJournalFailsWhileTheArmStops) {
  Walk walk;
  walk.to_fast_search();
  walk.on(EventKind::kDeviceFailed);
  ASSERT_EQ(walk.state.phase, Phase::kStopping);
  walk.on(EventKind::kJournalFailed);
  EXPECT_EQ(walk.state.phase, Phase::kStopping) << "rest is not confirmed yet";
  walk.on(EventKind::kStopped);
  EXPECT_EQ(walk.state.phase, Phase::kFailed);
  EXPECT_EQ(walk.state.failure->kind, FailureKind::kDevice);
}

TEST(AContactClosedWhileAPathIsPlanned, IsNamedByTheSensor) {
  Walk walk;
  walk.to_routing();
  walk.on(EventKind::kLinks, [](Event& event) {
    links(event).in_contact = true;
    links(event).contact_words = "in contact for 2 s";
  });
  walk.on(EventKind::kRouted);
  ASSERT_EQ(walk.state.phase, Phase::kFailed);
  EXPECT_EQ(walk.state.failure->kind, FailureKind::kContactClosed);
  EXPECT_NE(words(walk.state.failure->detail).find("In contact for 2 s"), std::string::npos)
      << words(walk.state.failure->detail);
}

TEST(WhatIsKnown, IsKeptOfLinksAndAssessmentsAndChangesNoDeadline) {
  Walk walk;
  walk.to_fast_search();
  const auto deadline = walk.state.deadline;
  walk.on(EventKind::kAssessed, [](Event& event) { assessed(event).residual_m = 0.001; });
  EXPECT_EQ(walk.state.residual_m, 0.001);
  walk.on(EventKind::kLinks, [](Event& event) { links(event).contact_words = "words"; });
  EXPECT_EQ(walk.state.links.contact_words, "words");
  walk.on(EventKind::kRun);
  EXPECT_EQ(walk.state.links.contact_words, "words");
  EXPECT_EQ(walk.state.residual_m, 0.001);
  EXPECT_EQ(walk.state.deadline, deadline);
}

}  // namespace
}  // namespace cellcal::daemon::testing
