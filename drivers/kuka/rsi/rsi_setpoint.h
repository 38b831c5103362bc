#pragma once
// Where the arm stands and what the controller holds: which correction is in force when a session
// is met, which pose is its zero, what is commanded, and what the next reply has to say.

#include <optional>
#include <span>

#include "drivers/kuka/moves/position_record.h"
#include "drivers/kuka/rsi/reply_bound.h"
#include "drivers/kuka/rsi/rsi_accumulator.h"
#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/kuka/rsi/rsi_offset.h"
#include "drivers/kuka/rsi/rsi_space.h"
#include "drivers/kuka/wire/rsi_codec.h"

namespace cellcal::drivers {

/// The first `count` of the axes and external axes of a packet [deg -> rad]; fewer if it has fewer.
AxisAngles axes_of(const AxisAngles& axes_deg, const AxisAngles& external_deg, std::size_t count);

class RsiSetpoint {
 public:
  /// `config` must outlive this.
  explicit RsiSetpoint(const RsiConfig& config);

  /// Another session, or the same after a silence of so long. Everything is in doubt.
  void begin_session(double silence_before_s);
  /// RSI 2's first frame, behind a silence of so long: this session's correction is 0. False: a
  /// damaged packet of a session that goes on looks the same.
  bool session_starts(double silence_before_s);
  /// The link was lost: what is known of it, for when it comes back. Without effect on a session
  /// that was never understood.
  void remember(const OffsetMemory& link);

  /// ASPos is the pose at RSI_ON: where it changes, a new session began, or the KRL program moves
  /// the arm itself. Either way the correction means something else now. Some simulators add the
  /// correction to ASPos too: then it is where the last replies have commanded a `moving` arm to
  /// be.
  std::optional<cause::SessionRestarted> start_pose_moved(const RobFrame& frame,
                                                          const AxisAngles& actual_rad,
                                                          bool moving);
  /// How far AIPos is from a packet's ASPos, which has to be there.
  double start_distance_rad(const RobFrame& frame, const AxisAngles& actual_rad) const;
  /// Looks at a packet until known(). True once the controller's correction is known. `waits`: the
  /// peer repeats this packet, nothing moves before it is answered.
  bool find(const RobFrame& frame, const AxisAngles& actual_rad, TimePoint t_rx, bool waits);
  bool known() const { return known_; }
  bool waits_for_rest() const { return verdict_ == OffsetVerdict::kWaitForRest; }
  bool denied() const { return verdict_ == OffsetVerdict::kDenied; }

  /// The arm stands here: this is what is commanded from now on, and the correction stays what it
  /// is.
  void stand_at(const AxisAngles& at_rad);

  AxisAngles& commanded_rad() { return commanded_; }
  const AxisAngles& commanded_rad() const { return commanded_; }
  const AxisAngles& base_rad() const { return base_; }  ///< pose at correction 0

  /// What can be said against a move from here. Where corrections are in space, each of its lines is
  /// looked at as a whole.
  std::optional<Cause> object_to(const Move& move) const;
  /// In space: how far RIst is from where the geometry has the TCP.
  TcpApart tcp_apart(const RobFrame& frame, const AxisAngles& actual_rad) const {
    return space_.apart(frame, actual_rad);
  }

  /// What the reply has to say: per axis [deg], or in space X Y Z [mm] and A B C [deg]. Bounded by
  /// the axes' limits (ReplyBound): beyond them it is what is held, and beyond() says so. `stops`:
  /// no move is on its way, or it is being brought to rest. Empty: nothing that could be said.
  std::span<const double> next(double cycle_s, bool stops);
  std::span<const double> again() { return on_wire(accumulator_.again_deg()); }
  std::span<const double> hold() { return on_wire(accumulator_.hold_deg()); }
  const std::optional<cause::ReplyBeyondLimit>& beyond() const { return beyond_; }
  /// The controller did not take the last reply.
  void not_taken() { bound_.not_taken(); }
  /// Increments of zero move nothing, whatever the controller holds.
  bool may_hold_unknown() const { return config_.mode == CorrectionMode::kRelative; }

 private:
  std::size_t axes() const { return config_.limits.size(); }
  void find_start(const AxisAngles& actual_rad);
  /// In space the angles that a running session shows do not say which frame it was sent: another
  /// geometry than the controller's makes another frame of them, and a reply with that one moves
  /// the arm. True where nothing is held, or what this adapter sent last, which `held_rad` then is.
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
  bool setpoint_follows_ = false;  ///< ASPos holds the correction, as with some simulators
  bool setpoint_apart_ = false;    ///< it was seen not to
  double silence_before_s_ = 0.0;
  AxisAngles start_pose_;        // ASPos of this session; empty if it is not sent
  AxisAngles base_, commanded_;  // pose at correction 0, and with the correction wanted
  // The axes at RSI_ON. Unlike base_ they do not take up what servos leave over: corrections in
  // space depend on them by more than their difference.
  AxisAngles start_;
  SpaceCorrector space_;
  KukaFrame rkorr_{};
};

}  // namespace cellcal::drivers
