#pragma once
// One move from its beginning to its result: travel, the contact sensor's say, stop, rest, latch.
//
//   travelling --end--> settling --rest, or near enough on the way--> result
//       |  trip (search)
//       +--> verdict (stopped) --contact, revoked, silence of the sensor--> settling
//       +--> settling (other stops)
//
// Every stop takes effect in the reply that is being made. Up to probing speed it is a freeze.
// Above it the arm brakes on the same path: a search within a few cycles, whatever the limits;
// other moves as soon as their jerk limit allows.
//
// Way-points are passed without stops. Where corrections are in space it comes to rest at each of
// them: limits and singularities are looked at along straight lines.

#include <cstdint>
#include <optional>

#include "drivers/contact.h"
#include "drivers/kuka/moves/position_record.h"
#include "drivers/kuka/moves/sensor_monitor.h"
#include "drivers/kuka/rsi/contact_input.h"
#include "drivers/kuka/rsi/ipoc_clock.h"
#include "drivers/kuka/rsi/path_move.h"
#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/kuka/rsi/rsi_report.h"

namespace cellcal::drivers {

/// Up to this speed of the fastest axis a stop is a freeze: 40 mm/s at 1.2 m of reach, a step in
/// velocity that the servos take without a word (0.008 deg per cycle of 4 ms).
inline constexpr double kProbingSpeedRadS = 0.035;
/// A search that is faster than that comes to rest within this time or three cycles, whichever is
/// longer: half a degree per second of speed presses 0.005 deg further than a freeze.
inline constexpr double kSearchRampS = 0.020;

struct MoverCycle {
  TimePoint now{};
  double cycle_s = 0.0;
  IpocClock clock;
  bool advance = true;  ///< false: this packet was answered before, hold what was sent
  /// False (ABSOLUTE): the controller counted a reply as late. The arm stands at the one before,
  /// and all that is commanded meanwhile it would do in one cycle.
  bool heard = true;
  bool sound = true;  ///< false: this packet was damaged, and says nothing of the arm
};

class Mover {
 public:
  /// All must outlive the mover; `guard` may be null.
  Mover(const RsiConfig& config, ContactGuard* guard, const PositionRecord& record);

  bool busy() const { return phase_ != Phase::kIdle; }
  bool moves() const { return busy() && in_motion_; }  ///< its command goes on
  double fastest_axis_rad_s() const { return moves() ? path_.fastest_axis_rad_s(t_s_) : 0.0; }
  /// Not on its way, or being brought to rest.
  bool stops() const { return !moves() || braking_; }
  /// Takes the sensor's events and level, and that of the controller's contact input: nothing where
  /// the packet does not have it. Once per packet, busy or not.
  void listen(TimePoint now, std::optional<bool> input_on = std::nullopt);
  /// The input says contact, and the sensor does not.
  bool input_alone() const {
    return sensor_.heard().input.contact && !sensor_.heard().snapshot.in_contact;
  }
  bool input_contact() const { return input_.contact(); }
  InputPath input_path() const { return input_.path(); }
  std::uint32_t stops_by_input() const { return stops_by_input_; }
  /// Another session of the controller.
  void forget_input() { input_.reset(); }
  /// Begins at rest at `commanded_rad`, after listen(). Empty result: begun.
  std::optional<CoreResult> start(const Move& move, const AxisAngles& commanded_rad);
  /// One cycle, after listen(): what to command next, and the result when the move is over.
  std::optional<CoreResult> step(const MoverCycle& cycle, AxisAngles& commanded_rad);
  /// To rest, with this outcome. Without effect on a move that is being stopped already.
  void halt(MoveOutcome outcome, const Cause& cause);
  /// The move is over now: packets no longer come, or nothing more can be commanded.
  CoreResult abandon(const Cause& cause, MoveOutcome outcome = MoveOutcome::kRobotSilent);

 private:
  enum class Phase { kIdle, kTravelling, kVerdict, kSettling };

  bool ends_well() const { return outcome_ == MoveOutcome::kArrived; }
  bool searching() const { return move_.kind == MoveKind::kSearch; }
  void end_travel(Phase next, MoveOutcome outcome, const Cause& cause);
  void brake();
  void watch_search(TimePoint now);
  void watch_other(const MoverCycle& cycle);
  void await_verdict(TimePoint now);
  void watch_following(const MoverCycle& cycle);
  /// Whether its end is rest, not only where it was commanded to within the tolerance: of what was
  /// stopped, of searches, and of a retreat until the contact is open. The next move of an arm on its way
  /// begins where the last was commanded to.
  bool needs_rest() const;
  std::optional<CoreResult> settle(const MoverCycle& cycle, const AxisAngles& commanded_rad);
  /// A retreat at rest: whether its contact opened, once that is known.
  bool opening_known(const MoverCycle& cycle);
  /// What the sensor has just told of contact or opening is what the input has to have shown.
  void judge_input();
  CoreResult result(const AxisAngles& commanded_rad);
  void fill_latch(const MoverCycle& cycle, const AxisAngles& settled_rad);

  const RsiConfig& config_;
  const PositionRecord& record_;
  ContactGuard* guard_;
  SensorMonitor sensor_;
  ContactInput input_;
  std::uint32_t stops_by_input_ = 0;  ///< before the sensor's word

  Phase phase_ = Phase::kIdle;
  Move move_;
  PathMove path_;
  double t_s_ = 0.0;
  bool in_motion_ = false, braking_ = false;  ///< on the path
  double open_by_s_ = 0.0;                    ///< retreat: so long its contact may be closed
  std::optional<TimePoint> open_due_;         ///< when it was over, and it was not heard to be open
  int unheard_cycles_ = 0;                    ///< in a row
  double cycle_s_ = 0.0;
  MoveOutcome outcome_ = MoveOutcome::kArrived;
  Cause cause_;
  TimePoint stopped_at_{};
  bool by_input_ = false;  ///< the search was stopped by it, before the sensor's word
  double settling_s_ = 0.0;
  int settling_cycles_ = 0;
  std::optional<ContactEvent> contact_;
  std::optional<Latch> latch_;
};

}  // namespace cellcal::drivers
