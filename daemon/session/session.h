#pragma once
// The session as a pure function, and its table.
//
//   step(State, Event) -> Step{State, actions}
//
// The rows of transition_table() are tried in order; the first whose phases hold the state's phase,
// whose event is the event's kind, and whose guard is true, is taken. Before the table: links and
// residuals are noted in the state, and results of moves and armings that carry another id than the
// newest are stale and change nothing; so is the journal's word on a move that is held no longer.
// After the table: an event that no row lists fails safe.

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "daemon/session/action.h"
#include "daemon/session/event.h"
#include "daemon/session/phase.h"
#include "daemon/session/state.h"

namespace cellcal::daemon {

using Actions = std::vector<Action>;

struct Step {
  State state;
  Actions actions;
};

/// Pure. Throws nothing but std::bad_alloc.
Step step(State state, const Event& event);

/// Whether the row applies; null: always.
using Guard = bool (*)(const State&, const Event&);
/// What the row does, while the phase is still the old one. Null: nothing.
using Effect = void (*)(State&, const Event&, Actions&);

struct Transition {
  Phases from;
  Events on;
  Guard when;
  const char* when_words;   ///< "" where there is no guard
  std::optional<Phase> to;  ///< none: the phase and its deadline stay
  Effect then;
  const char* words;  ///< what the row does, for people
};

std::span<const Transition> transition_table();

/// Result of another move or arming than the newest, or for a move that is not held: changes
/// nothing.
bool is_stale(const State& state, const Event& event);

/// The row that step() takes for an event that is not stale; null where it fails safe.
const Transition* find_row(const State& state, const Event& event);

/// The table as a Mermaid state diagram and as Graphviz.
std::string mermaid_picture();
std::string graphviz_picture();

}  // namespace cellcal::daemon
