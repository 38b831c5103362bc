#pragma once
// Position of the arm and correction held by the controller: the active correction at the start of
// a session, the pose at its zero, the commanded pose, and the next reply.

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/kuka/moves/cause.h"
#include "drivers/kuka/moves/position_record.h"
#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/kuka/rsi/rsi_space.h"
#include "drivers/kuka/wire/rsi_codec.h"
#include "drivers/kuka/wire/wire_axes.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

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
  std::optional<std::uint32_t> delay;  ///< in the packet of `ipoc` and `t_rx`
  std::uint32_t answered_since = 0;    ///< later packets, damaged ones, that were answered
  bool delay_counts = false;           ///< Delay has increased: the controller sends it
  bool counts_packets = false;         ///< IPOC does not advance while the peer waits for a reply
  AxisAngles actual_rad;               ///< in the last packet
  bool setpoint_follows = false;       ///< ASPos includes the correction: no information
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
  OffsetVerdict update(const OffsetEvidence& evidence);
  /// The correction held by the controller, once kKnown [rad].
  const AxisAngles& offset_rad() const { return offset_rad_; }

 private:
  OffsetVerdict by_setpoint(const OffsetEvidence& evidence);
  OffsetVerdict behind_replies(const OffsetEvidence& evidence, const AxisAngles& measured);
  OffsetVerdict by_counters(const OffsetEvidence& evidence);
  bool just_begun(const OffsetEvidence& evidence);
  OffsetVerdict decide(const AxisAngles& offset_rad);
  /// The newest replies had the same correction: which of them were accepted does not matter.
  bool only_one_sent() const;
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
  CorrectionAccumulator(CorrectionMode mode, int decimals, const WireAxes& axes);

  /// Sets the correction held by the controller [rad]: after taking over a session, or a new
  /// reference.
  void set(const AxisAngles& held_rad);
  /// Reply for the controller to hold `wanted_rad`, in the wire's order and units. Relative: no axis changes by more than
  /// `step_rad` in one reply.
  std::span<const double> next_deg(const AxisAngles& wanted_rad, const AxisAngles& step_rad);
  /// Another reply to the packet answered last: identical, counted once.
  std::span<const double> again_deg() const { return {sent_deg_.data(), held_rad_.size()}; }
  /// Reply without a change: the current correction, or zero increments.
  std::span<const double> hold_deg();

  const AxisAngles& held_rad() const { return held_rad_; }

 private:
  CorrectionMode mode_;
  WireAxes axes_;
  double per_deg_;  // units of the last decimal
  AxisAngles held_rad_;
  std::array<std::int64_t, kMaxAxes> held_{};  // relative: in these units
  std::array<double, kMaxAxes> sent_deg_{};
};

// Final check of a correction before it is sent: independent of its origin, no reply demands more
// speed, acceleration or jerk of an axis than its limits. It uses only the preceding replies,
// without sessions, moves or packets: any upstream error ends here, as a value, and the arm holds.
//
// Derivatives are approximated by divided differences of replies: those of a path within the limits
// are within them for any cycle. Stops may be harder: speed may drop immediately.

class ReplyBound {
 public:
  /// `limits` must outlive this.
  explicit ReplyBound(std::span<const AxisLimit> limits) : limits_(limits), axes_(limits) {}

  /// The controller holds this correction [rad], at rest.
  void rest_at(const AxisAngles& held_rad) { last_ = before_ = Said{held_rad}; }
  /// Checks the next correction [rad]; if admitted, it becomes the last reply. `stops`: no move is
  /// active, or it is being stopped.
  std::optional<cause::ReplyBeyondLimit> admit(const AxisAngles& next_rad, double cycle_s,
                                               bool stops);
  /// Late replies stopped the arm; the last one was accepted or not.
  void stopped(bool taken) { rest_at(taken ? last_.at_rad : before_.at_rad); }

 private:
  struct Said {
    AxisAngles at_rad{}, speed{}, acceleration{};  // speed and acceleration empty: at rest
    double cycle_s = 0.0, before_s = 0.0;          // to this reply, and to the preceding one
  };
  std::span<const AxisLimit> limits_;
  WireAxes axes_;
  Said last_, before_;
};

/// The axes of a packet, from AIPos and EIPos (ASPos and ESPos); fewer than `wire` has if the packet
/// has fewer.
AxisAngles axes_of(const AxisAngles& axes_deg, const AxisAngles& external_deg,
                   const WireAxes& wire);

class RsiSetpoint {
 public:
  /// `config` must outlive this.
  explicit RsiSetpoint(const RsiConfig& config);

