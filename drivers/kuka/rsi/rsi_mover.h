#pragma once
// One move from start to result: travel, contact sensor, stop, rest, latch.
//
//   travelling --end--> settling --rest, or near enough on the way--> result
//       |  trip (search)
//       +--> verdict (stopped) --contact, revoked, silence of the sensor--> settling
//       +--> settling (other stops)
//
// Every stop takes effect in the current reply. Up to probing speed it is a freeze. Above it the
// arm brakes on the same path: a search within a few cycles, regardless of the limits; other moves
// as soon as their jerk limit allows.
//
// Way-points are passed without stops. With corrections in space the arm comes to rest at each of
// them: limits and singularities are checked along straight lines.

#include <bitset>
#include <cstdint>
#include <optional>

#include "drivers/contact.h"
#include "drivers/kuka/moves/position_record.h"
#include "drivers/kuka/moves/sensor_monitor.h"
#include "drivers/kuka/rsi/path_move.h"
#include "drivers/kuka/rsi/rsi_config.h"
#include "drivers/kuka/rsi/rsi_report.h"
#include "drivers/kuka/rsi/rsi_stops.h"
#include "drivers/kuka/wire/wire_axes.h"

namespace cellcal::drivers {

// Position of the arm at an instant of this computer's clock, from packets stamped with IPOC, and
// its uncertainty.
//
// Two models; if IPOC counts milliseconds, the record itself determines which one holds:
//
//   - A clock that keeps time (every real controller): a packet arrives with a delay that is never
//     negative and small at least once in half a second, so that the earliest arrivals determine the
//     map, unaffected by late ones. The spread of the earliest arrivals of the quarters of the record
//     is the map's uncertainty. A network that becomes slower is one step between two quarters.
//   - By arrival: for peers that count packets, or whose milliseconds are not real time (a program
//     that sleeps from packet to packet lags in every quarter). Packet n belongs to the instant of
//     its arrival, without extrapolation. Motion between two packets may be uniform or a single jump:
//     the uncertainty is the longest of the intervals around the instant, over the root of three.
//
// In both models a later packet belongs to a later instant, and no packet is outside the record.

struct IpocClock {
  double seconds_per_count = 0.0;
  bool milliseconds = false;  ///< the peer's counter is declared to be milliseconds
};

struct AnglesAt {
  AxisAngles actual_rad;
  double time_sigma_s = 0.0;  ///< of the map from IPOC to this computer's clock, 1 sigma
};

/// Empty if t is outside the record. Neither allocates nor throws.
std::optional<AnglesAt> angles_at(const PositionRecord& record, TimePoint t,
                                  const IpocClock& clock);

/// Up to this speed of the fastest axis a stop is a freeze: 40 mm/s at 1.2 m of reach, a step in
/// velocity that the servos accept without a message (0.008 deg per cycle of 4 ms).
inline constexpr double kProbingSpeedRadS = 0.035;
/// A faster search comes to rest within this time or three cycles, whichever is longer: each half
/// degree per second of speed adds 0.005 deg of travel compared with a freeze.
inline constexpr double kSearchRampS = 0.020;

struct MoverCycle {
  TimePoint now{};
  double cycle_s = 0.0;
  IpocClock clock;
  bool advance = true;  ///< false: this packet was answered before, the reply is repeated
  /// False (ABSOLUTE): the controller counted a reply as late. The arm is at the preceding one, and
  /// would execute everything commanded meanwhile in one cycle.
  bool heard = true;
  bool sound = true;  ///< false: damaged packet, no information on the arm
  bool taken = true;  ///< false (ABSOLUTE): the controller did not accept the last reply
};

class Mover {
 public:
  /// All must outlive the mover; `guard` may be null.
  Mover(const RsiConfig& config, ContactGuard* guard, const PositionRecord& record);

