#include "daemon/doctor/contact_check.h"

#include <fmt/format.h>

#include <chrono>

#include "calib/model/units.h"
#include "drivers/contact/wire/ctp_codec.h"

namespace cellcal::daemon {

namespace {

// A latch known to 0.1 ms gives 0.2 um at 2 mm/s; above, the line needs inspection.
constexpr double kGoodClockS = 100e-6;
// One damaged frame in fifty: repeats no longer hide it.
constexpr double kBadLine = 0.02;
constexpr double kSlowRoundTripS = 0.008;
constexpr double kLateLimitS = std::chrono::duration<double>(drivers::kHeartbeatLimit).count();
// 2.5 times as much stops a search; an idle computer stays below a hundredth of it.
constexpr double kLateS = 0.4 * kLateLimitS;
// Duration of a search plus the two seconds of Timeouts::watching after a late heartbeat: more frequent
// lateness prevents every touch.
constexpr double kLeastQuietS = 3.0;
constexpr const char* kReadme = "drivers/contact/README.md";

std::string firmware(const drivers::ContactIdentity& id) {
  return fmt::format("{}.{}.{}", id.firmware[0], id.firmware[1], id.firmware[2]);
}

void judge_board(const drivers::ContactIdentity& id, Findings& findings) {
  const std::string check = "contact board";
  constexpr const char* kFlash =
      "flash firmware and fuses with a programmer (drivers/contact/firmware/README.md, Flashing)";
  if (!id.board.known) {
    findings.skip(check, "the firmware does not report the chip's fuses");
  } else if (id.board.old_loader) {
    findings.warn(check,
                  "old boot loader: after a watchdog reset it loops until the board is unplugged",
                  kFlash);
  } else if (id.board.weak_brown_out) {
    findings.warn(check,
                  "no brown-out reset at 4.3 V: the chip may compute wrongly when its supply drops",
                  kFlash);
  } else {
    findings.ok(check, "brown-out reset at 4.3 V, restarts by itself");
  }
}

void judge_circuit(const drivers::ContactStatus& s, Findings& findings) {
  const std::string check = "contact circuit";
  const double open_v = drivers::ctp::Config().open_mv * 1e-3;
  const bool looked_at = s.loop_ok || s.fault == drivers::ContactFault::kLoopBroken;
  if (s.relay == drivers::ContactRelay::kOpen) {
    findings.skip(check, "isolation relay open: the circuit is examined when a session begins");
  } else if (!looked_at) {
    findings.skip(check, "the sensor has not checked its wires yet");
  } else if (!s.loop_ok) {
    findings.fail(check, s.words.empty() ? "the touch circuit is broken" : s.words,
                  "repair it (circuit: drivers/contact/firmware/README.md); the self-test "
                  "repeats by itself");
  } else if (s.in_contact) {
    findings.fail(check,
                  fmt::format("{:.2f} V, closed: the tool touches something", s.sense_voltage_v),
                  "jog the tool free; if it stays closed, look for spatter, a short circuit or "
                  "a broken wire");
  } else if (s.sense_voltage_v < open_v) {
    findings.fail(check,
                  fmt::format("{:.2f} V, neither open (above {:.1f} V) nor in contact",
                              s.sense_voltage_v, open_v),
                  "look for coolant, a wet hose or spatter between tool and earth");
  } else {
    findings.ok(check,
                fmt::format("{:.2f} V, open; wires F, S and E are sound", s.sense_voltage_v));
  }
}

void judge_self_test(const drivers::ContactStatus& s, Findings& findings) {
  const std::string check = "contact self-test";
  if (s.self_test_ok) {
    findings.ok(check, "passed: the sensor detects its own test edge");
  } else if (!s.loop_ok || s.in_contact) {
    findings.skip(check, "the circuit has to be sound and open first");
  } else {
    findings.fail(check, s.words.empty() ? "not passed" : s.words,
                  "check the sensor's input stage: in this state it cannot detect a touch");
  }
}

void judge_clock(const drivers::ContactStatus& s, Findings& findings) {
  const std::string check = "contact clock";
  const drivers::ContactQuality& q = s.quality;
  const std::string figures =
      fmt::format("+- {:.1f} us (limit {:.0f} us), drift {:.1f} ppm", q.clock_sigma_s * 1e6,
                  s.clock_limit_s * 1e6, q.clock_drift_ppm);
  if (!(q.clock_sigma_s > 0.0)) {
    findings.fail(check, "not synchronised: too few answers to pings", "see 'contact line' below");
  } else if (q.clock_sigma_s > s.clock_limit_s) {
    findings.fail(check, figures,
                  "shorten the adapter's latency timer (udev rule in systemd/), or reduce the "
                  "load of this computer");
  } else if (q.clock_sigma_s > kGoodClockS) {
    findings.warn(check, figures,
                  "good enough to start; shorten the adapter's latency timer (udev rule in "
                  "systemd/)");
  } else {
    findings.ok(check, figures);
  }
}

void judge_baud(const ContactSeen& seen, Findings& findings) {
  if (!seen.answers_at) {
    findings.fail(
        "contact sensor", seen.newest.words,
        "set [contact] baud to the sensor's rate; if no rate works, check cable and earth");
    return;
  }
  findings.fail("contact sensor",
                fmt::format("{} baud at the sensor, {} baud in the configuration", *seen.answers_at,
                            seen.baud),
                fmt::format("set baud = {} under [contact]", *seen.answers_at));
}

}  // namespace

bool judge_contact(const ContactSeen& seen, Findings& findings) {
  const drivers::ContactStatus& s = seen.newest;
  const drivers::ContactIdentity& id = s.identity;
  if (id.protocol == 0 || s.fault == drivers::ContactFault::kVersion) {
    if (s.fault == drivers::ContactFault::kBaud) {
      judge_baud(seen, findings);
    } else {
      findings.fail("contact sensor", s.words.empty() ? "no answer" : s.words,
                    fmt::format("check in this order: supply, cable, firmware, {} (wiring: {})",
                                seen.datagrams ? "address" : "baud rate", kReadme));
    }
    for (const char* check : {"contact board", "contact configuration", "contact circuit",
                              "contact self-test", "contact clock"}) {
      findings.skip(check, "the sensor does not answer");
    }
    return false;
  }
  findings.ok("contact sensor", fmt::format("CTP/{}, firmware {}, uid {:08x}, boot id {}",
                                            id.protocol, firmware(id), id.uid, id.boot_id));
  judge_board(id, findings);
  if (id.config_crc == seen.wanted_config_crc) {
    findings.ok("contact configuration", fmt::format("accepted, CRC {:04x}", id.config_crc));
  } else {
    findings.fail("contact configuration",
                  fmt::format("CRC {:04x} in the sensor, {:04x} was sent", id.config_crc,
                              seen.wanted_config_crc),
                  s.words.empty() ? "unplug the sensor and plug it in again" : s.words);
  }
  judge_circuit(s, findings);
  judge_self_test(s, findings);
  judge_clock(s, findings);
  const bool ready = s.link == drivers::ContactLink::kReady;
  if (!ready && findings.green())
    findings.fail("contact link", s.words, "wait half a minute and run 'cellcal doctor' again");
  return ready && s.self_test_ok && !s.in_contact;
}

void judge_contact_line(const ContactSeen& seen, Findings& findings) {
  const std::string check = "contact line";
  const drivers::ContactQuality& q = seen.newest.quality;
  const std::uint64_t bad = q.crc_errors + q.gaps;
  const double rate =
      q.frames + bad == 0 ? 0.0 : static_cast<double>(bad) / static_cast<double>(q.frames + bad);
  const std::string overtaken =
      seen.datagrams ? fmt::format(", {} twice or overtaken", q.overtaken) : std::string{};
  const std::string figures = fmt::format(
      "{} frames in {:.0f} s, {} damaged, {} missing{}; round trip {:.2f} ms, p99 {:.2f}; heartbeat "
      "jitter {:.2f} ms",
      q.frames, seen.observed_s, q.crc_errors, q.gaps, overtaken,
      q.round_trip_p50_s * calib::kMsPerS, q.round_trip_p99_s * calib::kMsPerS,
      q.heartbeat_jitter_s * calib::kMsPerS);
  if (q.frames == 0) {
    findings.fail(check, "0 valid frames",
                  seen.newest.fault == drivers::ContactFault::kBaud
                      ? "set the same baud rate on both sides, see 'contact sensor'"
                  : seen.datagrams ? "check cable, supply and [contact] device"
                                   : "check baud rate, cable and supply");
  } else if (rate > kBadLine) {
    findings.fail(
        check, figures,
        seen.datagrams
            ? "use a cable from the board to a network card of its own, away from the motor "
              "cables, without a switch"
            : "use a shorter or screened cable away from the motor cables, or a lower baud "
              "rate on both sides");
  } else if (bad > 0) {
    findings.warn(
        check, figures,
        "single losses are repeated, without effect; check cable and earth before there are more");
  } else if (q.round_trip_p50_s > kSlowRoundTripS) {
    findings.warn(check, figures,
                  seen.datagrams ? "reduce the load of this computer, or take the switch away"
                                 : "the adapter buffers bytes: install the udev rule in systemd/ "
                                   "(latency timer of 1 ms)");
  } else {
    findings.ok(check, figures);
  }
}

void judge_contact_touch(const ContactSeen& seen, Findings& findings) {
  const std::string check = "contact touch";
  if (seen.touched) {
    findings.ok(check, "closed and opened again: tool and stands are in the circuit");
  } else {
    findings.warn(check, fmt::format("none in {:.0f} s", seen.observed_s),
                  "run 'cellcal doctor --for 30' and meanwhile touch each sphere with the "
                  "tool, or connect tip and stand with a wire. Only a touch proves that both "
                  "lugs are on the tool");
  }
}

void judge_contact_delivery(const ContactSeen& seen, Findings& findings) {
  const std::string check = "contact delivery";
  const drivers::ContactQuality& q = seen.newest.quality;
  if (!(q.late_worst_s > 0.0)) {
    findings.skip(check, "the sensor's clock is not synchronised yet");
    return;
  }
  const std::string figures = fmt::format(
      "heartbeats {:.2f} ms late on this computer (median), {:.1f} ms at worst (limit {:.0f} ms, "
      "exceeded {} times in {:.0f} s)",
      q.late_p50_s * calib::kMsPerS, q.late_worst_s * calib::kMsPerS, kLateLimitS * calib::kMsPerS,
      seen.newest.delivery.late, seen.observed_s);
  const std::string advice = fmt::format(
      "stop other programs on this computer, reserve a core, or read a CDC-ACM or FTDI "
      "adapter past the terminal: device = \"/dev/cellcal-contact-usb\" ({})",
      kReadme);
  const std::uint32_t times = seen.newest.delivery.late;
  if (q.late_worst_s > kLateLimitS && !seen.repeats) {
    findings.fail(
        check, figures + "; this computer was busy: that ends a session ([session] busy_repeats)",
        advice + ", or allow repeats");
  } else if (times > 1 && times * kLeastQuietS > seen.observed_s) {
    findings.fail(
        check,
        figures + fmt::format("; this computer is too busy: a touch needs {:.0f} s without",
                              kLeastQuietS),
        advice);
  } else if (q.late_worst_s > kLateLimitS) {
    findings.warn(check,
                  figures + "; this computer was busy: a session repeats the touch and goes on",
                  advice);
  } else if (q.late_worst_s > kLateS) {
    findings.warn(check, figures, advice);
  } else {
    findings.ok(check, figures);
  }
}

}  // namespace cellcal::daemon
