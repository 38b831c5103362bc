// The link: sessions, plausibility of data, and loss.

#include "tests/drivers/kuka/eki/eki_rig.h"

namespace cellcal::drivers {
namespace {

std::string without(std::string text, const std::string& from, const std::string& to) {
  for (auto at = text.find(from); at != std::string::npos; at = text.find(from)) {
    text.erase(at, text.find(to, at + from.size()) + to.size() - at);
  }
  return text;
}

TEST(EkiLink, IsDownUntilAStateComesAndReadyOnlyAfterAReference) {
  EkiRig rig;
  rig.run(40ms);
  EXPECT_EQ(rig.link(), RobotLink::kDown);
  EXPECT_NE(rig.words().find("172.31.1.147:54600"), std::string::npos) << rig.words();
  ASSERT_TRUE(rig.connect());
  rig.run(1s);
  EXPECT_EQ(rig.link(), RobotLink::kNotReferenced) << rig.words();
  EXPECT_EQ(rig.krc.session(), rig.session);
  rig.reference();
  EXPECT_NEAR(rig.actual()[1], -90 * kEkiDeg, 1e-6);
  EXPECT_NEAR(rig.core.state().cycle_s, 0.02, 0.002);
  EXPECT_EQ(rig.words(), "");
}

TEST(EkiLink, RefusesToMoveBeforeItIsReferenced) {
  EkiRig rig;
  rig.begin(MoveKind::kTransit, AxisAngles(6, 0.0));
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kRefused);
  rig.run(40ms);
  rig.connect();
  rig.run(500ms);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kRefused);
  EXPECT_EQ(rig.krc.moves(), 0u);
}

TEST(EkiLink, TakesBytesHoweverTcpCutsThem) {
  EkiRig rig;
  std::string held;
  int turn = 0;
  // Nothing for a while, then fragments: pieces of one state, several states at once.
  rig.mangle = [&](const std::string& bytes) {
    held += bytes;
    const std::size_t size = ++turn % 7 == 0 ? held.size() : std::min<std::size_t>(held.size(), 37);
    std::string part = held.substr(0, size);
    held.erase(0, size);
    return part;
  };
  rig.make_ready();
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 5)).outcome, MoveOutcome::kArrived);
  EXPECT_EQ(rig.words(), "");
}

TEST(EkiLink, SilenceIsALostLinkAndNothingMovesBeforeANewReference) {
  EkiRig rig;
  rig.make_ready();
  rig.krc.mute(true);
  EXPECT_TRUE(rig.run_until([&] { return rig.link() == RobotLink::kLost; }, 400ms));
  EXPECT_FALSE(rig.connected) << "the connection is cut";
  rig.krc.mute(false);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kRefused);
  rig.run(200ms);
  ASSERT_TRUE(rig.connect());
  rig.run(1s);
  EXPECT_EQ(rig.link(), RobotLink::kNotReferenced);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kRefused);
  rig.reference();
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kArrived);
}

TEST(EkiLink, AReconnectInTheMiddleOfAMoveStopsItAndDoesNotGoOn) {
  EkiRig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 90));
  rig.run(500ms);
  ASSERT_FALSE(rig.krc.at_rest());
  rig.close_connection();
  const auto result = rig.core.next_result();
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->outcome, MoveOutcome::kRobotSilent);
  EXPECT_TRUE(is<cause::LinkClosed>(result->cause)) << words(*result);
  EXPECT_TRUE(rig.run_until([&] { return rig.connect(); }, 2s)) << "the port opens again";
  EXPECT_TRUE(rig.run_until([&] { return rig.krc.at_rest(); }, 2s)) << "stopped by itself";
  rig.run(2s);
  const double rest = rig.true_deg();
  EXPECT_GT(rest, 1.0);
  EXPECT_LT(rest, 89.0);
  EXPECT_EQ(rig.link(), RobotLink::kNotReferenced);
  rig.reference();
  rig.run(1s);
  EXPECT_NEAR(rig.true_deg(), rest, 1e-3);
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kArrived);
}

