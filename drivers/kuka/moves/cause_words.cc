#include "drivers/kuka/moves/cause_words.h"

#include <fmt/format.h>

#include <string>

namespace cellcal::drivers {
namespace {

// Controllers number six axes A1..A6, then external ones E1..
std::string name(std::uint8_t axis) {
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

/// One for each kind of cause: the compiler names a kind that has none.
struct Words {
  const CoreResult& result;  ///< of the link and the kind of correction, where the words need them

  std::string operator()(const cause::None&) const { return {}; }

  // ---- before it begins ------------------------------------------------------------------------

  std::string operator()(const cause::NotReferenced&) const {
    return "not referenced: the arm's position has to be taken over first (rereference)";
  }
  std::string operator()(const cause::Busy&) const {
    return "another move is running: one at a time";
  }
  std::string operator()(const cause::Closing&) const {
    return "the session with the controller is being ended";
  }
  std::string operator()(const cause::AxisCount& c) const {
    return fmt::format("target has {} axes, the robot {}", c.given, c.expected);
  }
  std::string operator()(const cause::NotFinite& c) const {
    return fmt::format("{}: target {} is not a finite angle", name(c.axis), c.target);
  }
  std::string operator()(const cause::BelowLimit& c) const {
    return fmt::format("{}: target {:.4f} deg is below the axis limit {:.4f} deg", name(c.axis),
                       c.target_deg, c.limit_deg);
  }
  std::string operator()(const cause::AboveLimit& c) const {
    return fmt::format("{}: target {:.4f} deg is above the axis limit {:.4f} deg", name(c.axis),
                       c.target_deg, c.limit_deg);
  }
  std::string operator()(const cause::CorrectionLimit& c) const {
    return fmt::format(
        "{}: correction {:.4f} deg is beyond the limit of +-{:.4f} deg: begin the session nearer "
        "to the target, or widen correction_limit_deg, make the controller's files anew (kuka-files: "
        "{}AXISCORRMON), copy them there, cold start",
        name(c.axis), c.correction_deg, c.limit_deg, result.in_space ? "" : "AXISCORR, ");
  }
  std::string operator()(const cause::ShiftLimit& c) const {
    return fmt::format(
        "correction in space: shift {:.2f} mm is beyond the limit of {:.2f} mm: begin the "
        "session nearer to the target, or widen POSCORR, POSCORRMON and correction_limit_mm",
        c.shift_mm, c.limit_mm);
  }
  std::string operator()(const cause::TurnLimit& c) const {
    return fmt::format(
        "correction in space: turn {:.2f} deg is beyond the limit of {:.2f} deg: begin the "
        "session with the tool nearer to the target's orientation, or widen MaxRotAngle of "
        "POSCORR and POSCORRMON and correction_turn_limit_deg",
        c.turn_deg, c.limit_deg);
  }
  std::string operator()(const cause::NearSingular& c) const {
    return fmt::format(
        "correction in space: {} would turn {:.0f} times as far as the TCP on this line (limit "
        "{:.0f}): a wrist with A4 and A6 in line, a stretched arm, or a wrist above A1; go "
        "round it, begin the session elsewhere, or use axis corrections (AXISCORR, correction = "
        "\"axes\")",
        name(c.axis), c.gain, c.limit);
  }
  std::string operator()(const cause::BadCruise& c) const {
    return fmt::format("cruise time {} s is not a duration", c.cruise_s);
  }
  std::string operator()(const cause::StopAsked&) const { return "stopped on request"; }

  // ---- the contact sensor ----------------------------------------------------------------------

  std::string operator()(const cause::NoSensor&) const {
    return "a search needs a contact sensor, and there is none";
  }
  std::string operator()(const cause::NotArmed& c) const {
    return fmt::format("contact sensor is not armed (search wants arming {})", c.wanted);
  }
  std::string operator()(const cause::ArmedOtherwise& c) const {
    return fmt::format("contact sensor is armed with {}, search wants {}", c.in_force, c.wanted);
  }
  std::string operator()(const cause::TouchingAtStart&) const {
    return "already in contact: retreat before the search, or look for a short circuit";
  }
  std::string operator()(const cause::TrippedAtStart&) const {
    return "the contact sensor tripped between arming and the search: arm again";
  }
  std::string operator()(const cause::SensorDead&) const {
    return "no heartbeat from the contact sensor: check its cable and power";
  }
  std::string operator()(const cause::SensorLate& c) const {
    return fmt::format(
        "the contact sensor's bytes came {:.0f} ms late on this computer (limit {:.0f} ms), which "
        "the sensor had sent in time: stop other work on this computer, or set a core aside "
        "(drivers/contact/README.md)",
        1e3 * c.late_s, 1e3 * c.limit_s);
  }
  std::string operator()(const cause::KeepAliveLate&) const {
    return "this computer's keep-alive reached the contact sensor too late, and it disarmed itself: "
           "stop other work on this computer, or look at the line to the sensor";
  }
  std::string operator()(const cause::ArmExpired&) const {
    return "the contact sensor's arming ended before the search did: the arm is slower than "
           "planned; look at the controller's override (100 %)";
  }
  std::string operator()(const cause::TripUnconfirmed& c) const {
    return fmt::format(
        "the contact sensor tripped and neither confirmed nor revoked it in {:.0f} "
        "ms: check its cable",
        1e3 * c.waited_s);
  }
  std::string operator()(const cause::StampOutside& c) const {
    return fmt::format(
        "the contact's time stamp is {:.3f} s old, outside of the recorded path: "
        "the sensor's clock map is wrong",
        c.age_s);
  }
  std::string operator()(const cause::TouchedOutsideSearch&) const {
    return "contact outside of a search: look for an obstacle in the path or a short circuit";
  }
  std::string operator()(const cause::ContactNotOpen&) const {
    return "still in contact at the end of the retreat: look for a stuck tip or a short circuit";
  }

  // ---- how the arm moved -----------------------------------------------------------------------

  std::string operator()(const cause::AxisNotFollowing& c) const {
    if (result.in_space) {
      return fmt::format(
          "{} was commanded to {:.4f} deg and is at {:.4f} deg: drives off, or "
          "the controller makes something else of the correction{}",
          name(c.axis), c.commanded_deg, c.actual_deg, kSpaceChecks);
    }
    return fmt::format(
        "{} was commanded to {:.4f} deg and is at {:.4f} deg: drives off, or the "
        "correction is clamped by AXISCORR; reference anew",
        name(c.axis), c.commanded_deg, c.actual_deg);
  }
  std::string operator()(const cause::AxisStands& c) const {
    if (result.in_space) {
      return fmt::format(
          "{} stands at {:.4f} deg while it is commanded on, to {:.4f} deg: the "
          "drives are off, the arm is blocked, or POSCORR clamps in silence{}",
          name(c.axis), c.actual_deg, c.commanded_deg, kSpaceChecks);
    }
    return fmt::format(
        "{} stands at {:.4f} deg while it is commanded on, to {:.4f} deg: the correction is "
        "clamped in silence by AXISCORR (its limits must be those of correction_limit_deg or "
        "more), the drives are off, or the arm is blocked; reference anew",
        name(c.axis), c.actual_deg, c.commanded_deg);
  }
  std::string operator()(const cause::NotSettled& c) const {
    return fmt::format("{} still moved by {:.4f} deg after {:.2f} s", name(c.axis), c.moved_deg,
                       c.waited_s);
  }

  // ---- the link over RSI -----------------------------------------------------------------------

  std::string operator()(const cause::NoPackets& c) const {
    return fmt::format("no packets from the controller for {:.2f} s: start RSI on the pendant",
                       c.waited_s);
  }
  std::string operator()(const cause::NotAccepted&) const {
    return "the controller accepts no reply: check SENTYPE and IPOC";
  }
  std::string operator()(const cause::Silence& c) const {
    return fmt::format("no packet from the controller for {:.0f} ms (last IPOC {}){}",
                       1e3 * c.silent_s, result.ipoc, kReconnect);
  }
  std::string operator()(const cause::SessionRestarted&) const {
    return fmt::format("IPOC jumped (now {}): RSI was started anew, or many packets were lost{}",
                       result.ipoc, kReconnect);
  }
  std::string operator()(const cause::LateReplies& c) const {
    return fmt::format(
        "the controller counted {} late replies during this move (IPOC {}): "
        "check the load of this computer, real-time priority, and the network",
        c.replies, result.ipoc);
  }
  std::string operator()(const cause::IncrementLost& c) const {
    return fmt::format(
        "the controller did not take {} replies of this move (IPOC {}), and increments that "
        "are lost are never caught up: the arm is not where it was commanded to; reference anew, "
        "and check the load of this computer and the network",
        c.replies, result.ipoc);
  }
  std::string operator()(const cause::DelayGone&) const {
    return "the controller sends no Delay any more: an increment that is lost would not be "
           "noticed; wire DEF_Delay into the ethernet XML";
  }
  std::string operator()(const cause::TooCoarse& c) const {
    return fmt::format(
        "the angles come with {} decimals, as their first change shows: too coarse to "
        "calibrate with; set the ETHERNET object's Precision to 4 or more",
        c.decimals);
  }

  // ---- over EKI --------------------------------------------------------------------------------

  std::string operator()(const cause::NotConnected& c) const {
    return fmt::format(
        "no state from the controller for {:.2f} s: check that the submit program runs{}",
        c.waited_s, kReference);
  }
  std::string operator()(const cause::ControllerNotReady&) const {
    return "the controller's program is not ready to move: see the link's words";
  }
  std::string operator()(const cause::CommandNotTaken& c) const {
    return fmt::format(
        "the controller did not take the move within {:.2f} s; the link was cut "
        "so that it cannot begin later{}",
        c.waited_s, kReference);
  }
  std::string operator()(const cause::LinkClosed&) const {
    return fmt::format("the controller closed the connection{}", kReference);
  }
  std::string operator()(const cause::SessionTaken& c) const {
    return fmt::format(
        "the controller obeys another session ({}) now: two computers on one controller?{}",
        c.session, kReference);
  }
  std::string operator()(const cause::DeadMan&) const {
    return "the controller missed this computer's beats and stopped: check the network and the "
           "load of this computer";
  }
  std::string operator()(const cause::ProgramAborted& c) const {
    return fmt::format(
        "the controller's program was ended or stopped in the middle of the move "
        "(fault {}): see the pendant, select and start it again, then "
        "reference anew",
        c.fault);
  }
  std::string operator()(const cause::InputAtStart&) const {
    return "the controller's contact input is on before the search: retreat, or look for a short "
           "circuit or a swapped input";
  }
  std::string operator()(const cause::InputMissed&) const {
    return "the contact sensor tripped and the controller's contact input did not: check the "
           "wire to the input and its number; the arm was stopped over the network";
  }
  std::string operator()(const cause::InputAlone& c) const {
    return fmt::format(
        "the controller's contact input stopped the arm and the contact sensor "
        "saw nothing within {:.0f} ms: check the wires of both",
        1e3 * c.waited_s);
  }
  std::string operator()(const cause::OutsideSoftLimits&) const {
    return "the controller refused the target: outside of its software limit switches";
  }
  std::string operator()(const cause::NotFeasible&) const {
    return "the controller refused the move: its program could not compute the target";
  }
  std::string operator()(const cause::LatchMissing&) const {
    return "the controller stopped by its input and sent no latched angles of this move";
  }
  std::string operator()(const cause::LatchAstray& c) const {
    return fmt::format(
        "{} was latched at {:.4f} deg and was measured at {:.4f} deg at the "
        "contact: wrong latch_delay_ms, or angles of another contact",
        name(c.axis), c.latched_deg, c.measured_deg);
  }
  std::string operator()(const cause::TooFastForFlag& c) const {
    return fmt::format(
        "{} would search at {:.4f} deg/s; without a contact input on the "
        "controller {:.4f} deg/s is the limit: search slower",
        name(c.axis), c.speed_deg_s, c.limit_deg_s);
  }
  std::string operator()(const cause::NotMoving& c) const {
    return fmt::format(
        "the arm has not moved for {:.1f} s (override {} %): drives off, "
        "start key released, or override 0",
        c.still_s, c.override_percent);
  }
  std::string operator()(const cause::NotAtTarget& c) const {
    return fmt::format("{} was sent to {:.4f} deg and rests at {:.4f} deg; reference anew",
                       name(c.axis), c.target_deg, c.actual_deg);
  }
};

}  // namespace

std::string words(const CoreResult& result) { return std::visit(Words{result}, result.cause); }

MoveResult to_move_result(const CoreResult& r) {
  return {r.id, r.outcome, words(r), r.interruption, r.at_rad, r.latch};
}

}  // namespace cellcal::drivers
