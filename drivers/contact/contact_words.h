#pragma once
// Sentences of faults and refusals, with the remedy. Not for the cycle.

#include <array>
#include <cstdint>
#include <optional>

#include "drivers/contact.h"

namespace cellcal::drivers {

// State of the core as plain values that cross threads without allocation.

/// Step of the identification, in order; restarted after every loss.
enum class ContactStep { kClosed, kHello, kConfig, kClock, kSelfTest, kReady };

struct ContactFacts {
  ContactStep step = ContactStep::kClosed;
  ContactFault fault = ContactFault::kNone;
  bool heard = false;  ///< any valid frame since the port was opened
  bool touching_at_self_test = false;
  std::optional<bool> in_contact, loop_ok;  ///< as in ContactStatus
  bool self_test_ok = false, armed = false;
  bool voltage_trip = false;
  LoopFlaw loop_flaw = LoopFlaw::kNone;
  std::uint16_t arm_id = 0;
  ArmEnd last_arm_end = ArmEnd::kNone;
  std::uint8_t version = 0;
  std::array<std::uint8_t, 3> firmware{};
  std::uint32_t uid = 0, boot_id = 0;
  std::uint16_t config_crc = 0;
  BoardFlaws board;
  ContactRelay relay = ContactRelay::kNone;
  double waiting_s = 0.0;  ///< in the current step
  double silent_s = 0.0;   ///< since the last valid frame
  std::optional<double> sense_v;
  double clock_limit_s = 0.0;
  double unanswered_s = 0.0;                   ///< since the last answer to a PING
  double delivered_late_s = 0.0;               ///< as in ContactSnapshot
  double late_limit_s = 0.0;                   ///< limit for it
  double end_late_s = 0.0, end_limit_s = 0.0;  ///< the same at the last arming's end
  bool clock_ok = false;                       ///< as in ContactStatus
  ContactDelivery delivery;
  int baud = 0;                     ///< of the host
  bool datagrams = false;           ///< over Ethernet
  std::uint64_t bytes = 0;          ///< received since the port was opened
  std::uint64_t lost_events = 0;    ///< not read in time
  std::uint64_t sensor_errors = 0;  ///< damaged frames counted by the sensor
  ContactQuality quality;
};

/// Answer to an arming with the figures for its sentence.
struct ArmAnswer {
  std::uint16_t arm_id = 0;
  ArmRefusal refusal = ArmRefusal::kNone;
  ContactFacts facts;
};

ContactLink link_of(const ContactFacts& facts);
Sentence words_of(const ContactFacts& facts);
ContactStatus status_of(const ContactFacts& facts);
ArmResult result_of(const ArmAnswer& answer);

}  // namespace cellcal::drivers
