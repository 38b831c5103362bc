#pragma once
// Faults of the matrix: effect on the cell, timing, and inapplicable combinations.

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "cell.h"
#include "daemon/runner/runner.h"

namespace cellcal::faults {

/// The phases of a touch, the columns of the matrix.
enum class TouchPhase { kConnect, kTransit, kApproach, kSearch, kContact, kLatch, kRetreat };
inline constexpr std::array kTouchPhases{
    TouchPhase::kConnect, TouchPhase::kTransit, TouchPhase::kApproach, TouchPhase::kSearch,
    TouchPhase::kContact, TouchPhase::kLatch,   TouchPhase::kRetreat};
const char* to_string(TouchPhase phase);

/// Access for a fault. `runner` is null before the session begins.
struct Victim {
  FaultyCell& cell;
  TimePoint at;  ///< of the fault
  daemon::Runner* runner = nullptr;
};

/// The dead man that stops the arm.
enum class Silent { kRobot, kSensor, kHand };

struct Fault {
  std::string name;     ///< the row of the matrix
  std::string variant;  ///< description with figures
  std::string where;    ///< line and direction, or device
  /// Changes of the options at power on.
  std::function<void(CellOptions&, TimePoint at)> before{};
  /// Schedules the fault. Called once, before the run.
  std::function<void(const Victim&)> book{};
  /// From this instant on this device is silent or stationary, for longer than any dead-man time:
  /// the arm must rest within the dead-man time of it, not only of the error.
  std::optional<Silent> silences{};
  /// Replies arrive unmodified: the controller's command equals the adapter's.
  bool replies_arrive = false;
  /// The session is ended on request, which is its failure.
  bool asks_for_end = false;
  /// Not null: why the combination is not applicable.
  std::function<const char*(TouchPhase)> why_not{};
};

/// All faults of a cell with this interface, including inapplicable ones.
std::vector<Fault> faults_of(Wire wire);
/// The rows of the matrix, in order.
std::vector<std::string> fault_names();

}  // namespace cellcal::faults
