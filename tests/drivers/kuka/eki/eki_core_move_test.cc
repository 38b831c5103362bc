// Moves other than searches.

#include <algorithm>
#include <cmath>

#include "tests/drivers/kuka/eki/eki_rig.h"

namespace cellcal::drivers {
namespace {

TEST(EkiMove, ArrivesWhereItWasSent) {
  EkiRig rig;
  rig.make_ready();
  AxisAngles target = rig.actual();
  for (std::size_t i = 0; i < 6; ++i) target[i] += (i % 2 == 0 ? 7.5 : -12.25) * kEkiDeg;
  const CoreResult result = rig.move(MoveKind::kTransit, target);
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_TRUE(is<cause::None>(result.cause)) << words(result);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(result.at_rad[i], target[i], 1e-5);
  EXPECT_FALSE(result.latch.has_value());
}

TEST(EkiMove, GoesNoFasterThanItsLimits) {
  EkiRig rig;
  rig.make_ready();
  double fastest = 0.0, last = rig.true_deg();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 90));
  rig.run_until([&] {
    fastest = std::max(fastest, (rig.true_deg() - last) / 0.004);
    last = rig.true_deg();
    return rig.core.next_result().has_value();
  });
  EXPECT_LE(fastest, 100.01);
  EXPECT_GT(fastest, 90.0);
}

TEST(EkiMove, IsCheckedBeforeAnythingIsSent) {
  EkiRig rig;
  rig.make_ready();
  AxisAngles nan = rig.actual();
  nan[2] = std::nan("");
  const std::pair<Cause, Move> wrong[] = {
      {cause::AboveLimit{}, {1, MoveKind::kTransit, rig.moved_by(0, 190), 0.0, 0}},
      {cause::BelowLimit{}, {1, MoveKind::kTransit, rig.moved_by(1, -91), 0.0, 0}},
      {cause::NotFinite{}, {1, MoveKind::kTransit, nan, 0.0, 0}},
      {cause::AxisCount{}, {1, MoveKind::kTransit, AxisAngles(3, 0.0), 0.0, 0}},
      {cause::BadCruise{}, {1, MoveKind::kTransit, rig.moved_by(0, 1), -1.0, 0}},
  };
  for (const auto& [kind, move] : wrong) {
    rig.last_id = 1;
    rig.core.begin(move);
    const CoreResult result = rig.finish();
    EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
    EXPECT_EQ(result.cause.index(), kind.index()) << words(result);
  }
  EXPECT_EQ(rig.written.find("Type=\"3\""), std::string::npos);
}

/// Via 20 deg of A1, and 20 deg of A3, to 10 deg of A1 less.
Move by_way_points(EkiRig& rig, MoveKind kind = MoveKind::kTransit) {
  Move move{++rig.last_id, kind, rig.actual(), 0.0, 0};
  AxisAngles via = rig.actual();
  via[0] += 20 * kEkiDeg;
  move.via.push_back({via, 0.5, 0.5});
  via[2] += 20 * kEkiDeg;
  move.via.push_back({via, 0.5, 0.5});
  via[0] -= 10 * kEkiDeg;
  move.target_rad = via;
  return move;
}

TEST(EkiWayPoints, AreVisitedOneAfterTheOtherInOneMove) {
  EkiRig rig;
  rig.make_ready();
  const Move move = by_way_points(rig);
  rig.core.begin(move);
  std::vector<double> nearest(2, HUGE_VAL);
  std::optional<CoreResult> result;
  rig.run_until([&] {
    const std::vector<double> at = rig.krc.actual_rad_at(rig.now);
    for (std::size_t v = 0; v < 2; ++v) {
      double off = 0.0;
      for (std::size_t i = 0; i < 6; ++i)
        off = std::max(off, std::abs(at[i] - move.via[v].at_rad[i]));
      nearest[v] = std::min(nearest[v], off);
    }
    result = rig.core.next_result();
    return result.has_value();
  });
  ASSERT_TRUE(result);
  EXPECT_EQ(result->outcome, MoveOutcome::kArrived) << words(*result);
  EXPECT_EQ(result->id, move.id);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(result->at_rad[i], move.target_rad[i], 1e-5);
  for (const double off : nearest) EXPECT_LT(off, 0.05 * kEkiDeg);
  EXPECT_EQ(rig.krc.moves(), 3u);
  rig.run(1s);
  EXPECT_FALSE(rig.core.next_result()) << "one move, one result";
}

