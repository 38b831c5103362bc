#include "drivers/kuka/rsi/rsi_accumulator.h"

#include <algorithm>
#include <cmath>

#include "drivers/units.h"

namespace cellcal::drivers {

CorrectionAccumulator::CorrectionAccumulator(CorrectionMode mode, int decimals, std::size_t axes)
    : mode_(mode), per_deg_(std::pow(10.0, decimals)), held_rad_(axes, 0.0) {}

void CorrectionAccumulator::set(const AxisAngles& held_rad) {
  held_rad_ = held_rad;
  for (std::size_t i = 0; i < held_rad.size(); ++i) {
    held_[i] = std::llround(held_rad[i] * kDegPerRad * per_deg_);
  }
}

std::span<const double> CorrectionAccumulator::next_deg(const AxisAngles& wanted_rad,
                                                        const AxisAngles& step_rad) {
  for (std::size_t i = 0; i < held_rad_.size(); ++i) {
    const double wanted_deg = wanted_rad[i] * kDegPerRad;
    if (mode_ == CorrectionMode::kAbsolute) {
      sent_deg_[i] = wanted_deg;
      held_rad_[i] = wanted_rad[i];
      continue;
    }
    // One unit more than the step: the rounding of the last reply.
    const std::int64_t most =
        static_cast<std::int64_t>(std::floor(step_rad[i] * kDegPerRad * per_deg_)) + 1;
    const std::int64_t wanted = std::llround(wanted_deg * per_deg_);
    const std::int64_t step = std::clamp(wanted - held_[i], -most, most);
    held_[i] += step;
    sent_deg_[i] = static_cast<double>(step) / per_deg_;
    held_rad_[i] = static_cast<double>(held_[i]) / per_deg_ / kDegPerRad;
  }
  return again_deg();
}

std::span<const double> CorrectionAccumulator::hold_deg() {
  for (std::size_t i = 0; i < held_rad_.size(); ++i) {
    sent_deg_[i] = mode_ == CorrectionMode::kAbsolute ? held_rad_[i] * kDegPerRad : 0.0;
  }
  return again_deg();
}

}  // namespace cellcal::drivers
