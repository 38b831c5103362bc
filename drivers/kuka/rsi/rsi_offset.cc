#include "drivers/kuka/rsi/rsi_offset.h"

#include <algorithm>
#include <cmath>

#include "drivers/units.h"

namespace cellcal::drivers {

namespace {
// Tolerance for equal corrections: above servo error and AIPos noise at rest; a jump of this size
// (0.5 mm at 1.4 m) is within vibration.
constexpr double kSameRad = 0.02 * kRadPerDeg;
// Largest difference at rest, from servos or a controller that applies the correction inexactly.
constexpr double kServosLeaveRad = 0.05 * kRadPerDeg;
// Rest: no axis changes by more than this from packet to packet, several times in a row.
constexpr double kStillRad = 0.005 * kRadPerDeg;
constexpr int kStillPackets = 3;
// If several replies could be held by the controller, their distance may be less than the motion of
// an arm that is still settling: two or three more of its time constants.
constexpr int kSettledPackets = 12;
// Tolerance between IPOC and the host's clock for a continuing session: network jitter, two
// quartzes.
constexpr double kContinuityS = 0.05, kContinuityFraction = 0.01;
// Minimum silence on an own port that excludes a running session: five of the longest cycles. No
// program is stopped and started within it.
constexpr double kListenedS = 0.2;
// Delay of a running session may lag by one packet; that of a new one must be clearly below.
constexpr std::uint32_t kDelayLag = 1, kDelayClear = 3;
// Maximum lead, in packets, of a peer that waits for replies.
constexpr std::int32_t kMostAhead = 4;

double distance(const AxisAngles& a, const AxisAngles& b) {
  double most = a.size() == b.size() ? 0.0 : HUGE_VAL;
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    most = std::max(most, std::abs(a[i] - b[i]));
  }
  return most;
}

}  // namespace

void OffsetFinder::begin(const OffsetMemory& memory) {
  *this = OffsetFinder();
  memory_ = memory;
}

OffsetVerdict OffsetFinder::decide(const AxisAngles& offset_rad) {
  offset_rad_ = offset_rad;
  return OffsetVerdict::kKnown;
}

OffsetVerdict OffsetFinder::look(const OffsetEvidence& evidence) {
  zero_.assign(evidence.actual_rad.size(), 0.0);
  return evidence.setpoint_rad.empty() ? by_counters(evidence) : by_setpoint(evidence);
}

OffsetVerdict OffsetFinder::by_setpoint(const OffsetEvidence& evidence) {
  AxisAngles measured = evidence.actual_rad;
  for (std::size_t i = 0; i < measured.size(); ++i) measured[i] -= evidence.setpoint_rad[i];
  const double from_zero = distance(measured, zero_);
  // For a moving arm the controller may hold one of the preceding replies, too.
  const bool only_one = std::all_of(
      memory_.earlier_rad.begin(), memory_.earlier_rad.end(),
      [&](const AxisAngles& earlier) { return distance(earlier, memory_.sent_rad) <= kStillRad; });
  if (memory_.known) {
    const double from_sent = distance(measured, memory_.sent_rad);
    if (only_one && from_sent <= kSameRad && from_sent <= from_zero)
      return decide(memory_.sent_rad);
  }
  // Without a previous correction, or with a negligible one, a small difference is zero.
  if (from_zero <= kSameRad && (!memory_.known || distance(memory_.sent_rad, zero_) <= kSameRad)) {
    return decide(zero_);
  }
  // Otherwise the arm may be moving between two corrections: the difference identifies the active
  // one only at rest.
  const bool still = distance(measured, last_measured_) <= kStillRad;
  still_packets_ = still ? still_packets_ + 1 : 0;
  last_measured_ = measured;
  const int enough = memory_.known && !only_one ? kSettledPackets : kStillPackets;
  if (still_packets_ < enough && !evidence.waits) return OffsetVerdict::kWaitForRest;
  if (memory_.known) return behind_replies(evidence, measured);
  return decide(from_zero <= kSameRad ? zero_ : measured);
}

const AxisAngles& OffsetFinder::nearest_sent(const AxisAngles& measured) const {
  const AxisAngles* nearest = &memory_.sent_rad;
  for (const AxisAngles& earlier : memory_.earlier_rad) {
    if (distance(measured, earlier) < distance(measured, *nearest)) nearest = &earlier;
  }
  return *nearest;
}

