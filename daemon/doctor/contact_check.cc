#include <fmt/format.h>

#include <chrono>
#include <filesystem>

#include "calib/model/units.h"
#include "daemon/doctor/wires.h"
#include "daemon/session/driver_phrase.h"
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

using calib::Phrase;

std::string firmware(const drivers::ContactIdentity& id) {
  return fmt::format("{}.{}.{}", id.firmware[0], id.firmware[1], id.firmware[2]);
}

void judge_board(const drivers::ContactIdentity& id, Findings& findings) {
  const std::string check = "contact board";
  constexpr const char* kFlash = "say.doctor.board.do";
  if (!id.board.known) {
    findings.skip(check, "say.doctor.board.unknown");
  } else if (id.board.old_loader) {
    findings.warn(check, "say.doctor.board.loader", kFlash);
  } else if (id.board.weak_brown_out) {
    findings.warn(check, "say.doctor.board.brown_out", kFlash);
  } else {
    findings.ok(check, "say.doctor.board.good");
  }
}

void judge_circuit(const drivers::ContactStatus& s, Findings& findings) {
  const std::string check = "contact circuit";
  const double open_v = drivers::ctp::Config().open_mv * 1e-3;
  const double volts = s.sense_voltage_v.value_or(0.0);
  if (s.relay == drivers::ContactRelay::kOpen) {
    findings.skip(check, "say.doctor.circuit.relay");
  } else if (!s.loop_ok) {
    findings.skip(check, "say.doctor.circuit.unchecked");
  } else if (!*s.loop_ok) {
    findings.fail(check, or_else(phrase_of(s.words), "say.doctor.circuit.broken"),
                  "say.doctor.circuit.broken.do");
  } else if (s.in_contact == true) {
    findings.fail(check, {"say.doctor.circuit.closed", {{"volts", volts}}},
                  "say.doctor.circuit.closed.do");
  } else if (volts < open_v) {
    findings.fail(check, {"say.doctor.circuit.between", {{"volts", volts}, {"open", open_v}}},
                  "say.doctor.circuit.between.do");
  } else {
    findings.ok(check, {"say.doctor.circuit.open", {{"volts", volts}}});
  }
}

void judge_self_test(const drivers::ContactStatus& s, Findings& findings) {
  const std::string check = "contact self-test";
  if (s.self_test_ok) {
    findings.ok(check, "say.doctor.self_test.passed");
  } else if (s.loop_ok != true || s.in_contact != false) {
    findings.skip(check, "say.doctor.self_test.circuit");
  } else {
    findings.fail(check, or_else(phrase_of(s.words), "say.doctor.self_test.failed"),
                  "say.doctor.self_test.do");
  }
}

void judge_clock(const drivers::ContactStatus& s, Findings& findings) {
  const std::string check = "contact clock";
  const drivers::ContactQuality& q = s.quality;
  const Phrase figures{"say.doctor.clock",
                       {{"us", q.clock_sigma_s.value_or(0.0) * 1e6},
                        {"limit", s.clock_limit_s * 1e6},
                        {"ppm", q.clock_drift_ppm.value_or(0.0)}}};
  if (!q.clock_sigma_s) {
    findings.fail(check, "say.doctor.clock.none", "say.doctor.clock.none.do");
  } else if (q.clock_sigma_s > s.clock_limit_s) {
    findings.fail(check, figures, "say.doctor.clock.bad.do");
  } else if (q.clock_sigma_s > kGoodClockS) {
    findings.warn(check, figures, "say.doctor.clock.fair.do");
  } else {
    findings.ok(check, figures);
  }
}

void judge_baud(const ContactSeen& seen, Findings& findings) {
  if (!seen.answers_at) {
    findings.fail("contact sensor", phrase_of(seen.newest.words), "say.doctor.baud.do");
    return;
  }
  findings.fail(
      "contact sensor",
      {"say.doctor.baud.other", {{"sensor", *seen.answers_at}, {"configured", seen.baud}}},
      {"say.doctor.baud.other.do", {{"sensor", *seen.answers_at}}});
}

}  // namespace

