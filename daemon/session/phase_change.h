#pragma once
// A change of phase in the journal's log: "fast search -> backing off on contact".

#include <optional>
#include <string>
#include <string_view>

#include "daemon/session/event.h"
#include "daemon/session/phase.h"

namespace cellcal::daemon {

struct PhaseChange {
  Phase from = Phase::kIdle, to = Phase::kIdle;
  bool operator==(const PhaseChange&) const = default;
};

std::string words(const PhaseChange& change, EventKind on);
/// The change at the beginning of `words`, ignoring the rest; none for other text.
std::optional<PhaseChange> phase_change_in(std::string_view words);

}  // namespace cellcal::daemon
