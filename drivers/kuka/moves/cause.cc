#include "drivers/kuka/moves/cause.h"

#include <fmt/format.h>

#include <cmath>
#include <string>

#include "drivers/time.h"

namespace cellcal::drivers {

namespace {

// Controllers number six axes A1..A6, then external ones E1..
std::string name(WireAxis axis) {
  return axis.place < kArmAxes ? fmt::format("A{}", axis.place + 1)
                               : fmt::format("E{}", axis.place - 5);
}

const char* unit(WireAxis axis) { return axis.linear ? "mm" : "deg"; }

// Causes other than drives and obstacles (named by the session): the controller limits corrections
// without a message.
const char* const kAxisChecks =
    ". Check that the limits of AXISCORR are those of correction_limit_deg or more: it clamps "
    "silently";
const char* const kSpaceChecks =
    ". Check that RefCorrSys of POSCORR is correction_frame, that $TOOL is that of [controller] "
    "tool and of the cell file, that $BASE is $NULLFRAME, the robot file, and that the limits of "
    "POSCORR are those of correction_limit_mm and correction_turn_limit_deg or more: it clamps "
    "silently";

/// The point of a move concerned; empty for the target.
std::string point(std::uint8_t via) {
  return via == 0 ? std::string() : fmt::format("way-point {}, ", via);
}

/// One overload per kind of cause: a missing one is a compile error.
struct Words {
  const CoreResult& result;  ///< link and type of correction, if needed

  std::string operator()(const cause::None&) const { return {}; }

  // ---- before the move begins ------------------------------------------------------------------

  std::string operator()(const cause::NotReferenced&) const {
    return "not referenced: the arm's position has to be read first (rereference)";
  }
  std::string operator()(const cause::Busy&) const {
    return "another move is running; begin one at a time";
  }
  std::string operator()(const cause::Closing&) const {
    return "the session with the controller is being ended";
  }
  std::string operator()(const cause::AxisCount& c) const {
    return fmt::format("{} axes in {}, {} in the robot", c.given,
                       c.via == 0 ? "the target" : fmt::format("way-point {}", c.via), c.expected);
  }
  std::string operator()(const cause::NotFinite& c) const {
    return fmt::format("{}{}: target {} is not a finite {}", point(c.via), name(c.axis), c.target,
                       c.axis.linear ? "position" : "angle");
  }
  std::string operator()(const cause::BelowLimit& c) const {
    return fmt::format("{}{}: target {:.4f} {unit}, lower axis limit {:.4f} {unit}", point(c.via),
                       name(c.axis), c.target_deg, c.limit_deg, fmt::arg("unit", unit(c.axis)));
  }
  std::string operator()(const cause::AboveLimit& c) const {
    return fmt::format("{}{}: target {:.4f} {unit}, upper axis limit {:.4f} {unit}", point(c.via),
                       name(c.axis), c.target_deg, c.limit_deg, fmt::arg("unit", unit(c.axis)));
  }
  std::string operator()(const cause::CorrectionLimit& c) const {
    // No key sets a linear unit's: over RSI it is refused on a real controller.
    const std::string raise =
        c.axis.linear ? ""
                      : fmt::format(
                            ", or raise correction_limit_deg, make the controller's files "
                            "again (kuka-files: {}AXISCORRMON), copy them to the "
                            "controller and cold-start it",
                            result.in_space ? "" : "AXISCORR, ");
    return fmt::format(
        "{}{}: correction {:.4f} {unit}, limit +-{:.4f} {unit}. Begin the session nearer to the "
        "target{}",
        point(c.via), name(c.axis), c.correction_deg, c.limit_deg, raise,
        fmt::arg("unit", unit(c.axis)));
  }
  std::string operator()(const cause::ShiftLimit& c) const {
    return fmt::format(
        "{}correction in space: shift {:.2f} mm, limit {:.2f} mm. Begin the session nearer to "
        "the target, or raise the limits of POSCORR, POSCORRMON and correction_limit_mm",
        point(c.via), c.shift_mm, c.limit_mm);
  }
  std::string operator()(const cause::TurnLimit& c) const {
    return fmt::format(
        "{}correction in space: rotation {:.2f} deg, limit {:.2f} deg. Begin the session with "
        "the tool nearer to the target's orientation, or raise MaxRotAngle of POSCORR and "
        "POSCORRMON and correction_turn_limit_deg",
        point(c.via), c.turn_deg, c.limit_deg);
  }
  std::string operator()(const cause::NearSingular& c) const {
    return fmt::format(
        "{}near a singularity: {} would turn {:.0f} times as far as the TCP on this line "
        "(limit {:.0f}). A4 and A6 are in line, the arm is stretched, or the wrist is above "
        "A1: begin the session elsewhere, or use axis corrections (AXISCORR, correction = "
        "\"axes\")",
        point(c.via), name(c.axis), c.gain, c.limit);
  }
  std::string operator()(const cause::BadCruise& c) const {
    return fmt::format("cruise time {} s is not a duration", c.cruise_s);
  }
  std::string operator()(const cause::CruiseByWayPoints& c) const {
    return fmt::format(
        "cruise time {} s for a move with way-points: it belongs to one straight line. Leave it 0",
        c.cruise_s);
  }
  std::string operator()(const cause::SearchByWayPoints& c) const {
    return fmt::format("{} way-points in a search: it goes straight to its target", c.vias);
  }
  std::string operator()(const cause::BadShare& c) const {
    return fmt::format("{}share {} is not within 0 and {}", point(c.via), c.share, c.limit);
  }
  std::string operator()(const cause::StopAsked&) const { return "stopped on request"; }
  std::string operator()(const cause::TravelAtTarget& c) const {
    return fmt::format(
        "{}: {:.4f} {unit} of travel from {:.4f} {unit} in a search, or on the way out of a contact: "
        "these move the arm alone. Move the linear unit in a transit",
        name(c.axis), c.target_deg - c.from_deg, c.from_deg, fmt::arg("unit", unit(c.axis)));
  }

