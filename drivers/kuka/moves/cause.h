#pragma once
// Why a move on a KUKA ended as it did: one type per kind, with the evidence that belongs to it, by
// name and unit. Plain values that the cycle makes and passes on; the words that people read are
// made on the reader's side (cause_words.h), since making them allocates. Code asks for kinds.

#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <variant>

namespace cellcal::drivers {

/// An axis counts from 0; what is limited has the limit beside it. `via`: the way-point that it is
/// said of, from 1; 0 is the target.
namespace cause {

struct None {};

// Before it begins.
struct NotReferenced {};
struct Busy {};
struct Closing {};  ///< the session is being ended
struct AxisCount {
  std::size_t given = 0, expected = 0;
  std::uint8_t via = 0;
};
struct NotFinite {
  std::uint8_t axis = 0;
  double target = 0.0;
  std::uint8_t via = 0;
};
struct BelowLimit {
  std::uint8_t axis = 0;
  double target_deg = 0.0, limit_deg = 0.0;
  std::uint8_t via = 0;
};
struct AboveLimit {
  std::uint8_t axis = 0;
  double target_deg = 0.0, limit_deg = 0.0;
  std::uint8_t via = 0;
};
struct CorrectionLimit {
  std::uint8_t axis = 0;
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
  std::uint8_t axis = 0;
  double gain = 0.0, limit = 0.0;  ///< its way over the TCP's [rad per m or rad]
  std::uint8_t via = 0;
};
struct BadCruise {
  double cruise_s = 0.0;
};
struct CruiseByWayPoints {  ///< one duration for several legs
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
struct SensorDead {};  ///< no heartbeat, or link broken
struct SensorLate {    ///< this computer delivered its heartbeats late
  double late_s = 0.0, limit_s = 0.0;
};
struct KeepAliveLate {};  ///< the sensor did not hear this computer in time, and disarmed itself
struct ArmExpired {
  bool paced_here = false;  ///< this computer makes the arm's speed, not the controller's override
};
struct TripUnconfirmed {
  double waited_s = 0.0;
};
struct StampDenied {  ///< heartbeats that the sensor sent behind the contact's stamp said 'open'
  double denied_s = 0.0;  ///< the last of them was so much later than the stamp
};
struct OpeningUnheard {  ///< whether the contact opened is not known: nothing was heard since
  double unheard_s = 0.0;
};
struct StampOutside {
  double age_s = 0.0;  ///< of the sensor's time stamp
};
struct TouchedOutsideSearch {};
struct ContactNotOpen {};
struct InputTouched {};  ///< by the controller's contact input, the sensor has not said so (yet)

// How the arm moved.
struct AxisNotFollowing {
  std::uint8_t axis = 0;
  double commanded_deg = 0.0, actual_deg = 0.0;
};
struct AxisStands {  ///< it does not move at all while its command goes on
  std::uint8_t axis = 0;
  double commanded_deg = 0.0, actual_deg = 0.0;
};
struct NotSettled {
  std::uint8_t axis = 0;
  double moved_deg = 0.0, waited_s = 0.0;
};

// The link over RSI.
struct NoPackets {  ///< link down or lost at begin
  double waited_s = 0.0;
};
struct NotAccepted {};  ///< the controller counts every reply as late
struct Silence {
  double silent_s = 0.0;
};
struct SessionRestarted {
  /// Of what did not go on.
  enum class Sign : std::uint8_t { kIpoc, kDelay, kSetpoint };
  Sign sign = Sign::kIpoc;
  double before = 0.0, after = 0.0;  ///< Delay; ASPos of the axis [deg]
  std::uint8_t axis = 0;
};
struct DamagedPackets {  ///< of a sound IPOC and no sound angles, one behind the other
  std::uint32_t packets = 0;
};
/// A correction that was not sent: the step from the last one is more than the axis may do.
struct ReplyBeyondLimit {
  enum class Of : std::uint8_t { kSpeed, kAcceleration, kJerk };
  Of of = Of::kSpeed;
  std::uint8_t axis = 0;
  double value = 0.0, limit = 0.0;  ///< deg/s, deg/s^2, deg/s^3
};
struct
    HeldUp {  ///< this computer did not run the robot's thread: whether packets came is not known
  double silent_s = 0.0, limit_s = 0.0, slept_s = 0.0;
};
struct LateReplies {
  std::uint64_t replies = 0;  ///< during this move
};
struct IncrementLost {
  std::uint64_t replies = 0;  ///< during this move
};
struct DelayGone {};  ///< mode RELATIVE: nobody would notice that an increment is lost
struct TooCoarse {    ///< seen when the angles changed for the first time
  int decimals = 0;
};

// Over EKI.
struct NotConnected {
  double waited_s = 0.0;  ///< since the link was lost or opened
};
struct ControllerNotReady {};  ///< program not running, drives off, stopped: see the state's words
struct CommandNotTaken {
  double waited_s = 0.0;
};
struct LinkClosed {};  ///< by the controller
struct SessionTaken {
  std::uint32_t session = 0;  ///< that the controller obeys now
};
struct DeadMan {};  ///< the controller missed this computer's beats
struct ProgramAborted {
  int fault = 0;  ///< number of the controller's program
};
struct InputAtStart {};  ///< the controller's contact input is on before the search
struct InputMissed {};   ///< the sensor tripped, the controller's input did not
struct InputAlone {
  double waited_s = 0.0;  ///< for the sensor's word
};
struct OutsideSoftLimits {};
struct NotFeasible {};
struct LatchMissing {};
struct LatchAstray {
  std::uint8_t axis = 0;
  double latched_deg = 0.0, measured_deg = 0.0;  ///< measured: the path at the contact
};
struct TooFastForFlag {
  std::uint8_t axis = 0;
  double speed_deg_s = 0.0, limit_deg_s = 0.0;
};
struct NotMoving {
  double still_s = 0.0;
  int override_percent = 0;
};
struct NotAtTarget {
  std::uint8_t axis = 0;
  double target_deg = 0.0, actual_deg = 0.0;
};

}  // namespace cause

using Cause =
    std::variant<cause::None, cause::NotReferenced, cause::Busy, cause::Closing, cause::AxisCount,
                 cause::NotFinite, cause::BelowLimit, cause::AboveLimit, cause::CorrectionLimit,
                 cause::ShiftLimit, cause::TurnLimit, cause::NearSingular, cause::BadCruise,
                 cause::CruiseByWayPoints, cause::SearchByWayPoints, cause::BadShare,
                 cause::StopAsked, cause::NoSensor, cause::NotArmed, cause::ArmedOtherwise,
                 cause::TouchingAtStart, cause::TrippedAtStart, cause::SensorDead,
                 cause::SensorLate, cause::KeepAliveLate, cause::ArmExpired, cause::TripUnconfirmed,
                 cause::StampOutside, cause::StampDenied, cause::OpeningUnheard,
                 cause::TouchedOutsideSearch, cause::ContactNotOpen, cause::InputTouched, cause::AxisNotFollowing,
                 cause::AxisStands, cause::NotSettled, cause::NoPackets, cause::NotAccepted,
                 cause::Silence, cause::SessionRestarted, cause::DamagedPackets,
                 cause::ReplyBeyondLimit, cause::HeldUp, cause::LateReplies, cause::IncrementLost,
                 cause::DelayGone, cause::TooCoarse, cause::NotConnected, cause::ControllerNotReady,
                 cause::CommandNotTaken, cause::LinkClosed, cause::SessionTaken, cause::DeadMan,
                 cause::ProgramAborted, cause::InputAtStart, cause::InputMissed, cause::InputAlone,
                 cause::OutsideSoftLimits, cause::NotFeasible, cause::LatchMissing,
                 cause::LatchAstray, cause::TooFastForFlag, cause::NotMoving, cause::NotAtTarget>;

// It crosses threads in lock-free queues, from a cycle that does not allocate.
static_assert(std::is_trivially_copyable_v<Cause>);

/// It is one of these kinds.
template <class... Kinds>
constexpr bool is(const Cause& cause) {
  return (std::holds_alternative<Kinds>(cause) || ...);
}

}  // namespace cellcal::drivers