TEST(EkiLink, ACableThatIsPulledStopsTheArmWithinTheDeadMansTime) {
  EkiRig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 150));
  rig.run(600ms);
  ASSERT_FALSE(rig.krc.at_rest());
  rig.cable = false;  // without notification
  EXPECT_EQ(rig.finish(1s).outcome, MoveOutcome::kRobotSilent);
  // 250 ms of dead man, and the ramp.
  EXPECT_TRUE(rig.run_until([&] { return rig.krc.at_rest(); }, 600ms));
}

TEST(EkiLink, WhatAnEarlierClientLeftInTheBuffersMovesNothing) {
  sim::EkiControllerConfig careless = eki_controller();
  careless.clears_on_reconnect = false;
  EkiRig rig(careless);
  rig.make_ready();
  rig.krc.deaf(true);
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 45));
  rig.run(100ms);  // the move is in the controller's queues
  rig.close_connection();
  EXPECT_EQ(rig.finish().outcome, MoveOutcome::kRobotSilent);
  rig.run(300ms);
  ASSERT_TRUE(rig.connect());
  rig.krc.deaf(false);
  rig.run(1s);
  EXPECT_EQ(rig.krc.moves(), 0u);
  EXPECT_EQ(rig.link(), RobotLink::kNotReferenced) << rig.words();
  rig.reference();
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 1)).outcome, MoveOutcome::kArrived);
}

TEST(EkiLink, StatesOfAnotherSessionAreNotBelieved) {
  EkiRig rig;
  rig.run(40ms);
  rig.mangle = [&](std::string bytes) {
    const std::string own = "Session=\"" + std::to_string(rig.session) + "\"";
    const auto at = bytes.find(own);
    return at == std::string::npos ? bytes : bytes.replace(at, own.size(), "Session=\"55\"");
  };
  rig.connect();
  rig.run(1s);
  EXPECT_EQ(rig.link(), RobotLink::kDown);
  EXPECT_NE(rig.words().find("obeys session 55"), std::string::npos) << rig.words();
  // If the controller begins to obey another session during a move, the session is lost.
  rig.mangle = [](std::string bytes) { return bytes; };
  rig.run(1s);
  rig.reference();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 50));
  rig.run(300ms);
  rig.krc.receive(
      "<RobotCommand Session=\"77\" Seq=\"1\" Type=\"1\" Id=\"0\"><Axis A1=\"0\" A2=\"0\" "
      "A3=\"0\" A4=\"0\" A5=\"0\" A6=\"0\"/><Move Guard=\"0\" Path=\"1\" Percent=\"1\" "
      "Duration=\"0\"/></RobotCommand>");
  const CoreResult result = rig.finish();
  EXPECT_EQ(result.outcome, MoveOutcome::kRobotSilent);
  expect_cause(result.cause, cause::SessionTaken{77});
  EXPECT_EQ(rig.link(), RobotLink::kLost);
}

TEST(EkiLink, NeverHasMoreTelegramsUnderWayThanTheControllersBufferHolds) {
  EkiRig rig;
  rig.make_ready();
  rig.krc.deaf(true);
  rig.core.begin({1, MoveKind::kTransit, rig.moved_by(0, 5), 0.0, 0});
  rig.core.stop();
  rig.run(240ms);
  EXPECT_TRUE(rig.krc.connected()) << "no overflow";
  EXPECT_TRUE(rig.krc.channel().messages().empty());
  EXPECT_LE(rig.krc.channel().waiting("RobotCommand/@Seq"), 4u + 3u);
  EXPECT_GE(rig.krc.channel().waiting("RobotCommand/@Seq"), 4u);
}

TEST(EkiLink, NonsenseInsteadOfStatesIsNamedAndThenTheLinkIsCut) {
  EkiRig rig;
  rig.make_ready();
  rig.mangle = [](const std::string& bytes) {
    return bytes.empty() ? bytes : "<RobotState Session=\"nan\"/>";
  };
  EXPECT_TRUE(rig.run_until([&] { return rig.link() == RobotLink::kLost; }, 1s));
  EXPECT_NE(rig.words().find("finite number"), std::string::npos) << rig.words();
  rig.mangle = [](const std::string&) { return std::string(100, 'x'); };
  rig.run(200ms);
  ASSERT_TRUE(rig.connect());
  EXPECT_TRUE(rig.run_until([&] { return !rig.connected; }, 6s)) << "no state ever: give it up";
}