bool judge_contact(const ContactSeen& seen, Findings& findings) {
  const drivers::ContactStatus& s = seen.newest;
  const drivers::ContactIdentity& id = s.identity;
  if (id.protocol == 0 || s.fault == drivers::ContactFault::kVersion) {
    if (s.fault == drivers::ContactFault::kBaud) {
      judge_baud(seen, findings);
    } else {
      findings.fail("contact sensor", or_else(phrase_of(s.words), "say.doctor.sensor.silent"),
                    seen.datagrams ? "say.doctor.sensor.silent.do.network"
                                   : "say.doctor.sensor.silent.do.serial");
    }
    for (const char* check : {"contact board", "contact configuration", "contact circuit",
                              "contact self-test", "contact clock"}) {
      findings.skip(check, "say.doctor.sensor.skip");
    }
    return false;
  }
  findings.ok("contact sensor", {"say.doctor.sensor",
                                 {{"protocol", id.protocol},
                                  {"firmware", firmware(id)},
                                  {"uid", id.uid},
                                  {"boot", id.boot_id}}});
  judge_board(id, findings);
  if (id.config_crc == seen.wanted_config_crc) {
    findings.ok("contact configuration", {"say.doctor.config.good", {{"crc", id.config_crc}}});
  } else {
    findings.fail(
        "contact configuration",
        {"say.doctor.config.other", {{"crc", id.config_crc}, {"sent", seen.wanted_config_crc}}},
        or_else(phrase_of(s.words), "say.doctor.config.other.do"));
  }
  judge_circuit(s, findings);
  judge_self_test(s, findings);
  judge_clock(s, findings);
  const bool ready = s.link == drivers::ContactLink::kReady;
  if (!ready && findings.green())
    findings.fail("contact link", phrase_of(s.words), "say.doctor.contact.wait");
  return ready && s.self_test_ok && s.in_contact == false;
}

void judge_contact_line(const ContactSeen& seen, Findings& findings) {
  const std::string check = "contact line";
  const drivers::ContactQuality& q = seen.newest.quality;
  const std::uint64_t bad = q.crc_errors + q.gaps;
  const double rate =
      q.frames + bad == 0 ? 0.0 : static_cast<double>(bad) / static_cast<double>(q.frames + bad);
  Phrase figures{seen.datagrams ? "say.doctor.line.network" : "say.doctor.line",
                 {{"frames", q.frames},
                  {"s", seen.observed_s},
                  {"damaged", q.crc_errors},
                  {"missing", q.gaps},
                  {"overtaken", q.overtaken},
                  {"jitter", q.heartbeat_jitter_s * calib::kMsPerS}}};
  if (q.round_trip)
    figures = calib::joined("say.join.semicolon", figures,
                            {"say.link.round_trip",
                             {{"p50", q.round_trip->p50_s * calib::kMsPerS},
                              {"p99", q.round_trip->p99_s * calib::kMsPerS}}});
  if (q.frames == 0) {
    findings.fail(check, "say.doctor.line.none",
                  seen.newest.fault == drivers::ContactFault::kBaud ? "say.doctor.line.none.do.baud"
                  : seen.datagrams ? "say.doctor.line.none.do.network"
                                   : "say.doctor.line.none.do.serial");
  } else if (rate > kBadLine) {
    findings.fail(
        check, figures,
        seen.datagrams ? "say.doctor.line.bad.do.network" : "say.doctor.line.bad.do.serial");
  } else if (bad > 0) {
    findings.warn(check, figures, "say.doctor.line.losses.do");
  } else if (q.round_trip && q.round_trip->p50_s > kSlowRoundTripS) {
    findings.warn(
        check, figures,
        seen.datagrams ? "say.doctor.line.slow.do.network" : "say.doctor.line.slow.do.serial");
  } else {
    findings.ok(check, figures);
  }
}

void judge_contact_touch(const ContactSeen& seen, Findings& findings) {
  const std::string check = "contact touch";
  if (seen.touched) {
    findings.ok(check, "say.doctor.touch.seen");
  } else {
    findings.warn(check, {"say.doctor.touch.none", {{"s", seen.observed_s}}},
                  "say.doctor.touch.none.do");
  }
}