  /// Another session, or the same after a silence of this duration. The correction is unknown
  /// again.
  void begin_session(double silence_before_s);
  /// RSI 2's first frame, after a silence of this duration: this session's correction is 0. False:
  /// a damaged packet of a continuing session looks the same.
  bool session_starts(double silence_before_s);
  /// The link was lost: stores its state for when it resumes. No effect if the correction was never
  /// known.
  void remember(const OffsetMemory& link);

  /// ASPos is the pose at RSI_ON: if it changes, a new session began, or the KRL program moved the
  /// arm. In both cases the meaning of the correction has changed. Some simulators include the
  /// correction in ASPos: it then equals the pose commanded by the last replies to a `moving` arm.
  std::optional<cause::SessionRestarted> start_pose_moved(const RobFrame& frame,
                                                          const AxisAngles& actual_rad,
                                                          bool moving);
  /// Distance of AIPos from the packet's ASPos, which must be present.
  double start_distance_rad(const RobFrame& frame, const AxisAngles& actual_rad) const;
  /// Processes a packet until known(). True once the controller's correction is known. `waits`: the
  /// peer repeats this packet, no motion before it is answered.
  bool find(const RobFrame& frame, const AxisAngles& actual_rad, TimePoint t_rx, bool waits);
  bool known() const { return known_; }
  bool waits_for_rest() const { return verdict_ == OffsetVerdict::kWaitForRest; }
  bool denied() const { return verdict_ == OffsetVerdict::kDenied; }

  /// Sets the current pose as the commanded one; the correction is unchanged.
  void hold_at(const AxisAngles& at_rad);

  AxisAngles& commanded_rad() { return commanded_; }
  const AxisAngles& commanded_rad() const { return commanded_; }
  const AxisAngles& base_rad() const { return base_; }  ///< pose at correction 0

  /// Validates a move from here. For corrections in space each line is checked as a whole.
  std::optional<Cause> object_to(const Move& move) const;
  /// In space: distance of RIst from the TCP of the geometry.
  TcpApart tcp_apart(const RobFrame& frame, const AxisAngles& actual_rad) const {
    return space_.apart(frame, actual_rad);
  }

  /// Content of the reply: per axis [deg], or in space X Y Z [mm] and A B C [deg]. Bounded by the
  /// axes' limits (ReplyBound): if exceeded, the current correction is returned, and beyond()
  /// reports it. `stops`: no move is active, or it is being stopped. Empty: no valid reply.
  std::span<const double> next(double cycle_s, bool stops);
  std::span<const double> again() { return on_wire(accumulator_.again_deg()); }
  std::span<const double> hold() { return on_wire(accumulator_.hold_deg()); }
  const std::optional<cause::ReplyBeyondLimit>& beyond() const { return beyond_; }
  /// Late replies stopped the arm; the last one was accepted or not.
  void stopped(bool taken) { bound_.stopped(taken); }
  /// True if zero increments are safe without knowing the correction.
  bool can_hold_unknown() const { return config_.mode == CorrectionMode::kRelative; }

 private:
  std::size_t axes() const { return config_.limits.size(); }
  void find_start(const AxisAngles& actual_rad);
  /// In space the angles of a running session do not determine the frame that was sent: a geometry
  /// other than the controller's yields another frame, and replying with it would move the arm.
  /// True if nothing is held, or if the last correction sent by this adapter is, returned in
  /// `held_rad`.
  bool hold_in_space(AxisAngles& held_rad) const;
  AxisAngles correction_rad(const AxisAngles& axes_rad) const;
  std::span<const double> on_wire(std::span<const double> axes_deg);

  const RsiConfig& config_;
  const WireAxes wire_;
  CorrectionAccumulator accumulator_;
  ReplyBound bound_;
  std::optional<cause::ReplyBeyondLimit> beyond_;
  boost::container::static_vector<AxisAngles, 4> earlier_;  // held before the last replies
  OffsetFinder finder_;
  OffsetMemory memory_;
  OffsetVerdict verdict_ = OffsetVerdict::kUnknown;
  bool known_ = false, session_start_ = false;
  bool setpoint_follows_ = false;  ///< ASPos includes the correction, as with some simulators
  bool setpoint_apart_ = false;    ///< ASPos was seen without the correction
  double silence_before_s_ = 0.0;
  AxisAngles start_pose_;        // ASPos of this session; empty if not sent
  AxisAngles base_, commanded_;  // pose at correction 0, and with the desired correction
  // The axes at RSI_ON. Unlike base_ they exclude the servo error: the effect on corrections in
  // space exceeds the error itself.
  AxisAngles start_;
  SpaceCorrector space_;
  KukaFrame rkorr_{};
};

}  // namespace cellcal::drivers
