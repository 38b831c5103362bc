#include "daemon/session/phase_change.h"

#include "daemon/session/session.h"

namespace cellcal::daemon {

namespace {

constexpr std::string_view kTo = " -> ", kOn = " on ";

}  // namespace

std::string words(const PhaseChange& change, EventKind on) {
  return std::string(to_string(change.from)).append(kTo) + to_string(change.to) + std::string(kOn) +
         to_string(on);
}

std::optional<PhaseChange> phase_change_in(std::string_view words) {
  const std::size_t to = words.find(kTo);
  const std::size_t on = to == words.npos ? to : words.find(kOn, to);
  if (on == words.npos) return std::nullopt;
  const auto before = phase_of(words.substr(0, to));
  const auto after = phase_of(words.substr(to + kTo.size(), on - to - kTo.size()));
  if (!before || !after) return std::nullopt;
  return PhaseChange{*before, *after};
}

}  // namespace cellcal::daemon
