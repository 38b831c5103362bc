#pragma once
// A change of phase as the journal's log has it: "fast search -> backing off on contact".

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
/// The change that such words begin with, whatever follows; nothing where they are others.
std::optional<PhaseChange> phase_change_in(std::string_view words);

}  // namespace cellcal::daemon
