#pragma once
// How a move on a KUKA ended, as plain values that the cycle can pass on, and the words that people
// read. The words are made on the reader's side: making them allocates.

#include <cstdint>
#include <optional>

#include "drivers/robot.h"

namespace cellcal::drivers {

/// Why a move ended as it did. `axis`, `a`, `b` of the CoreResult belong to it.
enum class Cause : std::uint8_t {
  kNone,
  kNoPackets,  ///< link down or lost at begin
  kNotReferenced,
  kBusy,
  kClosing,          ///< the session is being ended
  kAxisCount,        ///< a: given, b: expected
  kNotFinite,        ///< axis
  kBelowLimit,       ///< axis, a: target [deg], b: limit [deg]
  kAboveLimit,       ///< axis, a: target [deg], b: limit [deg]
  kCorrectionLimit,  ///< axis, a: correction [deg], b: limit [deg]
  kShiftLimit,       ///< corrections in space. a: shift [mm], b: limit [mm]
  kTurnLimit,        ///< a: turn [deg], b: limit [deg]
  kNearSingular,     ///< axis, a: its way over the TCP's, b: limit
  kBadCruise,        ///< a: seconds
  kNotAccepted,      ///< the controller counts every reply as late
  kNoSensor,
  kNotArmed,  ///< a: arm_id of the move, b: arm_id in force or -1
  kTouchingAtStart,
  kTrippedAtStart,
  kSensorDead,     ///< no heartbeat, or link broken
  kSensorLate,     ///< this computer delivered its heartbeats late. a: seconds, b: limit [s]
  kKeepAliveLate,  ///< the sensor did not hear this computer in time, and disarmed itself
  kArmExpired,
  kTripUnconfirmed,  ///< a: seconds waited
  kStampOutside,     ///< a: age of the sensor's time stamp [s]
  kTouchedOutsideSearch,
  kContactNotOpen,
  kSilence,  ///< a: seconds
  kSessionRestarted,
  kLateReplies,       ///< a: how many during this move
  kIncrementLost,     ///< a: how many during this move
  kDelayGone,         ///< mode RELATIVE: nobody would notice that an increment is lost
  kAxisNotFollowing,  ///< axis, a: commanded [deg], b: actual [deg]
  kAxisStands,        ///< likewise: it does not move at all while its command goes on
  kNotSettled,        ///< axis, a: still moving by [deg], b: seconds waited
  kStopAsked,
  kTooCoarse,  ///< a: decimals of the angles, seen when they changed for the first time
  // EKI alone
  kNotConnected,        ///< a: seconds since the link was lost or opened
  kControllerNotReady,  ///< program not running, drives off, stopped: see the state's words
  kCommandNotTaken,     ///< a: seconds waited
  kLinkClosed,          ///< the controller closed the connection
  kSessionTaken,        ///< a: the session that the controller obeys now
  kDeadMan,             ///< the controller missed this computer's beats
  kProgramAborted,      ///< a: fault number of the controller's program
  kInputAtStart,        ///< the controller's contact input is on before the search
  kInputMissed,         ///< the sensor tripped, the controller's input did not
  kInputAlone,          ///< a: seconds waited for the sensor's word
  kOutsideSoftLimits,
  kNotFeasible,
  kLatchMissing,
  kLatchAstray,     ///< axis, a: latched [deg], b: measured path at the contact [deg]
  kTooFastForFlag,  ///< axis, a: speed [deg/s], b: limit [deg/s]
  kNotMoving,       ///< axis, a: seconds without motion, b: override [%]
  kNotAtTarget,     ///< axis, a: target [deg], b: actual [deg]
};

struct CoreResult {
  std::uint32_t id = 0;
  MoveOutcome outcome = MoveOutcome::kRefused;
  Cause cause = Cause::kNone;
  std::uint8_t axis = 0;
  double a = 0.0, b = 0.0;
  std::uint32_t ipoc = 0;                           ///< of the last packet
  Interruption interruption = Interruption::kNone;  ///< of the link, where it is why
  bool in_space = false;                            ///< by corrections in space
  AxisAngles at_rad;
  std::optional<Latch> latch;
};

MoveResult to_move_result(const CoreResult& result);

}  // namespace cellcal::drivers