  // ---- the contact sensor ----------------------------------------------------------------------

  std::string operator()(const cause::NoSensor&) const {
    return "a search needs a contact sensor; none is configured";
  }
  std::string operator()(const cause::NotArmed& c) const {
    return fmt::format("contact sensor is not armed (search needs arming {})", c.wanted);
  }
  std::string operator()(const cause::ArmedOtherwise& c) const {
    return fmt::format("contact sensor is armed with {}, search needs {}", c.in_force, c.wanted);
  }
  std::string operator()(const cause::TouchingAtStart&) const {
    return "already in contact before the search. Retreat, or look for a short circuit";
  }
  std::string operator()(const cause::TrippedAtStart&) const {
    return "the contact sensor tripped between arming and search. Arm it again";
  }
  std::string operator()(const cause::SensorDead&) const {
    return "no heartbeat from the contact sensor. Check its cable and power";
  }
  std::string operator()(const cause::SensorLate& c) const {
    return late_bytes_words(c.late_s, c.limit_s);
  }
  std::string operator()(const cause::KeepAliveLate&) const {
    return "the contact sensor disarmed itself: this computer's keep-alive came too late. Stop "
           "other programs on this computer, or check the line to the sensor";
  }
  std::string operator()(const cause::ArmExpired& c) const {
    return fmt::format(
        "the contact sensor's arming ended before the search: {}",
        c.paced_here ? "packets were missed, or its clock runs fast. Check the network and "
                       "the load of this computer with 'cellcal doctor'"
                     : "the arm is slower than planned. Set the controller's override to 100 %");
  }
  std::string operator()(const cause::TripUnconfirmed& c) const {
    return fmt::format(
        "the contact sensor tripped but neither confirmed nor revoked the trip within {:.0f} "
        "ms. Check its cable",
        1e3 * c.waited_s);
  }
  std::string operator()(const cause::StampOutside& c) const {
    return fmt::format(
        "the contact's time stamp is {:.3f} s old, outside of the recorded path: the "
        "sensor's clock is not synchronised",
        c.age_s);
  }
  std::string operator()(const cause::StampDenied& c) const {
    return fmt::format(
        "the contact's time stamp is {:.1f} ms too early: the sensor reported 'open' so long after "
        "it. Not recorded. Check the line to the sensor, and flash its firmware anew",
        1e3 * c.denied_s);
  }
  std::string operator()(const cause::OpeningUnheard& c) const {
    return fmt::format(
        "no message from the contact sensor for {:.0f} ms on whether the contact opened: its data are "
        "late or lost. Check its cable and the load of this computer",
        std::ceil(1e3 * c.unheard_s));
  }
  std::string operator()(const cause::TouchedOutsideSearch&) const {
    return "contact outside of a search. Look for an obstacle in the path or a short circuit";
  }
  std::string operator()(const cause::ContactNotOpen&) const {
    return "still in contact at the end of the retreat. Look for a stuck tip or a short circuit";
  }

  // ---- motion of the arm -----------------------------------------------------------------------

