#pragma once
// Interface of a contact sensor: arming for one search, reporting the first edge with its time, and
// reporting reliably whether the sensor can be trusted.
//
// Threads: the first group of functions is for the session. snapshot() and the events are for the
// robot's cycle and run on the thread that owns both; they neither block nor allocate.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/sentence.h"
#include "drivers/time.h"

namespace cellcal::drivers {

/// Silence of the sensor longer than this stops an arm that moves under an arming, unless a second
/// stop path has proven itself (ContactGuard::set_silence_limit).
inline constexpr std::chrono::milliseconds kHeartbeatLimit{25};

enum class ContactLink {
  kDown,         ///< port not open, or nothing received
  kIdentifying,  ///< HELLO sent, waiting for IDENT, clock map and self-test
  kReady,
  kFault,  ///< refused version, loop broken, self-test failed, lost state, silent; see words
};

/// Reason why the sensor is not reliable.
enum class ContactFault {
  kNone,
  kVersion,         ///< speaks another protocol version
  kLostState,       ///< restarted during use; persists until acknowledged
  kConfigRefused,   ///< rejects its configuration
  kLoopBroken,      ///< a wire of the touch circuit is open
  kSelfTestFailed,  ///< does not detect its own test edge
  kDeaf,            ///< sends, but does not respond to commands
  kSilent,          ///< no valid frame for the idle limit
  kClockJumped,     ///< its time stamps are discontinuous
  kDeliveredLate,   ///< it sent in time, but this computer processed its bytes late
  kBaud,            ///< bytes without valid frames: baud rates differ
  kDamaged,         ///< damaged frames, with answers missing
  kNoRelay,         ///< a relay in place of plug X1 is configured, but the board has none
  kRelayStaysOpen,  ///< driven, but its mirror contact reports released
  kRelayWelded,     ///< not driven, but its mirror contact reports a closed pole
};

/// Defects of the touch circuit's wires, by the last self-test and the newest heartbeat.
enum class LoopFlaw {
  kNone,
  kGunBreak,    ///< wire F or S is open
  kGunShort,    ///< F and S are shorted before the end resistor at the gun: touches go undetected
  kEarthBreak,  ///< wire E or its return is open: a stand may not be earthed
  kEarthShort,  ///< E and its return are shorted before the end resistor: breaks go undetected
  kEarthUnwatched,  ///< the sensor's firmware does not monitor wire E
};

/// State of the relay in place of plug X1, by its mirror contact.
enum class ContactRelay { kNone, kOpen, kClosed };

/// End of the last arming.
enum class ArmEnd {
  kNone,
  kDisarmed,
  kTripped,
  kExpired,
  kSilence,  ///< no heartbeat within kHeartbeatLimit, cause not (yet) known
  kSensorDisarmed,
  kLinkLost,
  kDeliveredLate,  ///< the heartbeats were sent in time, but this computer processed them late
};

/// Times from a request to its answer.
struct RoundTrip {
  double min_s = 0.0, p50_s = 0.0, p99_s = 0.0;
};

/// Link quality, for the status page and the log. Of the session with the sensor: empty after a silence.
struct ContactQuality {
  std::optional<RoundTrip> round_trip;
  std::optional<double> clock_sigma_s, clock_drift_ppm;
  double heartbeat_jitter_s = 0.0;
  /// Delay from the end of a heartbeat's transmission, by the sensor's own stamp, to the thread
  /// that reads the port, i.e. this computer's share. Over the last 256 heartbeats; maximum since
  /// the port was opened.
  double late_p50_s = 0.0, late_max_s = 0.0, late_worst_s = 0.0;
  TimeHistogram late_times;  ///< all since the port was opened
  std::uint64_t frames = 0;  ///< valid ones
  std::uint64_t crc_errors = 0, gaps = 0, overtaken = 0, unknown_types = 0, bounces = 0;
  double contact_voltage_v = 0.0;
};

/// Late data and its origin, by the sensor's own stamps. Counts never decrease.
struct ContactDelivery {
  std::uint32_t late = 0;    ///< this computer processed them later than kHeartbeatLimit
  std::uint32_t silent = 0;  ///< the sensor itself sent nothing for longer than a limit
  bool open = false;         ///< silent, and its origin is not yet known
};

/// Settings of the board's chip that lead to failures.
struct BoardFlaws {
  bool known = false;           ///< not reported by firmware before 1.1
  bool old_loader = false;      ///< starts a boot loader that loops on a watchdog reset
  bool weak_brown_out = false;  ///< no reset below 4.3 V: at 16 MHz it malfunctions before that
};

/// Identity reported by the sensor. All zero before its answer.
struct ContactIdentity {
  int protocol = 0;  ///< CTP's major version
  std::array<std::uint8_t, 3> firmware{};
  std::uint32_t uid = 0;
  std::uint32_t boot_id = 0;     ///< changes with each restart
  std::uint16_t config_crc = 0;  ///< of its active configuration
  BoardFlaws board;
};

struct ContactStatus {
  ContactLink link = ContactLink::kDown;
  std::optional<bool> in_contact;  ///< empty before the first heartbeat after a silence
  /// Ready, or in contact since before the self-test, which cannot pass in contact, with its loop
  /// tested: only a retreat can be guarded.
  bool can_guard_retreat = false;
  std::optional<bool> loop_ok;  ///< wires F, S and E; empty where not tested
  bool self_test_ok = false;
  bool armed = false;
  /// The last arming was ended by a voltage between the bands instead of an edge.
  bool voltage_trip = false;
  LoopFlaw loop_flaw = LoopFlaw::kNone;
  Sentence words;       ///< fault and remedy
  std::string warning;  ///< of the port, with the remedy; also in `words`
  ContactQuality quality;
  ContactIdentity identity;
  std::optional<double> sense_voltage_v;  ///< newest value
  double clock_limit_s = 0.0;             ///< largest clock_sigma_s at which arming is allowed
  ContactFault fault = ContactFault::kNone;
  ArmEnd last_arm_end = ArmEnd::kNone;
  bool clock_ok = false;  ///< clock known to clock_limit_s, by recent answers
  ContactDelivery delivery;
  ContactRelay relay = ContactRelay::kNone;
};

/// Reason for refusing an arming.
enum class ArmRefusal {
  kNone,
  kNotReady,
  kBusy,  ///< another arming is pending
  kInContact,
  kLoopBroken,
  kVoltageUndefined,
  kClockNotSynchronised,
  kSelfTestOld,
  kBadArgument,
  kBadVersion,
  kNoAnswer,
  kLinkLost,
  kWithdrawn,      ///< disarm() was called before the answer
  kTrippedAtOnce,  ///< the first edge preceded the answer
  kUnknownReason,  ///< a NAK with a reason unknown to this driver
};

/// Result of arm().
struct ArmResult {
  std::uint16_t arm_id = 0;
  bool armed = false;
  ArmRefusal refusal = ArmRefusal::kNone;
  Sentence why_not;  ///< the sensor's reason
};

/// State for the robot's cycle. Plain values without sentences.
struct ContactSnapshot {
  bool alive = false;       ///< heard within kHeartbeatLimit (armed) or the idle limit
  bool in_contact = false;  ///< level, debounced by the sensor
  bool armed = false;
  std::uint16_t arm_id = 0;  ///< of the active arming
  ArmEnd last_end = ArmEnd::kNone;
  /// Set once the sensor's stamps show late processing on this computer: age of the newest data
  /// [s], and the limit of it. 0: none, or not yet known.
  double delivered_late_s = 0.0, late_limit_s = 0.0;
  bool silence_open = false;  ///< as in ContactDelivery
  /// Time of the level by the sensor's own stamp: later changes are not yet included. And the delay
  /// until it was received.
  TimePoint said{};
  double said_late_s = 0.0;
};

enum class ContactEventKind { kTrip, kContact, kRevoked, kRelease };

struct ContactEvent {
  ContactEventKind kind = ContactEventKind::kTrip;
  std::uint16_t arm_id = 0;
  TimePoint first_edge{};     ///< host clock
  double time_sigma_s = 0.0;  ///< 1 sigma of the clock map
  int bounces = 0;
  /// Evidence against the stamp of a contact: a later message of the sensor, by this much, reported
  /// an open circuit or an unused arming. 0: none.
  double denied_s = 0.0;
};

/// The event as sent by the sensor, before any clock map: for the record.
struct ContactRecord {
  ContactEventKind kind = ContactEventKind::kTrip;
  std::uint16_t arm_id = 0;
  std::uint8_t sequence = 0;  ///< of its frame, modulo 256
  std::uint16_t event = 0;    ///< the sensor's event number; 0 for a trip
  std::uint32_t ticks = 0;    ///< the first edge on the sensor's clock, 0.5 us, modulo 2^32
  std::uint16_t confirmed_after_us = 0;  ///< from the first edge to the stable level; trip: 0
  int bounces = 0;
  double sense_v = 0.0;       ///< voltage at the circuit; trip: 0
  TimePoint heard{};          ///< host clock, at reception of its frame
  TimePoint first_edge{};     ///< host clock, by the clock map at that time
  double time_sigma_s = 0.0;  ///< 1 sigma of that map
  std::uint64_t lost = 0;     ///< number of preceding unread records lost
};

/// Interface of a contact sensor for the robot's cycle.
class ContactGuard {
 public:
  virtual ~ContactGuard() = default;
  virtual ContactSnapshot snapshot(TimePoint now) = 0;
  /// Oldest unread event.
  virtual std::optional<ContactEvent> pop_event() = 0;
  /// Sets the maximum silence or delay of the sensor under an arming. Longer than kHeartbeatLimit
  /// only while another stop path monitors the contact.
  virtual void set_silence_limit(Duration) {}
};

class ContactSensor {
 public:
  virtual ~ContactSensor() = default;

  /// Opens the port and starts the identification. Throws DriverError (missing device, port in
  /// use).
  virtual void open() = 0;
  virtual ContactStatus status() const = 0;
  /// Requests one armed search; the answer is returned by poll_arm().
  virtual void arm(std::uint16_t arm_id, std::chrono::milliseconds lifetime) = 0;
  virtual std::optional<ArmResult> poll_arm() = 0;
  virtual void disarm() = 0;
  /// Starts a self-test; the result appears in status(), whose self_test_ok is false from this call
  /// until then.
  virtual void self_test() = 0;
  /// Oldest unread event as sent by the sensor. Not used for motion.
  virtual std::optional<ContactRecord> next_record() = 0;
  virtual void close() = 0;
};

}  // namespace cellcal::drivers
