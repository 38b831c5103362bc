#pragma once
// Determines the correction held by the controller when packets begin or resume. An error is a jump
// of the arm: a new session (RSI_ON) starts at 0, a running one holds the last accepted correction,
// from this process or an earlier one.
//
// Evidence, strongest first: AIPos - ASPos is the correction itself; a discontinuous IPOC indicates
// another session; Delay counts every unanswered cycle, so that a running session shows all of them
// and a new one only its own. Silence before the first packet indicates a new session only if
// packets are sent regardless of replies: a peer that waits for replies is silent because nothing
// answered. If the evidence is insufficient, no reply is sent, and the controller's time-out keeps
// the arm at rest.
//
// After replies of this process no single kind of evidence is trusted against the others: the sent
// correction is held if AIPos - ASPos or the counters confirm it and neither contradicts; zero is
// held only after a silence, since no program restarts without one. All other cases remain
// unanswered.

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

/// State of the link when the packets stopped.
struct OffsetMemory {
  bool known = false;   ///< replies had been sent
  AxisAngles sent_rad;  ///< the last correction sent
  /// Preceding ones: the newest replies may have been lost with the link.
  boost::container::static_vector<AxisAngles, 4> earlier_rad;
  std::uint32_t ipoc = 0;
  std::uint32_t step = 0;         ///< of IPOC per packet, 0 if unknown
  double seconds_per_ipoc = 0.0;  ///< 0 if unknown
  TimePoint t_rx{};
  std::optional<std::uint32_t> delay;
  bool delay_counts = false;      ///< Delay has increased: the controller sends it
  bool counts_packets = false;    ///< IPOC does not advance while the peer waits for a reply
  AxisAngles actual_rad;          ///< in the last packet
  bool setpoint_follows = false;  ///< ASPos includes the correction: no information
};

struct OffsetEvidence {
  TimePoint t_rx{};
  std::uint32_t ipoc = 0;
  AxisAngles actual_rad;
  AxisAngles setpoint_rad;  ///< ASPos; empty if not sent
  std::optional<std::uint32_t> delay;
  double silence_before_s = 0.0;  ///< while listening, before this packet or this session's first
  bool session_start = false;     ///< RSI 2's first frame was received
  bool answered = false;          ///< with increments of zero, while the correction is unknown
  bool waits = false;             ///< the same packet is repeated: no motion before an answer
};

enum class OffsetVerdict {
  kKnown,
  kWaitForRest,
  kUnknown,
  kDenied,  ///< AIPos - ASPos matches neither the sent correction nor the counters
};

class OffsetFinder {
 public:
  void begin(const OffsetMemory& memory);
  /// Processes one packet; to be called for each until kKnown.
  OffsetVerdict look(const OffsetEvidence& evidence);
  /// The correction held by the controller, once kKnown [rad].
  const AxisAngles& offset_rad() const { return offset_rad_; }

 private:
  OffsetVerdict by_setpoint(const OffsetEvidence& evidence);
  OffsetVerdict behind_replies(const OffsetEvidence& evidence, const AxisAngles& measured);
  OffsetVerdict by_counters(const OffsetEvidence& evidence);
  bool just_begun(const OffsetEvidence& evidence);
  OffsetVerdict decide(const AxisAngles& offset_rad);
  const AxisAngles& nearest_sent(const AxisAngles& measured) const;

  OffsetMemory memory_;
  AxisAngles offset_rad_;
  AxisAngles zero_;
  AxisAngles last_measured_;
  int still_packets_ = 0;
  std::optional<std::uint32_t> first_delay_;
  TimePoint first_rx_{};
};

// The correction held by the controller if it accepted every reply, and the next reply that leads
// to the desired one. The control is based on the accumulator, not on the measured position.
//
// ABSOLUTE: the reply is the correction itself. RELATIVE: it is the increment of this cycle, and
// the controller adds them up. Increments are counted in units of the last transmitted decimal, so
// that rounding remainders are carried over to the next reply.

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
