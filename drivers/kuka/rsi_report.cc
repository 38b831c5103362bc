#include "drivers/kuka/rsi_report.h"

#include <fmt/format.h>

#include <algorithm>

namespace cellcal::drivers {
namespace {

// Controllers number six axes A1..A6, then external ones E1..
std::string axis_name(std::uint8_t axis) {
  return axis < 6 ? fmt::format("A{}", axis + 1) : fmt::format("E{}", axis - 5);
}

const char* const kReconnect =
    "; find the cause, start RSI again if the pendant asks for it, then reference anew";

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
          "to the target, or widen AXISCORR, AXISCORRMON and correction_limit_deg",
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
      return "the contact sensor's arming ended during the search: give it a longer life";
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
    case Cause::kAxisNotFollowing:
      return fmt::format(
          "{} was commanded to {:.4f} deg and is at {:.4f} deg: drives off, or the "
          "correction is clamped by AXISCORR; reference anew",
          axis, r.a, r.b);
    case Cause::kNotSettled:
      return fmt::format("{} still moved by {:.4f} deg after {:.2f} s", axis, r.a, r.b);
    case Cause::kStopAsked:
      return "stopped on request";
  }
  return "unknown cause";
}

std::string trouble_words(const CoreState& s, const ReportNames& names) {
  switch (s.trouble) {
    case Trouble::kNone:
      return {};
    case Trouble::kLearning:
      return "learning the controller's cycle";
    case Trouble::kOddCycle:
      return "packets come outside of 2 to 40 ms: use #IPO_FAST (4 ms) or #IPO (12 ms)";
    case Trouble::kCoarse:
      return fmt::format(
          "AIPos comes with {} decimals, too coarse to calibrate with: set the "
          "ETHERNET object's Precision to 4 or more",
          s.decimals);
    case Trouble::kTooFewAxes:
      return fmt::format("packets hold fewer than {} axes: wire DEF_AIPos (and DEF_EIPos)", s.axes);
    case Trouble::kWaitingForRest:
      return "not answering yet: the arm moves and its correction is not known";
    case Trouble::kUnknownOffset:
      return "not answering: which correction the controller holds cannot be known, and a wrong "
             "guess would make the arm jump; let RSI time out and start it anew on the pendant, "
             "and "
             "wire DEF_ASPos and DEF_Delay into the ethernet XML";
    case Trouble::kNotAccepted:
      return fmt::format(
          "the controller counts every reply as late: SENTYPE or IPOC is not "
          "accepted; this side sends SENTYPE \"{}\"",
          names.sentype);
  }
  return "unknown trouble";
}

std::string link_words(const CoreState& s, const ReportNames& names) {
  if (s.link == RobotLink::kDown) {
    return fmt::format(
        "no packet in {:.1f} s on {}: check that RSI runs on the pendant, IP_NUMBER and PORT of "
        "the ethernet XML, the cable and the subnet (not 192.168.0.x), the firewall, and that no "
        "other program listens",
        s.waited_s, names.listening);
  }
  if (s.link == RobotLink::kLost) {
    return fmt::format("packets stopped {:.1f} s ago after IPOC {}{}", s.waited_s, s.ipoc,
                       kReconnect);
  }
  if (s.link == RobotLink::kNotReferenced && s.rereference_pending) {
    return "referencing: waiting for the arm to rest";
  }
  return {};
}

void add(std::string& words, const std::string& more) {
  if (more.empty()) return;
  if (!words.empty()) words += ". ";
  words += more;
}

}  // namespace

MoveResult to_move_result(const CoreResult& r) {
  return {r.id, r.outcome, cause_words(r), r.at_rad, r.latch};
}

RobotState to_robot_state(const CoreState& s, const ReportNames& names) {
  RobotState state;
  state.link = s.link;
  state.actual_rad.assign(s.actual_rad, s.actual_rad + s.axes);
  state.commanded_rad.assign(s.commanded_rad, s.commanded_rad + s.axes);
  state.moving = s.moving;
  state.cycle_s = s.cycle_s;
  state.packets = s.packets;
  state.late = s.late;
  add(state.words, link_words(s, names));
  add(state.words, trouble_words(s, names));
  if (s.bad_packets > 0) {
    add(state.words, fmt::format("{} damaged packets, the last: {}, \"{}\"", s.bad_packets,
                                 to_string(s.last_error), s.last_bad));
  }
  return state;
}

}  // namespace cellcal::drivers
