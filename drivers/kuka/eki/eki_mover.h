#pragma once
// One move that the controller carries out, from the telegram to the result.
//
//   asked --taken--> moving --done--> verdict (search with contact) --> settling --rest--> result
//     ^---- next leg -----+
//
// A move through way-points is a command for each leg, one after the other: the controller comes
// to rest at every way-point, and goes on with the telegram that its arrival asks for.
//
// The controller moves by itself and stops by itself: at the target, at its contact input, at the
// flag that a stop telegram sets, or because it hears nothing. Here it is watched, the contact
// sensor is heard, and what both say is put together. A search counts as a contact only when the
// sensor has confirmed it; the joint angles come from the controller's latch (kInput) or from the
// recorded path at the sensor's time stamp (kFlag).

#include <cstdint>
#include <optional>

#include "drivers/contact.h"
#include "drivers/kuka/eki/eki_config.h"
#include "drivers/kuka/moves/core_result.h"
#include "drivers/kuka/moves/move_check.h"
#include "drivers/kuka/moves/position_record.h"
#include "drivers/kuka/moves/sensor_monitor.h"
#include "drivers/kuka/wire/eki_codec.h"

namespace cellcal::drivers {

class EkiMover {
 public:
  /// All must outlive the mover; `guard` may be null: then searches are refused.
  EkiMover(const EkiConfig& config, ContactGuard* guard, const PositionRecord& record);

  bool busy() const { return phase_ != Phase::kIdle; }
  /// Takes the sensor's events and level. Once per tick, busy or not.
  void listen(TimePoint now);
  /// After listen(), arm at rest at `at_rad`. Empty: begun, command() is to be sent.
  std::optional<CoreResult> start(const Move& move, const AxisAngles& at_rad, TimePoint now);
  /// Target, path, speed and guard; session, seq and id are the core's.
  const EkiCommand& command() const { return command_; }
  /// The command is due.
  bool wants_sending() const { return phase_ == Phase::kAsked && command_.id == 0; }
  void sent(std::uint32_t id) { command_.id = id; }

  /// A stop telegram for this move is due.
  bool wants_stop() const { return busy() && stop_wanted_ && !stop_sent_; }
  void stop_sent(TimePoint now);

  /// A state of the controller, after it was recorded.
  std::optional<CoreResult> on_state(const EkiState& state, TimePoint now);
  /// After listen(). A result of CommandNotTaken means that the link must be cut.
  std::optional<CoreResult> on_tick(TimePoint now);
  /// To rest, with this outcome. Without effect on a move that is being stopped already.
  void halt(MoveOutcome outcome, const Cause& cause);
  /// The move was halted before its command was sent: over at once, or after the arm, which stands
  /// at a way-point, has come to rest.
  std::optional<CoreResult> cancel(TimePoint now);
  /// The move is over here; the controller stops it by itself.
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
  void take_leg_done(TimePoint now);
  std::optional<Cause> too_fast(const Move& move, const AxisAngles& at_rad) const;
  void watch_search(TimePoint now);
  void watch_arrived(TimePoint now);
  void watch_other(TimePoint now);
  void watch_motion(const EkiState& state, TimePoint now);
  void take_done(const EkiState& state, TimePoint now);
  void take_search_done(EkiOutcome outcome, TimePoint now);
  void await_verdict(TimePoint now);
  void begin_settling(TimePoint now);
  std::optional<CoreResult> settle(TimePoint now);
  void fill_latch(const AxisAngles& settled_rad, TimePoint now);
  CoreResult result(const AxisAngles& at_rad);

  const EkiConfig& config_;
  const PositionRecord& record_;
  SensorMonitor sensor_;

  Phase phase_ = Phase::kIdle;
  Move move_;
  std::size_t leg_ = 0;
  EkiCommand command_;  ///< of that leg
  MoveOutcome outcome_ = MoveOutcome::kArrived;
  Cause cause_;
  TimePoint asked_at_{}, stop_sent_at_{}, done_at_{};
  bool stop_wanted_ = false, stop_sent_ = false, by_input_ = false;
  std::optional<TimePoint> touched_at_;
  Verdict verdict_ = Verdict::kNone;
  std::optional<ContactEvent> contact_;
  std::optional<TimePoint> open_due_;  ///< retreat: its contact was not heard to be open here
  std::optional<AxisAngles> latched_rad_;
  AxisAngles still_rad_;  ///< where the arm was when it last moved
  TimePoint still_since_{};
  TimePoint settling_since_{};
  std::size_t settling_states_ = 0;
  std::optional<Latch> latch_;
};

}  // namespace cellcal::drivers
