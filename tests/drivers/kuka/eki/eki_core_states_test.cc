// The EKI core with scripted states, one at a time: effect of each, the reply, and state discarded
// by another connection.

#include <fmt/format.h>

#include "tests/drivers/kuka/eki/eki_rig.h"

namespace cellcal::drivers {
namespace {

/// A scripted controller.
struct EkiStates : testing::Test {
  explicit EkiStates(const EkiConfig& config = eki_config()) : core(config, &guard) {}

  struct Command {
    unsigned seq = 0, type = 0, id = 0;
  };

  void connect() {
    core.on_connected(++session, now);
    listen();
  }
  void tick(Duration after = 4ms) {
    core.on_tick(now += after);
    listen();
  }
  std::string state() const {
    const std::string move = fmt::format("<Move Id=\"{}\" State=\"{}\" Outcome=\"{}\"/>", move_id,
                                         static_cast<int>(progress), static_cast<int>(outcome));
    return fmt::format(
        "<RobotState Session=\"{}\" Heard=\"{}\" {}><Axis A1=\"{:.{}f}\" A2=\"-90.{:0{}}\" "
        "A3=\"90\" A4=\"0\" A5=\"90\" A6=\"0\"/>{}<Status Ready=\"{}\" Mode=\"{}\" Drives=\"{}\" "
        "Stopped=\"{}\" Override=\"{}\" Input=\"{}\" Fault=\"{}\" Bad=\"{}\"/></RobotState>",
        obeyed.value_or(session), heard, more, a1_deg, decimals, 0, decimals, move, ready ? 1 : 0,
        mode, drives ? 1 : 0, stopped ? 1 : 0, override_percent, input ? 1 : 0, fault, bad);
  }
  /// The next state, and the following tick.
  void say(Duration after = 20ms) {
    now += after;
    core.on_bytes(state(), now);
    core.on_tick(now);
    listen();
  }
  void say_times(int times) {
    for (int i = 0; i < times; ++i) say();
  }
  void listen() {
    const std::string out(core.output());
    if (!takes) return;
    core.sent(out.size());
    for (auto at = out.find("<RobotCommand"); at != std::string::npos;
         at = out.find("<RobotCommand", at + 1)) {
      const auto number = [&](const char* name) {
        const auto value = out.find(name, at) + std::string(name).size();
        return static_cast<unsigned>(std::stoul(out.substr(value)));
      };
      commands.push_back({number(" Seq=\""), number(" Type=\""), number(" Id=\"")});
      if (reads) heard = commands.back().seq;
    }
  }
  void reference() {
    core.rereference();
    for (int i = 0; i < 50 && facts().link != RobotLink::kReady; ++i) say();
    ASSERT_EQ(facts().link, RobotLink::kReady);
  }
  void get_ready() {
    connect();
    say_times(12);
    reference();
    commands.clear();
  }
  void begin(double a1_to_deg) {
    AxisAngles target{core.state().actual_rad};
    target[0] = a1_to_deg * kEkiDeg;
    core.begin({++last_id, MoveKind::kTransit, target, 0.0, 0});
  }
  /// Started: accepted by the controller.
  void begin_and_take(double a1_to_deg) {
    begin(a1_to_deg);
    say();
    move_id = of(EkiType::kMove).back().id;
    progress = EkiProgress::kMoving;
    say();
    ASSERT_TRUE(facts().moving);
  }
  void close() {
    core.on_closed(now);
    heard = 0;
  }
  std::vector<Command> of(EkiType type) const {
    std::vector<Command> found;
    for (const Command& one : commands) {
      if (one.type == static_cast<unsigned>(type)) found.push_back(one);
    }
    return found;
  }
  const EkiCoreState& facts() const { return core.core_state(); }
  CoreResult result() {
    const auto result = core.next_result();
    EXPECT_TRUE(result.has_value());
    return result.value_or(CoreResult{});
  }

