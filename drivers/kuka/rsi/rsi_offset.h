#pragma once
// Which correction does the controller hold when packets begin or begin again? A wrong answer is a
// jump of the arm: a fresh session (RSI_ON) starts at 0, a running one holds what it accepted last,
// from this process or from one before it.
//
// Evidence, strongest first: AIPos - ASPos is the correction itself; an IPOC that did not go on is
// another session; Delay counts every cycle that was not answered, so a running session shows all
// of them and a fresh one only its own. Silence before the first packet tells a fresh session only
// where packets come whether they are answered or not: a peer that waits for replies is silent
// because nobody answered it. Where the evidence does not decide: no reply at all, and
// the controller's time-out keeps the arm still.
//
// Behind replies of this process no one kind is believed against the others: what was sent is held
// where AIPos - ASPos or the counters say so and neither denies it; nothing is held only behind a
// silence, since no program is started again without one. Everything else is left unanswered.

#include <cstdint>
#include <optional>

#include "drivers/robot.h"

namespace cellcal::drivers {

/// What was known when the packets stopped.
struct OffsetMemory {
  bool known = false;   ///< replies had been sent
  AxisAngles sent_rad;  ///< the last correction sent
  /// Those before it: the newest replies may be what was lost with the link.
  boost::container::static_vector<AxisAngles, 4> earlier_rad;
  std::uint32_t ipoc = 0;
  std::uint32_t step = 0;         ///< of IPOC per packet, 0 if not known
  double seconds_per_ipoc = 0.0;  ///< 0 if not known
  TimePoint t_rx{};
  std::optional<std::uint32_t> delay;
  bool delay_counts = false;      ///< Delay was seen to grow: the controller wires it
  bool counts_packets = false;    ///< IPOC stands still while the peer waits for a reply
  AxisAngles actual_rad;          ///< in the last packet
  bool setpoint_follows = false;  ///< ASPos holds the correction too: it says nothing here
};

struct OffsetEvidence {
  TimePoint t_rx{};
  std::uint32_t ipoc = 0;
  AxisAngles actual_rad;
  AxisAngles setpoint_rad;  ///< ASPos; empty if not sent
  std::optional<std::uint32_t> delay;
  double silence_before_s = 0.0;  ///< listened to, before this packet or this session's first
  bool session_start = false;     ///< RSI 2's first frame was seen
  bool answered = false;          ///< with increments of zero, while nothing is known
  bool waits = false;             ///< the same packet for long: nothing moves before an answer
};

enum class OffsetVerdict {
  kKnown,
  kWaitForRest,
  kUnknown,
  kDenied,  ///< AIPos - ASPos is neither what was sent nor what the counters leave open
};

class OffsetFinder {
 public:
  void begin(const OffsetMemory& memory);
  /// One packet; ask again with the next while it is not kKnown.
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

}  // namespace cellcal::drivers
