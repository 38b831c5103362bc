#include "drivers/kuka/rsi/rsi_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "drivers/kuka/wire/stated_tcp.h"

namespace cellcal::drivers {

namespace {

const char* const kReconnect =
    ". Read the message on the pendant, and start RSI again if it asks for it";

std::string trouble_words(const CoreState& s, const ReportNames& names) {
  switch (s.trouble) {
    case Trouble::kNone:
      return {};
    case Trouble::kLearning:
      return "learning the controller's cycle";
    case Trouble::kOddCycle:
      return "packet cycle outside of 2 to 40 ms. Use RSI_ON with #IPO_FAST (4 ms) or #IPO (12 ms)";
    case Trouble::kCoarse:
      return fmt::format(
          "AIPos with {} decimals: too coarse to calibrate. Set the ETHERNET object's "
          "Precision to 4 or more",
          s.decimals);
    case Trouble::kTooFewAxes:
      return fmt::format(
          "packets with fewer than {} axes. Add DEF_AIPos (and DEF_EIPos) to the ethernet XML",
          s.axes);
    case Trouble::kWaitingForRest:
      return "not answering yet: the arm moves and its correction is unknown";
    case Trouble::kUnknownOffset:
      return "not answering: the correction that the controller holds is unknown, and a wrong one "
             "would make the arm jump. Wait for RSI's time-out, start it again on the pendant, "
             "and add DEF_ASPos and DEF_Delay to the ethernet XML";
    case Trouble::kCorrectionDenied:
      return "not answering: AIPos - ASPos is not the correction that was sent, IPOC and Delay show "
             "no new session, and the arm holds. Wait for RSI's time-out, start it again on the "
             "pendant, and check what sends ASPos";
    case Trouble::kUnknownSum:
      return "the correction that the controller holds is unknown, and so is what is left of its "
             "limit. Start RSI again on the pendant, or add DEF_ASPos to the ethernet XML";
    case Trouble::kNoDelay:
      return "mode RELATIVE without Delay: a lost increment would not be detected. Add DEF_Delay "
             "to the ethernet XML";
    case Trouble::kTcpDiffers:
      return fmt::format(
          "{:.2f} mm and {:.3f} deg between the controller's TCP (RIst) and that of robot and "
          "cell file: corrections in space would be wrong by as much. Compare $TOOL with "
          "[controller] tool (0: the flange) and with the cell file's tool, and the robot file "
          "with the arm's type; $BASE and $ROBROOT must be zero (or remove DEF_RIst from the "
          "ethernet XML if $ROBROOT only shifts)",
          s.tcp_apart.mm, s.tcp_apart.deg);
    case Trouble::kNotAccepted:
      return fmt::format(
          "no reply accepted: the controller counts each of {} as late (Delay). This computer "
          "sends SENTYPE \"{}\" and the received IPOC: set the same SENTYPE in the ethernet XML",
          s.replies, names.sentype);
  }
  return "unknown trouble";
}

std::string link_words(const CoreState& s, const ReportNames& names) {
  if (s.link == RobotLink::kDown) {
    return fmt::format(
        "no packet for {:.1f} s on {}. Check that RSI runs on the pendant, IP_NUMBER and PORT "
        "of the ethernet XML, the cable and the subnet (not 192.168.0.x), the firewall, and "
        "that no other program listens; if this computer or its network card is new, "
        "cold-start the controller (it keeps the old hardware address)",
        s.waited_s, names.listening);
  }
  if (s.link == RobotLink::kLost) {
    const double for_s = std::max(s.waited_s, s.silent_s);
    return fmt::format("no packet for {}, last IPOC {}{}",
                       for_s < 1.0 ? fmt::format("{:.0f} ms", std::ceil(1e3 * for_s))
                                   : fmt::format("{:.1f} s", for_s),
                       s.ipoc, kReconnect);
  }
  if (s.link == RobotLink::kNotReferenced && s.rereference_pending) {
    return "referencing: waiting for the arm to come to rest";
  }
  return {};
}

std::string input_words(InputPath path) {
  if (path == InputPath::kMissed)
    return "the controller's contact input missed a touch: late bytes of the sensor stop the arm as "
           "without it. Check the wire from O+ and O- to the input, and its number";
  if (path == InputPath::kUntold)
    return "the controller does not send its contact input ([rsi] contact_tag). Install the files of "
           "'cellcal kuka-files' anew";
  return {};
}

void add(std::string& words, const std::string& more) {
  if (more.empty()) return;
  const std::size_t begins = words.empty() ? 0 : words.size() + 2;
  words += (begins == 0 ? "" : ". ") + more;
  if (begins > 0)
    words[begins] = static_cast<char>(std::toupper(static_cast<unsigned char>(words[begins])));
}

}  // namespace

RobotState to_robot_state(const CoreState& s, const ReportNames& names) {
  RobotState state;
  state.link = s.link;
  state.linear_unit = s.linear_unit;
  state.actual_rad.assign(s.actual_rad, s.actual_rad + s.axes);
  state.commanded_rad.assign(s.commanded_rad, s.commanded_rad + s.axes);
  if (s.states_tcp) state.stated_tcp = to_stated_tcp(s.tcp);
  state.moving = s.moving;
  state.interruption = s.interruption;
  state.interruptions = s.interruptions;
  state.session = s.session;
  const bool linked = s.link == RobotLink::kNotReferenced || s.link == RobotLink::kReady;
  state.unsettled = linked && s.trouble != Trouble::kNone;
  if (linked) {
    state.mode = s.mode;
    state.input_path = s.input_path;
    if (s.override_percent >= 0) state.override_percent = s.override_percent;
  }
  state.stops_by_input = s.stops_by_input;
  state.cycle_s = s.cycle_s;
  state.packets = s.packets;
  state.late = s.late;
  state.quality.jitter_s = s.jitter_s;
  state.quality.longest_gap_s = s.longest_gap_s;
  state.quality.gaps = s.gaps;
  state.quality.bad_packets = s.bad_packets;
  state.quality.duplicates = s.duplicates;
  state.quality.replies = s.replies;
  add(state.words, link_words(s, names));
  if (s.unasked) add(state.words, words(*s.unasked));
  add(state.words, trouble_words(s, names));
  add(state.words, input_words(state.input_path));
  if (s.late > 0) {
    add(state.words,
        fmt::format(
            "{} of {} replies late. Check the load of this computer, its real-time priority, and "
            "the network",
            s.late, s.replies));
  }
  if (s.bad_packets > 0) {
    add(state.words, fmt::format("{} damaged packets, last: {}, \"{}\"", s.bad_packets,
                                 to_string(s.last_error), s.last_bad));
  }
  return state;
}

namespace {

constexpr int kGoodDecimals = 4;

}  // namespace

Fitness fitness_of_decimals(const CoreState& state) {
  if (state.decimals >= kGoodDecimals) return Fitness::kGood;
  if (state.decimals >= kFewestDecimals) return Fitness::kUsable;
  return state.decimals_unproven ? Fitness::kUnproven : Fitness::kUnfit;
}

Fitness fitness_of_elements(const CoreState& state) {
  if (state.relative && !state.sends_delay) return Fitness::kUnfit;
  return state.sends_setpoint && state.sends_delay ? Fitness::kGood : Fitness::kUsable;
}

}  // namespace cellcal::drivers