  std::string operator()(const cause::AxisNotFollowing& c) const {
    return fmt::format(
        "{}: following error {:.4f} {unit}, set-point {:.4f} {unit}, actual {:.4f} {unit}{}",
        name(c.axis), std::abs(c.commanded_deg - c.actual_deg), c.commanded_deg, c.actual_deg,
        result.in_space ? kSpaceChecks : kAxisChecks, fmt::arg("unit", unit(c.axis)));
  }
  std::string operator()(const cause::AxisStands& c) const {
    return fmt::format(
        "{}: following error {:.4f} {unit}, at standstill at {:.4f} {unit} while its set-point "
        "advances to {:.4f} {unit}{}",
        name(c.axis), std::abs(c.commanded_deg - c.actual_deg), c.actual_deg, c.commanded_deg,
        result.in_space ? kSpaceChecks : kAxisChecks, fmt::arg("unit", unit(c.axis)));
  }
  std::string operator()(const cause::MovedUnasked& c) const {
    return fmt::format(
        "{}: {:.4f}, held at {:.4f} [{}]: the external axis moved and was not asked to. Find what moves "
        "it (another program, a hand on its pendant key, a coupled axis), then reference again",
        name(c.axis), c.actual_deg, c.held_deg, c.axis.linear ? "mm" : "deg, mm of a linear axis");
  }
  std::string operator()(const cause::NotSettled& c) const {
    return fmt::format("{}: still moving by {:.4f} {} after {:.2f} s", name(c.axis), c.moved_deg,
                       unit(c.axis), c.waited_s);
  }

  // ---- RSI link --------------------------------------------------------------------------------

  std::string operator()(const cause::NoPackets& c) const {
    return fmt::format("no packet from the controller for {:.2f} s. Start RSI on the pendant",
                       c.waited_s);
  }
  std::string operator()(const cause::NotAccepted&) const {
    return "the controller accepts no reply. Check SENTYPE";
  }
  std::string operator()(const cause::Silence& c) const {
    return fmt::format("no packet from the controller for {:.0f} ms (last IPOC {})",
                       1e3 * c.silent_s, result.ipoc);
  }
  std::string operator()(const cause::SessionRestarted& c) const {
    switch (c.sign) {
      case cause::SessionRestarted::Sign::kIpoc:
        break;
      case cause::SessionRestarted::Sign::kDelay:
        return fmt::format(
            "Delay counted back from {:.0f} to {:.0f} (IPOC {}): RSI was restarted. Read the "
            "message on the pendant",
            c.before, c.after, result.ipoc);
      case cause::SessionRestarted::Sign::kSetpoint:
        return fmt::format(
            "{}: start pose (ASPos) went from {:.4f} {unit} to {:.4f} {unit} within the session (IPOC "
            "{}): RSI was restarted, or the controller's program moves the arm. Read the message "
            "on the pendant",
            name(c.axis), c.before, c.after, result.ipoc, fmt::arg("unit", unit(c.axis)));
    }
    return fmt::format("IPOC jumped (now {}): RSI was restarted, or many packets were lost",
                       result.ipoc);
  }
  std::string operator()(const cause::DamagedPackets& c) const {
    return fmt::format(
        "{} damaged packets from the controller in a row (IPOC {}): the arm's position is not "
        "known. Check the cable and SEND of the ethernet XML",
        c.packets, result.ipoc);
  }
  std::string operator()(const cause::ReplyBeyondLimit& c) const {
    using Of = cause::ReplyBeyondLimit::Of;
    const char* const per = c.of == Of::kSpeed ? "/s" : c.of == Of::kAcceleration ? "/s2" : "/s3";
    const std::string asked = unit(c.axis) + std::string(per);
    return fmt::format(
        "{}: the next correction asked for {:.0f} {}, limit {:.0f} {}. It was not sent, and the arm "
        "holds. Inspect the arm, reference it again, and report this",
        name(c.axis), c.value, asked, c.limit, asked);
  }
  std::string operator()(const cause::HeldUp& c) const {
    return fmt::format(
        "this computer was busy: no packet read for {:.0f} ms, limit {:.0f} ms; its real-time "
        "thread did not run for {:.0f} ms of them (last IPOC {}). Stop other programs on this "
        "computer, and check its real-time priority",
        std::ceil(1e3 * c.silent_s), 1e3 * c.limit_s, 1e3 * c.slept_s, result.ipoc);
  }
  std::string operator()(const cause::LateReplies& c) const {
    return fmt::format(
        "this computer was busy: {} late replies during this move, counted by the controller "
        "(IPOC {}). Stop other programs on this computer, and check its real-time priority and the "
        "network",
        c.replies, result.ipoc);
  }
  std::string operator()(const cause::IncrementLost& c) const {
    return fmt::format(
        "this computer was busy: {} replies of this move not accepted by the controller (IPOC {}): "
        "their increments are lost, and the arm is not at its set-point. Stop other programs on "
        "this computer, and check the network",
        c.replies, result.ipoc);
  }
  std::string operator()(const cause::DelayGone&) const {
    return "the controller stopped sending Delay: a lost increment would not be detected. Check "
           "DEF_Delay in the ethernet XML";
  }
  std::string operator()(const cause::TooCoarse& c) const {
    return fmt::format(
        "angles with {} decimals (seen at their first change): too coarse to calibrate. "
        "Set the ETHERNET object's Precision to 4 or more",
        c.decimals);
  }

