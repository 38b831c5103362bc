#pragma once
// Events of every kind, with access to their evidence.

#include <optional>
#include <stdexcept>
#include <variant>

#include "daemon/session/event.h"

namespace cellcal::daemon::testing {

namespace evidence {

template <class T>
void of(EventKind kind, std::optional<EventEvidence>& found) {
  if (T{}.kind() == kind) found = T{};
}

template <class... T>
std::optional<EventEvidence> of_kind(EventKind kind, const std::variant<T...>*) {
  std::optional<EventEvidence> found;
  (of<T>(kind, found), ...);
  return found;
}

}  // namespace evidence

/// With empty evidence.
inline Event event_of_kind(EventKind kind) {
  for (const auto outcome : all_values<drivers::MoveOutcome>())
    if (event_of(outcome) == kind) return {MoveEnded{outcome}};
  if (kind == EventKind::kArmed) return {ArmAnswer{true}};
  const auto found = evidence::of_kind(kind, static_cast<const EventEvidence*>(nullptr));
  if (!found) throw std::logic_error(to_string(kind));
  return {*found};
}

inline Links& links(Event& event) { return std::get<Links>(event.evidence); }
inline MoveEnded& move(Event& event) { return std::get<MoveEnded>(event.evidence); }
inline ArmAnswer& arming(Event& event) { return std::get<ArmAnswer>(event.evidence); }
inline Assessed& assessed(Event& event) { return std::get<Assessed>(event.evidence); }
inline Routed& routed(Event& event) { return std::get<Routed>(event.evidence); }
inline Offer& offer(Event& event) {
  Planned* planned = std::get_if<Planned>(&event.evidence);
  return planned != nullptr ? planned->offer : routed(event).offer;
}

}  // namespace cellcal::daemon::testing
