#include "daemon/doctor/robot_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/model/units.h"
#include "daemon/config/config.h"
#include "drivers/kuka/rsi/rsi_report.h"

namespace cellcal::daemon {

namespace {

// A KRC4 by itself is measured at 0.3 to 0.5 ms.
constexpr double kGoodJitterS = 0.001;
// Targets of the reply path; above half a cycle the network has no reserve.
constexpr double kGoodReplyS = 0.001, kPoorReplyShare = 0.5;
constexpr double kMsTolerance = 1e-6;

using calib::Phrase;

bool is_refused(const RsiSeen& seen) {
  const drivers::CoreState& s = seen.newest;
  // A controller with a short Timeout stops sending before the adapter is certain.
  constexpr std::uint64_t kFew = 5, kOnTheirWay = 2;
  const bool all_late = s.replies >= kFew && s.late + kOnTheirWay >= s.replies;
  return seen.refused || (seen.lost && all_late);
}

void judge_packets(const RsiSeen& seen, Findings& findings) {
  const std::string check = "rsi packets";
  const drivers::CoreState& s = seen.newest;
  if (!seen.up && s.bad_packets > 0) {
    findings.fail(check,
                  {"say.doctor.packets.foreign",
                   {{"packets", s.bad_packets},
                    {"at", seen.listening},
                    {"error", to_string(s.last_error)},
                    {"bytes", s.last_bad}}},
                  "say.doctor.packets.foreign.do");
  } else if (!seen.up) {
    findings.fail(check,
                  {"say.doctor.packets.none", {{"s", seen.waited_s}, {"at", seen.listening}}},
                  "say.doctor.packets.none.do");
  } else if (seen.lost && !is_refused(seen)) {
    findings.fail(check, {"say.doctor.packets.ended", {{"packets", s.packets}, {"ipoc", s.ipoc}}},
                  "say.doctor.packets.ended.do");
  } else if (const std::uint64_t twice = seen.state.quality.duplicates; twice > 0) {
    findings.warn(check, {"say.doctor.packets.twice", {{"packets", s.packets}, {"twice", twice}}},
                  "say.doctor.packets.twice.do");
  } else if (s.bad_packets > 0) {
    findings.warn(
        check,
        {"say.doctor.packets.damaged",
         {{"packets", s.packets}, {"damaged", s.bad_packets}, {"error", to_string(s.last_error)}}},
        "say.doctor.packets.damaged.do");
  } else {
    findings.ok(check, {"say.doctor.packets",
                        {{"packets", s.packets},
                         {"s", seen.observed_s},
                         {"first", seen.first_packet_s},
                         {"missing", s.gaps}}});
  }
}

void judge_sender(const RsiSeen& seen, Findings& findings) {
  if (seen.foreign > 0) {
    findings.fail("rsi sender",
                  {"say.doctor.sender.two", {{"sender", seen.sender}, {"packets", seen.foreign}}},
                  "say.doctor.sender.two.do");
  } else {
    findings.ok("rsi sender", seen.sender);
  }
}

void judge_cycle(const RsiSeen& seen, Findings& findings) {
  const std::string check = "rsi cycle";
  const drivers::CoreState& s = seen.newest;
  if (!(s.cycle_s > 0.0)) {
    findings.fail(check,
                  s.trouble == drivers::Trouble::kOddCycle ? "say.doctor.cycle.odd"
                                                           : "say.doctor.cycle.unknown",
                  "say.doctor.cycle.do");
    return;
  }
  const double ms = s.cycle_s * calib::kMsPerS;
  const Phrase figures{"say.doctor.cycle",
                       {{"ms", ms},
                        {"jitter", s.jitter_s * calib::kMsPerS},
                        {"longest", s.longest_gap_s * calib::kMsPerS},
                        {"step", s.ipoc_step}}};
  const bool usual = std::abs(ms - 4.0) < 0.1 || std::abs(ms - 12.0) < 0.1;
  const bool milliseconds = std::abs(s.ipoc_step - ms) < 0.1 + kMsTolerance;
  if (!usual || !milliseconds) {
    findings.warn(check, figures, "say.doctor.cycle.unusual.do");
  } else if (s.jitter_s > kGoodJitterS) {
    findings.warn(check, figures, "say.doctor.cycle.jitter.do");
  } else {
    findings.ok(check, figures);
  }
}

void judge_decimals(const RsiSeen& seen, Findings& findings) {
  const std::string check = "rsi decimals";
  const int decimals = seen.newest.decimals;
  const char* const advice = "say.doctor.decimals.do";
  const auto found = [decimals](const char* id) { return Phrase(id, {{"decimals", decimals}}); };
  switch (drivers::fitness_of_decimals(seen.newest)) {
    case drivers::Fitness::kUnfit:
      return findings.fail(check, found("say.doctor.decimals.coarse"), advice);
    case drivers::Fitness::kUnproven:
      return findings.warn(check, found("say.doctor.decimals.unproven"),
                           "say.doctor.decimals.unproven.do");
    case drivers::Fitness::kUsable:
      return findings.warn(check, found("say.doctor.decimals"), advice);
    case drivers::Fitness::kGood: return findings.ok(check, found("say.doctor.decimals"));
  }
}

void judge_elements(const RsiSeen& seen, Findings& findings) {
  const drivers::CoreState& s = seen.newest;
  const std::string check = "rsi elements";
  const char* const found = s.sends_setpoint ? "say.doctor.elements.delay"
                            : s.sends_delay  ? "say.doctor.elements.setpoint"
                                             : "say.doctor.elements.both";
  switch (drivers::fitness_of_elements(s)) {
    case drivers::Fitness::kUnfit:
      return findings.fail(check, found, "say.doctor.elements.relative.do");
    case drivers::Fitness::kUnproven:
    case drivers::Fitness::kUsable: return findings.warn(check, found, "say.doctor.elements.do");
    case drivers::Fitness::kGood: return findings.ok(check, "say.doctor.elements");
  }
}

void judge_state(const RsiSeen& seen, const RsiExpected& expected, Findings& findings) {
  const std::string check = "rsi state";
  const drivers::CoreState& s = seen.newest;
  const bool mode = s.mode != drivers::OperatingMode::kUnknown, percent = s.override_percent >= 0;
  const Phrase figures = percent ? Phrase("say.doctor.state", {{"mode", to_string(s.mode)},
                                                               {"percent", s.override_percent}})
                                 : Phrase("say.doctor.state.mode", {{"mode", to_string(s.mode)}});
  if (!expected.mode && !expected.override_percent) {
    findings.skip(check, "say.doctor.state.skip");
  } else if ((expected.mode && !mode) || (expected.override_percent && !percent)) {
    findings.warn(check, figures, "say.doctor.state.do");
  } else {
    findings.ok(check, {"say.doctor.state.good", {{"figures", figures}}});
  }
}

void judge_second_path(const RsiSeen& seen, const RsiExpected& expected, Findings& findings) {
  const std::string check = "rsi contact input";
  if (seen.newest.input_path == drivers::InputPath::kUntold) {
    return findings.fail(check, "say.doctor.input.unsent", "say.doctor.input.unsent.do");
  }
  judge_input(check, seen.input, expected.input, false, findings);
}

/// A mismatch of the TCP between controller and files falsifies Cartesian corrections by the same amount.
void judge_tcp(const RsiSeen& seen, Findings& findings) {
  const std::string check = "rsi tool";
  const drivers::TcpApart& apart = seen.newest.tcp_apart;
  const Phrase figures{"say.doctor.tool", {{"mm", apart.mm}, {"deg", apart.deg}}};
  if (apart.much()) {
    findings.fail(check, figures, "say.doctor.tool.do");
  } else if (apart.mm > 0.0 || apart.deg > 0.0) {
    findings.ok(check, figures);
  } else {
    findings.warn(check, "say.doctor.tool.unknown", "say.doctor.tool.unknown.do");
  }
}

void judge_replies(const RsiSeen& seen, const RsiExpected& expected, Findings& findings) {
  const std::string check = "rsi replies";
  const drivers::CoreState& s = seen.newest;
  const std::uint64_t late = s.late - std::min(s.late, seen.late_at_start);
  if (is_refused(seen)) {
    findings.fail(check, {"say.doctor.replies.refused", {{"late", s.late}, {"replies", s.replies}}},
                  {"say.doctor.replies.refused.do", {{"sentype", expected.sentype}}});
  } else if (!seen.answered) {
    findings.fail(check, or_else(seen.last_words, "say.doctor.replies.none"),
                  "say.doctor.replies.none.do");
  } else if (late >= static_cast<std::uint64_t>(expected.late_limit)) {
    findings.fail(check, {"say.doctor.replies.late", {{"late", late}, {"replies", s.replies}}},
                  "say.doctor.replies.late.do");
  } else if (late > 0) {
    findings.warn(check, {"say.doctor.replies.late", {{"late", late}, {"replies", s.replies}}},
                  "say.doctor.replies.some.do");
  } else {
    findings.ok(check, {"say.doctor.replies", {{"replies", s.replies}}});
  }
}

void judge_times(const RsiSeen& seen, Findings& findings) {
  const std::string check = "rsi reply times";
  const drivers::RobotQuality& q = seen.state.quality;
  if (q.replies == 0) return findings.skip(check, "say.doctor.times.none");
  Phrase figures{"say.doctor.times",
                 {{"p50", q.reply_p50_s * calib::kMsPerS},
                  {"p99", q.reply_p99_s * calib::kMsPerS},
                  {"p999", q.reply_p999_s * calib::kMsPerS},
                  {"longest", q.reply_max_s * calib::kMsPerS},
                  {"replies", q.replies}}};
  for (const auto& [ms, count] : seen.replies_within) {
    if (count == 0) continue;
    figures = joined("say.join.semicolon", figures,
                     {"say.doctor.times.within", {{"replies", count}, {"ms", ms}}});
    if (count >= q.replies) break;
  }
  if (q.reply_p99_s > kPoorReplyShare * seen.newest.cycle_s) {
    findings.fail(check, figures, "say.doctor.times.bad.do");
  } else if (q.reply_p999_s > kGoodReplyS) {
    findings.warn(check, figures, "say.doctor.times.slow.do");
  } else {
    findings.ok(check, figures);
  }
}

calib::Joint joint_like(const calib::PositionerAxis& axis) {
  calib::Joint joint;
  joint.name = axis.name;
  joint.min_rad = axis.min_rad;
  joint.max_rad = axis.max_rad;
  return joint;
}

// The programs send every 20 ms, or every loop of a busy submit interpreter.
constexpr double kSlowStatesS = 0.060;
// The overtravel figures hold for a pass every 20 ms; $TIMER counts in steps of 12 ms.
constexpr std::uint32_t kSlowPassMs = 36;
constexpr int kFewestDecimals = 3;

bool judge_connection(const EkiSeen& seen, Findings& findings) {
  if (!seen.connected) {
    findings.fail("eki connection", seen.last_words, "say.doctor.eki.connection.do");
    return false;
  }
  findings.ok("eki connection", {"say.doctor.eki.connection", {{"peer", seen.peer}}});
  return true;
}

bool judge_states(const EkiSeen& seen, Findings& findings) {
  const drivers::EkiCoreState& s = seen.newest;
  const std::string check = "eki states";
  if (!seen.up || s.states == 0) {
    findings.fail(check, seen.last_words, "say.doctor.eki.states.none.do");
    return false;
  }
  Phrase figures{"say.doctor.eki.states",
                 {{"states", s.states},
                  {"s", seen.observed_s},
                  {"every", s.cycle_s * calib::kMsPerS},
                  {"jitter", s.jitter_s * calib::kMsPerS},
                  {"gap", s.longest_gap_s * calib::kMsPerS}}};
  if (s.longest_pass_ms > 0)
    figures = {"say.doctor.eki.states.pass", {{"figures", figures}, {"ms", s.longest_pass_ms}}};
  if (seen.lost) {
    findings.fail(
        check, {"say.doctor.eki.states.lost", {{"figures", figures}, {"words", seen.last_words}}},
        "say.doctor.eki.states.lost.do");
  } else if (s.cycle_s > kSlowStatesS || s.longest_pass_ms > kSlowPassMs) {
    findings.warn(check, figures, "say.doctor.eki.states.slow.do");
  } else {
    findings.ok(check, figures);
  }
  return true;
}

void judge_elements(const EkiSeen& seen, Findings& findings) {
  const drivers::EkiCoreState& s = seen.newest;
  const char* const advice = "say.doctor.eki.elements.do";
  if (s.bad_documents > 0) {
    findings.fail(
        "eki elements",
        {"say.doctor.eki.elements.damaged",
         {{"states", s.bad_documents}, {"error", to_string(s.last_error)}, {"bytes", s.last_bad}}},
        advice);
  } else if (s.unread_by_controller > 0) {
    findings.fail("eki elements",
                  {"say.doctor.eki.elements.unread", {{"telegrams", s.unread_by_controller}}},
                  advice);
  } else if (s.trouble == drivers::EkiTrouble::kUnread ||
             s.trouble == drivers::EkiTrouble::kOtherSession) {
    findings.fail("eki elements", seen.last_words, advice);
  } else {
    findings.ok("eki elements", "say.doctor.eki.elements");
  }
}

void judge_decimals(const EkiSeen& seen, Findings& findings) {
  const int decimals = seen.newest.decimals_seen;
  if (decimals < kFewestDecimals) {
    findings.fail(
        "eki decimals",
        {"say.doctor.eki.decimals.coarse", {{"decimals", decimals}, {"least", kFewestDecimals}}},
        "say.doctor.eki.decimals.do");
  } else {
    findings.ok("eki decimals", {"say.doctor.eki.decimals", {{"decimals", decimals}}});
  }
}

void judge_readiness(const EkiSeen& seen, Findings& findings) {
  const drivers::EkiCoreState& s = seen.newest;
  const std::string check = "eki readiness";
  Phrase figures{s.drives ? "say.doctor.eki.ready.drives_on" : "say.doctor.eki.ready.drives_off",
                 {{"mode", to_string(s.mode)}, {"percent", s.override_percent}}};
  if (s.stopped) figures = joined("say.join.comma", figures, "say.doctor.eki.ready.stopped");
  if (s.fault != 0) {
    findings.fail(check, {"say.doctor.eki.ready.fault", {{"figures", figures}, {"fault", s.fault}}},
                  "say.doctor.eki.ready.fault.do");
  } else if (!s.ready) {
    findings.warn(check, {"say.doctor.eki.ready.not", {{"figures", figures}}},
                  {"say.doctor.eki.ready.not.do", {{"what", start_instruction(WireKind::kEki)}}});
  } else {
    findings.ok(check, {"say.doctor.eki.ready", {{"figures", figures}}});
  }
}

}  // namespace

void judge_rsi(const RsiSeen& seen, const RsiExpected& expected, Findings& findings) {
  judge_packets(seen, findings);
  if (!seen.up) {
    for (const char* check : {"rsi sender", "rsi cycle", "rsi decimals", "rsi elements",
                              "rsi state", "rsi replies", "rsi reply times"}) {
      findings.skip(check, "say.doctor.no_packets");
    }
    if (expected.in_space) findings.skip("rsi tool", "say.doctor.no_packets");
    if (expected.input > 0) findings.skip("rsi contact input", "say.doctor.no_packets");
    return;
  }
  judge_sender(seen, findings);
  judge_cycle(seen, findings);
  judge_decimals(seen, findings);
  judge_elements(seen, findings);
  judge_state(seen, expected, findings);
  if (expected.input > 0) judge_second_path(seen, expected, findings);
  if (expected.in_space) judge_tcp(seen, findings);
  judge_replies(seen, expected, findings);
  judge_times(seen, findings);
}

void judge_rsi_end(std::optional<double> ended_after_s, Findings& findings) {
  const std::string check = "rsi stop";
  if (!ended_after_s) {
    findings.warn(check, "say.doctor.stop.none", "say.doctor.stop.none.do");
  } else {
    findings.ok(check, {"say.doctor.stop", {{"s", *ended_after_s}}});
  }
}

void judge_model(const calib::ControllerModel& model, const calib::Robot& robot, bool sends,
                 WireKind wire, Findings& findings) {
  using enum calib::ControllerModel::Outcome;
  const std::string check = "controller's model";
  const Phrase found = phrase(model, robot);
  switch (model.outcome) {
    case kAgrees: return findings.ok(check, found);
    case kNotStated:
      if (sends)
        return findings.skip(check, wire == WireKind::kRsi ? "say.doctor.model.moving.rsi"
                                                           : "say.doctor.model.moving.eki");
      return findings.warn(check, found,
                           wire == WireKind::kRsi ? "say.doctor.model.unsent.do.rsi"
                                                  : "say.doctor.model.unsent.do.eki");
    case kOtherFrames: return findings.warn(check, found, "say.doctor.model.frames.do");
    case kUndecided: return findings.warn(check, found, "say.doctor.model.undecided.do");
    case kDiffers: return findings.fail(check, found, "say.doctor.model.differs.do");
  }
}

void judge_angles(const std::string& check, const drivers::AxisAngles& actual_rad,
                  const calib::Robot* robot, Findings& findings) {
  constexpr double kNearDeg = 1.0, kNearMm = 10.0;
  const bool track = robot != nullptr && robot->first_turning() > 0;
  std::string shown;
  for (std::size_t i = 0; i < actual_rad.size(); ++i) {
    const bool in_mm = track && i == 0;
    shown += fmt::format("{}{:.3f}{}", shown.empty() ? "" : ", ",
                         actual_rad[i] * (in_mm ? calib::kMmPerM : calib::kDegPerRad),
                         in_mm ? " mm" : "");
  }
  if (robot == nullptr)
    return findings.skip(check, {"say.doctor.angles.unchecked", {{"deg", shown}}});
  const std::size_t joints = robot->joints.size(), axes = joints + robot->positioner.size();
  if (axes != actual_rad.size()) {
    return findings.fail(
        check, {"say.doctor.angles.count", {{"angles", actual_rad.size()}, {"joints", axes}}},
        "say.doctor.angles.count.do");
  }
  std::string outside, near;
  for (std::size_t i = 0; i < actual_rad.size(); ++i) {
    const bool turns = i >= joints;  // an axis of the positioner
    const calib::Joint joint = turns ? joint_like(robot->positioner[i - joints]) : robot->joints[i];
    const double room = std::min(actual_rad[i] - joint.min_rad, joint.max_rad - actual_rad[i]) *
                        calib::unit_of(joint).per_si;
    std::string& list = room < 0.0 ? outside : near;
    // A positioner may rest at the end of its range.
    if (room < (turns ? 0.0 : joint.is_prismatic() ? kNearMm : kNearDeg))
      list += fmt::format("{}{}", list.empty() ? "" : ", ", joint.name);
  }
  if (!outside.empty()) {
    findings.fail(check, {"say.doctor.angles.outside", {{"deg", shown}, {"axes", outside}}},
                  "say.doctor.angles.outside.do");
  } else if (!near.empty()) {
    findings.warn(check,
                  {track ? "say.doctor.angles.near.unit" : "say.doctor.angles.near",
                   {{"deg", shown}, {"axes", near}}},
                  "say.doctor.angles.near.do");
  } else {
    findings.ok(check, {"say.doctor.angles", {{"deg", shown}}});
  }
}

void judge_input(const std::string& check, const InputSeen& seen, int number, bool contact_is_on,
                 Findings& findings) {
  const auto found = [number](const char* id) { return Phrase(id, {{"number", number}}); };
  if (seen.on_while_open) {
    findings.fail(check, found("say.doctor.input.on_while_open"),
                  {"say.doctor.input.on_while_open.do", {{"level", contact_is_on ? "on" : "off"}}});
  } else if (seen.contact_changed && !seen.changed) {
    findings.fail(check, found("say.doctor.input.dead"), "say.doctor.input.dead.do");
  } else if (seen.changed && seen.contact_changed && contact_is_on) {
    findings.warn(check, found("say.doctor.input.normally_open"),
                  "say.doctor.input.normally_open.do");
  } else if (seen.changed && seen.contact_changed) {
    findings.ok(check, found("say.doctor.input.good"));
  } else if (seen.changed) {
    findings.fail(check, found("say.doctor.input.alone"), "say.doctor.input.alone.do");
  } else if (seen.on) {
    findings.warn(check, found("say.doctor.input.closed"), "say.doctor.input.closed.do");
  } else {
    findings.warn(check, found("say.doctor.input.untested"), "say.doctor.input.untested.do");
  }
}

void judge_eki(const EkiSeen& seen, const EkiExpected& expected, Findings& findings) {
  const bool fine = judge_connection(seen, findings) && judge_states(seen, findings);
  if (!fine) {
    for (const char* check :
         {"eki elements", "eki decimals", "eki readiness", "eki contact input"}) {
      findings.skip(check, "say.doctor.no_states");
    }
    return;
  }
  judge_elements(seen, findings);
  judge_decimals(seen, findings);
  judge_readiness(seen, findings);
  if (expected.by_input) {
    judge_input("eki contact input", seen.input, expected.input, expected.contact_is_on, findings);
  } else {
    findings.ok("eki contact input", "say.doctor.input.unused");
  }
}

}  // namespace cellcal::daemon
