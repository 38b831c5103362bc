#include "drivers/kuka/rsi/link/rsi_report.h"

#include <fmt/format.h>

namespace cellcal::drivers {
namespace {

const char* const kReconnect =
    "; find the cause, start RSI again if the pendant asks for it, then reference anew";

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
             "guess would make the arm jump; let RSI time out and start it anew on the pendant, and "
             "wire DEF_ASPos and DEF_Delay into the ethernet XML";
    case Trouble::kUnknownSum:
      return "the correction that the controller holds cannot be known, so neither can what is "
             "left of it: start RSI anew on the pendant, or wire DEF_ASPos into the ethernet XML";
    case Trouble::kNoDelay:
      return "mode RELATIVE without Delay: an increment that is lost would not be noticed; wire "
             "DEF_Delay into the ethernet XML";
    case Trouble::kTcpDiffers:
      return fmt::format(
          "the controller has its TCP (RIst) {:.2f} mm and {:.3f} deg beside where the cell's "
          "nominal arm puts it, and corrections in space would go wrong by that: compare $TOOL "
          "with [controller] tool (0: the flange) and the cell file's tool, the robot file with "
          "the arm's type, and $BASE and $ROBROOT, which must be zero (or take DEF_RIst out of "
          "the ethernet XML where $ROBROOT only shifts)",
          s.tcp_apart.mm, s.tcp_apart.deg);
    case Trouble::kNotAccepted:
      return fmt::format(
          "SENTYPE or IPOC is not accepted: the controller counts every reply as late (Delay grows "
          "with each of {}); this side sends SENTYPE \"{}\" and the IPOC that came, so compare "
          "SENTYPE in the ethernet XML",
          s.replies, names.sentype);
  }
  return "unknown trouble";
}

std::string link_words(const CoreState& s, const ReportNames& names) {
  if (s.link == RobotLink::kDown) {
    return fmt::format(
        "no packet in {:.1f} s on {}: check that RSI runs on the pendant, IP_NUMBER and PORT of "
        "the ethernet XML, the cable and the subnet (not 192.168.0.x), the firewall, that no other "
        "program listens, and, where this computer or its network card is new, a cold start of the "
        "controller (it keeps the old hardware address)",
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

RobotState to_robot_state(const CoreState& s, const ReportNames& names) {
  RobotState state;
  state.link = s.link;
  state.actual_rad.assign(s.actual_rad, s.actual_rad + s.axes);
  state.commanded_rad.assign(s.commanded_rad, s.commanded_rad + s.axes);
  state.moving = s.moving;
  state.interruption = s.interruption;
  state.interruptions = s.interruptions;
  state.session = s.session;
  const bool linked = s.link == RobotLink::kNotReferenced || s.link == RobotLink::kReady;
  state.unsettled = linked && s.trouble != Trouble::kNone;
  state.cycle_s = s.cycle_s;
  state.packets = s.packets;
  state.late = s.late;
  state.quality.jitter_s = s.jitter_s;
  state.quality.longest_gap_s = s.longest_gap_s;
  state.quality.gaps = s.gaps;
  state.quality.bad_packets = s.bad_packets;
  state.quality.replies = s.replies;
  add(state.words, link_words(s, names));
  add(state.words, trouble_words(s, names));
  if (s.late > 0) {
    add(state.words, fmt::format("{} of {} replies came late: check the load of this computer, "
                                 "real-time priority, and the network",
                                 s.late, s.replies));
  }
  if (s.bad_packets > 0) {
    add(state.words, fmt::format("{} damaged packets, the last: {}, \"{}\"", s.bad_packets,
                                 to_string(s.last_error), s.last_bad));
  }
  return state;
}

}  // namespace cellcal::drivers
