// The second stop path: the contact sensor's output at an input of the controller, in each packet.

#include "drivers/kuka/rsi/rsi_stops.h"
#include "tests/drivers/kuka/rsi/rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

sim::ControllerConfig krc_with_input() {
  sim::ControllerConfig krc;
  krc.contact_tag = "Contact.R";
  return krc;
}

RsiConfig config_with_input() {
  RsiConfig config = rig_config();
  config.contact_tag = "Contact.R";
  return config;
}

class InputOfTheController : public ::testing::Test {
 protected:
  InputOfTheController() : rig(krc_with_input(), config_with_input()) {
    rig.krc.input(rig.now, true);
    rig.make_ready();
  }

  InputPath path() const { return rig.core.core_state().input_path; }
  void begin_search(Duration into = 1s) {
    rig.guard.arm(kArm);
    rig.begin(MoveKind::kSearch, rig.moved_by(0, 2.0), 10.0, kArm);
    rig.run(into);
    ASSERT_TRUE(rig.core.state().moving);
  }
  /// A search that ends in contact, shown by the input this much later than the sensor's stamp.
  CoreResult touch(std::optional<Duration> input_after = 3ms) {
    begin_search();
    const TimePoint edge = rig.now + 1ms;
    if (input_after) rig.krc.input(edge + *input_after, false);
    rig.run(4ms);
    rig.guard.trip(kArm, edge);
    rig.guard.push(ContactEventKind::kContact, kArm, edge);
    rig.guard.touch(true);
    return rig.finish();
  }
  /// Retreat from it.
  CoreResult leave(bool input_opens = true) {
    rig.begin(MoveKind::kRetreat, rig.moved_by(0, -1.0));
    rig.run(60ms);
    rig.guard.touch(false);
    if (input_opens) rig.krc.input(rig.now, true);
    return rig.finish();
  }
  void prove() {
    ASSERT_EQ(touch().outcome, MoveOutcome::kContact);
    ASSERT_EQ(leave().outcome, MoveOutcome::kArrived);
    ASSERT_EQ(path(), InputPath::kFollows);
  }

  Rig rig;
};

TEST_F(InputOfTheController, IsProvenByATouchAndItsOpening) {
  EXPECT_EQ(path(), InputPath::kUnproven);
  EXPECT_EQ(rig.guard.silence_limit(), kHeartbeatLimit);
  EXPECT_EQ(touch().outcome, MoveOutcome::kContact);
  EXPECT_EQ(path(), InputPath::kUnproven) << "it may be stuck there";
  EXPECT_EQ(leave().outcome, MoveOutcome::kArrived);
  EXPECT_EQ(path(), InputPath::kFollows);
  rig.cycle();
  EXPECT_EQ(rig.guard.silence_limit(), kInputWatchLimit);
}

TEST_F(InputOfTheController, StopsASearchInTheVeryReplyAndTheSensorsStampLatches) {
  prove();
  begin_search();
  const AxisAngles before = rig.commanded();
  const std::uint32_t stops = rig.core.core_state().stops_by_input;
  const TimePoint edge = rig.now + 1ms;
  const std::vector<double> truth = rig.krc.actual_rad_at(edge);
  rig.krc.input(edge, false);
  rig.guard.set_heard(false);
  rig.cycle();
  EXPECT_EQ(rig.commanded(), before) << "not one step more";
  rig.run(500ms);
  EXPECT_EQ(rig.commanded(), before);
  ASSERT_TRUE(rig.core.state().moving) << "the touch is the sensor's to tell";
  rig.guard.trip(kArm, edge);
  rig.guard.push(ContactEventKind::kContact, kArm, edge);
  rig.guard.touch(true);
  const CoreResult result = rig.finish();
  ASSERT_EQ(result.outcome, MoveOutcome::kContact) << words(result);
  EXPECT_NEAR(result.latch->contact_rad[0], truth[0], 1.5e-4 * kDeg);
  EXPECT_NEAR(result.latch->reaction_s, 3.1e-3, 2e-3);
  EXPECT_EQ(rig.core.core_state().stops_by_input, stops + 1);
  EXPECT_EQ(path(), InputPath::kFollows);
}

TEST_F(InputOfTheController, StopsAFirstSearchLikewise) {
  begin_search();
  const AxisAngles before = rig.commanded();
  rig.krc.input(rig.now, false);
  rig.cycle();
  EXPECT_EQ(rig.commanded(), before);
}

