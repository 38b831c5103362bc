#include "daemon/doctor/robot_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/model/enum_table.h"
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

const char* const kChecklist =
    "check in this order: (1) CELLCAL_RSI is started on the pendant and shows no RSI fault "
    "(KSS29002: reset it and start it again while doctor waits, this computer has to listen "
    "before RSI_ON); (2) IP_NUMBER and PORT of the ethernet XML are this computer's, and the "
    "controller was cold-started after a change; (3) RSI has a subnet of its own (not "
    "192.168.0.x), and the cable is in it; (4) no firewall of this computer drops UDP ('nft "
    "list ruleset'); (5) no other program (TestServer, another cellcald) uses the port on the "
    "computer with that IP_NUMBER";

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
                  fmt::format("{} datagrams on {}, none of them from RSI: {}, \"{}\"",
                              s.bad_packets, seen.listening, to_string(s.last_error), s.last_bad),
                  "find out which device sends them; check that the ethernet XML has DEF_AIPos");
  } else if (!seen.up) {
    findings.fail(check, fmt::format("none in {:.0f} s on {}", seen.waited_s, seen.listening),
                  kChecklist);
  } else if (seen.lost && !is_refused(seen)) {
    findings.fail(check, fmt::format("{}, then none after IPOC {}", s.packets, s.ipoc),
                  "read the message on the pendant (KSS29002: time-out by late replies, see "
                  "below; KSS29000: correction limit), reset CELLCAL_RSI and start it again");
  } else if (const std::uint64_t twice = seen.state.quality.duplicates; twice > 0) {
    findings.warn(check,
                  fmt::format("{}, {} of them received twice (the same IPOC)", s.packets, twice),
                  "look for two ways between controller and computer: a loop or a mirrored port at "
                  "the switch, two cables, a bridge. Connect both by one cable");
  } else if (s.bad_packets > 0) {
    findings.warn(check,
                  fmt::format("{}, {} of them damaged: {}", s.packets, s.bad_packets,
                              to_string(s.last_error)),
                  "check network cards and cables between controller and computer");
  } else {
    findings.ok(check, fmt::format("{} in {:.0f} s, first after {:.1f} s, {} missing", s.packets,
                                   seen.observed_s, seen.first_packet_s, s.gaps));
  }
}

void judge_sender(const RsiSeen& seen, Findings& findings) {
  if (seen.foreign > 0) {
    findings.fail("rsi sender",
                  fmt::format("{}; {} packets from another address", seen.sender, seen.foreign),
                  "two controllers send to one port: give each a port of its own");
  } else {
    findings.ok("rsi sender", seen.sender);
  }
}

void judge_cycle(const RsiSeen& seen, Findings& findings) {
  const std::string check = "rsi cycle";
  const drivers::CoreState& s = seen.newest;
  if (!(s.cycle_s > 0.0)) {
    findings.fail(check,
                  s.trouble == drivers::Trouble::kOddCycle ? "outside of 2 to 40 ms"
                                                           : "unknown: too few packets",
                  "use RSI_ON with #IPO_FAST (4 ms) or #IPO (12 ms)");
    return;
  }
  const double ms = s.cycle_s * calib::kMsPerS;
  const std::string figures =
      fmt::format("{:.2f} ms, jitter {:.2f} ms, longest {:.1f} ms, IPOC step {}", ms,
                  s.jitter_s * calib::kMsPerS, s.longest_gap_s * calib::kMsPerS, s.ipoc_step);
  const bool usual = std::abs(ms - 4.0) < 0.1 || std::abs(ms - 12.0) < 0.1;
  const bool milliseconds = std::abs(s.ipoc_step - ms) < 0.1 + kMsTolerance;
  if (!usual || !milliseconds) {
    findings.warn(check, figures,
                  "a KUKA controller has 4 or 12 ms and an IPOC in milliseconds: check for "
                  "lost packets, and what this device is");
  } else if (s.jitter_s > kGoodJitterS) {
    findings.warn(check, figures,
                  "connect controller and computer by a cable of their own, and stop other "
                  "programs on this computer; see 'real time'");
  } else {
    findings.ok(check, figures);
  }
}

