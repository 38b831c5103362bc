#include "drivers/kuka/moves/cause.h"

#include <fmt/format.h>

#include <string>

namespace cellcal::drivers {
namespace {

// Controllers number six axes A1..A6, then external ones E1..
std::string axis_name(std::uint8_t axis) {
  return axis < 6 ? fmt::format("A{}", axis + 1) : fmt::format("E{}", axis - 5);
}

const char* const kReconnect =
    "; find the cause, start RSI again if the pendant asks for it, then reference anew";

const char* const kReference =
    "; find the cause, start the program again if the pendant asks for it, then reference anew";

// What an arm does not follow by, where RKorr carries it.
const char* const kSpaceChecks =
    "; corrections are in space: check that RefCorrSys of POSCORR is correction_frame, that $TOOL "
    "is that of [controller] tool and of the cell file, that $BASE is $NULLFRAME, the robot file, "
    "and that the limits of POSCORR are those of correction_limit_mm and correction_turn_limit_deg "
    "or more; reference anew";

std::string eki_words(const CoreResult& r, const std::string& axis) {
  switch (r.cause) {
    case Cause::kNotConnected:
      return fmt::format(
          "no state from the controller for {:.2f} s: check that the submit program runs{}", r.a,
          kReference);
    case Cause::kControllerNotReady:
      return "the controller's program is not ready to move: see the link's words";
    case Cause::kCommandNotTaken:
      return fmt::format(
          "the controller did not take the move within {:.2f} s; the link was cut "
          "so that it cannot begin later{}",
          r.a, kReference);
    case Cause::kLinkClosed:
      return fmt::format("the controller closed the connection{}", kReference);
    case Cause::kSessionTaken:
      return fmt::format(
          "the controller obeys another session ({:.0f}) now: two computers on one "
          "controller?{}",
          r.a, kReference);
    case Cause::kDeadMan:
      return "the controller missed this computer's beats and stopped: check the network and the "
             "load of this computer";
    case Cause::kProgramAborted:
      return fmt::format(
          "the controller's program was ended or stopped in the middle of the move "
          "(fault {:.0f}): see the pendant, select and start it again, then "
          "reference anew",
          r.a);
    case Cause::kInputAtStart:
      return "the controller's contact input is on before the search: retreat, or look for a short "
             "circuit or a swapped input";
    case Cause::kInputMissed:
      return "the contact sensor tripped and the controller's contact input did not: check the "
             "wire to the input and its number; the arm was stopped over the network";
    case Cause::kInputAlone:
      return fmt::format(
          "the controller's contact input stopped the arm and the contact sensor "
          "saw nothing within {:.0f} ms: check the wires of both",
          1e3 * r.a);
    case Cause::kOutsideSoftLimits:
      return "the controller refused the target: outside of its software limit switches";
    case Cause::kNotFeasible:
      return "the controller refused the move: its program could not compute the target";
    case Cause::kLatchMissing:
      return "the controller stopped by its input and sent no latched angles of this move";
    case Cause::kLatchAstray:
      return fmt::format(
          "{} was latched at {:.4f} deg and was measured at {:.4f} deg at the "
          "contact: wrong latch_delay_ms, or angles of another contact",
          axis, r.a, r.b);
    case Cause::kTooFastForFlag:
      return fmt::format(
          "{} would search at {:.4f} deg/s; without a contact input on the "
          "controller {:.4f} deg/s is the limit: search slower",
          axis, r.a, r.b);
    case Cause::kNotMoving:
      return fmt::format(
          "the arm has not moved for {:.1f} s (override {:.0f} %): drives off, "
          "start key released, or override 0",
          r.a, r.b);
    case Cause::kNotAtTarget:
      return fmt::format("{} was sent to {:.4f} deg and rests at {:.4f} deg; reference anew", axis,
                         r.a, r.b);
    default:
      return "unknown cause";
  }
}

std::string cause_words(const CoreResult& r) {
  const std::string axis = axis_name(r.axis);
  switch (r.cause) {
    case Cause::kNone:
      return {};
    case Cause::kNoPackets:
      return fmt::format("no packets from the controller for {:.2f} s: start RSI on the pendant",
                         r.a);
    case Cause::kNotReferenced:
      return "not referenced: the arm's position has to be taken over first (rereference)";
    case Cause::kBusy:
      return "another move is running: one at a time";
    case Cause::kClosing:
      return "the session with the controller is being ended";
    case Cause::kAxisCount:
      return fmt::format("target has {:.0f} axes, the robot {:.0f}", r.a, r.b);
    case Cause::kNotFinite:
      return fmt::format("{}: target {} is not a finite angle", axis, r.a);
    case Cause::kBelowLimit:
      return fmt::format("{}: target {:.4f} deg is below the axis limit {:.4f} deg", axis, r.a,
                         r.b);
    case Cause::kAboveLimit:
      return fmt::format("{}: target {:.4f} deg is above the axis limit {:.4f} deg", axis, r.a,
                         r.b);
    case Cause::kCorrectionLimit:
      return fmt::format(
          "{}: correction {:.4f} deg is beyond the limit of +-{:.4f} deg: begin the session nearer "
          "to the target, or widen correction_limit_deg, make the controller's files anew (kuka-files: "
          "{}AXISCORRMON), copy them there, cold start",
          axis, r.a, r.b, r.in_space ? "" : "AXISCORR, ");
    case Cause::kShiftLimit:
      return fmt::format(
          "correction in space: shift {:.2f} mm is beyond the limit of {:.2f} mm: begin the "
          "session nearer to the target, or widen POSCORR, POSCORRMON and correction_limit_mm",
          r.a, r.b);
    case Cause::kTurnLimit:
      return fmt::format(
          "correction in space: turn {:.2f} deg is beyond the limit of {:.2f} deg: begin the "
          "session with the tool nearer to the target's orientation, or widen MaxRotAngle of "
          "POSCORR and POSCORRMON and correction_turn_limit_deg",
          r.a, r.b);
    case Cause::kNearSingular:
      return fmt::format(
          "correction in space: {} would turn {:.0f} times as far as the TCP on this line (limit "
          "{:.0f}): a wrist with A4 and A6 in line, a stretched arm, or a wrist above A1; go "
          "round it, begin the session elsewhere, or use axis corrections (AXISCORR, correction = "
          "\"axes\")",
          axis, r.a, r.b);
    case Cause::kBadCruise:
      return fmt::format("cruise time {} s is not a duration", r.a);
    case Cause::kNotAccepted:
      return "the controller accepts no reply: check SENTYPE and IPOC";
    case Cause::kNoSensor:
      return "a search needs a contact sensor, and there is none";
    case Cause::kNotArmed:
      return r.b < 0.0
                 ? fmt::format("contact sensor is not armed (search wants arming {:.0f})", r.a)
                 : fmt::format("contact sensor is armed with {:.0f}, search wants {:.0f}", r.b,
                               r.a);
    case Cause::kTouchingAtStart:
      return "already in contact: retreat before the search, or look for a short circuit";
    case Cause::kTrippedAtStart:
      return "the contact sensor tripped between arming and the search: arm again";
    case Cause::kSensorDead:
      return "no heartbeat from the contact sensor: check its cable and power";
    case Cause::kArmExpired:
      return "the contact sensor's arming ended before the search did: the arm is slower than "
             "planned; look at the controller's override (100 %)";
    case Cause::kSensorLate:
      return fmt::format(
          "the contact sensor's bytes came {:.0f} ms late on this computer (limit {:.0f} ms), which "
          "the sensor had sent in time: stop other work on this computer, or set a core aside "
          "(drivers/contact/README.md)",
          1e3 * r.a, 1e3 * r.b);
    case Cause::kKeepAliveLate:
      return "this computer's keep-alive reached the contact sensor too late, and it disarmed itself: "
             "stop other work on this computer, or look at the line to the sensor";
    case Cause::kTripUnconfirmed:
      return fmt::format(
          "the contact sensor tripped and neither confirmed nor revoked it in {:.0f} "
          "ms: check its cable",
          1e3 * r.a);
    case Cause::kStampOutside:
      return fmt::format(
          "the contact's time stamp is {:.3f} s old, outside of the recorded path: "
          "the sensor's clock map is wrong",
          r.a);
    case Cause::kTouchedOutsideSearch:
      return "contact outside of a search: look for an obstacle in the path or a short circuit";
    case Cause::kContactNotOpen:
      return "still in contact at the end of the retreat: look for a stuck tip or a short circuit";
    case Cause::kSilence:
      return fmt::format("no packet from the controller for {:.0f} ms (last IPOC {}){}", 1e3 * r.a,
                         r.ipoc, kReconnect);
    case Cause::kSessionRestarted:
      return fmt::format("IPOC jumped (now {}): RSI was started anew, or many packets were lost{}",
                         r.ipoc, kReconnect);
    case Cause::kLateReplies:
      return fmt::format(
          "the controller counted {:.0f} late replies during this move (IPOC {}): "
          "check the load of this computer, real-time priority, and the network",
          r.a, r.ipoc);
    case Cause::kDelayGone:
      return "the controller sends no Delay any more: an increment that is lost would not be "
             "noticed; wire DEF_Delay into the ethernet XML";
    case Cause::kIncrementLost:
      return fmt::format(
          "the controller did not take {:.0f} replies of this move (IPOC {}), and increments that "
          "are lost are never caught up: the arm is not where it was commanded to; reference anew, "
          "and check the load of this computer and the network",
          r.a, r.ipoc);
    case Cause::kAxisStands:
      if (r.in_space) {
        return fmt::format(
            "{} stands at {:.4f} deg while it is commanded on, to {:.4f} deg: the "
            "drives are off, the arm is blocked, or POSCORR clamps in silence{}",
            axis, r.b, r.a, kSpaceChecks);
      }
      return fmt::format(
          "{} stands at {:.4f} deg while it is commanded on, to {:.4f} deg: the correction is "
          "clamped in silence by AXISCORR (its limits must be those of correction_limit_deg or "
          "more), the drives are off, or the arm is blocked; reference anew",
          axis, r.b, r.a);
    case Cause::kAxisNotFollowing:
      if (r.in_space) {
        return fmt::format(
            "{} was commanded to {:.4f} deg and is at {:.4f} deg: drives off, or "
            "the controller makes something else of the correction{}",
            axis, r.a, r.b, kSpaceChecks);
      }
      return fmt::format(
          "{} was commanded to {:.4f} deg and is at {:.4f} deg: drives off, or the "
          "correction is clamped by AXISCORR; reference anew",
          axis, r.a, r.b);
    case Cause::kNotSettled:
      return fmt::format("{} still moved by {:.4f} deg after {:.2f} s", axis, r.a, r.b);
    case Cause::kStopAsked:
      return "stopped on request";
    case Cause::kTooCoarse:
      return fmt::format(
          "the angles come with {:.0f} decimals, as their first change shows: too coarse to "
          "calibrate with; set the ETHERNET object's Precision to 4 or more",
          r.a);
    default:
      return eki_words(r, axis);
  }
}

}  // namespace

MoveResult to_move_result(const CoreResult& r) {
  return {r.id, r.outcome, cause_words(r), r.interruption, r.at_rad, r.latch};
}

}  // namespace cellcal::drivers
