#pragma once
// The last look at a correction before it is written: whatever led to it, no reply asks an axis for
// more speed, acceleration or jerk than its limits. It knows nothing of sessions, moves or packets,
// only what was said last: what is wrong before it ends here, as a value, and the arm holds.
//
// Divided differences of replies stand for the derivatives: those of a path within the limits are
// within them, however the cycle changes. A stop may always be harder: speed may fall at once.

#include <optional>
#include <span>

#include "drivers/kuka/moves/cause.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

class ReplyBound {
 public:
  /// `limits` must outlive this.
  explicit ReplyBound(std::span<const AxisLimit> limits) : limits_(limits) {}

  /// The controller holds this correction [rad], and nothing moves.
  void rest_at(const AxisAngles& held_rad) { last_ = before_ = Said{held_rad}; }
  /// May the next reply lead to this correction [rad]? Then it is what was said last. `stops`: no
  /// move is on its way, or it is being brought to rest.
  std::optional<cause::ReplyBeyondLimit> admit(const AxisAngles& next_rad, double cycle_s,
                                               bool stops);
  /// The controller did not take what was said last.
  void not_taken() { last_ = before_; }

 private:
  struct Said {
    AxisAngles at_rad{}, speed{}, acceleration{};  // those two empty: at rest
    double cycle_s = 0.0, before_s = 0.0;          // to this reply, and to the one before
  };
  std::span<const AxisLimit> limits_;
  Said last_, before_;
};

}  // namespace cellcal::drivers