void judge_decimals(const RsiSeen& seen, Findings& findings) {
  const std::string check = "rsi decimals";
  const int decimals = seen.newest.decimals;
  const std::string advice =
      "set Precision of the ETHERNET object to 4 or more (default 1), as 'cellcal kuka-files' "
      "does, and create the context again";
  switch (drivers::fitness_of_decimals(seen.newest)) {
    case drivers::Fitness::kUnfit:
      return findings.fail(
          check, fmt::format("AIPos with {} decimals: too coarse to calibrate", decimals), advice);
    case drivers::Fitness::kUnproven:
      return findings.warn(
          check,
          fmt::format(
              "AIPos with {} decimals from a device that is not a KUKA controller; at rest they "
              "may be exact",
              decimals),
          "a session measures them at its first move and stops if they are too coarse; on a "
          "controller " +
              advice);
    case drivers::Fitness::kUsable:
      return findings.warn(check, fmt::format("AIPos with {} decimals", decimals), advice);
    case drivers::Fitness::kGood:
      return findings.ok(check, fmt::format("AIPos with {} decimals", decimals));
  }
}

void judge_elements(const RsiSeen& seen, Findings& findings) {
  const drivers::CoreState& s = seen.newest;
  std::string missing;
  if (!s.sends_setpoint) missing += "ASPos";
  if (!s.sends_delay) missing += missing.empty() ? "Delay" : " and Delay";
  const std::string check = "rsi elements", found = missing + " is not sent";
  const std::string wire = "add DEF_ASPos and DEF_Delay to SEND of the ethernet XML: ";
  switch (drivers::fitness_of_elements(s)) {
    case drivers::Fitness::kUnfit:
      return findings.fail(check, found,
                           wire +
                               "mode RELATIVE needs Delay, otherwise a lost increment is not "
                               "detected");
    case drivers::Fitness::kUnproven:
    case drivers::Fitness::kUsable:
      return findings.warn(check, found,
                           wire +
                               "otherwise a restarted RSI session and refused replies are not "
                               "detected, and an RSI session that already runs may not be "
                               "answered");
    case drivers::Fitness::kGood:
      return findings.ok(check, "AIPos, ASPos, Delay");
  }
}

void judge_state(const RsiSeen& seen, const RsiExpected& expected, Findings& findings) {
  const std::string check = "rsi state";
  const drivers::CoreState& s = seen.newest;
  const bool mode = s.mode != drivers::OperatingMode::kUnknown, percent = s.override_percent >= 0;
  const std::string figures =
      fmt::format("mode {}, override {}", to_string(s.mode),
                  percent ? fmt::format("{} %", s.override_percent) : std::string("unknown"));
  if (!expected.mode && !expected.override_percent) {
    findings.skip(check, "[rsi] mode_tag and override_tag are empty");
  } else if ((expected.mode && !mode) || (expected.override_percent && !percent)) {
    findings.warn(check, figures,
                  "install the files of 'cellcal kuka-files' anew: they send both. Until then the "
                  "speed is bounded as in T1 before the first calibration alone, and an unattended "
                  "session does not detect a person working in the cell");
  } else {
    findings.ok(check, figures + " (which does not slow RSI down)");
  }
}

void judge_second_path(const RsiSeen& seen, const RsiExpected& expected, Findings& findings) {
  const std::string check = "rsi contact input";
  if (seen.newest.input_path == drivers::InputPath::kUntold) {
    return findings.fail(check, "not sent, but [rsi] contact_tag is set",
                         "install the files of 'cellcal kuka-files' anew: they send it");
  }
  judge_input(check, seen.input, expected.input, false, findings);
}

/// A mismatch of the TCP between controller and files falsifies Cartesian corrections by the same amount.
void judge_tcp(const RsiSeen& seen, Findings& findings) {
  const std::string check = "rsi tool";
  const drivers::TcpApart& apart = seen.newest.tcp_apart;
  const std::string figures = fmt::format(
      "{:.2f} mm and {:.3f} deg between the controller's TCP (RIst) and that of robot and cell "
      "file",
      apart.mm, apart.deg);
  if (apart.much()) {
    findings.fail(check, figures,
                  "compare $TOOL with [controller] tool (0: the flange) and with the cell "
                  "file's tool, and the robot file with the arm's type; $BASE and $ROBROOT "
                  "must be zero");
  } else if (apart.mm > 0.0 || apart.deg > 0.0) {
    findings.ok(check, figures);
  } else {
    findings.warn(check, "not compared: RIst is not sent, or [controller] base is not 0",
                  "add DEF_RIst to SEND of the ethernet XML, with $BASE=$NULLFRAME: otherwise "
                  "a wrong tool or robot file shows only when the arm leaves its line");
  }
}

