#pragma once
// One move executed by the controller, from the telegram to the result.
//
//   asked --taken--> moving --done--> verdict (search with contact) --> settling --rest--> result
//     ^---- next leg -----+
//     ^---- one that the next state takes back: stopped --------------------+
//
// A move through way-points is a sequence of commands, one per leg: the controller comes to rest at
// every way-point, and continues with the next telegram, sent on arrival.
//
// The controller moves and stops autonomously: at the target, at its contact input, at the flag set
// by a stop telegram, or on loss of communication. This class monitors it and the contact sensor,
// and combines both. A search counts as a contact only if the sensor has confirmed it; the joint
// angles come from the controller's latch (kInput) or from the recorded path at the sensor's time
// stamp (kFlag).

#include <cstdint>
#include <optional>

#include "drivers/contact.h"
#include "drivers/kuka/eki/eki_config.h"
#include "drivers/kuka/moves/move_queue.h"
#include "drivers/kuka/moves/position_record.h"
#include "drivers/kuka/moves/sensor_monitor.h"
#include "drivers/kuka/wire/eki_codec.h"
#include "drivers/kuka/wire/wire_axes.h"

namespace cellcal::drivers {

class EkiMover {
 public:
  /// All must outlive the mover; `guard` may be null: searches are then refused.
  EkiMover(const EkiConfig& config, ContactGuard* guard, const PositionRecord& record);

  bool busy() const { return phase_ != Phase::kIdle; }
  /// Reads the sensor's events and level. To be called once per tick, also when idle.
  void listen(TimePoint now);
  /// After listen(), with the arm at rest at `at_rad`. Empty: started, command() is to be sent.
  std::optional<CoreResult> start(const Move& move, const AxisAngles& at_rad, TimePoint now);
  /// As the controller has to hold the axes without a limit: at the end of every command.
  void hold_unused(const AxisAngles& on_wire) { unused_ = on_wire; }
  /// Bounds of this axis until the leg's end: where the leg begins and ends; idle: where it was left.
  struct Span {
    double min = 0.0, max = 0.0;
  };
  Span asked(std::size_t axis) const { return {low_rad_[axis], high_rad_[axis]}; }
  /// Target, path, speed and guard; session, seq and id are set by the core.
  const EkiCommand& command() const { return command_; }
  /// True if the command is due.
  bool wants_sending() const { return phase_ == Phase::kAsked && command_.id == 0; }
  void sent(std::uint32_t id) { command_.id = id; }

  /// True if a stop telegram for this move is due.
  bool wants_stop() const { return busy() && stop_wanted_ && !stop_sent_; }
  void stop_sent(TimePoint now);
  /// True until the controller has obeyed it: repeated, since one telegram may be unreadable.
  bool is_stopping() const { return under_way() && stop_sent_; }

  /// Processes a state of the controller, after it was recorded.
  std::optional<CoreResult> on_state(const EkiState& state, TimePoint now);
  /// After listen(). A result of CommandNotTaken requires closing the connection.
  std::optional<CoreResult> on_tick(TimePoint now);
  /// Stops with this outcome; one that is already being stopped, or at rest, keeps its own.
  void halt(MoveOutcome outcome, const Cause& cause);
  /// Likewise, also of a move whose arm is at rest and whose result is still due.
  void condemn(MoveOutcome outcome, const Cause& cause, TimePoint now);
  /// The move was halted before its command was sent: ends immediately, or, at a way-point, once
  /// the arm is at rest.
  std::optional<CoreResult> cancel(TimePoint now);
  /// Ends the move on this side; the controller stops it autonomously.
  CoreResult abandon(const Cause& cause);

 private:
  enum class Phase { kIdle, kAsked, kMoving, kVerdict, kSettling };
  enum class Verdict { kNone, kContact, kRevoked };

  bool ends_well() const { return outcome_ == MoveOutcome::kArrived; }
  bool searching() const { return move_.kind == MoveKind::kSearch; }
  bool under_way() const { return phase_ == Phase::kAsked || phase_ == Phase::kMoving; }
  void fail(MoveOutcome outcome, const Cause& cause);
  void ask(std::size_t leg, const AxisAngles& from_rad, TimePoint now);
  bool last_leg() const { return leg_ + 1 == leg_count(move_); }
  void choose_path(const AxisAngles& at_rad);
  void widen(const AxisAngles& by_rad);
  void on_leg_done(TimePoint now);
  std::optional<Cause> too_fast(const Move& move, const AxisAngles& at_rad) const;
  void watch_search(TimePoint now);
  void watch_arrived(TimePoint now);
  void watch_other(TimePoint now);
  void watch_motion(const EkiState& state, TimePoint now);
  void withdraw_end();
  void note_latch(const EkiState& state);
  void apply_progress_report(const EkiState& state, TimePoint now);
  void on_search_done(EkiOutcome outcome, TimePoint now);
  void await_verdict(TimePoint now);
  void begin_settling(TimePoint now);
  std::optional<CoreResult> settle(TimePoint now);
  /// Joint angles of the contact: from the controller's own latch, or interpolated in the recorded path, and
  /// cross-checked. Returns the reason if there are none.
  std::optional<Cause> fill_latch(const AxisAngles& settled_rad, TimePoint now);
  CoreResult result(const AxisAngles& at_rad);

  WireAxes axes() const { return WireAxes(config_.limits); }

  const EkiConfig& config_;
  const PositionRecord& record_;
  SensorMonitor sensor_;

  Phase phase_ = Phase::kIdle;
  Move move_;
  std::size_t leg_ = 0;
  AxisAngles low_rad_, high_rad_;  ///< of the leg, from where it begins to its end
  AxisAngles unused_;              ///< on the wire
  EkiCommand command_;             ///< of the current leg
  MoveOutcome outcome_ = MoveOutcome::kArrived;
  Cause cause_;
  TimePoint asked_at_{}, stop_sent_at_{}, done_at_{};
  bool stop_wanted_ = false, stop_sent_ = false, by_input_ = false;
  std::optional<TimePoint> touched_at_;
  Verdict verdict_ = Verdict::kNone;
  std::optional<ContactEvent> contact_;
  std::optional<TimePoint>
      open_due_;  ///< retreat: when the contact was due, and not heard, to be open
  std::optional<AxisAngles> latched_rad_;
  int agreeing_latches_ = 0;
  AxisAngles still_rad_;  ///< position at the last motion
  TimePoint still_since_{};
  TimePoint settling_since_{};
  std::size_t settling_states_ = 0;
  std::optional<Latch> latch_;
};

}  // namespace cellcal::drivers