  // ---- EKI link --------------------------------------------------------------------------------

  std::string operator()(const cause::NotConnected& c) const {
    return fmt::format(
        "no state from the controller for {:.2f} s. Check that the submit program runs",
        c.waited_s);
  }
  std::string operator()(const cause::ControllerNotReady&) const {
    return "the controller's program is not ready to move. See 'cellcal status'";
  }
  std::string operator()(const cause::CommandNotTaken& c) const {
    return fmt::format(
        "the controller did not accept the move within {:.2f} s. The link was closed, so "
        "that the move cannot begin later",
        c.waited_s);
  }
  std::string operator()(const cause::LinkClosed&) const {
    return "the controller closed the connection";
  }
  std::string operator()(const cause::SessionTaken& c) const {
    return fmt::format(
        "the controller obeys another session ({}) now. Check whether two computers use "
        "one controller",
        c.session);
  }
  std::string operator()(const cause::DeadMan&) const {
    return "the controller received no heartbeat of this computer and stopped. Check the "
           "network and the load of this computer";
  }
  std::string operator()(const cause::ProgramAborted& c) const {
    return fmt::format(
        "the controller's program ended or stopped during the move (fault {}). Read the "
        "message on the pendant, select the program and start it again",
        c.fault);
  }
  std::string operator()(const cause::InputAtStart&) const {
    return "the controller's contact input is on before the search. Retreat, or look for a "
           "short circuit or a wrong input number";
  }
  std::string operator()(const cause::InputTouched&) const {
    return "the controller's contact input reported contact in a move other than a search, the contact "
           "sensor did not. Check what the tool touches, the sensor's supply, and the wire to the input";
  }
  std::string operator()(const cause::InputMissed&) const {
    return "the contact sensor tripped, the controller's contact input did not; the arm was "
           "stopped over the network. Check the wire to the input and the input's number";
  }
  std::string operator()(const cause::InputAlone& c) const {
    return fmt::format(
        "the controller's contact input stopped the arm, the contact sensor detected nothing "
        "within {:.0f} ms. Check the wires of both",
        1e3 * c.waited_s);
  }
  std::string operator()(const cause::OutsideSoftLimits&) const {
    return "the controller refused the target: it is outside of its software limit switches";
  }
  std::string operator()(const cause::NotFeasible&) const {
    return "the controller refused the move: its program could not compute the target";
  }
  std::string operator()(const cause::LatchMissing&) const {
    return "the controller stopped by its input but sent no latched angles of this move";
  }
  std::string operator()(const cause::LatchOutOfRange& c) const {
    return fmt::format(
        "{}: {:.4f} {unit} latched, {:.4f} {unit} measured at the contact. Check latch_delay_ms",
        name(c.axis), c.latched_deg, c.measured_deg, fmt::arg("unit", unit(c.axis)));
  }
  std::string operator()(const cause::TooFastForFlag& c) const {
    return fmt::format(
        "{}: search at {:.4f} deg/s, {:.4f} deg/s allowed without a contact input on the "
        "controller. Search slower",
        name(c.axis), c.speed_deg_s, c.limit_deg_s);
  }
  std::string operator()(const cause::NotMoving& c) const {
    return fmt::format(
        "the arm has not moved for {:.1f} s (override {} %). Check drives, start key and "
        "override",
        c.still_s, c.override_percent);
  }
  std::string operator()(const cause::NotAtTarget& c) const {
    return fmt::format("{}: target {:.4f} {unit}, at rest at {:.4f} {unit}", name(c.axis),
                       c.target_deg, c.actual_deg, fmt::arg("unit", unit(c.axis)));
  }
};

}  // namespace

std::string words(const CoreResult& result) { return std::visit(Words{result}, result.cause); }

std::string words(const Cause& cause) {
  CoreResult result;
  result.cause = cause;
  return words(result);
}

MoveResult to_move_result(const CoreResult& r) {
  return {r.id, r.outcome, words(r), r.interruption, r.at_rad, r.latch};
}

}  // namespace cellcal::drivers
