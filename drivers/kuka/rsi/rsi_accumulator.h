#pragma once
// What the controller holds if it took every reply, and what the next reply has to say so that it
// holds what is wanted. The accumulator is the truth of the control; the measured position is not.
//
// ABSOLUTE: the reply is the correction itself. RELATIVE: it is the increment of this cycle, and
// the controller adds them up. Increments are counted in units of the wire's last decimal, so that
// what is rounded away in one reply is not lost but sent with the next.

#include <array>
#include <cstdint>
#include <span>

#include "drivers/kuka/rsi/rsi_config.h"

namespace cellcal::drivers {

class CorrectionAccumulator {
 public:
  CorrectionAccumulator(CorrectionMode mode, int decimals, std::size_t axes);

  /// The controller holds this [rad]: a session was taken over, or the arm was looked at anew.
  void set(const AxisAngles& held_rad);
  /// What to send so that the controller holds `wanted_rad` [deg]. Relative: no axis goes farther
  /// than `step_rad` in one reply.
  std::span<const double> next_deg(const AxisAngles& wanted_rad, const AxisAngles& step_rad);
  /// Another reply to the packet that was answered last: the same once more, counted once.
  std::span<const double> again_deg() const { return {sent_deg_.data(), held_rad_.size()}; }
  /// Nothing new: the correction that is held, or no increment.
  std::span<const double> hold_deg();

  const AxisAngles& held_rad() const { return held_rad_; }

 private:
  CorrectionMode mode_;
  double per_deg_;  // units of the last decimal
  AxisAngles held_rad_;
  std::array<std::int64_t, kMaxAxes> held_{};  // relative: in those units
  std::array<double, kMaxAxes> sent_deg_{};
};

}  // namespace cellcal::drivers