TEST(EkiLink, AStreamWithoutAnEndIsCutAtOnce) {
  EkiRig rig;
  rig.make_ready();
  rig.mangle = [](const std::string&) { return "<RobotState>" + std::string(9000, 'x'); };
  rig.cycle();
  rig.cycle();
  EXPECT_EQ(rig.link(), RobotLink::kLost);
  EXPECT_FALSE(rig.connected);
}

TEST(EkiLink, RefusesToBeReferencedOnCoarseAngles) {
  EkiRig rig;
  rig.run(40ms);
  rig.mangle = [](std::string bytes) {
    for (auto at = bytes.find("0000\""); at != std::string::npos; at = bytes.find("0000\"")) {
      bytes.erase(at, 4);
    }
    return bytes;
  };
  rig.connect();
  rig.run(1s);
  rig.core.rereference();
  rig.run(1s);
  EXPECT_EQ(rig.link(), RobotLink::kNotReferenced);
  EXPECT_NE(rig.words().find("3 decimals"), std::string::npos) << rig.words();
}

TEST(EkiLink, StatesOfAnotherProgramAreNamedAndNothingIsDriven) {
  EkiRig rig;
  rig.run(40ms);
  rig.mangle = [](const std::string& bytes) {
    return bytes.empty() ? bytes
                         : std::string(
                               "<RobotState><Pos A1=\"0.0\" A2=\"-90.0\"></Pos>"
                               "<RobotCommand Size=\"1\"></RobotCommand></RobotState>");
  };
  rig.connect();
  rig.run(1s);
  rig.core.rereference();
  rig.run(1s);
  EXPECT_NE(rig.link(), RobotLink::kReady);
  EXPECT_NE(rig.words().find("CELLCAL_SUB"), std::string::npos) << rig.words();
  EXPECT_NE(rig.words().find("element of the channel's SEND part is missing"), std::string::npos)
      << rig.words();
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 5)).outcome, MoveOutcome::kRefused);
  EXPECT_NEAR(rig.true_deg(), 0.0, 1e-9);
}

TEST(EkiLink, SaysWhatTheControllerLacksToBeReady) {
  EkiRig rig;
  rig.krc.emergency_stop(true);
  rig.run(40ms);
  rig.connect();
  rig.run(500ms);
  rig.core.rereference();
  rig.run(500ms);
  EXPECT_EQ(rig.link(), RobotLink::kNotReferenced);
  EXPECT_NE(rig.words().find("Drives off"), std::string::npos) << rig.words();
  rig.krc.emergency_stop(false);
  rig.run(500ms);
  EXPECT_NE(rig.words().find("Acknowledge"), std::string::npos) << rig.words();
  rig.krc.start_program();
  EXPECT_TRUE(rig.run_until([&] { return rig.link() == RobotLink::kReady; }, 2s)) << rig.words();
}

TEST(EkiLink, WorksWithAControllerThatSendsNeitherClockNorStatus) {
  EkiRig rig;
  rig.mangle = [](std::string bytes) {
    bytes = without(std::move(bytes), " Time=\"", "\"");
    bytes = without(std::move(bytes), " Mode=\"", "\"");
    return without(std::move(bytes), " Drives=\"", "\"");
  };
  rig.make_ready();
  EXPECT_EQ(rig.move(MoveKind::kTransit, rig.moved_by(0, 5)).outcome, MoveOutcome::kArrived);
}

TEST(EkiLink, SaysGoodbyeAtRest) {
  EkiRig rig;
  rig.make_ready();
  rig.begin(MoveKind::kTransit, rig.moved_by(0, 90));
  rig.run(400ms);
  rig.core.close();
  EXPECT_TRUE(rig.run_until([&] { return rig.core.ended(); }, 3s));
  rig.run(100ms);
  EXPECT_TRUE(rig.krc.at_rest());
  EXPECT_EQ(rig.krc.session(), 0u);
  const auto result = rig.core.next_result();
  ASSERT_TRUE(result.has_value());
  EXPECT_EQ(result->outcome, MoveOutcome::kStopped);
}

}  // namespace
}  // namespace cellcal::drivers
