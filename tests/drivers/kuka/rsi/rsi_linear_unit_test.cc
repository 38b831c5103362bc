// An arm on a linear unit, corrected with it, and external axes that no move uses.

#include <string>

#include "drivers/error.h"
#include "tests/drivers/kuka/rsi/rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

constexpr std::size_t kE1 = 0, kA1 = 1;

RsiConfig on_track() {
  RsiConfig config = rig_config();
  config.limits.insert(config.limits.begin(), {0.0, 3.0, 1.0, 0.5, 5.0, true});
  config.correction_limit_deg.insert(config.correction_limit_deg.begin(), 2000.0);
  return config;
}

sim::ControllerConfig controller_on_track() {
  sim::ControllerConfig config;
  config.linear_unit = true;
  config.start_rad.insert(config.start_rad.begin(), 1.2);
  config.start_rad.push_back(12.5 * kDeg);  // E2
  config.noise_sigma_deg = 0.0005;
  return config;
}

struct TrackRig : Rig {
  TrackRig() : Rig(controller_on_track(), on_track()) { make_ready(); }

  double e1_m() const { return krc.actual_rad_at(now)[kE1]; }
  AxisAngles travelled_by(double m) const {
    AxisAngles target = commanded();
    target[kE1] += m;
    return target;
  }
  /// From now on the packets report motion of this axis at this speed.
  void creep(const std::string& axis, double per_s) {
    before_core = [this, axis, per_s, from = now] {
      const std::size_t element = packet.find("<EIPos"), at = packet.find(axis + "=\"", element);
      ASSERT_NE(at, std::string::npos);
      const std::size_t begin = at + axis.size() + 2, end = packet.find('"', begin);
      const double told = std::stod(packet.substr(begin, end - begin)) +
                          per_s * std::chrono::duration<double>(now - from).count();
      packet.replace(begin, end - begin, std::to_string(told));
    };
  }
};

TEST(RsiLinearUnit, IsTheFirstAxisInMetresAndCorrectedInMillimetres) {
  TrackRig rig;
  ASSERT_EQ(rig.core.state().actual_rad.size(), 7u);
  EXPECT_TRUE(rig.core.state().linear_unit);
  EXPECT_NEAR(rig.core.state().actual_rad[kE1], 1.2, 1e-4);
  AxisAngles target = rig.travelled_by(-0.35);
  target[kA1] += 10 * kDeg;
  const CoreResult result = rig.move(MoveKind::kTransit, target);
  EXPECT_EQ(result.outcome, MoveOutcome::kArrived) << words(result);
  EXPECT_NEAR(rig.e1_m(), 0.85, 5e-5);
  EXPECT_NEAR(rig.krc.correction_deg()[6], -350.0, 0.05);
  EXPECT_NEAR(rig.krc.correction_deg()[0], 10.0, 0.01);
  EXPECT_EQ(rig.krc.correction_deg()[7], 0.0) << "E2";
}

TEST(RsiLinearUnit, IsCheckedInMillimetresBeforeAnythingMoves) {
  TrackRig rig;
  AxisAngles beyond = rig.commanded();
  beyond[kE1] = 3.001;
  expect_cause(rig.move(MoveKind::kTransit, beyond).cause,
               cause::AboveLimit{WireAxis(6, true), 3001.0, 3000.0});
  RsiConfig narrow = on_track();
  narrow.correction_limit_deg[kE1] = 100.0;
  Rig other(controller_on_track(), narrow);
  other.make_ready();
  AxisAngles far = other.commanded();
  far[kE1] += 0.101;
  const CoreResult refused = other.move(MoveKind::kTransit, far);
  EXPECT_EQ(refused.outcome, MoveOutcome::kRefused);
  expect_cause(refused.cause, cause::CorrectionLimit{WireAxis(6, true), 101.0, 100.0}, 1e-6);
}

