#include "drivers/contact/contact_words.h"

#include <fmt/format.h>

#include <cmath>

#include "drivers/contact/wire/ctp.h"
#include "drivers/sentence.h"

namespace cellcal::drivers {

namespace {

/// A port silent for longer than this is not starting up (a bootloader takes up to 2 s).
constexpr double kMuteS = 3.0;
constexpr double kMsPerS = 1e3, kUsPerS = 1e6;

std::string firmware_of(const ContactFacts& f) {
  return fmt::format("{}.{}.{}", f.firmware[0], f.firmware[1], f.firmware[2]);
}

Sentence late_words(const ContactFacts& f) {
  return late_bytes(f.delivered_late_s, f.late_limit_s);
}

Sentence identified_again(Sentence why) { return sentences(std::move(why), "say.contact.again"); }

Sentence with_volts(const char* id, const ContactFacts& f) {
  return {id, {{"volts", f.sense_v.value_or(0.0)}}};
}

Sentence loop_words(const ContactFacts& f) {
  if (f.relay == ContactRelay::kOpen) return "say.contact.loop.relay_open";
  switch (f.loop_flaw) {
    case LoopFlaw::kNone:  // repaired; not yet confirmed by the self-test
    case LoopFlaw::kGunBreak: return with_volts("say.contact.loop.gun_break", f);
    case LoopFlaw::kGunShort: return "say.contact.loop.gun_short";
    case LoopFlaw::kEarthBreak: return "say.contact.loop.earth_break";
    case LoopFlaw::kEarthShort: return "say.contact.loop.earth_short";
    case LoopFlaw::kEarthUnwatched:
      return {"say.contact.loop.earth_unwatched", {{"firmware", firmware_of(f)}}};
  }
  return {};
}

Sentence fault_words(const ContactFacts& f) {
  switch (f.fault) {
    case ContactFault::kNone: return {};
    case ContactFault::kVersion:
      return {"say.contact.fault.version",
              {{"found", f.version},
               {"firmware", firmware_of(f)},
               {"own", static_cast<int>(CTP_VERSION)}}};
    case ContactFault::kLostState: return {"say.contact.fault.lost_state", {{"boot", f.boot_id}}};
    case ContactFault::kConfigRefused: return "say.contact.fault.config_refused";
    case ContactFault::kLoopBroken: return sentences(loop_words(f), "say.contact.test_again");
    case ContactFault::kSelfTestFailed: return with_volts("say.contact.fault.self_test", f);
    case ContactFault::kDeaf: return "say.contact.fault.deaf";
    case ContactFault::kDamaged:
      return {"say.contact.fault.damaged", {{"frames", f.quality.crc_errors}}};
    case ContactFault::kSilent: return {"say.contact.fault.silent", {{"s", f.silent_s}}};
    case ContactFault::kDeliveredLate: return identified_again(late_words(f));
    case ContactFault::kNoRelay: return "say.contact.fault.no_relay";
    case ContactFault::kRelayStaysOpen: return "say.contact.fault.relay_stays_open";
    case ContactFault::kRelayWelded: return "say.contact.fault.relay_welded";
    case ContactFault::kBaud:
      return {"say.contact.fault.baud", {{"bytes", f.bytes}, {"baud", f.baud}}};
    case ContactFault::kClockJumped: return identified_again("say.contact.fault.clock_jumped");
  }
  return {};
}

Sentence with_clock(const char* id, const ContactFacts& f) {
  return {id,
          {{"us", f.quality.clock_sigma_s.value_or(0.0) * kUsPerS},
           {"limit", f.clock_limit_s * kUsPerS},
           {"ms", f.quality.round_trip.value_or(RoundTrip{}).min_s * kMsPerS}}};
}

Sentence hello_words(const ContactFacts& f) {
  if (f.waiting_s < kMuteS) return "say.contact.hello.waiting";
  return {f.heard       ? "say.contact.hello.unanswered"
          : f.datagrams ? "say.contact.hello.nothing.network"
                        : "say.contact.hello.nothing.serial",
          {{"s", f.waiting_s}, {"baud", f.baud}}};
}

Sentence step_words(const ContactFacts& f) {
  switch (f.step) {
    case ContactStep::kClosed: return "say.contact.closed";
    case ContactStep::kHello: return hello_words(f);
    case ContactStep::kConfig: return "say.contact.configuring";
    case ContactStep::kClock:
      if (f.waiting_s < kMuteS || !(f.quality.clock_sigma_s > f.clock_limit_s))
        return "say.contact.synchronising";
      return with_clock("say.contact.clock_uncertain", f);
    case ContactStep::kSelfTest:
      if (f.touching_at_self_test || f.in_contact == true) return "say.contact.touching";
      if (f.relay == ContactRelay::kOpen) return "say.contact.relay_closing";
      return "say.contact.testing";
    case ContactStep::kReady: return {};
  }
  return {};
}

Sentence not_ready(const Sentence& why) {
  if (why.empty()) return "say.contact.not_ready";
  return {"say.contact.not_ready.why", {{"why", why}}};
}

Sentence refusal_words(const ArmAnswer& a) {
  const ContactFacts& f = a.facts;
  switch (a.refusal) {
    case ArmRefusal::kNone: return {};
    case ArmRefusal::kNotReady: return not_ready(words_of(f));
    case ArmRefusal::kBusy: return "say.contact.refused.busy";
    case ArmRefusal::kInContact: return with_volts("say.contact.refused.in_contact", f);
    case ArmRefusal::kLoopBroken: return loop_words(f);
    case ArmRefusal::kVoltageUndefined: return with_volts("say.contact.refused.voltage", f);
    case ArmRefusal::kClockNotSynchronised:
      if (f.quality.clock_sigma_s > 0.0 && f.quality.clock_sigma_s <= f.clock_limit_s)
        return {"say.contact.refused.no_pings", {{"s", f.unanswered_s}}};
      return with_clock("say.contact.refused.clock", f);
    case ArmRefusal::kSelfTestOld: return "say.contact.refused.self_test_old";
    case ArmRefusal::kBadArgument:
      return {"say.contact.refused.bad_argument", {{"arming", a.arm_id}}};
    case ArmRefusal::kBadVersion: return "say.contact.refused.version";
    case ArmRefusal::kNoAnswer: return "say.contact.refused.no_answer";
    case ArmRefusal::kLinkLost: return "say.contact.refused.link_lost";
    case ArmRefusal::kWithdrawn: return "say.contact.refused.withdrawn";
    case ArmRefusal::kTrippedAtOnce: return "say.contact.refused.tripped_at_once";
    case ArmRefusal::kUnknownReason: return "say.contact.refused.unknown";
  }
  return {};
}

Sentence end_words(const ContactFacts& f) {
  if (f.last_arm_end == ArmEnd::kTripped && f.voltage_trip)
    return with_volts("say.contact.ended.voltage", f);
  switch (f.last_arm_end) {
    case ArmEnd::kDeliveredLate:
      return {"say.contact.ended.late",
              {{"ms", std::ceil(f.end_late_s * kMsPerS)}, {"limit", f.end_limit_s * kMsPerS}}};
    case ArmEnd::kSilence: return "say.contact.ended.silence";
    case ArmEnd::kExpired: return "say.contact.ended.expired";
    case ArmEnd::kSensorDisarmed: return "say.contact.ended.disarmed";
    default: return {};
  }
}

}  // namespace

ContactLink link_of(const ContactFacts& f) {
  if (f.step == ContactStep::kClosed) return ContactLink::kDown;
  if (f.fault != ContactFault::kNone) return ContactLink::kFault;
  if (f.step == ContactStep::kReady) return ContactLink::kReady;
  if (f.step == ContactStep::kHello && !f.heard && f.waiting_s >= kMuteS) return ContactLink::kDown;
  return ContactLink::kIdentifying;
}

Sentence words_of(const ContactFacts& f) {
  const bool again = f.step > ContactStep::kClosed && f.step < ContactStep::kSelfTest;
  if (again && f.fault == ContactFault::kNone && f.delivered_late_s > 0.0)
    return identified_again(late_words(f));
  if (f.step == ContactStep::kClosed || f.fault == ContactFault::kNone) {
    const Sentence words = step_words(f);
    return words.empty() ? end_words(f) : words;
  }
  return fault_words(f);
}

ContactStatus status_of(const ContactFacts& f) {
  ContactStatus s;
  s.link = link_of(f);
  s.in_contact = f.in_contact;
  s.can_guard_retreat =
      s.link == ContactLink::kReady || (f.step == ContactStep::kSelfTest &&
                                        f.touching_at_self_test && f.fault == ContactFault::kNone);
  s.loop_ok = f.loop_ok;
  s.self_test_ok = f.self_test_ok;
  s.loop_flaw = f.loop_flaw;
  s.voltage_trip = f.voltage_trip;
  s.armed = f.armed;
  s.words = words_of(f);
  s.quality = f.quality;
  s.identity = {f.version, f.firmware, f.uid, f.boot_id, f.config_crc, f.board};
  s.sense_voltage_v = f.sense_v;
  s.clock_limit_s = f.clock_limit_s;
  s.fault = f.fault;
  s.last_arm_end = f.last_arm_end;
  s.clock_ok = f.clock_ok;
  s.delivery = f.delivery;
  s.relay = f.relay;
  return s;
}

ArmResult result_of(const ArmAnswer& a) {
  return {a.arm_id, a.refusal == ArmRefusal::kNone, a.refusal, refusal_words(a)};
}

}  // namespace cellcal::drivers
