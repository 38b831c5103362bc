#pragma once
// The single clock of all components: steady and injected, so that the emulated cell can run in
// virtual time.

#include <chrono>

namespace cellcal::drivers {

using TimePoint = std::chrono::steady_clock::time_point;
using Duration = std::chrono::steady_clock::duration;

inline double seconds(Duration d) { return std::chrono::duration<double>(d).count(); }

class Clock {
 public:
  virtual ~Clock() = default;
  virtual TimePoint now() const = 0;
  /// Returns when now() >= t. On a virtual clock it advances the emulated cell.
  virtual void sleep_until(TimePoint t) = 0;
};

/// The machine's steady clock.
Clock& steady_clock();

}  // namespace cellcal::drivers