TEST(RsiLinearUnit, KeepsItsSpeedAccelerationAndJerk) {
  TrackRig rig;
  double last = rig.e1_m(), speed = 0.0, fastest = 0.0;
  rig.begin(MoveKind::kTransit, rig.travelled_by(1.5));
  rig.run_until([&] {
    speed = (rig.krc.setpoint_rad()[kE1] - last) / 0.004;
    last = rig.krc.setpoint_rad()[kE1];
    fastest = std::max(fastest, speed);
    return rig.core.next_result().has_value();
  });
  EXPECT_LE(fastest, 1.001);
  EXPECT_GT(fastest, 0.5);
}

TEST(RsiLinearUnit, DoesNotTravelInASearchNorOnTheWayOutOfAContact) {
  TrackRig rig;
  for (const MoveKind kind : {MoveKind::kSearch, MoveKind::kRetreat}) {
    rig.guard.arm(kArm);
    const CoreResult result = rig.move(kind, rig.travelled_by(0.01), 5.0, kArm);
    EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
    EXPECT_TRUE(is<cause::TravelAtTarget>(result.cause)) << words(result);
  }
  EXPECT_EQ(rig.krc.correction_deg()[6], 0.0);
}

TEST(RsiLinearUnit, ThatMovesInASearchStopsTheArm) {
  TrackRig rig;
  rig.guard.arm(kArm);
  rig.begin(MoveKind::kSearch, rig.moved_by(kA1, 5), 10.0, kArm);
  rig.run(1s);
  rig.creep("E1", 20.0);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing) << words(result);
  const double stopped = rig.krc.setpoint_rad()[kA1];
  rig.run(200ms);
  EXPECT_EQ(rig.krc.setpoint_rad()[kA1], stopped);
}

TEST(RsiExternalAxis, WithoutALimitThatMovesStopsTheArmInTheVeryNextReply) {
  TrackRig rig;
  rig.begin(MoveKind::kSearch, rig.moved_by(kA1, 5), 10.0, kArm);
  rig.guard.arm(kArm);
  rig.run(1s);
  rig.creep("E2", 100.0);  // 0.4 deg per packet
  rig.cycle();
  const std::string held = rig.reply.substr(0, rig.reply.find("<IPOC"));
  rig.cycle();
  EXPECT_EQ(rig.reply.substr(0, rig.reply.find("<IPOC")), held);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kNotFollowing);
  ASSERT_TRUE(is<cause::MovedUnasked>(result.cause)) << words(result);
  EXPECT_EQ(std::get<cause::MovedUnasked>(result.cause).axis.place, 7);
}

TEST(RsiExternalAxis, ThatMovesBetweenMovesForbidsTheNextUntilAReference) {
  for (const char* axis : {"E1", "E2"}) {
    TrackRig rig;
    rig.creep(axis, 10.0);
    rig.run(500ms);
    rig.before_core = nullptr;
    const CoreResult result = rig.move(MoveKind::kTransit, rig.moved_by(kA1, 1));
    EXPECT_EQ(result.outcome, MoveOutcome::kRefused);
    EXPECT_TRUE(is<cause::MovedUnasked>(result.cause)) << words(result);
    EXPECT_TRUE(has(said(rig.core.state().words), axis)) << rig.core.state().words;
    rig.make_referenced();
    EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(kA1, 1)).outcome, MoveOutcome::kArrived);
  }
}

TEST(RsiLinearUnit, WithoutItInThePacketsThereIsNoReference) {
  Rig rig({}, on_track());
  rig.krc.rsi_on();
  rig.run(500ms);
  EXPECT_EQ(rig.core.state().link, RobotLink::kDown);
}

TEST(RsiLinearUnit, IsTheFirstOfSevenAxesOrMore) {
  RsiConfig config = on_track();
  EXPECT_NO_THROW(config.validate());
  std::swap(config.limits[0], config.limits[3]);
  EXPECT_THROW(config.validate(), ConfigError);
}

}  // namespace
}  // namespace cellcal::drivers
