#pragma once
// The correction held by the controller if it accepted every reply, and the next reply that leads
// to the desired one. The control is based on the accumulator, not on the measured position.
//
// ABSOLUTE: the reply is the correction itself. RELATIVE: it is the increment of this cycle, and
// the controller adds them up. Increments are counted in units of the last transmitted decimal, so
// that rounding remainders are carried over to the next reply.

#include <array>
#include <cstdint>
#include <span>

#include "drivers/kuka/rsi/rsi_config.h"

namespace cellcal::drivers {

class CorrectionAccumulator {
 public:
  CorrectionAccumulator(CorrectionMode mode, int decimals, std::size_t axes);

  /// Sets the correction held by the controller [rad]: after taking over a session, or a new
  /// reference.
  void set(const AxisAngles& held_rad);
  /// Reply for the controller to hold `wanted_rad` [deg]. Relative: no axis changes by more than
  /// `step_rad` in one reply.
  std::span<const double> next_deg(const AxisAngles& wanted_rad, const AxisAngles& step_rad);
  /// Another reply to the packet answered last: identical, counted once.
  std::span<const double> again_deg() const { return {sent_deg_.data(), held_rad_.size()}; }
  /// Reply without a change: the current correction, or zero increments.
  std::span<const double> hold_deg();

  const AxisAngles& held_rad() const { return held_rad_; }

 private:
  CorrectionMode mode_;
  double per_deg_;  // units of the last decimal
  AxisAngles held_rad_;
  std::array<std::int64_t, kMaxAxes> held_{};  // relative: in these units
  std::array<double, kMaxAxes> sent_deg_{};
};

}  // namespace cellcal::drivers