TEST_F(InputOfTheController, WithASensorThatIsSilentForTooLongIsNoTouch) {
  prove();
  begin_search();
  rig.krc.input(rig.now, false);
  rig.run(8ms);
  rig.guard.set_alive(false);
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::SensorDead>(result.cause)) << words(result);
}

TEST_F(InputOfTheController, ThatGoesOffAloneIsACutWireAndNoTouch) {
  prove();
  begin_search();
  const AxisAngles before = rig.commanded();
  rig.krc.input(rig.now, false);
  const CoreResult result = rig.finish(1s);
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::InputAlone>(result.cause)) << words(result);
  EXPECT_EQ(result.at_rad, before);
  rig.begin(MoveKind::kSearch, rig.moved_by(0, 1.0), 10.0, kArm);
  const CoreResult next = rig.finish();
  EXPECT_EQ(next.outcome, MoveOutcome::kRefused);
  EXPECT_TRUE(is<cause::InputAtStart>(next.cause)) << words(next);
}

TEST_F(InputOfTheController, WithATripThatIsNeverConfirmedIsNotAlone) {
  prove();
  begin_search();
  rig.krc.input(rig.now, false);
  rig.run(8ms);
  rig.guard.trip(kArm, rig.now - 8ms);
  const CoreResult result = rig.finish(1s);
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::TripUnconfirmed>(result.cause)) << words(result);
}

TEST_F(InputOfTheController, StopsWhereTheSensorHadDisarmedItselfForWantOfAKeepAlive) {
  prove();
  begin_search();
  rig.krc.input(rig.now, false);
  rig.cycle();
  rig.guard.end_arming(ArmEnd::kSensorDisarmed);
  rig.guard.touch(true);
  const CoreResult result = rig.finish(1s);
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent) << "its contact is of no arming";
  EXPECT_TRUE(is<cause::KeepAliveLate>(result.cause)) << words(result);
  EXPECT_EQ(result.interruption, Interruption::kLateBytes);
}

TEST_F(InputOfTheController, BlinksWithNoiseThatTheSensorRevokes) {
  prove();
  begin_search();
  rig.krc.input(rig.now, false);
  rig.krc.input(rig.now + 3ms, true);
  rig.run(4ms);
  rig.guard.push(ContactEventKind::kRevoked, kArm, rig.now);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kRevoked);
  EXPECT_EQ(path(), InputPath::kFollows);
}

TEST_F(InputOfTheController, ThatMissesATouchStopsNothingAndIsNamed) {
  prove();
  EXPECT_EQ(touch(std::nullopt).outcome, MoveOutcome::kContact) << "stopped by the sensor's bytes";
  EXPECT_EQ(path(), InputPath::kMissed);
  EXPECT_TRUE(has(said(rig.core.state().words), "missed a touch")) << rig.core.state().words;
  EXPECT_EQ(leave().outcome, MoveOutcome::kArrived);
  EXPECT_EQ(rig.guard.silence_limit(), kHeartbeatLimit);
  EXPECT_EQ(touch().outcome, MoveOutcome::kContact);
  EXPECT_EQ(leave().outcome, MoveOutcome::kArrived);
  EXPECT_EQ(path(), InputPath::kMissed) << "once is enough";
}

TEST_F(InputOfTheController, ThatShowsATouchTooLateHasMissedIt) {
  EXPECT_EQ(touch(kInputFollows + 8ms).outcome, MoveOutcome::kContact);
  EXPECT_EQ(path(), InputPath::kMissed);
}

TEST_F(InputOfTheController, ThatWentOffBeforeTheTouchIsNoProof) {
  begin_search();
  const TimePoint edge = rig.now + 20ms;
  rig.krc.input(rig.now, false);
  rig.run(24ms);
  rig.guard.trip(kArm, edge);
  rig.guard.push(ContactEventKind::kContact, kArm, edge);
  rig.guard.touch(true);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kContact);
  EXPECT_EQ(path(), InputPath::kMissed);
}

TEST_F(InputOfTheController, StopsATransitInTheVeryReply) {
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 0.2), 4.0);
  rig.run(1s);
  const AxisAngles before = rig.commanded();
  rig.krc.input(rig.now, false);
  rig.cycle();
  EXPECT_EQ(rig.commanded(), before) << "slow: a freeze";
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kUnexpectedContact);
  EXPECT_TRUE(is<cause::InputTouched>(result.cause)) << words(result);
  const CoreResult next = rig.move(MoveKind::kTransit, rig.moved_by(0, 0.2));
  EXPECT_EQ(next.outcome, MoveOutcome::kUnexpectedContact);
}

