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

/// Harmless interruptions, after which a session went on or tries to, by what was behind them.
struct InterruptionCounts {
  int late_bytes = 0, late_replies = 0;  ///< this computer was late
  int packets_stopped = 0;

  int total() const { return late_bytes + late_replies + packets_stopped; }
  void count(drivers::Interruption by);
  bool operator==(const InterruptionCounts&) const = default;
};
/// The causes that are counted.
inline constexpr std::array kCountedCauses{drivers::Interruption::kLateBytes,
                                           drivers::Interruption::kLateReplies,
                                           drivers::Interruption::kPacketsStopped};
int count_of(const InterruptionCounts& counts, drivers::Interruption by);
/// "sensor-data-late", "robot-replies-late", "packets-stopped": in journal, API and metrics; "" of one that is not
/// counted.
const char* name_of_cause(drivers::Interruption by);
std::optional<drivers::Interruption> cause_of(std::string_view name);
/// "5 sensor data late (this computer), 1 packets stopped"; empty where there are none.
std::string words(const InterruptionCounts& counts);

/// The arm was left where it is, when no axis is farther from there: at 40 deg/s three cycles whose
/// replies were lost leave 0.5 deg, and by hand it is not moved while RSI runs.
inline constexpr double kLeftThereRad = 0.0175;  // 1 deg

}  // namespace cellcal::daemon