TEST(EkiWayPoints, AStopOnALaterLegIsTheEndOfAllOfThem) {
  for (const auto after : {200ms, 500ms, 900ms}) {
    EkiRig rig;
    rig.make_ready();
    const Move move = by_way_points(rig);
    rig.core.begin(move);
    rig.run(after);
    rig.core.stop();
    const CoreResult result = rig.finish();
    EXPECT_EQ(result.outcome, MoveOutcome::kStopped) << words(result);
    const auto moves = rig.krc.moves();
    EXPECT_LE(moves, 3u);
    rig.run(1s);
    EXPECT_EQ(rig.krc.moves(), moves);
    EXPECT_TRUE(rig.krc.at_rest());
    EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, -5)).outcome, MoveOutcome::kArrived);
  }
}

TEST(EkiWayPoints, AllOfThemAreCheckedBeforeAnythingIsSent) {
  EkiRig rig;
  rig.make_ready();
  Move beyond = by_way_points(rig);
  beyond.via[1].at_rad[1] = 70 * kEkiDeg;
  rig.core.begin(beyond);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  const auto* why = std::get_if<cause::AboveLimit>(&result.cause);
  ASSERT_NE(why, nullptr) << words(result);
  EXPECT_EQ(why->via, 2);
  rig.core.begin(by_way_points(rig, MoveKind::kSearch));
  EXPECT_TRUE(is<cause::SearchByWayPoints>(rig.finish().cause));
  EXPECT_EQ(rig.written.find("Type=\"3\""), std::string::npos);
}

TEST(EkiWayPoints, ATouchOnTheSecondLegStopsIt) {
  EkiRig rig;
  rig.make_ready();
  const Move move = by_way_points(rig);
  rig.core.begin(move);
  ASSERT_TRUE(rig.run_until(
      [&] { return rig.krc.actual_rad_at(rig.now)[2] > move.via[0].at_rad[2] + 2 * kEkiDeg; }));
  rig.guard.touch(true);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kUnexpectedContact) << words(result);
  EXPECT_LT(result.at_rad[2], move.via[1].at_rad[2]);
  EXPECT_EQ(rig.krc.moves(), 2u);
}

TEST(EkiWayPoints, TheInputStopsARetreatFromItsSecondLegOn) {
  for (const int leg : {2, 3}) {
    EkiRig rig;
    rig.make_ready();
    rig.krc.input(rig.now, true);
    rig.guard.touch(true);
    const Move move = by_way_points(rig, MoveKind::kRetreat);
    rig.core.begin(move);
    rig.run(200ms);
    ASSERT_FALSE(rig.krc.at_rest()) << "it begins in contact";
    rig.krc.input(rig.now, false);
    rig.guard.touch(false);
    ASSERT_TRUE(rig.run_until([&] { return rig.krc.moves() == static_cast<unsigned>(leg); }));
    rig.run(200ms);
    rig.krc.input(rig.now, true);  // the sensor says nothing
    const CoreResult result = rig.finish();
    EXPECT_EQ(result.outcome, MoveOutcome::kUnexpectedContact) << leg << words(result);
    EXPECT_EQ(rig.krc.moves(), static_cast<unsigned>(leg));
  }
}

TEST(EkiWayPoints, ARetreatStillInContactAfterItsFirstLegGoesNoFarther) {
  EkiRig rig;
  rig.make_ready();
  rig.guard.touch(true);
  Move move = by_way_points(rig, MoveKind::kRetreat);
  rig.core.begin(move);
  CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kStillInContact) << words(result);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(result.at_rad[i], move.via[0].at_rad[i], 1e-5);
  EXPECT_EQ(rig.krc.moves(), 1u);

  move = by_way_points(rig, MoveKind::kRetreat);
  rig.core.begin(move);
  rig.run(100ms);
  rig.guard.touch(false);
  result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_EQ(rig.krc.moves(), 4u);
}