  bool busy() const { return phase_ != Phase::kIdle; }
  bool moves() const { return busy() && in_motion_; }  ///< its command advances
  /// The move under way, at rest in the end or not, leads this axis elsewhere.
  bool drives(std::size_t axis) const { return busy() && driven_[axis]; }
  double fastest_axis_rad_s() const { return moves() ? path_.fastest_axis_rad_s(t_s_) : 0.0; }
  /// No move active, or it is being stopped.
  bool stops() const { return !moves() || braking_; }
  /// Reads the sensor's events and level, and the controller's contact input: empty if absent from
  /// the packet. To be called once per packet, also when idle.
  void listen(TimePoint now, std::optional<bool> input_on = std::nullopt);
  /// The input reports contact, and the sensor does not.
  bool input_alone() const {
    return sensor_.heard().input.contact && !sensor_.heard().snapshot.in_contact;
  }
  bool input_contact() const { return input_.contact(); }
  InputPath input_path() const { return input_.path(); }
  std::uint32_t stops_by_input() const { return stops_by_input_; }
  /// Another session of the controller.
  void forget_input() { input_.reset(); }
  /// Starts at rest at `commanded_rad`, after listen(). Empty result: started.
  std::optional<CoreResult> start(const Move& move, const AxisAngles& commanded_rad);
  /// One cycle, after listen(): the next command, and the result at the end of the move.
  std::optional<CoreResult> step(const MoverCycle& cycle, AxisAngles& commanded_rad);
  /// Stops with this outcome. No effect on a move that is already being stopped.
  void halt(MoveOutcome outcome, const Cause& cause);
  /// Likewise, also of a move whose arm is at rest and whose result is still due.
  void condemn(MoveOutcome outcome, const Cause& cause);
  /// Ends the move immediately: packets have ceased, or nothing more can be commanded.
  CoreResult abandon(const Cause& cause, MoveOutcome outcome = MoveOutcome::kRobotSilent);

 private:
  enum class Phase { kIdle, kTravelling, kVerdict, kSettling };

  bool ends_well() const { return outcome_ == MoveOutcome::kArrived; }
  bool searching() const { return move_.kind == MoveKind::kSearch; }
  void end_travel(Phase next, MoveOutcome outcome, const Cause& cause);
  void brake();
  /// The command is where the controller holds the arm: one that was not accepted would be executed in
  /// one cycle whenever replies are heard again.
  void hold(AxisAngles& commanded_rad);
  void watch_search(TimePoint now);
  void watch_other(const MoverCycle& cycle);
  void await_verdict(TimePoint now);
  void watch_following(const MoverCycle& cycle);
  /// True if the move ends at rest, not only within the tolerance of the commanded position: after a
  /// stop, for searches, and for a retreat until the contact is open. The next move of a moving arm
  /// begins at the last commanded position.
  bool needs_rest() const;
  std::optional<CoreResult> settle(const MoverCycle& cycle, const AxisAngles& commanded_rad);
  /// A retreat at rest: true once it is known whether its contact opened.
  bool opening_known(const MoverCycle& cycle);
  /// Compares the sensor's message on contact or opening with the input.
  void judge_input();
  CoreResult result(const AxisAngles& commanded_rad);
  void fill_latch(const MoverCycle& cycle, const AxisAngles& settled_rad);

  WireAxes axes() const { return WireAxes(config_.limits); }

  const RsiConfig& config_;
  const PositionRecord& record_;
  ContactGuard* guard_;
  SensorMonitor sensor_;
  ContactInput input_;
  std::uint32_t stops_by_input_ = 0;  ///< before the sensor's message

  Phase phase_ = Phase::kIdle;
  Move move_;
  std::bitset<kMaxAxes> driven_;  ///< by the move
  PathMove path_;
  double t_s_ = 0.0;
  bool in_motion_ = false, braking_ = false;  ///< on the path
  double open_by_s_ = 0.0;                    ///< retreat: time by which its contact must open
  std::optional<TimePoint> open_due_;         ///< retreat: end of that time, contact not yet open
  AxisAngles before_rad_;                     ///< commanded before the path last advanced
  double before_s_ = 0.0;                     ///< likewise, on the path
  bool taken_ = true;                         ///< the controller holds what it advanced to
  double cycle_s_ = 0.0;
  MoveOutcome outcome_ = MoveOutcome::kArrived;
  Cause cause_;
  TimePoint stopped_at_{};
  bool by_input_ = false;  ///< the search was stopped by the input, before the sensor's message
  double settling_s_ = 0.0;
  int settling_cycles_ = 0;
  std::optional<ContactEvent> contact_;
  std::optional<Latch> latch_;
};

}  // namespace cellcal::drivers
