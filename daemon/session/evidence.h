#pragma once
// Evidence recorded with a session besides its touches: every change of phase, and every event of the contact
// sensor as received. No decision depends on it.

#include <cstddef>
#include <cstdint>
#include <string>

#include "daemon/session/event.h"
#include "daemon/session/phase.h"
#include "drivers/contact.h"

namespace cellcal::daemon {

struct RecordChange {
  PhaseChange change;
  EventKind on = EventKind::kRun;
  std::string utc{};
  double clock_s = 0.0;  ///< session's clock
  /// Late replies as the controller counted them by then, and how late this computer delivered the
  /// sensor's bytes at worst.
  std::uint64_t late_replies = 0;
  double sensor_late_s = 0.0;
};

struct RecordContact {
  std::size_t touch = 0;  ///< current touch
  std::string utc;        ///< time of the event
  drivers::ContactRecord contact;
};

/// A harmless interruption, by its cause.
struct RecordCause {
  std::string utc;
  drivers::Interruption by = drivers::Interruption::kNone;
};

/// "trip", "contact", "revoked", "release".
const char* to_string(drivers::ContactEventKind kind);

}  // namespace cellcal::daemon
