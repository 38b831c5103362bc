#pragma once
// Cause of the end of a move on a KUKA: one type per kind, with its evidence by name and unit.
// Plain values created on the cycle; the sentence is made by the reader, since that allocates. Code compares
// kinds.

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <type_traits>
#include <variant>

#include "drivers/kuka/wire/wire_axes.h"
#include "drivers/robot.h"
#include "drivers/sentence.h"

namespace cellcal::drivers {

/// Values named _deg are millimetres of a linear axis. Limited values are followed by their limit. `via`: the way-point concerned,
/// from 1; 0 is the target.
namespace cause {

struct None {};

// Before the move begins.
struct NotReferenced {};
struct Busy {};
struct Closing {};  ///< the session is ending
struct AxisCount {
  std::size_t given = 0, expected = 0;
  std::uint8_t via = 0;
};
struct NotFinite {
  WireAxis axis{};
  double target = 0.0;
  std::uint8_t via = 0;
};
struct BelowLimit {
  WireAxis axis{};
  double target_deg = 0.0, limit_deg = 0.0;
  std::uint8_t via = 0;
};
struct AboveLimit {
  WireAxis axis{};
  double target_deg = 0.0, limit_deg = 0.0;
  std::uint8_t via = 0;
};
struct CorrectionLimit {
  WireAxis axis{};
  double correction_deg = 0.0, limit_deg = 0.0;
  std::uint8_t via = 0;
};
struct ShiftLimit {  ///< corrections in space
  double shift_mm = 0.0, limit_mm = 0.0;
  std::uint8_t via = 0;
};
struct TurnLimit {
  double turn_deg = 0.0, limit_deg = 0.0;
  std::uint8_t via = 0;
};
struct NearSingular {
  WireAxis axis{};
  double gain = 0.0, limit = 0.0;  ///< axis motion per TCP motion [rad per m or rad]
  std::uint8_t via = 0;
};
struct BadCruise {
  double cruise_s = 0.0;
};
struct CruiseByWayPoints {  ///< a single duration for several legs
  double cruise_s = 0.0;
};
struct SearchByWayPoints {
  std::size_t vias = 0;
};
struct BadShare {
  double share = 0.0, limit = 0.0;
  std::uint8_t via = 0;
};
struct StopAsked {};

struct TravelAtTarget {  ///< of an external axis: searches and leaving a contact move the arm alone
  WireAxis axis{};
  double from_deg = 0.0, target_deg = 0.0;
};

// The contact sensor.
struct NoSensor {};
struct NotArmed {
  std::uint16_t wanted = 0;  ///< the move's arming
};
struct ArmedOtherwise {
  std::uint16_t wanted = 0, in_force = 0;
};
struct TouchingAtStart {};
struct TrippedAtStart {};
struct SensorDead {};  ///< no heartbeat, or link down
struct SensorLate {    ///< this computer processed its heartbeats late
  double late_s = 0.0, limit_s = 0.0;
};
struct KeepAliveLate {};  ///< the sensor missed this computer's keep-alive and disarmed itself
struct ArmExpired {
  bool paced_here = false;  ///< the speed is set by this computer, not by an override
};
struct TripUnconfirmed {
  double waited_s = 0.0;
};
struct StampDenied {      ///< heartbeats sent after the contact's stamp reported 'open'
  double denied_s = 0.0;  ///< the last of them was this much later than the stamp
};
struct OpeningUnheard {  ///< unknown whether the contact opened: nothing was received since
  double unheard_s = 0.0;
};
struct StampOutside {
  double age_s = 0.0;  ///< of the sensor's time stamp
};
struct TouchedOutsideSearch {};
struct ContactNotOpen {};
struct InputTouched {};  ///< by the controller's contact input; not (yet) by the sensor

// Motion of the arm.
struct AxisNotFollowing {
  WireAxis axis{};
  double commanded_deg = 0.0, actual_deg = 0.0;
};
struct AxisStands {  ///< it does not move at all while its command advances
  WireAxis axis{};
  double commanded_deg = 0.0, actual_deg = 0.0;
};
struct MovedUnasked {  ///< an external axis that is not part of the move, or between moves
  WireAxis axis{};
  double held_deg = 0.0, actual_deg = 0.0;  ///< held_deg: nearest position asked for
};
struct NotSettled {
  WireAxis axis{};
  double moved_deg = 0.0, waited_s = 0.0;
};

// RSI link.
struct NoPackets {  ///< link down or lost at begin
  double waited_s = 0.0;
};
struct NotAccepted {};  ///< the controller counts every reply as late
struct Silence {
  double silent_s = 0.0;
};
struct SessionRestarted {
  /// The signal that was discontinuous.
  enum class Sign : std::uint8_t { kIpoc, kDelay, kSetpoint };
  Sign sign = Sign::kIpoc;
  double before = 0.0, after = 0.0;  ///< Delay; ASPos of the axis [deg]
  WireAxis axis{};
};
struct DamagedPackets {  ///< with a valid IPOC but no valid angles, consecutive
  std::uint32_t packets = 0;
};
/// A correction that was withheld: its step from the last one exceeds the axis limits.
struct ReplyBeyondLimit {
  enum class Of : std::uint8_t { kSpeed, kAcceleration, kJerk };
  Of of = Of::kSpeed;
  WireAxis axis{};
  double value = 0.0, limit = 0.0;  ///< deg/s, deg/s^2, deg/s^3
};
struct HeldUp {  ///< this computer did not run the robot's thread; packets may have arrived
  double silent_s = 0.0, limit_s = 0.0, slept_s = 0.0;
};
struct LateReplies {
  std::uint64_t replies = 0;  ///< during this move
};
struct IncrementLost {
  std::uint64_t replies = 0;  ///< during this move
};
struct DelayGone {};  ///< mode RELATIVE: lost increments would not be detected
struct TooCoarse {    ///< detected at the first change of the angles
  int decimals = 0;
};

// EKI link.
struct NotConnected {
  double waited_s = 0.0;  ///< since losing or opening the link
};
struct ControllerNotReady {};  ///< program not running, drives off, stopped: see the state
struct CommandNotTaken {
  double waited_s = 0.0;
};
struct LinkClosed {};  ///< by the controller
struct SessionTaken {
  std::uint32_t session = 0;  ///< obeyed by the controller
};
struct DeadMan {};  ///< the controller missed this computer's beats, or a telegram
struct ProgramAborted {
  int fault = 0;  ///< number defined by the controller's program
};
struct EndWithdrawn {};  ///< reported as ended, and then as under way
struct InputAtStart {};  ///< the controller's contact input is on before the search
struct InputMissed {};   ///< the sensor tripped, the controller's input did not
struct InputAlone {
  double waited_s = 0.0;  ///< for the sensor's message
};
struct OutsideSoftLimits {};
struct NotFeasible {};
struct LatchMissing {};
struct LatchOutOfRange {
  WireAxis axis{};
  double latched_deg = 0.0, measured_deg = 0.0;  ///< measured: the path at the contact
};
struct TooFastForFlag {
  WireAxis axis{};
  double speed_deg_s = 0.0, limit_deg_s = 0.0;
};
struct NotMoving {
  double still_s = 0.0;
  int override_percent = 0;
};
struct NotAtTarget {
  WireAxis axis{};
  double target_deg = 0.0, actual_deg = 0.0;
};

}  // namespace cause

using Cause = std::variant<
    cause::None, cause::NotReferenced, cause::Busy, cause::Closing, cause::AxisCount,
    cause::NotFinite, cause::BelowLimit, cause::AboveLimit, cause::CorrectionLimit,
    cause::ShiftLimit, cause::TurnLimit, cause::NearSingular, cause::BadCruise,
    cause::CruiseByWayPoints, cause::SearchByWayPoints, cause::BadShare, cause::StopAsked,
    cause::TravelAtTarget, cause::NoSensor, cause::NotArmed, cause::ArmedOtherwise,
    cause::TouchingAtStart, cause::TrippedAtStart, cause::SensorDead, cause::SensorLate,
    cause::KeepAliveLate, cause::ArmExpired, cause::TripUnconfirmed, cause::StampOutside,
    cause::StampDenied, cause::OpeningUnheard, cause::TouchedOutsideSearch, cause::ContactNotOpen,
    cause::InputTouched, cause::AxisNotFollowing, cause::AxisStands, cause::MovedUnasked,
    cause::NotSettled, cause::NoPackets, cause::NotAccepted, cause::Silence,
    cause::SessionRestarted, cause::DamagedPackets, cause::ReplyBeyondLimit, cause::HeldUp,
    cause::LateReplies, cause::IncrementLost, cause::DelayGone, cause::TooCoarse,
    cause::NotConnected, cause::ControllerNotReady, cause::CommandNotTaken, cause::LinkClosed,
    cause::SessionTaken, cause::DeadMan, cause::ProgramAborted, cause::EndWithdrawn,
    cause::InputAtStart, cause::InputMissed, cause::InputAlone, cause::OutsideSoftLimits,
    cause::NotFeasible, cause::LatchMissing, cause::LatchOutOfRange, cause::TooFastForFlag,
    cause::NotMoving, cause::NotAtTarget>;

// It is passed through lock-free queues, from a cycle that does not allocate.
static_assert(std::is_trivially_copyable_v<Cause>);

/// True if the cause is one of these kinds.
template <class... Kinds>
constexpr bool is(const Cause& cause) {
  return (std::holds_alternative<Kinds>(cause) || ...);
}

/// Result of a move on a KUKA, as a plain value created on the cycle.
struct CoreResult {
  std::uint32_t id = 0;
  MoveOutcome outcome = MoveOutcome::kRefused;
  Cause cause;
  std::uint32_t ipoc = 0;                           ///< of the last packet
  Interruption interruption = Interruption::kNone;  ///< of the link, if it is the cause
  bool in_space = false;                            ///< corrections in space
  AxisAngles at_rad;
  std::optional<Latch> latch;
};

/// Result of a move that does not begin.
CoreResult refusal_of(const Move& move, const Cause& why, const AxisAngles& at_rad,
                      MoveOutcome outcome = MoveOutcome::kRefused);

// Sentences of causes, off the cycle, since they allocate.

/// Event, location, and remedy; empty if there is nothing to report.
Sentence words(const CoreResult& result);
/// Likewise, of a cause without a move.
Sentence words(const Cause& cause);
MoveResult to_move_result(const CoreResult& result);

}  // namespace cellcal::drivers
