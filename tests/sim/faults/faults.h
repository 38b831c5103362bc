#pragma once
// The faults of the matrix: what is done to the cell, when, and where that makes no sense.

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

/// What a fault may reach. `runner` is null before the session begins.
struct Victim {
  FaultyCell& cell;
  TimePoint at;  ///< of the fault
  daemon::Runner* runner = nullptr;
};

/// Whose dead man it is that stops the arm.
enum class Silent { kRobot, kSensor, kHand };

struct Fault {
  std::string name;     ///< the row of the matrix
  std::string variant;  ///< in words, with its figures
  std::string where;    ///< line and direction, or device
  /// What has to be different at power on.
  std::function<void(CellOptions&, TimePoint at)> before{};
  /// Books the fault. Called once, before anything happens.
  std::function<void(const Victim&)> book{};
  /// From this instant on this one is not heard or does not move any more, for longer than any
  /// dead man waits: the arm must rest within the dead-man time of it, not of the error alone.
  std::optional<Silent> silences{};
  /// Replies reach the controller as they are said: what it commands is what the adapter said.
  bool replies_arrive = false;
  /// The session is ended on request: that is its name.
  bool asks_for_end = false;
  /// Not null: why the combination makes no sense.
  std::function<const char*(TouchPhase)> why_not{};
};

/// All faults that a cell over this wire can have, those that make no sense on it included.
std::vector<Fault> faults_of(Wire wire);
/// The rows of the matrix, in order.
std::vector<std::string> fault_names();

}  // namespace cellcal::faults
