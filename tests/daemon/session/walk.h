#pragma once
// A session driven step by step: one event after the other, and the resulting actions.

#include <gtest/gtest.h>

#include <functional>

#include "daemon/session/session.h"
#include "tests/daemon/runner/fakes.h"
#include "tests/daemon/session/events.h"

namespace cellcal::daemon::testing {

/// Timeouts::waypoint
inline constexpr double kWaypointS = 180.0;

class Walk {
 public:
  explicit Walk(std::size_t touches = 2) : plan(std::make_shared<calib::Plan>(line_plan(touches))) {
    state.policy.confirm_every = 1;  // all elements of a touch
  }

  /// By default the devices are ready and the newest move or arming is concerned; see `change`.
  const Walk& on(EventKind kind, const std::function<void(Event&)>& change = nullptr) {
    at += std::chrono::milliseconds(7);
    Event event = event_of_kind(kind);
    event.at = at;
    event.utc = "2026-01-02T03:04:05.000Z";
    std::visit(Meant{*this}, event.evidence);
    if (change) change(event);
    Step next = step(state, event);
    state = std::move(next.state);
    actions = std::move(next.actions);
    if (const CheckJournal* check = find<CheckJournal>()) journal_sound(check->move_id);
    return *this;
  }
  /// At rest after a contact.
  const Walk& contact(double contact_rad, double settled_rad) {
    return on(EventKind::kContact, [=](Event& event) {
      drivers::Latch latch;
      latch.contact_rad = {contact_rad};
      latch.settled_rad = {settled_rad};
      latch.time_sigma_s = 2e-5;
      latch.reaction_s = 0.003;
      latch.bounces = 6;
      move(event).latch = latch;
    });
  }
  void to_routing() {
    on(EventKind::kRun);
    on(EventKind::kPlanned);
    on(EventKind::kLinks);
    on(EventKind::kLinks);
  }
  void to_arming() {
    to_routing();
    on(EventKind::kRouted);
    on(EventKind::kArrived);
  }
  void to_fast_search() {
    to_arming();
    on(EventKind::kArmed);
  }
  /// The contact of a fast search, up to the slow one.
  void to_next_search() {
    contact(0.110, 0.1102);
    on(EventKind::kArrived);
    on(EventKind::kArmed);
  }
  void to_slow_search() {
    to_fast_search();
    to_next_search();
  }

  template <class T>
  const T* find() const {
    for (const Action& action : actions) {
      if (const T* found = std::get_if<T>(&action)) return found;
    }
    return nullptr;
  }
  template <class T>
  const T& the() const {
    static const T kNone{};
    const T* found = find<T>();
    EXPECT_NE(found, nullptr) << "in phase " << to_string(state.phase);
    return found != nullptr ? *found : kNone;
  }
  double timeout_s() const {
    EXPECT_TRUE(state.deadline);
    return state.deadline ? std::chrono::duration<double>(*state.deadline - at).count() : -1.0;
  }

  /// Everything recorded before this move is on disk.
  void journal_sound(std::uint32_t move_id) {
    Event event{JournalSound{move_id}};
    event.at = at;
    Step next = step(state, event);
    state = std::move(next.state);
    for (Action& action : next.actions) actions.push_back(std::move(action));
  }

  struct Meant {
    Walk& walk;
    void operator()(MoveEnded& move) const { move.move_id = walk.state.move_id; }
    void operator()(JournalSound& sound) const { sound.move_id = walk.state.move_id; }
    void operator()(ArmAnswer& answer) const { answer.arm_id = walk.state.arm_id; }
    void operator()(Links& links) const {
      links.robot = drivers::RobotLink::kReady;
      links.contact = drivers::ContactLink::kReady;
      links.self_test_ok = links.clock_ok = true;
    }
    void operator()(Planned& planned) const {
      planned.offer = offer();
      planned.plan_hash = "hash";
    }
    void operator()(Routed& routed) const { routed.offer = offer(); }
    void operator()(auto&) const {}
    Offer offer() const {
      calib::Progress progress;
      progress.touches_left = 4;
      progress.checks_left = 2;
      return {walk.plan, "stage", progress};
    }
  };

  State state;
  Actions actions;
  std::shared_ptr<calib::Plan> plan;
  drivers::TimePoint at{std::chrono::hours(2)};
};

inline void expect_move(const Walk& walk, drivers::MoveKind kind, double to_rad, double cruise_s,
                        double timeout_s) {
  const drivers::Move& move = walk.the<BeginMove>().move;
  EXPECT_EQ(move.kind, kind);
  ASSERT_EQ(move.target_rad.size(), 1u);
  EXPECT_NEAR(move.target_rad[0], to_rad, 1e-9);
  EXPECT_NEAR(move.cruise_s, cruise_s, 1e-9);
  EXPECT_EQ(move.id, walk.state.move_id);
  EXPECT_EQ(move.arm_id, kind == drivers::MoveKind::kSearch ? walk.state.arm_id : 0);
  EXPECT_NEAR(walk.timeout_s(), timeout_s, 2e-3);
}

}  // namespace cellcal::daemon::testing