  ScriptedGuard guard;
  EkiCore core;
  TimePoint now{1000s};
  std::uint32_t session = 100, last_id = 0;
  std::optional<std::uint32_t> obeyed;
  unsigned heard = 0, move_id = 0, mode = 4, bad = 0;
  bool reads = true, takes = true;
  EkiProgress progress = EkiProgress::kIdle;
  EkiOutcome outcome = EkiOutcome::kNone;
  double a1_deg = 0.0;
  int decimals = 4, override_percent = 100, fault = 0;
  bool ready = true, drives = true, stopped = false, input = false;
  std::string more;
  std::vector<Command> commands;
};

// ---- before and after a connection ------------------------------------------------------------------

TEST_F(EkiStates, WithoutAConnectionNothingIsSaidAndNothingIsLost) {
  for (int i = 0; i < 300; ++i) tick();
  EXPECT_EQ(facts().link, RobotLink::kDown);
  EXPECT_EQ(facts().loss, EkiLoss::kNone);
  EXPECT_FALSE(core.wants_close());
  EXPECT_TRUE(commands.empty());
  core.rereference();
  EXPECT_EQ(facts().link, RobotLink::kDown);
  core.on_bytes(state(), now);
  EXPECT_EQ(facts().states, 0u);
}

TEST_F(EkiStates, AClosedConnectionIsDeafAndMuteAndKeepsTheNameOfItsLoss) {
  get_ready();
  const std::uint64_t states = facts().states;
  close();
  EXPECT_FALSE(facts().connected);
  EXPECT_EQ(facts().trouble, EkiTrouble::kNotConnected);
  EXPECT_EQ(facts().link, RobotLink::kLost);
  commands.clear();
  for (int i = 0; i < 300; ++i) tick();
  core.on_bytes(state(), now);
  EXPECT_TRUE(commands.empty());
  EXPECT_EQ(facts().states, states);
  EXPECT_EQ(facts().link, RobotLink::kLost);
  EXPECT_EQ(facts().loss, EkiLoss::kClosed) << "not of its silence since";
}

TEST_F(EkiStates, WhatComesBehindALossOnTheSameConnectionIsNotBelieved) {
  get_ready();
  obeyed = 777;
  say();
  EXPECT_EQ(facts().link, RobotLink::kLost);
  EXPECT_EQ(facts().loss, EkiLoss::kSessionTaken);
  EXPECT_TRUE(core.wants_close());
  const std::uint64_t states = facts().states;
  obeyed.reset();
  commands.clear();
  say_times(20);
  EXPECT_EQ(facts().link, RobotLink::kLost);
  EXPECT_EQ(facts().states, states);
  EXPECT_TRUE(commands.empty());
}

TEST_F(EkiStates, EachConnectionCountsAndJudgesAnew) {
  get_ready();
  begin_and_take(5.0);
  obeyed = 777;
  say();
  EXPECT_EQ(facts().other_session, 777u);
  close();
  obeyed.reset();
  progress = EkiProgress::kIdle;
  move_id = 0;
  decimals = 1;
  commands.clear();
  connect();
  EXPECT_EQ(facts().other_session, 0u);
  EXPECT_EQ(facts().decimals_seen, 0);
  EXPECT_EQ(facts().link, RobotLink::kLost) << "until a state comes";
  core.rereference();
  say();
  EXPECT_EQ(facts().link, RobotLink::kNotReferenced);
  core.rereference();
  say_times(15);
  EXPECT_EQ(facts().decimals_seen, 1);
  EXPECT_EQ(facts().trouble, EkiTrouble::kCoarse);
  EXPECT_EQ(facts().link, RobotLink::kNotReferenced);
  decimals = 4;
  reference();
  begin(5.0);
  say();
  ASSERT_EQ(of(EkiType::kMove).size(), 1u);
  EXPECT_EQ(of(EkiType::kMove)[0].id, 1u) << "its first move";
}

TEST_F(EkiStates, AReferenceTakesTenStatesOfThisConnection) {
  for (int connection = 0; connection < 2; ++connection) {
    connect();
    say();
    core.rereference();
    for (int i = 2; i < 10; ++i) {
      say();
      ASSERT_EQ(facts().link, RobotLink::kNotReferenced) << i;
      ASSERT_TRUE(facts().rereference_pending);
    }
    say();
    EXPECT_EQ(facts().link, RobotLink::kReady);
    EXPECT_FALSE(facts().rereference_pending);
    close();
  }
}

// ---- references -------------------------------------------------------------------------------------

TEST_F(EkiStates, AReferenceIsAnArmThatRestedForTenStates) {
  connect();
  say_times(15);
  a1_deg = 1.0;  // the arm is jogged
  core.rereference();
  for (int i = 1; i < 10; ++i) {
    say();
    ASSERT_EQ(facts().link, RobotLink::kNotReferenced) << i;
  }
  say();
  EXPECT_EQ(facts().link, RobotLink::kReady);
}

TEST_F(EkiStates, NoReferenceIsTakenWhileTheControllerMovesAndOneIsBehindAMoveThatIsDone) {
  connect();
  progress = EkiProgress::kMoving;
  say_times(15);
  core.rereference();
  say_times(15);
  EXPECT_EQ(facts().link, RobotLink::kNotReferenced);
  progress = EkiProgress::kDone;
  say();
  EXPECT_EQ(facts().link, RobotLink::kReady);
}

TEST_F(EkiStates, ThreeDecimalsAreEnoughAndTwoAreNotAsTenStatesShow) {
  for (const int given : {2, 3}) {
    decimals = given;
    connect();
    say_times(9);
    EXPECT_EQ(facts().trouble, EkiTrouble::kNone) << "they may be exact";
    say();
    EXPECT_EQ(facts().trouble, given == 2 ? EkiTrouble::kCoarse : EkiTrouble::kNone);
    core.rereference();
    say_times(15);
    EXPECT_EQ(facts().link, given == 2 ? RobotLink::kNotReferenced : RobotLink::kReady);
    close();
  }
}

TEST_F(EkiStates, AskedForInAMoveItIsIgnored) {
  get_ready();
  begin_and_take(5.0);
  core.rereference();
  tick();
  EXPECT_FALSE(facts().rereference_pending);
  EXPECT_EQ(facts().link, RobotLink::kReady);
  EXPECT_TRUE(facts().moving);
}

TEST_F(EkiStates, AControllerThatIsNotReadyAnyMoreLosesItAtRestAndNothingBegins) {
  get_ready();
  ready = false;
  say();
  EXPECT_EQ(facts().link, RobotLink::kNotReferenced);
  EXPECT_EQ(facts().trouble, EkiTrouble::kNotReady);
  begin(5.0);
  say();
  const CoreResult refused = result();
  EXPECT_EQ(refused.outcome, MoveOutcome::kRefused);
  EXPECT_TRUE(is<cause::ControllerNotReady>(refused.cause));
  EXPECT_EQ(refused.interruption, Interruption::kNone);
  ready = true;
  say_times(15);
  EXPECT_EQ(facts().link, RobotLink::kNotReferenced) << "it has to be asked for";
  reference();
  // During a move this is evaluated by the mover.
  begin_and_take(5.0);
  ready = false;
  say();
  EXPECT_EQ(facts().link, RobotLink::kReady);
  EXPECT_TRUE(facts().moving);
}

// ---- content of a state -----------------------------------------------------------------------------

TEST_F(EkiStates, AreTakenOverWordByWord) {
  ready = false, mode = 2, drives = false, stopped = true, override_percent = 30, input = true;
  fault = 7, bad = 3;
  connect();
  say();
  EXPECT_FALSE(facts().ready || facts().drives);
  EXPECT_TRUE(facts().stopped && facts().input);
  EXPECT_EQ(facts().mode, OperatingMode::kT2);
  EXPECT_EQ(facts().override_percent, 30);
  EXPECT_EQ(facts().fault, 7);
  EXPECT_EQ(facts().unread_by_controller, 3u);
}

TEST_F(EkiStates, TheirPaceIsThatOfTheNewestFifty) {
  connect();
  say();
  EXPECT_EQ(facts().cycle_s, 0.0) << "one is no pace";
  say();
  EXPECT_NEAR(facts().cycle_s, 0.02, 1e-9);
  say_times(60);
  EXPECT_NEAR(facts().jitter_s, 0.0, 1e-9);
  for (int i = 1; i <= 49; ++i) {
    say(30ms);
    EXPECT_NEAR(facts().cycle_s, 0.02 + 0.01 * i / 49, 1e-9) << i;
  }
  EXPECT_GT(facts().jitter_s, 1e-3);
  EXPECT_NEAR(facts().longest_gap_s, 0.03, 1e-9);
}

TEST_F(EkiStates, OfAnotherSessionAreForgottenWithTheFirstOfOurs) {
  connect();
  obeyed = 777;
  say();
  EXPECT_EQ(facts().trouble, EkiTrouble::kOtherSession);
  EXPECT_EQ(facts().other_session, 777u);
  EXPECT_EQ(facts().link, RobotLink::kDown);
  obeyed.reset();
  say();
  EXPECT_EQ(facts().trouble, EkiTrouble::kNone);
  EXPECT_EQ(facts().other_session, 0u);
}

TEST_F(EkiStates, BytesWithoutAnEndLoseTheLinkByThatName) {
  get_ready();
  begin_and_take(5.0);
  now += 20ms;
  core.on_bytes("<RobotState>" + std::string(9000, 'x'), now);
  EXPECT_EQ(facts().last_error, EkiError::kOversized);
  EXPECT_EQ(facts().bad_documents, 1u);
  EXPECT_EQ(facts().loss, EkiLoss::kNotAStream);
  EXPECT_EQ(facts().link, RobotLink::kLost);
  const CoreResult ended = result();
  EXPECT_EQ(ended.outcome, MoveOutcome::kRobotSilent);
  EXPECT_TRUE(is<cause::LinkClosed>(ended.cause));
  EXPECT_EQ(ended.interruption, Interruption::kOther);
}

struct EkiSevenAxes : EkiStates {
  static EkiConfig seven() {
    EkiConfig config = eki_config();
    config.limits.push_back(config.limits.front());
    config.full_speed_rad_s.push_back(1.0);
    return config;
  }
  EkiSevenAxes() : EkiStates(seven()) {}
};

TEST_F(EkiSevenAxes, StatesOfSixAreNamedAndForgottenWithTheConnection) {
  connect();
  say();
  EXPECT_EQ(facts().trouble, EkiTrouble::kTooFewAxes);
  EXPECT_EQ(facts().last_error, EkiError::kNoAxes);
  EXPECT_EQ(facts().link, RobotLink::kDown);
  close();
  connect();
  tick();
  EXPECT_EQ(facts().trouble, EkiTrouble::kNotHeard);
}

// ---- moves and telegrams ----------------------------------------------------------------------------

TEST_F(EkiStates, AMoveThatWaitsToBeginWhenTheConnectionClosesIsRefusedByThat) {
  get_ready();
  begin(5.0);
  close();
  const CoreResult refused = result();
  EXPECT_EQ(refused.outcome, MoveOutcome::kRefused);
  EXPECT_TRUE(is<cause::LinkClosed>(refused.cause));
  begin(5.0);
  tick();
  const CoreResult again = result();
  EXPECT_TRUE(is<cause::NotConnected>(again.cause));
}

TEST_F(EkiStates, AMoveThatTheLinkEndedIsAnInterruptionAndOneThatWasStoppedIsNot) {
  get_ready();
  begin_and_take(5.0);
  core.stop();
  say();
  progress = EkiProgress::kDone;
  outcome = EkiOutcome::kStop;
  say_times(15);
  const CoreResult stopped_by_us = result();
  EXPECT_EQ(stopped_by_us.outcome, MoveOutcome::kStopped);
  EXPECT_EQ(stopped_by_us.interruption, Interruption::kNone);
  begin_and_take(5.0);
  EXPECT_EQ(move_id, 2u);
  close();
  const CoreResult ended = result();
  EXPECT_EQ(ended.outcome, MoveOutcome::kRobotSilent);
  EXPECT_EQ(ended.interruption, Interruption::kOther);
}

TEST_F(EkiStates, AMoveThatIsNotConfirmedCostsTheLinkByThatName) {
  get_ready();
  begin(5.0);
  for (int i = 0; i < 40 && facts().link == RobotLink::kReady; ++i) say();
  EXPECT_EQ(facts().link, RobotLink::kLost);
  EXPECT_EQ(facts().loss, EkiLoss::kNotTaken);
  const CoreResult ended = result();
  expect_cause(ended.cause, cause::CommandNotTaken{0.5}, 0.03);
}

TEST_F(EkiStates, AStopIsSaidAtOnceAlsoWhereTheWindowIsFullAndRepeatedUntilTheArmRests) {
  for (const bool full : {false, true}) {
    if (full) close();
    progress = EkiProgress::kIdle;
    outcome = EkiOutcome::kNone;
    move_id = 0;
    get_ready();
    begin_and_take(5.0);
    reads = !full;
    if (full) say_times(12);  // beats fill it
    core.stop();
    say();
    ASSERT_EQ(of(EkiType::kStop).size(), 1u) << full;
    EXPECT_EQ(of(EkiType::kStop)[0].id, move_id);
    reads = true;
    heard = commands.back().seq;
    say_times(10);
    EXPECT_GT(of(EkiType::kStop).size(), 3u) << "one telegram may be unreadable";
    progress = EkiProgress::kDone;
    outcome = EkiOutcome::kStop;
    say_times(12);
    const std::size_t all = of(EkiType::kStop).size();
    EXPECT_EQ(result().outcome, MoveOutcome::kStopped);
    say_times(10);
    EXPECT_EQ(of(EkiType::kStop).size(), all);
  }
}

TEST_F(EkiStates, AMoveThatIsStoppedBeforeThereWasRoomForItIsNeverSaid) {
  get_ready();
  reads = false;
  say_times(12);  // the window is full
  begin(5.0);
  say();
  ASSERT_TRUE(of(EkiType::kMove).empty());
  EXPECT_TRUE(facts().moving);
  core.stop();
  say();
  const CoreResult cancelled = result();
  EXPECT_EQ(cancelled.outcome, MoveOutcome::kStopped);
  EXPECT_FALSE(facts().moving);
  reads = true;
  heard = commands.empty() ? heard : commands.back().seq;
  say_times(10);
  EXPECT_TRUE(of(EkiType::kMove).empty()) << "it must not begin later";
  begin(5.0);
  say();
  ASSERT_EQ(of(EkiType::kMove).size(), 1u);
  EXPECT_EQ(of(EkiType::kMove)[0].id, 1u);
}

TEST_F(EkiStates, TelegramsThatAreNotReadAreNamed) {
  get_ready();
  reads = false;
  say_times(30);
  EXPECT_EQ(facts().trouble, EkiTrouble::kUnread);
  reads = true;
  heard = commands.back().seq;
  say();
  EXPECT_EQ(facts().trouble, EkiTrouble::kNone);
}

TEST(EkiSender, ATelegramReadStartsTheWaitForTheNext) {
  EkiConfig config;
  config.limits.assign(2, {-9, 9, 1, 0, 0});
  const auto silence =
      std::chrono::duration_cast<Duration>(std::chrono::duration<double>(config.silence_s));
  const TimePoint begun{1000s};
  EkiSender sender(config);
  sender.begin(7, begun);
  ASSERT_TRUE(sender.send({}, begun));
  EXPECT_FALSE(sender.unread(begun + silence));
  EXPECT_TRUE(sender.unread(begun + silence + 1ms));
  ASSERT_TRUE(sender.confirm(1, begun + silence / 2));
  EXPECT_FALSE(sender.unread(begun + silence + 1ms));
  ASSERT_TRUE(sender.confirm(1, begun + silence));  // again: nothing was read
  EXPECT_TRUE(sender.unread(begun + 3 * silence / 2 + 1ms));
  ASSERT_TRUE(sender.confirm(2, begun + 2 * silence));
  EXPECT_FALSE(sender.unread(begun + 9 * silence));
  ASSERT_TRUE(sender.send({}, begun + 9 * silence));
  EXPECT_FALSE(sender.unread(begun + 10 * silence));
}

TEST_F(EkiStates, TheHelloIsGivenUpBehindFiveSeconds) {
  obeyed = 0;
  connect();
  const TimePoint connected = now;
  while (now + 20ms < connected + 5s) say();
  tick(connected + 5s - now);
  EXPECT_FALSE(core.wants_close());
  tick();
  EXPECT_TRUE(core.wants_close());
  EXPECT_EQ(of(EkiType::kHello).size(), 4u) << "every half second, as far as the window has room";
}

// ---- the end ----------------------------------------------------------------------------------------

TEST_F(EkiStates, TheSessionEndsWithAByeOfItsNewestMoveThatWasHandedOut) {
  EXPECT_FALSE(core.ended());
  get_ready();
  begin_and_take(5.0);
  EXPECT_FALSE(core.ended());
  core.close();
  say();
  EXPECT_FALSE(core.ended()) << "it moves";
  EXPECT_TRUE(of(EkiType::kBye).empty());
  EXPECT_EQ(of(EkiType::kStop).size(), 1u);
  progress = EkiProgress::kDone;
  outcome = EkiOutcome::kStop;
  takes = false;
  say_times(15);
  EXPECT_FALSE(core.ended()) << "the socket has not taken it";
  takes = true;
  listen();
  EXPECT_TRUE(core.ended());
  ASSERT_EQ(of(EkiType::kBye).size(), 1u);
  EXPECT_EQ(of(EkiType::kBye)[0].id, move_id);
  const std::size_t last = commands.size();
  say_times(5);
  EXPECT_EQ(commands.size(), last) << "no beat behind it";
}

TEST_F(EkiStates, AByeGoesOutAlsoWhereTheWindowIsFullAndOnEachConnection) {
  get_ready();
  reads = false;
  say_times(12);
  core.close();
  say();
  EXPECT_EQ(of(EkiType::kBye).size(), 1u);
  EXPECT_TRUE(core.ended());
  close();
  reads = true;
  commands.clear();
  connect();
  EXPECT_TRUE(core.ended()) << "nobody obeys us yet";
  say_times(2);
  EXPECT_EQ(of(EkiType::kBye).size(), 1u);
}

TEST_F(EkiStates, WithoutAConnectionThereIsNobodyToSayGoodbyeTo) {
  core.close();
  EXPECT_TRUE(core.ended());
  connect();
  EXPECT_TRUE(core.ended()) << "nor before it obeys us";
  takes = false;
  say();
  EXPECT_FALSE(core.ended());
}

}  // namespace
}  // namespace cellcal::drivers
