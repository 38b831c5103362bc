#pragma once
// Which failures are harmless: those after which a session may go on by itself. One table, with the
// reason of each; what is not harmless in it is never retried, however often it may pass.
//
// Harmless is only what leaves the controller at work and the arm where it was commanded to rest.
// Where this computer was late, and neither robot nor sensor, it goes on by default, a bounded number
// of times (BusyRepeats); behind anything else only where its owner allows it ([session] retries).
// Whether it was harmless is proven each time before anything moves: the same session of the controller
// is back, no further gap, late reply or late heartbeat within Timeouts::watching, the sensor's clock map
// is good, its self-test has passed (or the arm stands in a contact that it was making), the position is
// taken over anew, and the arm is where it was left.

#include <array>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "daemon/session/failure.h"
#include "drivers/robot.h"

namespace cellcal::daemon {

enum class GoesOn {
  kNever,
  kRetries,  ///< where the owner allows it, so often as [session] retries says
  kRepeats,  ///< by default: this computer was late
};

struct Harm {
  FailureKind failure;
  /// Behind it; none: whatever it is.
  std::optional<drivers::Interruption> by;
  GoesOn goes_on;
  const char* reason;
};

/// Every kind of failure, with what can be behind it.
std::span<const Harm> harm_table();

GoesOn goes_on(FailureKind failure, drivers::Interruption by);

/// How a session names what made a move silent, or a link lose its reference.
FailureKind failure_by(drivers::Interruption by, FailureKind otherwise);

/// A cause of harmless interruptions: after these a session goes on by itself.
struct CountedCause {
  drivers::Interruption by;
  const char* name;   ///< in journal, API and metrics
  const char* words;  ///< for people, after a number
  bool of_computer;   ///< this computer was late
};
inline constexpr std::array kCountedCauses{
    CountedCause{drivers::Interruption::kLateBytes, "sensor-data-late",
                 "sensor data late (this computer was busy)", true},
    CountedCause{drivers::Interruption::kLateReplies, "robot-replies-late",
                 "robot replies late (this computer was busy)", true},
    CountedCause{drivers::Interruption::kPacketsStopped, "packets-stopped",
                 "controller packets stopped", false}};

/// Interruptions by their cause, in the order of kCountedCauses.
struct InterruptionCounts {
  std::array<int, kCountedCauses.size()> of{};

  int total() const;
  int of_computer() const;  ///< this computer was late
  void count(drivers::Interruption by);
  bool operator==(const InterruptionCounts&) const = default;
};
/// Name of a counted cause; empty for any other.
const char* name_of_cause(drivers::Interruption by);
/// Inverse of name_of_cause(); none for a name that is not counted.
std::optional<drivers::Interruption> cause_of(std::string_view name);
/// "5 sensor data late (this computer was busy), 1 controller packets stopped"; empty without any.
std::string words(const InterruptionCounts& counts);

/// The arm was left where it is, when no axis is farther from there: at 40 deg/s three cycles whose
/// replies were lost leave 0.5 deg, and by hand it is not moved while RSI runs.
inline constexpr double kLeftThereRad = 0.0175;  // 1 deg

}  // namespace cellcal::daemon
