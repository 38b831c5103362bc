#include "drivers/kuka/rsi/rsi_report.h"

#include <cmath>

#include "drivers/kuka/wire/wire_axes.h"

namespace cellcal::drivers {

namespace {

Sentence trouble_words(const CoreState& s, const ReportNames& names) {
  switch (s.trouble) {
    case Trouble::kNone: return {};
    case Trouble::kLearning: return "say.rsi.learning";
    case Trouble::kOddCycle: return "say.rsi.odd_cycle";
    case Trouble::kCoarse: return {"say.rsi.coarse", {{"decimals", s.decimals}}};
    case Trouble::kTooFewAxes: return {"say.rsi.too_few_axes", {{"axes", s.axes}}};
    case Trouble::kWaitingForRest: return "say.rsi.waiting_for_rest";
    case Trouble::kUnknownOffset: return "say.rsi.unknown_offset";
    case Trouble::kCorrectionDenied: return "say.rsi.correction_denied";
    case Trouble::kUnknownSum: return "say.rsi.unknown_sum";
    case Trouble::kNoDelay: return "say.rsi.no_delay";
    case Trouble::kTcpDiffers:
      return {"say.rsi.tcp_differs", {{"mm", s.tcp_apart.mm}, {"deg", s.tcp_apart.deg}}};
    case Trouble::kNotAccepted:
      return {"say.rsi.not_accepted", {{"replies", s.replies}, {"sentype", names.sentype}}};
  }
  return {};
}

Sentence link_words(const CoreState& s, const ReportNames& names) {
  if (s.link == RobotLink::kDown)
    return {"say.rsi.no_packet", {{"s", s.waited_s}, {"at", names.listening}}};
  if (s.link == RobotLink::kLost) {
    const double for_s = std::max(s.waited_s, s.silent_s);
    return {for_s < 1.0 ? "say.rsi.lost.ms" : "say.rsi.lost.s",
            {{"ms", std::ceil(1e3 * for_s)}, {"s", for_s}, {"ipoc", s.ipoc}}};
  }
  if (s.link == RobotLink::kNotReferenced && s.rereference_pending) return "say.robot.referencing";
  return {};
}

Sentence input_words(InputPath path) {
  if (path == InputPath::kMissed) return "say.rsi.input_missed";
  if (path == InputPath::kUntold) return "say.rsi.input_untold";
  return {};
}

void add(Sentence& all, Sentence more) { all = sentences(std::move(all), std::move(more)); }

constexpr int kGoodDecimals = 4;

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
  if (s.late > 0) add(state.words, {"say.rsi.late", {{"late", s.late}}});
  if (s.bad_packets > 0)
    add(state.words, {"say.rsi.damaged",
                      {{"packets", s.bad_packets},
                       {"error", to_string(s.last_error)},
                       {"bytes", std::string(s.last_bad)}}});
  return state;
}

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