TEST(EkiMove, IsRefusedWhileAnotherOneRuns) {
  EkiRig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 30));
  rig.run(100ms);
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 5));
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kRefused);
  --rig.last_id;
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kArrived);
}

TEST(EkiMove, StopsWhenAsked) {
  EkiRig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 120));
  rig.run(600ms);
  rig.core.stop();
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kStopped);
  EXPECT_TRUE(rig.krc.at_rest());
  EXPECT_NEAR(result.at_rad[0] / kEkiDeg, rig.true_deg(), 1e-3);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, -5)).outcome, MoveOutcome::kArrived);
}

TEST(EkiMove, StopsAlsoWhereTheStopArrivesUnreadable) {
  EkiRig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 150));
  rig.run(600ms);
  int broken = 0;
  rig.mangle_written = [&](std::string bytes) {
    if (const auto at = bytes.find("Type=\"4\""); at != std::string::npos && broken++ == 0)
      bytes.erase(at + 5, 1);
    return bytes;
  };
  const double asked_deg = rig.true_deg();
  rig.core.stop();
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kStopped);
  EXPECT_GT(broken, 0);
  EXPECT_LT(rig.true_deg() - asked_deg, 40.0);
  EXPECT_EQ(rig.link(), RobotLink::kReady);
}

TEST(EkiMove, StoppedBeforeItWasSentIsNeverSent) {
  EkiRig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 30));
  rig.core.stop();
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kStopped);
  rig.run(1s);
  EXPECT_EQ(rig.krc.moves(), 0u);
}

TEST(EkiMove, WhoseConfirmationIsLostIsAFailureAndCannotBeginLater) {
  EkiRig rig;
  rig.make_ready();
  rig.krc.forgetful(true);
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(0, 30));
  EXPECT_EQ(result.outcome, MoveOutcome::kRobotSilent);
  EXPECT_TRUE(is<cause::CommandNotTaken>(result.cause)) << words(result);
  EXPECT_EQ(rig.link(), RobotLink::kLost);
  EXPECT_FALSE(rig.connected);
  rig.krc.forgetful(false);
  rig.run(1s);
  EXPECT_EQ(rig.krc.moves(), 0u);
}

TEST(EkiMove, SurvivesStatesThatAreLostInBetween) {
  EkiRig rig;
  rig.make_ready();
  int count = 0;
  // Every state repeats all information: nine in ten may be missing.
  rig.mangle = [&](const std::string& bytes) {
    return bytes.empty() || ++count % 10 == 0 ? bytes : std::string();
  };
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 5)).outcome, MoveOutcome::kArrived);
}

TEST(EkiMove, EndsByAnEmergencyStopAndNothingGoesOnAfterwards) {
  EkiRig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 120));
  rig.run(600ms);
  rig.krc.emergency_stop(true);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
  EXPECT_TRUE(is<cause::ProgramAborted>(result.cause)) << words(result);
  EXPECT_EQ(rig.link(), RobotLink::kNotReferenced);
  const double rest = rig.true_deg();
  rig.krc.emergency_stop(false);
  rig.krc.start_program();
  rig.run(2s);
  EXPECT_NEAR(rig.true_deg(), rest, 1e-6);
  rig.reference();
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kArrived);
}

TEST(EkiMove, EndsWhenTheProgramIsCancelledOrTheDrivesDrop) {
  for (const bool drives : {true, false}) {
    EkiRig rig;
    rig.make_ready();
    rig.begin(MoveKind::kTransit, rig.moved_by(0, 120));
    rig.run(600ms);
    if (drives) {
      rig.krc.drives(false);
    } else {
      rig.krc.cancel_program();
    }
    EXPECT_EQ(rig.finish().outcome, MoveOutcome::kNotFollowing);
    EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kRefused);
  }
}

