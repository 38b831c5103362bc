#pragma once
// The session as a pure function, and its table.
//
//   step(State, Event) -> Step{State, actions}
//
// The rows of transition_table() are tried in order; the first row that contains the state's phase and the
// event's kind, and whose guard is true, is taken. Before the table: links and residuals are stored in the
// state, and results of moves and armings with another id than the newest are stale and change nothing; so is
// a kJournalSound for a move that is no longer held. After the table: an event that no row lists fails safe.

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

/// Condition of a row; null: always true.
using Guard = bool (*)(const State&, const Event&);
/// Effect of a row, run while the phase is still the old one. Null: none.
using Effect = void (*)(State&, const Event&, Actions&);

struct Transition {
  Phases from;
  Events on;
  Guard when;
  const char* when_words;   ///< "" without a guard
  std::optional<Phase> to;  ///< none: phase and deadline are kept
  Effect then;
  const char* words;  ///< effect of the row, for people
};

std::span<const Transition> transition_table();

/// Result of another move or arming than the newest, or for a move that is not held: changes nothing.
bool is_stale(const State& state, const Event& event);

/// The row that step() takes for an event that is not stale, with its links noted in the state; null: it
/// fails safe.
const Transition* find_row(const State& state, const Event& event);

/// The table as a Mermaid state diagram and as Graphviz.
std::string mermaid_picture();
std::string graphviz_picture();

}  // namespace cellcal::daemon