void judge_contact_delivery(const ContactSeen& seen, Findings& findings) {
  const std::string check = "contact delivery";
  const drivers::ContactQuality& q = seen.newest.quality;
  if (!(q.late_worst_s > 0.0)) {
    findings.skip(check, "say.doctor.delivery.clock");
    return;
  }
  const Phrase figures{"say.doctor.delivery",
                       {{"median", q.late_p50_s * calib::kMsPerS},
                        {"worst", q.late_worst_s * calib::kMsPerS},
                        {"limit", kLateLimitS * calib::kMsPerS},
                        {"times", seen.newest.delivery.late},
                        {"s", seen.observed_s}}};
  const char* const advice = "say.doctor.delivery.do";
  const std::uint32_t times = seen.newest.delivery.late;
  if (q.late_worst_s > kLateLimitS && !seen.repeats) {
    findings.fail(check, {"say.doctor.delivery.ends", {{"figures", figures}}},
                  "say.doctor.delivery.do.or_repeat");
  } else if (times > 1 && times * kLeastQuietS > seen.observed_s) {
    findings.fail(check,
                  {"say.doctor.delivery.too_busy", {{"figures", figures}, {"quiet", kLeastQuietS}}},
                  advice);
  } else if (q.late_worst_s > kLateLimitS) {
    findings.warn(check, {"say.doctor.delivery.repeats", {{"figures", figures}}}, advice);
  } else if (q.late_worst_s > kLateS) {
    findings.warn(check, figures, advice);
  } else {
    findings.ok(check, figures);
  }
}

void judge_adapter(const std::string& device, const std::optional<drivers::Adapter>& adapter,
                   int baud, Findings& findings) {
  using drivers::AdapterFit;
  const std::string check = "contact adapter";
  if (!adapter) {
    findings.skip(check, {"say.doctor.adapter.none", {{"device", device}}});
    return;
  }
  const Phrase who{"say.doctor.adapter.name",
                   {{"name", or_else(adapter->name, "say.doctor.adapter.unnamed")},
                    {"vendor", adapter->vendor},
                    {"product", adapter->product}}};
  const Phrase timer{"say.doctor.adapter.timer.do",
                     {{"tty", std::filesystem::path(device).filename().string()}}};
  const int latency_ms = adapter->latency_ms.value_or(0);
  switch (drivers::fit_of(*adapter, baud)) {
    case AdapterFit::kFits:
      findings.ok(check, adapter->latency_ms
                             ? Phrase("say.doctor.adapter.good", {{"who", who}, {"ms", latency_ms}})
                             : who);
      break;
    case AdapterFit::kTooLate:
      findings.fail(check,
                    {"say.doctor.adapter.late",
                     {{"ms", latency_ms},
                      {"who", who},
                      {"lost", latency_ms + 2 * int{CTP_KEEPALIVE_MS}},
                      {"limit", drivers::kHeartbeatLimit.count()}}},
                    timer);
      break;
    case AdapterFit::kHoldsBack:
      findings.warn(check, {"say.doctor.adapter.holds", {{"who", who}, {"ms", latency_ms}}}, timer);
      break;
    case AdapterFit::kNoSuchRate:
      findings.fail(check, {"say.doctor.adapter.rate", {{"baud", baud}, {"who", who}}},
                    "say.doctor.adapter.slower.do");
      break;
    case AdapterFit::kRateUntried:
      findings.warn(check, {"say.doctor.adapter.rate_untried", {{"baud", baud}, {"who", who}}},
                    "say.doctor.adapter.rate_untried.do");
      break;
    case AdapterFit::kUntried:
      findings.warn(check, {"say.doctor.adapter.untried", {{"who", who}}},
                    "say.doctor.adapter.untried.do");
      break;
  }
}

void judge_interface(const std::optional<drivers::BoardInterface>& way, Findings& findings) {
  const std::string check = "contact adapter";
  if (!way) {
    findings.fail(check, "say.doctor.interface.none", "say.doctor.interface.none.do");
  } else if (!way->carrier) {
    findings.fail(check, {"say.doctor.interface.no_link", {{"name", way->name}}},
                  "say.doctor.interface.no_link.do");
  } else if (way->wireless) {
    findings.warn(check, {"say.doctor.interface.wireless", {{"name", way->name}}},
                  "say.doctor.interface.wireless.do");
  } else {
    findings.ok(check, way->speed_mbit ? Phrase("say.doctor.interface",
                                                {{"name", way->name}, {"mbit", *way->speed_mbit}})
                                       : Phrase(way->name));
  }
}

}  // namespace cellcal::daemon
