// Every event in every phase.

#include <gtest/gtest.h>

#include <set>

#include "tests/daemon/runner/fakes.h"
#include "tests/daemon/session/events.h"

namespace cellcal::daemon {
namespace {

struct Param {
  bool one_by_one = false;  ///< touches are chosen one by one
  int retries = 0;
  /// Interruption reported by events of the robot's link.
  drivers::Interruption interruption = drivers::Interruption::kNone;
  BusyRepeats repeats{0, 0};
};

bool of_the_sensor(const Param& param) {
  return param.interruption == drivers::Interruption::kLateBytes ||
         param.interruption == drivers::Interruption::kUnheard;
}

/// A state with the data required by every guard.
State state_in(Phase phase, const Param& param) {
  State state;
  state.one_by_one = param.one_by_one;
  state.retries = param.retries;
  state.repeats = param.repeats;
  // Pending, for phases that wait after such a silence.
  state.unheard = param.interruption == drivers::Interruption::kUnheard;
  if (param.interruption == drivers::Interruption::kLateBytes)
    state.busy_until = drivers::TimePoint(std::chrono::hours(1));
  state.interrupted = Failure{FailureKind::kContactSilent, "earlier"};
  state.phase = phase;
  state.plan = std::make_shared<const calib::Plan>(testing::line_plan(3));
  state.move_id = 7;
  state.arm_id = 3;
  return state;
}

/// The same state with the newest move not yet begun.
State holding(State state) {
  state.held = HeldMove{{}, std::chrono::seconds(1)};
  state.held->move.id = ++state.move_id;
  return state;
}

struct Meant {
  const Param& param;
  void operator()(MoveEnded& move) const {
    move.move_id = 7;
    move.at_rad = {0.11};
    move.interruption = param.interruption;
    move.latch.emplace();
    move.latch->contact_rad = move.latch->settled_rad = {0.11};
  }
  void operator()(Links& links) const {
    if (of_the_sensor(param)) {
      const bool known = param.interruption == drivers::Interruption::kLateBytes;
      links.fault = known ? drivers::ContactFault::kDeliveredLate : drivers::ContactFault::kSilent;
      links.delivery.open = !known;
    } else {
      links.interruption = param.interruption;
    }
    const bool ready = param.interruption == drivers::Interruption::kNone || of_the_sensor(param);
    links.robot = ready ? drivers::RobotLink::kReady : drivers::RobotLink::kLost;
    links.interruptions = ready ? 0 : 1;
    links.contact =
        of_the_sensor(param) ? drivers::ContactLink::kFault : drivers::ContactLink::kReady;
  }
  void operator()(ArmAnswer& answer) const { answer.arm_id = 3; }
  void operator()(JournalSound& sound) const { sound.move_id = 8; }
  void operator()(Planned& planned) const { planned.offer.plan = plan(); }
  void operator()(Routed& routed) const { routed.offer.plan = plan(); }
  void operator()(Identified& identified) const {
    identified.result = std::make_shared<const SessionResult>();
  }
  void operator()(auto&) const {}
  static std::shared_ptr<const calib::Plan> plan() {
    return std::make_shared<const calib::Plan>(testing::line_plan(3));
  }
};

Event event_of_kind(EventKind kind, const Param& param = {}) {
  Event event = testing::event_of_kind(kind);
  event.words = "evidence";
  std::visit(Meant{param}, event.evidence);
  return event;
}

template <typename T>
int count(const Actions& actions) {
  int found = 0;
  for (const Action& action : actions) found += std::holds_alternative<T>(action) ? 1 : 0;
  return found;
}

std::string pair(Phase phase, EventKind kind) {
  return std::string(to_string(phase)) + " x " + to_string(kind);
}

class EveryPair : public ::testing::TestWithParam<Param> {};
INSTANTIATE_TEST_SUITE_P(
    OfPhaseAndEvent, EveryPair,
    ::testing::Values(Param{false}, Param{true},
                      Param{false, 1, drivers::Interruption::kPacketsStopped},
                      Param{true, 1, drivers::Interruption::kPacketsStopped},
                      Param{false, 1, drivers::Interruption::kLateReplies},
                      Param{false, 0, drivers::Interruption::kLateReplies, {1, 1}},
                      Param{false, 0, drivers::Interruption::kLateBytes, {1, 1}},
                      Param{true, 0, drivers::Interruption::kLateBytes, {1, 1}},
                      Param{true, 0, drivers::Interruption::kLateBytes},
                      Param{false, 0, drivers::Interruption::kUnheard, {1, 1}},
                      Param{true, 0, drivers::Interruption::kUnheard, {1, 1}},
                      Param{false, 9, drivers::Interruption::kUnheard},
                      Param{true, 0, drivers::Interruption::kPacketsStopped},
                      Param{false, 1, drivers::Interruption::kOther}));

TEST_P(EveryPair, HasAnAnswerToEveryEventInEveryPhase) {
  for (Phase phase : kAllPhases) {
    for (EventKind kind : kAllEvents) {
      if (kind == EventKind::kJournalSound) continue;  // no move is pending: dropped, see below
      const Event event = event_of_kind(kind, GetParam());
      State state = state_in(phase, GetParam());
      if (kind == EventKind::kLinks) state.links = event.get<Links>();
      const Transition* row = find_row(state, event);
      const Step next = step(std::move(state), event);
      if (row != nullptr) {
        EXPECT_EQ(next.state.phase, row->to.value_or(phase)) << pair(phase, kind);
        continue;
      }
      ASSERT_TRUE(next.state.failure.has_value()) << pair(phase, kind);
      EXPECT_EQ(next.state.failure->kind, FailureKind::kUnexpectedEvent) << pair(phase, kind);
      EXPECT_EQ(count<StopArm>(next.actions), 1) << pair(phase, kind);
      EXPECT_TRUE(next.state.phase == Phase::kFailed || next.state.phase == Phase::kStopping)
          << pair(phase, kind);
    }
  }
}

TEST_P(EveryPair, DecidesOnAMoveOnlyIntoAMovingPhaseAndNeverOnTheWayToAnEnd) {
  for (Phase phase : kAllPhases) {
    for (EventKind kind : kAllEvents) {
      const Step next = step(state_in(phase, GetParam()), event_of_kind(kind, GetParam()));
      const int moves = count<CheckJournal>(next.actions);
      EXPECT_LE(moves, 1) << pair(phase, kind);
      EXPECT_TRUE(moves == 0 || kMovingPhases.has(next.state.phase)) << pair(phase, kind);
      EXPECT_EQ(next.state.held.has_value(), moves == 1) << pair(phase, kind);
      const bool entered = kMovingPhases.has(next.state.phase) && next.state.phase != phase;
      EXPECT_TRUE(!entered || moves == 1) << pair(phase, kind);
    }
  }
}

TEST_P(EveryPair, BeginsAMoveOnlyWhenTheJournalSaysThatAllBeforeItIsOnDisk) {
  for (Phase phase : kAllPhases) {
    for (EventKind kind : kAllEvents) {
      for (const bool held : {false, true}) {
        const State state = state_in(phase, GetParam());
        const Step next = step(held ? holding(state) : state, event_of_kind(kind));
        const bool released = held && kMovingPhases.has(phase) && kind == EventKind::kJournalSound;
        EXPECT_EQ(count<BeginMove>(next.actions), released ? 1 : 0) << pair(phase, kind);
        EXPECT_TRUE(!released || (next.state.phase == phase && !next.state.held));
      }
    }
  }
}

TEST_P(EveryPair, EndsAMoveThatHasNotBegunWithoutAStop) {
  Event lost = event_of_kind(EventKind::kLinks), faulty = lost;
  testing::links(lost).robot = drivers::RobotLink::kLost;
  testing::links(faulty).contact = drivers::ContactLink::kFault;
  const std::pair<Event, std::optional<FailureKind>> kCases[] = {
      {event_of_kind(EventKind::kAbort), std::nullopt},
      {event_of_kind(EventKind::kDeadline), FailureKind::kJournal},
      {event_of_kind(EventKind::kJournalFailed), FailureKind::kJournal},
      {lost, FailureKind::kRobotSilent},
      {faulty, FailureKind::kContactFault}};
  for (Phase phase : kAllPhases) {
    if (!kMovingPhases.has(phase)) continue;
    for (const auto& [event, failure] : kCases) {
      const Step next = step(holding(state_in(phase, GetParam())), event);
      EXPECT_EQ(next.state.phase, failure ? Phase::kFailed : Phase::kAborted)
          << pair(phase, event.kind());
      ASSERT_EQ(next.state.failure.has_value(), failure.has_value()) << pair(phase, event.kind());
      EXPECT_TRUE(!failure || next.state.failure->kind == *failure) << pair(phase, event.kind());
      EXPECT_EQ(count<BeginMove>(next.actions) + count<StopArm>(next.actions), 0);
      EXPECT_EQ(count<CloseDevices>(next.actions), 1) << pair(phase, event.kind());
    }
    const Step moving = step(state_in(phase, GetParam()), event_of_kind(EventKind::kJournalFailed));
    EXPECT_EQ(moving.state.phase, Phase::kStopping) << to_string(phase);
    EXPECT_EQ(count<StopArm>(moving.actions), 1) << to_string(phase);
  }
}

TEST_P(EveryPair, GivesEveryPhaseThatWaitsADeadline) {
  for (Phase phase : kAllPhases) {
    for (EventKind kind : kAllEvents) {
      const State next = step(state_in(phase, GetParam()), event_of_kind(kind, GetParam())).state;
      if (next.phase == phase || next.phase == Phase::kIdle || is_final(next.phase)) continue;
      EXPECT_TRUE(next.deadline.has_value()) << pair(phase, kind);
    }
  }
}

TEST_P(EveryPair, AnswersADeadlineInEveryPhaseThatCanHaveOne) {
  for (Phase phase : kAllPhases) {
    if (phase == Phase::kIdle || is_final(phase)) continue;
    const Step next =
        step(state_in(phase, GetParam()), event_of_kind(EventKind::kDeadline, GetParam()));
    const bool waits = (phase == Phase::kWatchingTheLinks || phase == Phase::kRecovering) &&
                       next.state.phase == Phase::kRecovering;
    if (waits) {
      EXPECT_EQ(next.state.deadline, next.state.busy_until)
          << "no longer than a busy spell may take";
      continue;
    }
    EXPECT_NE(next.state.phase, phase) << to_string(phase);
    ASSERT_TRUE(next.state.failure.has_value()) << to_string(phase);
    EXPECT_NE(next.state.failure->kind, FailureKind::kUnexpectedEvent) << to_string(phase);
  }
}

TEST_P(EveryPair, ClosesDevicesAndRecordsTheEndWheneverASessionEndsBadly) {
  for (Phase phase : kAllPhases) {
    for (EventKind kind : kAllEvents) {
      if (is_final(phase)) continue;
      const Step next = step(state_in(phase, GetParam()), event_of_kind(kind, GetParam()));
      if (next.state.phase != Phase::kFailed && next.state.phase != Phase::kAborted) continue;
      EXPECT_EQ(count<CloseDevices>(next.actions), 1) << pair(phase, kind);
      ASSERT_EQ(count<RecordEnd>(next.actions), 1) << pair(phase, kind);
      EXPECT_TRUE(std::holds_alternative<RecordEnd>(next.actions.back())) << pair(phase, kind);
    }
  }
}

TEST_P(EveryPair, CanBeAbortedInEveryPhaseOfASession) {
  for (Phase phase : kAllPhases) {
    if (!kActivePhases.has(phase)) continue;
    const Step next =
        step(state_in(phase, GetParam()), event_of_kind(EventKind::kAbort, GetParam()));
    if (kMovingPhases.has(phase)) {
      EXPECT_EQ(next.state.phase, Phase::kStopping) << to_string(phase);
      EXPECT_EQ(count<StopArm>(next.actions), 1) << to_string(phase);
    } else {
      EXPECT_EQ(next.state.phase, Phase::kAborted) << to_string(phase);
    }
  }
}

TEST_P(EveryPair, MovesNothingAfterAFailure) {
  for (EventKind kind : kAllEvents) {
    for (Phase phase : {Phase::kFailed, Phase::kAborted, Phase::kDone}) {
      const Step next = step(state_in(phase, GetParam()), event_of_kind(kind, GetParam()));
      EXPECT_TRUE(next.actions.empty()) << pair(phase, kind);
    }
  }
}

TEST(SessionTable, EveryRowCanBeReachedByItsPhaseAndEvent) {
  for (const Transition& row : transition_table()) {
    bool possible = false;
    for (Phase phase : kAllPhases) {
      for (EventKind kind : kAllEvents) possible |= row.from.has(phase) && row.on.has(kind);
    }
    EXPECT_TRUE(possible) << row.words;
    EXPECT_STRNE(row.words, "");
    EXPECT_EQ(row.when == nullptr, row.when_words[0] == '\0') << row.words;
  }
}

TEST(SessionTable, NoRowIsHiddenBehindOneWithoutAGuard) {
  const auto table = transition_table();
  for (std::size_t i = 0; i < table.size(); ++i) {
    bool open = false;
    for (Phase phase : kAllPhases) {
      for (EventKind kind : kAllEvents) {
        if (!table[i].from.has(phase) || !table[i].on.has(kind)) continue;
        bool hidden = false;
        for (std::size_t j = 0; j < i; ++j) {
          hidden |= table[j].when == nullptr && table[j].from.has(phase) && table[j].on.has(kind);
        }
        open |= !hidden;
      }
    }
    EXPECT_TRUE(open) << table[i].words;
  }
}

TEST(SessionTable, EveryPhaseCanBeReachedFromIdle) {
  std::set<Phase> reached{Phase::kIdle};
  for (std::size_t round = 0; round < kAllPhases.size(); ++round) {
    for (const Transition& row : transition_table()) {
      for (Phase phase : kAllPhases) {
        if (row.from.has(phase) && reached.contains(phase) && row.to) reached.insert(*row.to);
      }
    }
  }
  EXPECT_EQ(reached.size(), kAllPhases.size());
}

TEST_P(EveryPair, DropsResultsOfEarlierMovesAndArmings) {
  for (Phase phase : kAllPhases) {
    for (EventKind kind : kAllEvents) {
      Event stale = event_of_kind(kind, GetParam());
      if (auto* move = std::get_if<MoveEnded>(&stale.evidence))
        move->move_id = 6;
      else if (auto* answer = std::get_if<ArmAnswer>(&stale.evidence))
        answer->arm_id = 2;
      else if (auto* sound = std::get_if<JournalSound>(&stale.evidence))
        sound->move_id = 6;
      else
        continue;
      const Step next = step(state_in(phase, GetParam()), stale);
      EXPECT_EQ(next.state.phase, phase) << pair(phase, kind);
      EXPECT_TRUE(next.actions.empty()) << pair(phase, kind);
    }
  }
}

TEST(AFailureInWords, SaysOnceWhatTheDriverHasSaid) {
  Event touched = event_of_kind(EventKind::kUnexpectedContact);
  touched.words = "contact outside of a search: look for an obstacle in the path";
  const State end = step(state_in(Phase::kTransit, {}), touched).state;
  ASSERT_TRUE(end.failure);
  const std::string words = calib::words(end.failure->detail);
  const std::string said = "contact outside of a search";
  const std::size_t first = words.find(said);
  ASSERT_NE(first, std::string::npos) << words;
  EXPECT_EQ(words.find(said, first + 1), std::string::npos) << words;
  EXPECT_NE(words.find("obstacle in the path"), std::string::npos) << words;
}

TEST_P(EveryPair, MovesNothingBehindAnInterruptionBeforeANewReference) {
  for (Phase phase : {Phase::kRecovering, Phase::kWatchingTheLinks, Phase::kReferencing}) {
    for (EventKind kind : kAllEvents) {
      const Step next = step(state_in(phase, GetParam()), event_of_kind(kind, GetParam()));
      EXPECT_EQ(count<BeginMove>(next.actions) + count<CheckJournal>(next.actions), 0)
          << pair(phase, kind);
      const bool on = !is_final(next.state.phase) && next.state.phase != phase;
      if (phase == Phase::kReferencing || !on) continue;
      EXPECT_TRUE(
          next.state.phase == Phase::kWatchingTheLinks || next.state.phase == Phase::kRecovering ||
          (next.state.phase == Phase::kIdentifying && count<CloseDevices>(next.actions) == 1) ||
          count<Rereference>(next.actions) == 1)
          << pair(phase, kind);
    }
  }
}

TEST_P(EveryPair, GoesOnByItselfOnlyWhereItMayAndFromWhatIsHarmless) {
  const bool late = GetParam().interruption == drivers::Interruption::kLateReplies ||
                    GetParam().interruption == drivers::Interruption::kLateBytes;
  const bool may =
      (late && GetParam().repeats.of_touch > 0) ||
      (GetParam().retries > 0 && GetParam().interruption == drivers::Interruption::kPacketsStopped);
  for (Phase phase : kAllPhases) {
    for (EventKind kind : kAllEvents) {
      const Step next = step(state_in(phase, GetParam()), event_of_kind(kind, GetParam()));
      if (next.state.interruptions.total() == 0) continue;
      EXPECT_TRUE(may) << pair(phase, kind);
      EXPECT_TRUE(kind == EventKind::kRobotSilent || kind == EventKind::kContactSilent ||
                  kind == EventKind::kRefused || kind == EventKind::kLinks)
          << pair(phase, kind);
    }
  }
}

TEST(SessionTable, DropsAnswersToQuestionsThatWereAskedAnew) {
  State state = state_in(Phase::kRouting, {});
  state.route_id = 2;
  const auto answers = [](std::uint32_t id) {
    return std::vector<Event>{{Routed{{Meant::plan()}, id}}, {WorkFailed{id}}};
  };
  for (const Event& old : answers(1))
    EXPECT_EQ(step(state, old).state.phase, Phase::kRouting) << to_string(old.kind());
  for (const Event& current : answers(2))
    EXPECT_NE(step(state, current).state.phase, Phase::kRouting) << to_string(current.kind());
}

TEST(SessionTable, NamesEveryPhaseEventAndFailureDifferently) {
  std::set<std::string> phases, events;
  for (Phase phase : kAllPhases) phases.insert(to_string(phase));
  for (EventKind kind : kAllEvents) events.insert(to_string(kind));
  EXPECT_EQ(phases.size(), kAllPhases.size());
  EXPECT_EQ(events.size(), kAllEvents.size());
}

}  // namespace
}  // namespace cellcal::daemon