OffsetVerdict OffsetFinder::behind_replies(const OffsetEvidence& evidence,
                                           const AxisAngles& measured) {
  const AxisAngles& sent = nearest_sent(measured);
  if (distance(measured, sent) <= kServosLeaveRad) return decide(sent);
  if (distance(measured, zero_) > kSameRad) return OffsetVerdict::kDenied;
  if (evidence.silence_before_s < kListenedS) return OffsetVerdict::kDenied;
  // For a session without a correction only the counters, if present, show whether it is a new one.
  if (!evidence.delay || !memory_.delay) return decide(zero_);
  const OffsetVerdict counted = by_counters(evidence);
  if (counted != OffsetVerdict::kKnown) return counted;
  return distance(offset_rad_, zero_) <= kSameRad ? OffsetVerdict::kKnown : OffsetVerdict::kDenied;
}

/// No late replies yet, although no other process can have answered for many cycles. Without the
/// silence it may be a session that another process has answered until now; and the silence is
/// significant only for a peer that does not wait for replies: the packets after the first one
/// arrive unanswered, and each is counted. While zeros are sent (relative) this is not observable,
/// and no jump is possible.
bool OffsetFinder::just_begun(const OffsetEvidence& evidence) {
  if (!evidence.delay || evidence.waits || evidence.silence_before_s < kListenedS) return false;
  if (evidence.answered) return *evidence.delay == 0;
  if (!first_delay_) {
    first_delay_ = evidence.delay;
    first_rx_ = evidence.t_rx;
    return false;
  }
  const double since_s = std::chrono::duration<double>(evidence.t_rx - first_rx_).count();
  return *first_delay_ == 0 && *evidence.delay > 0 && since_s < kListenedS;
}

OffsetVerdict OffsetFinder::by_counters(const OffsetEvidence& evidence) {
  const bool may_be_other_session = !memory_.known || evidence.silence_before_s >= kListenedS;
  if (evidence.session_start) return decide(zero_);
  // A peer that counts packets from 0 waits for the answer to its first one.
  const bool first_packet = evidence.ipoc == 0 && evidence.delay.value_or(0) == 0;
  if (first_packet && may_be_other_session) return decide(zero_);
  if (!memory_.known) {
    return just_begun(evidence) ? decide(zero_) : OffsetVerdict::kUnknown;
  }
  if (distance(memory_.sent_rad, zero_) <= kSameRad) return decide(memory_.sent_rad);
  if (memory_.step == 0 || memory_.seconds_per_ipoc <= 0.0) return OffsetVerdict::kUnknown;

  const auto passed = static_cast<std::int32_t>(evidence.ipoc - memory_.ipoc);
  // After any time: if position and counter are unchanged, the session continues.
  if (memory_.counts_packets && passed >= 0 && passed <= kMostAhead &&
      distance(evidence.actual_rad, memory_.actual_rad) <= kSameRad) {
    return decide(memory_.sent_rad);
  }
  const double elapsed_s = std::chrono::duration<double>(evidence.t_rx - memory_.t_rx).count();
  const double by_ipoc_s = passed * memory_.seconds_per_ipoc;
  if (std::abs(by_ipoc_s - elapsed_s) > kContinuityS + kContinuityFraction * elapsed_s) {
    return may_be_other_session ? decide(zero_) : OffsetVerdict::kUnknown;
  }
  if (!evidence.delay || !memory_.delay) return OffsetVerdict::kUnknown;
  // It never decreases within a session.
  if (*evidence.delay < *memory_.delay)
    return may_be_other_session ? decide(zero_) : OffsetVerdict::kUnknown;
  if (!first_delay_) first_delay_ = evidence.delay;
  const bool counts = memory_.delay_counts || *evidence.delay > *first_delay_;
  const std::uint32_t unanswered =
      std::max(static_cast<std::uint32_t>(passed) / memory_.step, 1U) - 1;
  const std::uint32_t expected = *memory_.delay + unanswered;
  if (*evidence.delay + kDelayLag >= expected) return decide(memory_.sent_rad);
  if (counts && may_be_other_session && *evidence.delay + kDelayClear <= expected)
    return decide(zero_);
  return OffsetVerdict::kUnknown;
}

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