void judge_replies(const RsiSeen& seen, const RsiExpected& expected, Findings& findings) {
  const std::string check = "rsi replies";
  const drivers::CoreState& s = seen.newest;
  const std::uint64_t late = s.late - std::min(s.late, seen.late_at_start);
  if (is_refused(seen)) {
    findings.fail(
        check,
        fmt::format("not accepted: {1} of {0} counted as late by the controller", s.replies,
                    s.late),
        fmt::format("set SENTYPE in the controller's ethernet XML to \"{}\", letter by letter: the "
                    "controller silently discards any other",
                    expected.sentype));
  } else if (!seen.answered) {
    findings.fail(check, seen.last_words.empty() ? "none were sent" : seen.last_words,
                  "wait for RSI's time-out, reset CELLCAL_RSI and start it again while doctor "
                  "waits");
  } else if (late >= static_cast<std::uint64_t>(expected.late_limit)) {
    findings.fail(check, fmt::format("{} of {} came too late for the controller", late, s.replies),
                  "a move would be stopped: see 'real time' and 'rsi reply times', and check "
                  "the switch between controller and computer");
  } else if (late > 0) {
    findings.warn(check, fmt::format("{} of {} came too late for the controller", late, s.replies),
                  "see 'real time' and 'rsi reply times'");
  } else {
    findings.ok(check, fmt::format("{}, all accepted in time", s.replies));
  }
}

void judge_times(const RsiSeen& seen, Findings& findings) {
  const std::string check = "rsi reply times";
  const drivers::RobotQuality& q = seen.state.quality;
  if (q.replies == 0) return findings.skip(check, "no replies were sent");
  std::string histogram;
  for (const auto& [ms, count] : seen.replies_within) {
    if (count == 0) continue;
    histogram += fmt::format("; {} within {} ms", count, ms);
    if (count >= q.replies) break;
  }
  const std::string figures =
      fmt::format("p50 {1:.2f} ms, p99 {2:.2f} ms, p99.9 {3:.2f} ms, longest {4:.2f} ms of {0}{5}",
                  q.replies, q.reply_p50_s * calib::kMsPerS, q.reply_p99_s * calib::kMsPerS,
                  q.reply_p999_s * calib::kMsPerS, q.reply_max_s * calib::kMsPerS, histogram);
  if (q.reply_p99_s > kPoorReplyShare * seen.newest.cycle_s) {
    findings.fail(check, figures, "this computer is too busy for RSI: see 'real time'");
  } else if (q.reply_p999_s > kGoodReplyS) {
    findings.warn(check, figures,
                  "grant real-time priority (see 'real time'), and stop other programs on this "
                  "computer");
  } else {
    findings.ok(check, figures);
  }
}

}  // namespace

void judge_rsi(const RsiSeen& seen, const RsiExpected& expected, Findings& findings) {
  judge_packets(seen, findings);
  if (!seen.up) {
    for (const char* check : {"rsi sender", "rsi cycle", "rsi decimals", "rsi elements",
                              "rsi state", "rsi replies", "rsi reply times"}) {
      findings.skip(check, "no packets");
    }
    if (expected.in_space) findings.skip("rsi tool", "no packets");
    if (expected.input > 0) findings.skip("rsi contact input", "no packets");
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
    findings.warn(check, "the controller went on sending for 2 s after Stop",
                  "wire the STOP object to the Stop element (Mode 4, rising edge) and check "
                  "stop_tag: otherwise each session ends with a fault on the pendant");
  } else {
    findings.ok(check,
                fmt::format("RSI ended {:.2f} s after Stop; start CELLCAL_RSI again for the next "
                            "session",
                            *ended_after_s));
  }
}

