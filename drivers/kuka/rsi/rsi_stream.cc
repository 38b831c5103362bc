#include "drivers/kuka/rsi/rsi_stream.h"

#include <algorithm>
#include <span>

#include "drivers/median.h"

namespace cellcal::drivers {

namespace {

// An interval above this multiple of the median is a pause, and is truncated to it.
constexpr double kPause = 2.0;
// Adaptation rate of the cycle per packet: a change by half takes 40 packets.
constexpr double kFollow = 0.01;
// IPOC increment per packet in milliseconds: #IPO_FAST.
constexpr std::uint32_t kSmallestControllerStep = 4;
// Packets for learning the cycle: 0.1 s at 4 ms, long compared with a jitter of 0.5 ms.
constexpr std::size_t kLearnPackets = 25;
// IPOC counts milliseconds if the arrivals agree within this fraction.
constexpr double kMillisecondTolerance = 0.15;
// 2..40 ms, with the timer tolerance of a loaded machine.
constexpr double kShortestSeenCycleS = 0.0016, kLongestCycleS = 0.048;
constexpr double kSecondsPerMillisecond = 0.001;
// Peers that count packets are programs on a general-purpose computer: they pause longer than a
// controller may, with their arms waiting.
constexpr double kSilenceOfCountersS = 0.2;
// Before the cycle is known: five times the longest.
constexpr double kSilenceWhileLearningS = 0.2;
// Largest initial IPOC increment of one cycle; later ones are compared with the learned step.
constexpr std::int32_t kLargestStep = 100;
// Maximum consecutive packets overtaken by a faster one.
constexpr int kMostOvertaken = 2;

// Replies not yet counted by the newest packet.
constexpr std::uint64_t kUnderWay = 2;

}  // namespace

double RsiStream::seconds_per_ipoc() const {
  return step_ > 0 ? cycle_s_ / static_cast<double>(step_) : 0.0;
}

double RsiStream::motion_cycle_s() const {
  return counts_milliseconds() ? std::min(cycle_s_, step_ * kSecondsPerMillisecond) : cycle_s_;
}

/// In silence_limit_s(); the configured number until the cycle is known.
int RsiStream::silent_cycles() const {
  if (!counts_packets()) return silence_cycles_;
  return static_cast<int>(std::ceil(silence_limit_s() / cycle_s_));
}

double RsiStream::silence_limit_s() const {
  if (!learnt()) return kSilenceWhileLearningS;
  const double limit_s = silence_cycles_ * cycle_s_;
  return counts_packets() ? std::max(limit_s, kSilenceOfCountersS) : limit_s;
}

Arrival RsiStream::place(std::uint32_t ipoc) const {
  if (packets_ == 0) return Arrival::kFirst;
  const auto difference = static_cast<std::int32_t>(ipoc - last_ipoc_);
  const std::int32_t window =
      step_ > 0 ? static_cast<std::int32_t>(step_) * (silent_cycles() + 1) : kLargestStep;
  if (difference == 0) return Arrival::kRepeat;
  if (difference < -window || difference > window) return Arrival::kRestart;
  return difference < 0 ? Arrival::kStale : Arrival::kNext;
}

void RsiStream::step_to(std::uint32_t ipoc, TimePoint t_rx) {
  const std::uint32_t step = ipoc - last_ipoc_;
  if (step_ == 0 || step < step_) {
    // Every other packet was lost so far, and two cycles were taken for one.
    if (learnt()) cycle_s_ *= static_cast<double>(step) / step_;
    step_ = step;
  }
  if (step > step_) gaps_ += step / step_ - 1;
  note_pace(t_rx, step);
  last_ipoc_ = ipoc;
  last_rx_ = t_rx;
}

Arrival RsiStream::push_damaged(std::uint32_t ipoc, TimePoint t_rx) {
  const Arrival arrival = place(ipoc);
  // Multiples of the cycle only: a smaller increment in a single packet is an invalid IPOC.
  if (arrival == Arrival::kNext && (step_ == 0 || (ipoc - last_ipoc_) % step_ != 0))
    return Arrival::kRestart;
  if (arrival == Arrival::kNext) step_to(ipoc, t_rx);
  return arrival;
}

Arrival RsiStream::push(const RobFrame& frame, TimePoint t_rx) {
  const std::uint32_t ipoc = frame.ipoc.value;
  const Arrival arrival = place(ipoc);
  delay_fell_ = false;
  if (arrival == Arrival::kStale) {
    // Overtaken packets are isolated; a counter that was set back continues from there.
    return ++stale_in_a_row_ > kMostOvertaken ? Arrival::kRestart : Arrival::kStale;
  }
  if (arrival == Arrival::kRepeat || arrival == Arrival::kRestart) return arrival;
  if (arrival == Arrival::kNext) {
    // It never decreases within a session.
    delay_fell_ = frame.delay && *frame.delay < last_delay_;
    if (delay_fell_) return Arrival::kRestart;
    step_to(ipoc, t_rx);
  }
  stale_in_a_row_ = 0;
  ++packets_;
  last_ipoc_ = ipoc;
  last_rx_ = t_rx;
  last_delay_ = frame.delay.value_or(0);
  decimals_ = std::max(decimals_, frame.decimals);
  foreign_hand_ = foreign_hand_ || frame.foreign_hand;
  if (first_deg_.empty()) first_deg_ = frame.axes_deg;
  changed_ = changed_ || frame.axes_deg != first_deg_;
  if (!learnt()) {
    learn();
  } else if (!exact_) {
    follow();
  }
  return arrival;
}

void RsiStream::note_pace(TimePoint t_rx, std::uint32_t counts) {
  paces_[next_pace_] = std::chrono::duration<double>(t_rx - last_rx_).count() / counts;
  next_pace_ = (next_pace_ + 1) % kPaces;
  pace_count_ = std::min(pace_count_ + 1, kPaces);
}

/// Mean time per count, with pauses truncated.
double RsiStream::pace_s() const {
  std::array<double, kPaces> sorted = paces_;
  const std::span<double> seen = std::span(sorted).first(pace_count_);
  const double longest_s = kPause * median_of(seen);
  double sum_s = 0.0;
  for (const double pace : seen) sum_s += std::min(pace, longest_s);
  return sum_s / static_cast<double>(pace_count_);
}

void RsiStream::learn() {
  if (pace_count_ < kLearnPackets) return;
  const double measured_s = pace_s() * step_;
  const double by_ipoc_s = step_ * kSecondsPerMillisecond;
  exact_ = std::abs(measured_s - by_ipoc_s) <= kMillisecondTolerance * by_ipoc_s;
  // A controller is never classified as a packet counter, regardless of the jitter of its packets.
  counts_milliseconds_ = exact_ || step_ >= kSmallestControllerStep;
  const double cycle_s = exact_ ? by_ipoc_s : measured_s;
  odd_cycle_ = cycle_s < kShortestSeenCycleS || cycle_s > kLongestCycleS;
  if (odd_cycle_) {
    pace_count_ = next_pace_ = 0;
  } else {
    cycle_s_ = cycle_s;
  }
}

void RsiStream::follow() {
  const double measured_s = pace_s() * step_;
  const double by_ipoc_s = step_ * kSecondsPerMillisecond;
  // Learned from packets processed late by a busy computer, and no longer needed.
  exact_ =
      counts_milliseconds_ && std::abs(measured_s - by_ipoc_s) <= kMillisecondTolerance * by_ipoc_s;
  if (exact_) {
    cycle_s_ = by_ipoc_s;
    return;
  }
  const double followed_s =
      std::clamp(measured_s, (1.0 - kFollow) * cycle_s_, (1.0 + kFollow) * cycle_s_);
  cycle_s_ = std::clamp(followed_s, kShortestSeenCycleS, kLongestCycleS);
}

void DelayWatch::begin_session() {
  first_.reset();
  replies_ = 0;
}

std::uint32_t DelayWatch::note(std::optional<std::uint32_t> delay) {
  const std::uint32_t more = delay && last_ && *delay > *last_ ? *delay - *last_ : 0;
  accepted_in_a_row_ = more > 0 ? 0 : accepted_in_a_row_ + 1;
  if (!delay) return 0;
  counts_ = counts_ || more > 0;
  last_ = delay;
  return more;
}

bool DelayWatch::refused(std::uint64_t replies) const {
  return replies_ >= replies && first_ && last_ && *last_ >= *first_ &&
         *last_ - *first_ + kUnderWay >= replies_;
}

}  // namespace cellcal::drivers
