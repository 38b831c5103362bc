#pragma once
// Position of the arm and correction held by the controller: the active correction at the start of
// a session, the pose at its zero, the commanded pose, and the next reply.

#include <optional>
#include <span>

#include "drivers/kuka/moves/cause.h"
#include "drivers/kuka/moves/position_record.h"
#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/kuka/rsi/rsi_offset.h"
#include "drivers/kuka/rsi/rsi_space.h"
#include "drivers/kuka/wire/rsi_codec.h"
#include "drivers/robot.h"

namespace cellcal::drivers {

// Final check of a correction before it is sent: independent of its origin, no reply demands more
// speed, acceleration or jerk of an axis than its limits. It uses only the preceding replies,
// without sessions, moves or packets: any upstream error ends here, as a value, and the arm holds.
//
// Derivatives are approximated by divided differences of replies: those of a path within the limits
// are within them for any cycle. Stops may be harder: speed may drop immediately.

class ReplyBound {
 public:
  /// `limits` must outlive this.
  explicit ReplyBound(std::span<const AxisLimit> limits) : limits_(limits) {}

  /// The controller holds this correction [rad], at rest.
  void rest_at(const AxisAngles& held_rad) { last_ = before_ = Said{held_rad}; }
  /// Checks the next correction [rad]; if admitted, it becomes the last reply. `stops`: no move is
  /// active, or it is being stopped.
  std::optional<cause::ReplyBeyondLimit> admit(const AxisAngles& next_rad, double cycle_s,
                                               bool stops);
  /// The controller did not accept the last reply.
  void not_taken() { last_ = before_; }

 private:
  struct Said {
    AxisAngles at_rad{}, speed{}, acceleration{};  // speed and acceleration empty: at rest
    double cycle_s = 0.0, before_s = 0.0;          // to this reply, and to the preceding one
  };
  std::span<const AxisLimit> limits_;
  Said last_, before_;
};

/// The first `count` of the axes and external axes of a packet [deg -> rad]; fewer if it has fewer.
AxisAngles axes_of(const AxisAngles& axes_deg, const AxisAngles& external_deg, std::size_t count);

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
  /// The controller did not accept the last reply.
  void not_taken() { bound_.not_taken(); }
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
