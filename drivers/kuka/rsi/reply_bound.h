#pragma once
// Final check of a correction before it is sent: independent of its origin, no reply demands more
// speed, acceleration or jerk of an axis than its limits. It uses only the preceding replies,
// without sessions, moves or packets: any upstream error ends here, as a value, and the arm holds.
//
// Derivatives are approximated by divided differences of replies: those of a path within the limits
// are within them for any cycle. Stops may be harder: speed may drop immediately.

#include <optional>
#include <span>

#include "drivers/kuka/moves/cause.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

class ReplyBound {
 public:
  /// `limits` must outlive this.
  explicit ReplyBound(std::span<const AxisLimit> limits) : limits_(limits) {}

  /// The controller holds this correction [rad], at rest.
  void rest_at(const AxisAngles& held_rad) { last_ = before_ = Said{held_rad}; }
  /// Checks the next correction [rad]; if admitted, it becomes the last reply. `stops`: no move is
  /// active, or it is being stopped.
  std::optional<cause::ReplyBeyondLimit> admit(const AxisAngles& next_rad, double cycle_s,
                                               bool stops);
  /// The controller did not accept the last reply.
  void not_taken() { last_ = before_; }

 private:
  struct Said {
    AxisAngles at_rad{}, speed{}, acceleration{};  // speed and acceleration empty: at rest
    double cycle_s = 0.0, before_s = 0.0;          // to this reply, and to the preceding one
  };
  std::span<const AxisLimit> limits_;
  Said last_, before_;
};

}  // namespace cellcal::drivers
