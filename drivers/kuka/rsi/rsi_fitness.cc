#include "drivers/kuka/rsi/rsi_fitness.h"

namespace cellcal::drivers {

namespace {

constexpr int kGoodDecimals = 4;

}  // namespace

Fitness fitness_of_decimals(const CoreState& state) {
  if (state.decimals >= kGoodDecimals) return Fitness::kGood;
  if (state.decimals >= kFewestDecimals) return Fitness::kUsable;
  return state.decimals_unproven ? Fitness::kUnproven : Fitness::kUnfit;
}

Fitness fitness_of_elements(const CoreState& state) {
  if (state.relative && !state.sends_delay) return Fitness::kUnfit;
  return state.sends_setpoint && state.sends_delay ? Fitness::kGood : Fitness::kUsable;
}

}  // namespace cellcal::drivers
