#pragma once
// Start of a sequence of identical packets. Some peers repeat a packet until it is answered, with
// the arm at rest. Repetition of an answered packet shows that replies are no longer accepted.

#include <cstdint>

#include "drivers/robot.h"

namespace cellcal::drivers {

class RepeatWatch {
 public:
  void note(std::uint32_t ipoc, const AxisAngles& actual_rad, TimePoint t_rx) {
    if (ipoc_ == ipoc && actual_rad_ == actual_rad) return;
    ipoc_ = ipoc;
    actual_rad_ = actual_rad;
    since_ = t_rx;
  }
  double same_s(TimePoint t_rx) const {
    return std::chrono::duration<double>(t_rx - since_).count();
  }

 private:
  std::uint32_t ipoc_ = 0;
  AxisAngles actual_rad_;
  TimePoint since_{};
};

}  // namespace cellcal::drivers