void judge_model(const calib::ControllerModel& model, const calib::Robot& robot, bool sends,
                 WireKind wire, Findings& findings) {
  using enum calib::ControllerModel::Outcome;
  const std::string check = "controller's model", found = words(model, robot);
  switch (model.outcome) {
    case kAgrees:
      return findings.ok(check, found);
    case kNotStated:
      if (sends)
        return findings.skip(check,
                             wire == WireKind::kRsi
                                 ? "0 postures: the arm did not rest for 0.3 s"
                                 : "0 postures: CELLCAL_EKI does not run, or the arm did not rest");
      return findings.warn(
          check, found,
          wire == WireKind::kRsi
              ? "add DEF_RIst to SEND of the ethernet XML: without it another robot type or absolute "
                "accuracy is not detected"
              : "make the controller's files anew and copy CellcalEki.xml, cellcal_sub.sub and "
                "cellcal_eki.dat: they send $POS_ACT. Without it another robot type or absolute "
                "accuracy is not detected");
    case kOtherFrames:
      return findings.warn(check, found,
                           "compare $TOOL and $BASE with [controller] tool and base; joint angles, "
                           "and so the calibration, do not depend on them");
    case kUndecided:
      return findings.warn(check, found,
                           "compare the pendant's actual position with 'robot geometry', and "
                           "[controller] tool and base; each session compares it at every touch");
    case kDiffers:
      return findings.fail(check, found,
                           "choose the robot file of the type plate, or switch absolute accuracy "
                           "off ($DEACTIVATE_ABS_ACCUR)");
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
  if (robot == nullptr) return findings.skip(check, shown + " deg; limits not checked (no --cell)");
  if (robot->joints.size() != actual_rad.size()) {
    return findings.fail(check,
                         fmt::format("{} angles received, {} joints in the robot file",
                                     actual_rad.size(), robot->joints.size()),
                         "use the robot file of this arm");
  }
  std::string outside, near;
  for (std::size_t i = 0; i < actual_rad.size(); ++i) {
    const calib::Joint& joint = robot->joints[i];
    const double room = std::min(actual_rad[i] - joint.min_rad, joint.max_rad - actual_rad[i]) *
                        calib::unit_of(joint).per_si;
    std::string& list = room < 0.0 ? outside : near;
    if (room < (joint.is_prismatic() ? kNearMm : kNearDeg))
      list += fmt::format("{}{}", list.empty() ? "" : ", ", joint.name);
  }
  if (!outside.empty()) {
    findings.fail(check, fmt::format("{} deg: {} outside the robot file's limits", shown, outside),
                  "check the robot file; if it is right, jog the axis back (it may be a full "
                  "turn away)");
  } else if (!near.empty()) {
    findings.warn(
        check,
        fmt::format("{} deg: {} within 1 deg{} of a limit", shown, near, track ? ", 10 mm," : ""),
        "jog the arm towards the middle of its range");
  } else {
    findings.ok(check, shown + " deg, within the robot file's limits");
  }
}

namespace {

// The programs send every 20 ms, or every loop of a busy submit interpreter.
constexpr double kSlowStatesS = 0.060;
// The overtravel figures hold for a pass every 20 ms; $TIMER counts in steps of 12 ms.
constexpr std::uint32_t kSlowPassMs = 36;
constexpr int kFewestDecimals = 3;

const char* mode_of(drivers::EkiMode mode) {
  using enum drivers::EkiMode;
  static constexpr EnumNames<drivers::EkiMode> kTable{
      {{kUnknown, "unknown"}, {kT1, "T1"}, {kT2, "T2"}, {kAut, "AUT"}, {kExt, "EXT"}}};
  return kTable[mode];
}

bool judge_connection(const EkiSeen& seen, Findings& findings) {
  if (!seen.connected) {
    findings.fail(
        "eki connection", seen.last_words,
        "check in this order: (1) 'ping' the controller's KLI address; (2) CELLCAL_SUB runs "
        "(Configuration, Submit interpreter), and the controller was cold-started after "
        "CellcalEki.xml was copied; (3) address and port are the same in CellcalEki.xml and in "
        "[eki]; (4) no other client is connected: the controller accepts one");
    return false;
  }
  findings.ok("eki connection", "to " + seen.peer);
  return true;
}

bool judge_states(const EkiSeen& seen, Findings& findings) {
  const drivers::EkiCoreState& s = seen.newest;
  const std::string check = "eki states";
  if (!seen.up || s.states == 0) {
    findings.fail(check, seen.last_words,
                  "check that CELLCAL_SUB runs, and that CellcalEki.xml and the programs come "
                  "from one run of 'cellcal kuka-files'");
    return false;
  }
  std::string figures =
      fmt::format("{} in {:.0f} s, every {:.1f} ms, jitter {:.1f} ms, longest gap {:.0f} ms",
                  s.states, seen.observed_s, s.cycle_s * calib::kMsPerS,
                  s.jitter_s * calib::kMsPerS, s.longest_gap_s * calib::kMsPerS);
  if (s.longest_pass_ms > 0)
    figures += fmt::format(", longest pass of CELLCAL_SUB {} ms", s.longest_pass_ms);
  if (seen.lost) {
    findings.fail(check, figures + "; link lost: " + seen.last_words,
                  "check the cable and the messages on the pendant");
  } else if (s.cycle_s > kSlowStatesS || s.longest_pass_ms > kSlowPassMs) {
    findings.warn(
        check, figures,
        "the submit interpreter is slow, and stops over the network with it: remove other "
        "programs from it, or call CELLCAL_SUB in one of its own");
  } else {
    findings.ok(check, figures);
  }
  return true;
}

void judge_elements(const EkiSeen& seen, Findings& findings) {
  const drivers::EkiCoreState& s = seen.newest;
  const std::string advice =
      "install channel file and programs from one run of 'cellcal kuka-files'; 'cellcal "
      "kuka-files --verify DIR' compares them";
  if (s.bad_documents > 0) {
    findings.fail("eki elements",
                  fmt::format("{} states damaged or incomplete: {}, \"{}\"", s.bad_documents,
                              to_string(s.last_error), s.last_bad),
                  advice);
  } else if (s.unread_by_controller > 0) {
    findings.fail(
        "eki elements",
        fmt::format("{} telegrams could not be read by the controller", s.unread_by_controller),
        advice);
  } else if (s.trouble == drivers::EkiTrouble::kUnread ||
             s.trouble == drivers::EkiTrouble::kOtherSession) {
    findings.fail("eki elements", seen.last_words, advice);
  } else {
    findings.ok("eki elements", "all received, in both directions");
  }
}

void judge_decimals(const EkiSeen& seen, Findings& findings) {
  const int decimals = seen.newest.decimals_seen;
  if (decimals < kFewestDecimals) {
    findings.fail("eki decimals",
                  fmt::format("{} decimals, too coarse (at least {})", decimals, kFewestDecimals),
                  "install the programs as 'cellcal kuka-files' wrote them: they send "
                  "$AXIS_ACT_MEAS as REAL");
  } else {
    findings.ok("eki decimals", fmt::format("{} decimals", decimals));
  }
}

void judge_readiness(const EkiSeen& seen, Findings& findings) {
  const drivers::EkiCoreState& s = seen.newest;
  const std::string check = "eki readiness";
  std::string figures = fmt::format("mode {}, override {} %, drives {}", mode_of(s.mode),
                                    s.override_percent, s.drives ? "on" : "off");
  if (s.stopped) figures += ", a stop is active";
  if (s.fault != 0) {
    findings.fail(check, fmt::format("{}, fault {} of CELLCAL_EKI", figures, s.fault),
                  "read the message on the pendant, reset CELLCAL_EKI and start it again");
  } else if (!s.ready) {
    findings.warn(check, figures + ": not ready to move",
                  fmt::format("before a session {}", start_instruction(WireKind::kEki)));
  } else {
    findings.ok(check, figures + ", program runs");
  }
}

}  // namespace

void judge_input(const std::string& check, const InputSeen& seen, int number, bool contact_is_on,
                 Findings& findings) {
  const std::string input = fmt::format("$IN[{}]", number);
  if (seen.on_while_open) {
    findings.fail(
        check, input + " is at its contact level although the contact circuit is open",
        fmt::format("check the input's number, the wire to the sensor's box, and [controller] "
                    "contact_level (\"{}\": the input during contact)",
                    contact_is_on ? "on" : "off"));
  } else if (seen.contact_changed && !seen.changed) {
    findings.fail(check, "the sensor detected a contact, but " + input + " did not change",
                  "check the wire from the sensor's output to the controller's input, and "
                  "[controller] input");
  } else if (seen.changed && seen.contact_changed && contact_is_on) {
    findings.warn(check,
                  input + " changed with the contact; but a broken wire would read as no contact",
                  "set [controller] contact_level = \"off\", wire the sensor's own output "
                  "(drivers/contact/firmware/README.md), and make the controller's files again");
  } else if (seen.changed && seen.contact_changed) {
    findings.ok(check, input + " changed with the contact: correctly wired");
  } else if (seen.changed) {
    findings.fail(check, input + " changed although the sensor detected no contact",
                  "check what else is wired to it, and [controller] input");
  } else if (seen.on) {
    findings.warn(check, input + " is at its contact level, and the contact is closed or unknown",
                  "jog the tool free and run 'cellcal doctor' again");
  } else {
    findings.warn(
        check, input + " is as expected of an open contact; its wire was not tested",
        "run 'cellcal doctor --for 30' once, and meanwhile touch the tool with a wire from a "
        "sphere's stand");
  }
}

void judge_eki(const EkiSeen& seen, const EkiExpected& expected, Findings& findings) {
  const bool fine = judge_connection(seen, findings) && judge_states(seen, findings);
  if (!fine) {
    for (const char* check :
         {"eki elements", "eki decimals", "eki readiness", "eki contact input"}) {
      findings.skip(check, "no states");
    }
    return;
  }
  judge_elements(seen, findings);
  judge_decimals(seen, findings);
  judge_readiness(seen, findings);
  if (expected.by_input) {
    judge_input("eki contact input", seen.input, expected.input, expected.contact_is_on, findings);
  } else {
    findings.ok("eki contact input", "not used: [eki] stop = \"flag\"");
  }
}

}  // namespace cellcal::daemon
