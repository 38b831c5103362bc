#include "drivers/kuka/rsi_stream.h"

#include <algorithm>
#include <cmath>

namespace cellcal::drivers {
namespace {

// Of IPOC per packet, in milliseconds: #IPO_FAST.
constexpr std::uint32_t kSmallestControllerStep = 4;
// Packets over which the cycle is learnt: 0.1 s at 4 ms, long against a jitter of 0.5 ms.
constexpr int kLearnPackets = 25;
// Arrivals within this fraction of IPOC's milliseconds: IPOC counts milliseconds.
constexpr double kMillisecondTolerance = 0.15;
// 2..40 ms, and what a timer on a loaded machine makes of it.
constexpr double kShortestCycleS = 0.0016, kLongestCycleS = 0.048;
constexpr double kSecondsPerMillisecond = 0.001;
// Peers that count packets are programs on a computer of many: they pause for longer than a
// controller may, and their arms wait meanwhile.
constexpr double kSilenceOfCountersS = 0.2;
// Before the cycle is known: five times the longest.
constexpr double kSilenceWhileLearningS = 0.2;
// Largest first step of IPOC that can be one cycle; later ones are compared with the step.
constexpr std::int32_t kLargestStep = 100;

}  // namespace

double RsiStream::seconds_per_ipoc() const {
  return step_ > 0 ? cycle_s_ / static_cast<double>(step_) : 0.0;
}

double RsiStream::silence_limit_s() const {
  if (!learnt()) return kSilenceWhileLearningS;
  const double limit_s = silence_cycles_ * cycle_s_;
  return counts_packets() ? std::max(limit_s, kSilenceOfCountersS) : limit_s;
}

Arrival RsiStream::push(const RobFrame& frame, TimePoint t_rx) {
  const std::uint32_t ipoc = frame.ipoc.value;
  Arrival arrival = Arrival::kFirst;
  if (packets_ > 0) {
    const auto difference = static_cast<std::int32_t>(ipoc - last_ipoc_);
    const std::int32_t window =
        step_ > 0 ? static_cast<std::int32_t>(step_) * (silence_cycles_ + 1) : kLargestStep;
    if (difference == 0) return Arrival::kRepeat;
    if (difference < 0 && difference >= -window) return Arrival::kStale;
    if (difference < 0 || difference > window) return Arrival::kRestart;
    // It counts within a session and never back.
    if (frame.delay && *frame.delay < last_delay_) return Arrival::kRestart;
    const auto step = static_cast<std::uint32_t>(difference);
    if (step_ == 0 || step < step_) step_ = step;
    if (step > step_) gaps_ += step / step_ - 1;
    arrival = Arrival::kNext;
  }
  ++packets_;
  last_ipoc_ = ipoc;
  last_delay_ = frame.delay.value_or(0);
  decimals_ = std::max(decimals_, frame.decimals);
  foreign_hand_ = foreign_hand_ || frame.foreign_hand;
  if (first_deg_.empty()) first_deg_ = frame.axes_deg;
  changed_ = changed_ || frame.axes_deg != first_deg_;
  if (!learnt()) learn(t_rx, ipoc);
  return arrival;
}

void RsiStream::learn(TimePoint t_rx, std::uint32_t ipoc) {
  if (learning_++ == 0) {
    learn_from_ = t_rx;
    learn_from_ipoc_ = ipoc;
  }
  if (learning_ <= kLearnPackets) return;
  const double elapsed_s = std::chrono::duration<double>(t_rx - learn_from_).count();
  const double cycles = static_cast<double>(ipoc - learn_from_ipoc_) / step_;
  const double measured_s = elapsed_s / cycles;
  const double by_ipoc_s = step_ * kSecondsPerMillisecond;
  const bool milliseconds = std::abs(measured_s - by_ipoc_s) <= kMillisecondTolerance * by_ipoc_s;
  // A controller is never taken for a counter, however badly its packets arrive.
  counts_milliseconds_ = milliseconds || step_ >= kSmallestControllerStep;
  const double cycle_s = milliseconds ? by_ipoc_s : measured_s;
  odd_cycle_ = cycle_s < kShortestCycleS || cycle_s > kLongestCycleS;
  if (odd_cycle_) {
    learning_ = 0;
  } else {
    cycle_s_ = cycle_s;
  }
}

}  // namespace cellcal::drivers