TEST(EkiMove, IsSlowerAtALowerOverrideAndNamedWhenItDoesNotMove) {
  EkiRig rig;
  rig.make_ready();
  rig.krc.set_override(10);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 10)).outcome, MoveOutcome::kArrived);
  rig.krc.set_override(0);
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(0, 10));
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
  ASSERT_TRUE(is<cause::NotMoving>(result.cause)) << words(result);
  EXPECT_EQ(std::get<cause::NotMoving>(result.cause).override_percent, 0);
  rig.krc.set_override(100);
  const double rest = rig.true_deg();
  rig.run(2s);
  EXPECT_NEAR(rig.true_deg(), rest, 0.01) << "it was stopped, not only waited for";
}

TEST(EkiMove, InT1IsSlowAndHoldsWhenTheStartKeyIsReleased) {
  EkiRig rig;
  rig.krc.mode(OperatingMode::kT1);
  rig.krc.start_program();
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 20));
  rig.run(500ms);
  rig.krc.start_key(false);
  rig.run(400ms);
  const double held = rig.true_deg();
  rig.run(400ms);
  EXPECT_NEAR(rig.true_deg(), held, 0.01);
  rig.krc.start_key(true);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kArrived);
}

TEST(EkiMove, HeldByTheStartKeyForTooLongDoesNotGoOnWhenItIsPressedAgain) {
  EkiRig rig;
  rig.krc.mode(OperatingMode::kT1);
  rig.krc.start_program();
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 20));
  rig.run(500ms);
  rig.krc.start_key(false);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kNotFollowing);
  const double held = rig.true_deg();
  rig.krc.start_key(true);
  rig.run(2s);
  EXPECT_NEAR(rig.true_deg(), held, 0.01);
  EXPECT_NE(rig.words().find("Select CELLCAL_EKI"), std::string::npos) << rig.words();
}

TEST(EkiMove, ReportsWhatTheControllerRefuses) {
  sim::EkiControllerConfig controller = eki_controller();
  controller.soft_max_rad.assign(6, 2.0);
  EkiRig rig(controller);
  rig.make_ready();
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(0, 150));
  EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
  EXPECT_TRUE(is<cause::OutsideSoftLimits>(result.cause)) << words(result);
  EXPECT_EQ(rig.krc.moves(), 0u);
}

TEST(EkiMove, IsStoppedByContactInATransitByTheControllerItself) {
  EkiRig rig;
  rig.make_ready();
  rig.wall_rad = 20 * kEkiDeg;
  rig.seen_by_sensor = false;  // only the input
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(0, 90));
  EXPECT_EQ(result.outcome, MoveOutcome::kUnexpectedContact);
  EXPECT_LT(rig.true_deg(), 35.0);
}

TEST(EkiMove, IsStoppedByContactInATransitThatTheSensorAloneSees) {
  EkiRig rig;
  rig.make_ready();
  rig.wall_rad = 20 * kEkiDeg;
  rig.wired_to_input = false;
  const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(0, 90));
  EXPECT_EQ(result.outcome, MoveOutcome::kUnexpectedContact);
  EXPECT_LT(rig.true_deg(), 45.0);
}

TEST(EkiMove, StopsWhenTheSensorFallsSilent) {
  EkiRig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 120));
  rig.run(400ms);
  rig.guard.set_alive(false);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_LT(rig.true_deg(), 90.0);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kContactSilent);
}

TEST(EkiMove, ARetreatEndsOpenOrSaysThatItDoesNot) {
  EkiRig rig;
  rig.make_ready();
  rig.guard.touch(true);
  rig.krc.input(rig.now, true);
  CoreResult result = rig.move(MoveKind::kRetreat, rig.moved_by(0, -1), 0.5);
  EXPECT_EQ(result.outcome, MoveOutcome::kStillInContact);
  rig.begin(MoveKind::kRetreat, rig.moved_by(0, -1), 0.5);
  rig.run(200ms);
  rig.guard.touch(false);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kArrived);
}

}  // namespace
}  // namespace cellcal::drivers