TEST_F(InputOfTheController, MayBeALittleBehindASensorThatIsFree) {
  rig.krc.input(rig.now, false);
  rig.run(100ms);
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 0.2));
  const AxisAngles before = rig.commanded();
  rig.run(kInputFollows - 8ms);
  EXPECT_EQ(rig.commanded(), before);
  rig.krc.input(rig.now, true);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kArrived);
}

TEST_F(InputOfTheController, ThatStaysOffAfterARetreatIsNamed) {
  EXPECT_EQ(touch().outcome, MoveOutcome::kContact);
  const CoreResult result = leave(false);
  EXPECT_EQ(result.outcome, MoveOutcome::kContactSilent);
  EXPECT_TRUE(is<cause::InputAlone>(result.cause)) << words(result);
}

TEST_F(InputOfTheController, OpensARetreatWhoseSensorIsHeardLate) {
  prove();
  ASSERT_EQ(touch().outcome, MoveOutcome::kContact);
  // Its last message is that of the touch, until the arm has long retreated.
  rig.guard.set_said(rig.now);
  const AxisAngles clear = rig.moved_by(0, -0.5);
  AxisAngles target = clear;
  target[1] -= 20 * kDeg;
  rig.core.begin({++rig.last_id, MoveKind::kRetreat, target, 0.0, 0, {{clear, 0.5, 0.5}}});
  rig.run(30ms);
  rig.krc.input(rig.now, true);
  rig.run(400ms);
  rig.guard.touch(false);
  rig.guard.set_said(rig.now);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kArrived);
}

TEST_F(InputOfTheController, ThatOpensDoesNotHideASensorThatSaysContactAgain) {
  prove();
  ASSERT_EQ(touch().outcome, MoveOutcome::kContact);
  rig.begin(MoveKind::kRetreat, rig.moved_by(0, -1.0), 4.0);
  rig.run(100ms);
  rig.krc.input(rig.now, true);
  rig.run(200ms);
  rig.guard.set_said(rig.now);
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kUnexpectedContact);
}

TEST_F(InputOfTheController, IsNotBelievedWhereAPacketDoesNotHaveIt) {
  prove();
  rig.before_core = [&] {
    const std::size_t at = rig.packet.find("<Contact R=\"1\"");
    ASSERT_NE(at, std::string::npos);
    rig.packet.replace(at, std::string_view("<Contact R=\"1\"").size(), "<Contact R=\"2\"");
    rig.before_core = nullptr;
  };
  rig.cycle();
  EXPECT_EQ(path(), InputPath::kUntold);
  EXPECT_EQ(rig.guard.silence_limit(), kHeartbeatLimit);
  rig.cycle();
  EXPECT_EQ(path(), InputPath::kFollows);
}

TEST_F(InputOfTheController, IsProvenAnewInAnotherSession) {
  prove();
  rig.krc.cancel_program();
  rig.run(2s);
  rig.make_ready();
  EXPECT_EQ(path(), InputPath::kUnproven);
  EXPECT_EQ(rig.guard.silence_limit(), kHeartbeatLimit);
}

TEST(ContactInputProof, LastsForAWhile) {
  ContactInput input(true);
  TimePoint now{1000s};
  input.note(true, now);
  input.note(false, now += 4ms);
  input.judge_contact(now);
  input.note(true, now += 1s);
  input.judge_opening();
  EXPECT_TRUE(input.follows());
  input.note(true, now + kInputProofLasts);
  EXPECT_TRUE(input.follows());
  input.note(true, now + kInputProofLasts + 1ms);
  EXPECT_EQ(input.path(), InputPath::kUnproven);
}

TEST(ContactInputProof, IsNoneWithoutAnInput) {
  ContactInput input(false);
  input.note(false, TimePoint{1s});
  EXPECT_FALSE(input.contact());
  EXPECT_EQ(input.path(), InputPath::kNone);
}

TEST(ContactInputProof, IsNotMissedWhereThePacketsNeverHadIt) {
  ContactInput input(true);
  input.note(std::nullopt, TimePoint{1s});
  input.judge_contact(TimePoint{1s});
  input.judge_opening();
  EXPECT_EQ(input.path(), InputPath::kUntold);
}

}  // namespace
}  // namespace cellcal::drivers
