#include <fmt/format.h>

#include "calib/model/enum_table.h"
#include "calib/model/units.h"
#include "daemon/config/config.h"
#include "daemon/doctor/robot_check.h"

namespace cellcal::daemon {

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
