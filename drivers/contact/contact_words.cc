#include "drivers/contact/contact_words.h"

#include <fmt/format.h>

#include <cmath>

#include "drivers/contact/wire/ctp.h"
#include "drivers/time.h"

namespace cellcal::drivers {

namespace {

/// A port silent for longer than this is not starting up (a bootloader takes up to 2 s).
constexpr double kMuteS = 3.0;

std::string firmware_of(const ContactFacts& f) {
  return fmt::format("{}.{}.{}", f.firmware[0], f.firmware[1], f.firmware[2]);
}

/// Baud rates supported by the firmware (drivers/contact/firmware/README.md).
constexpr const char* kSensorRates =
    "1000000; 250000 with D4, 115200 with D5 connected to ground at its reset";

std::string late_words(const ContactFacts& f) {
  return late_bytes_words(f.delivered_late_s, f.late_limit_s);
}

std::string loop_words(const ContactFacts& f) {
  if (f.relay == ContactRelay::kOpen)
    return "isolation relay open: the touch circuit is connected when a session begins";
  switch (f.loop_flaw) {
    case LoopFlaw::kNone:  // repaired; not yet confirmed by the self-test
    case LoopFlaw::kGunBreak:
      return fmt::format(
          "touch circuit open ({:.2f} V): a wire between sensor and tool is broken or "
          "unplugged, or its fuse is blown. Check feed and sense wire (F, S)",
          f.sense_v);
    case LoopFlaw::kGunShort:
      return "short circuit between wires F and S, or no end resistor at the tool: a touch would "
             "not be detected. Check the cable and both lugs at the tool";
    case LoopFlaw::kEarthBreak:
      return "wire through the stands (E) open: a stand may not be earthed, and a touch on its "
             "sphere would not be detected. Check the lugs at every stand, the plug, and the fuse "
             "of E";
    case LoopFlaw::kEarthShort:
      return "short circuit between wire E and its return (R), or no end resistor at the last "
             "stand: a break would not be detected. Check the cable and the last stand's lugs";
    case LoopFlaw::kEarthUnwatched:
      return fmt::format(
          "the contact sensor's firmware {} does not monitor the wire through the stands (E). "
          "Flash 1.1 or newer, and wire E back to terminal R (drivers/contact/firmware)",
          firmware_of(f));
  }
  return {};
}

std::string fault_words(const ContactFacts& f) {
  switch (f.fault) {
    case ContactFault::kNone:
      return {};
    case ContactFault::kVersion:
      return fmt::format(
          "protocol CTP/{} in the contact sensor (firmware {}), CTP/{} in this driver. Flash "
          "firmware {}.x from drivers/contact/firmware, or install the matching driver",
          f.version, firmware_of(f), static_cast<int>(CTP_VERSION), static_cast<int>(CTP_VERSION));
    case ContactFault::kLostState:
      return fmt::format(
          "the contact sensor restarted while in use (boot id is now {}): its arming and its "
          "clock are lost. Check its supply and cable, then start a self-test",
          f.boot_id);
    case ContactFault::kConfigRefused:
      return "the contact sensor refused its configuration. Check confirm_samples, sample_us, "
             "heartbeat, and that open_mv is above contact_mv";
    case ContactFault::kLoopBroken:
      return loop_words(f) + ". The self-test repeats by itself";
    case ContactFault::kSelfTestFailed:
      return fmt::format(
          "the contact sensor does not detect its own test edge ({:.2f} V): its input is "
          "stuck, or a supply is shorted to the sense line. It cannot detect a touch: check "
          "the input stage",
          f.sense_v);
    case ContactFault::kDeaf:
      return "the contact sensor sends, but receives no command. Check the line from this "
             "computer to the sensor (TX, connector, earth)";
    case ContactFault::kDamaged:
      return fmt::format(
          "{} damaged frames from the contact sensor, and no answer to its self-test: interference on "
          "the line from the sensor to this computer. Check that line (RX, connector, earth), and "
          "lay it away from motor cables",
          f.quality.crc_errors);
    case ContactFault::kSilent:
      return fmt::format(
          "no valid frame from the contact sensor for {:.1f} s. Check cable and supply; it is "
          "being identified again",
          f.silent_s);
    case ContactFault::kDeliveredLate:
      return late_words(f) + ". It is being identified again";
    case ContactFault::kNoRelay:
      return "no isolation relay at the contact sensor, and [contact] isolation is \"relay\". Fit it and "
             "flash firmware 1.3 or newer (drivers/contact/firmware), or set isolation = \"plug\"";
    case ContactFault::kRelayStaysOpen:
      return "isolation relay open though it is driven: its coil, its supply or its mirror contact. "
             "Check them; the touch circuit is not connected";
    case ContactFault::kRelayWelded:
      return "isolation relay welded: its mirror contact reports a closed pole though the coil is off. "
             "Do not weld: unplug X1 and replace the relay";
    case ContactFault::kBaud:
      return fmt::format(
          "{} bytes from the contact sensor, but no valid frame at {} baud: the sensor uses "
          "another rate. Set [contact] baud to the sensor's ({})",
          f.bytes, f.baud, kSensorRates);
    case ContactFault::kClockJumped:
      return "the contact sensor's clock jumped: its time stamps are not continuous. It is being "
             "identified again";
  }
  return {};
}

std::string step_words(const ContactFacts& f) {
  switch (f.step) {
    case ContactStep::kClosed:
      return "the contact sensor's port is not open";
    case ContactStep::kHello:
      if (f.waiting_s < kMuteS) return "waiting for the contact sensor's answer";
      if (!f.heard) {
        return fmt::format(
            "nothing received from the contact sensor for {:.0f} s. Check its power, its "
            "firmware and {}",
            f.waiting_s,
            f.datagrams ? "the cable, both lamps at its socket, and the address in [contact] device"
                        : fmt::format("the baud rate ({} here)", f.baud));
      }
      return fmt::format("the contact sensor has not answered HELLO for {:.0f} s", f.waiting_s);
    case ContactStep::kConfig:
      return "configuring the contact sensor";
    case ContactStep::kClock:
      if (f.waiting_s < kMuteS || f.quality.clock_sigma_s <= f.clock_limit_s) {
        return "synchronising the contact sensor's clock";
      }
      return fmt::format(
          "the contact sensor's clock is uncertain by {:.0f} us, {:.0f} us are allowed (round "
          "trip {:.1f} ms). Shorten the adapter's latency timer",
          f.quality.clock_sigma_s * 1e6, f.clock_limit_s * 1e6, f.quality.round_trip_min_s * 1e3);
    case ContactStep::kSelfTest:
      if (f.touching_at_self_test || f.in_contact) {
        return "the tool is in contact. Jog it free; the self-test then runs by itself";
      }
      if (f.relay == ContactRelay::kOpen) return "the isolation relay is closing";
      return "the contact sensor's self-test is running";
    case ContactStep::kReady:
      return {};
  }
  return {};
}

std::string refusal_words(const ArmAnswer& a) {
  const ContactFacts& f = a.facts;
  switch (a.refusal) {
    case ArmRefusal::kNone:
      return {};
    case ArmRefusal::kNotReady: {
      const std::string why = words_of(f);
      return "the contact sensor is not ready" + (why.empty() ? std::string{} : ": " + why);
    }
    case ArmRefusal::kBusy:
      return "an earlier arming is not answered yet. Wait for it, or disarm";
    case ArmRefusal::kInContact:
      return fmt::format(
          "the tool is already in contact ({:.2f} V). Jog it free, look for spatter or a short "
          "circuit, or run the self-test to exclude a broken wire",
          f.sense_v);
    case ArmRefusal::kLoopBroken:
      return loop_words(f);
    case ArmRefusal::kVoltageUndefined:
      return fmt::format(
          "sense voltage {:.2f} V is neither open nor contact, or the feed voltage is not "
          "open. Look for moisture, spatter or a bad connection at the tool",
          f.sense_v);
    case ArmRefusal::kClockNotSynchronised:
      if (f.quality.clock_sigma_s > 0.0 && f.quality.clock_sigma_s <= f.clock_limit_s)
        return fmt::format(
            "the contact sensor's clock is not synchronised: no answer to pings for {:.1f} s. "
            "Check its line with 'cellcal doctor'",
            f.unanswered_s);
      return fmt::format(
          "the contact sensor's clock is not synchronised (uncertainty {:.0f} us, limit {:.0f} "
          "us, round trip {:.1f} ms). Check the adapter's latency timer and the load of this "
          "computer",
          f.quality.clock_sigma_s * 1e6, f.clock_limit_s * 1e6, f.quality.round_trip_min_s * 1e3);
    case ArmRefusal::kSelfTestOld:
      return "no recent passed self-test. Jog the tool free and start a self-test";
    case ArmRefusal::kBadArgument:
      return fmt::format(
          "arming {} is not valid: its id must be new and not 0, its lifetime 1 to 65535 ms",
          a.arm_id);
    case ArmRefusal::kBadVersion:
      return "the contact sensor refuses this driver's protocol version";
    case ArmRefusal::kNoAnswer:
      return "the contact sensor did not answer the arming. Check its line with 'cellcal doctor'";
    case ArmRefusal::kLinkLost:
      return "the link to the contact sensor was lost before it answered";
    case ArmRefusal::kWithdrawn:
      return "disarmed before the sensor answered";
    case ArmRefusal::kTrippedAtOnce:
      return "the contact sensor tripped at once when armed: the tool is already at the surface, "
             "or the line is noisy";
    case ArmRefusal::kUnknownReason:
      return "the contact sensor refused for a reason this driver does not know";
  }
  return {};
}

std::string end_words(const ContactFacts& f) {
  if (f.last_arm_end == ArmEnd::kTripped && f.voltage_trip) {
    return fmt::format(
        "the last trip was a voltage without an edge ({:.2f} V now): oxide, paint or coolant "
        "between tip and sphere (above 430 Ohm), or a broken joint at D8. Clean both, then "
        "check the sensor's input",
        f.sense_v);
  }
  switch (f.last_arm_end) {
    case ArmEnd::kDeliveredLate:
      return fmt::format(
          "the last arming ended: this computer was busy, sensor data {:.0f} ms late (limit {:.0f} ms)",
          std::ceil(f.delivered_late_s * 1e3), f.late_limit_s * 1e3);
    case ArmEnd::kSilence:
      return "the last arming ended: no heartbeat within 25 ms";
    case ArmEnd::kExpired:
      return "the last arming ended: its lifetime was over";
    case ArmEnd::kSensorDisarmed:
      return "the last arming ended: this computer's keep-alive reached the sensor too late";
    default:
      return {};
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

std::string words_of(const ContactFacts& f) {
  const bool again = f.step > ContactStep::kClosed && f.step < ContactStep::kSelfTest;
  if (again && f.fault == ContactFault::kNone && f.delivered_late_s > 0.0) {
    return late_words(f) + ". It is being identified again";
  }
  if (f.step == ContactStep::kClosed || f.fault == ContactFault::kNone) {
    const std::string words = step_words(f);
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
