#pragma once
// What any contact sensor can do: be armed for one search, report the first edge with its time,
// and say honestly whether it can be trusted.
//
// Threads: the calls of the first group are the session's. snapshot() and the events are for the
// robot's cycle and run on the thread that owns both; they neither block nor allocate.

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/time.h"
#include "drivers/time_histogram.h"

namespace cellcal::drivers {

/// Silence of the sensor longer than this, while the arm moves under arm, stops the arm, unless a
/// second stop path has proven itself (ContactGuard::set_silence_limit).
inline constexpr std::chrono::milliseconds kHeartbeatLimit{25};

enum class ContactLink {
  kDown,         ///< port not open, or nothing heard
  kIdentifying,  ///< HELLO sent, waiting for IDENT, clock map and self-test
  kReady,
  kFault,  ///< refused version, loop broken, self-test failed, lost state, silent; see words
};

/// Why the sensor cannot be relied on.
enum class ContactFault {
  kNone,
  kVersion,         ///< speaks another protocol version
  kLostState,       ///< restarted while in use; holds until it is acknowledged
  kConfigRefused,   ///< does not accept its configuration
  kLoopBroken,      ///< a wire of the touch circuit is open
  kSelfTestFailed,  ///< does not see its own edge
  kDeaf,            ///< is heard, and does nothing that it is told
  kSilent,          ///< no valid frame for the idle limit
  kClockJumped,     ///< its time stamps do not continue
  kDeliveredLate,   ///< it spoke in time, and this computer delivered its bytes late
  kBaud,            ///< bytes come, and none is a frame: the two sides' baud rates differ
  kDamaged,         ///< its frames come damaged, so that its answers are missing
  kNoRelay,         ///< a relay in the place of plug X1 is configured, and the board has none
  kRelayStaysOpen,  ///< it is driven, and its mirror contact says released
  kRelayWelded,     ///< it is not driven, and its mirror contact says that a pole is closed
};

/// What is wrong with the wires of the touch circuit, as the last self-test and the newest
/// heartbeat tell.
enum class LoopFlaw {
  kNone,
  kGunBreak,        ///< wire F or S is open
  kGunShort,        ///< F and S touch before the end resistor at the gun: no touch would be seen
  kEarthBreak,      ///< wire E is open, or its way back: a stand may not be earthed
  kEarthShort,      ///< E and its way back touch before the end resistor: a break would not show
  kEarthUnwatched,  ///< the sensor's firmware does not look at wire E
};

/// The relay in the place of plug X1, by its mirror contact.
enum class ContactRelay { kNone, kOpen, kClosed };

/// How the last arming ended.
enum class ArmEnd {
  kNone,
  kDisarmed,
  kTripped,
  kExpired,
  kSilence,  ///< no heartbeat within kHeartbeatLimit, and not known (yet) whose fault it was
  kSensorDisarmed,
  kLinkLost,
  kDeliveredLate,  ///< the heartbeats were sent in time, and this computer delivered them late
};

/// Link quality, for the status page and the log.
struct ContactQuality {
  double round_trip_min_s = 0.0, round_trip_p50_s = 0.0, round_trip_p99_s = 0.0;
  double clock_sigma_s = 0.0;
  double clock_drift_ppm = 0.0;
  double heartbeat_jitter_s = 0.0;
  /// From the end of a heartbeat on the wire, by the sensor's own stamp, to the thread that reads
  /// the port: this computer's share. Of the last 256 heartbeats; worst since the port was opened.
  double late_p50_s = 0.0, late_max_s = 0.0, late_worst_s = 0.0;
  TimeHistogram late_times;  ///< all since then
  std::uint64_t frames = 0;  ///< sound ones
  std::uint64_t crc_errors = 0, gaps = 0, overtaken = 0, unknown_types = 0, bounces = 0;
  double contact_voltage_v = 0.0;
};

/// Data that came late, and whose fault it was, by the sensor's own stamps. Counts never go back.
struct ContactDelivery {
  std::uint32_t late = 0;    ///< this computer delivered them later than kHeartbeatLimit
  std::uint32_t silent = 0;  ///< the sensor itself sent nothing for longer than a limit
  bool open = false;         ///< silent, and nothing has come yet that tells whose silence it is
};

/// What the board's chip is set up to that will fail some day.
struct BoardFlaws {
  bool known = false;           ///< firmware before 1.1 does not tell
  bool old_loader = false;      ///< starts a boot loader that loops on a watchdog's reset
  bool weak_brown_out = false;  ///< no reset below 4.3 V: at 16 MHz it errs before that
};

/// Who the sensor says it is. All zero before it has answered.
struct ContactIdentity {
  int protocol = 0;  ///< CTP's major version
  std::array<std::uint8_t, 3> firmware{};
  std::uint32_t uid = 0;
  std::uint32_t boot_id = 0;     ///< another one after each of its restarts
  std::uint16_t config_crc = 0;  ///< of the configuration that it runs with
  BoardFlaws board;
};

struct ContactStatus {
  ContactLink link = ContactLink::kDown;
  bool in_contact = false;
  /// Ready, or in contact since before the self-test, which cannot pass there, with its loop
  /// examined: a retreat can be guarded, nothing else.
  bool can_guard_retreat = false;
  bool loop_ok = false;  ///< wires F, S and E
  bool self_test_ok = false;
  bool armed = false;
  /// The last arming was used up by a voltage between the bands and not by an edge.
  bool voltage_trip = false;
  LoopFlaw loop_flaw = LoopFlaw::kNone;
  std::string words;    ///< for people: what is wrong and what to do
  std::string warning;  ///< of the port, with the fix; also in the words
  ContactQuality quality;
  ContactIdentity identity;
  double sense_voltage_v = 0.0;  ///< newest
  double clock_limit_s = 0.0;    ///< clock_sigma_s above which nothing is armed
  ContactFault fault = ContactFault::kNone;
  ArmEnd last_arm_end = ArmEnd::kNone;
  bool clock_ok = false;  ///< its clock is known to clock_limit_s, by answers that are not old
  ContactDelivery delivery;
  ContactRelay relay = ContactRelay::kNone;
};

/// Why an arming was refused.
enum class ArmRefusal {
  kNone,
  kNotReady,
  kBusy,  ///< another arming is being asked for
  kInContact,
  kLoopBroken,
  kVoltageUndefined,
  kClockNotSynchronised,
  kSelfTestOld,
  kBadArgument,
  kBadVersion,
  kNoAnswer,
  kLinkLost,
  kWithdrawn,      ///< disarm() came before the answer
  kTrippedAtOnce,  ///< the first edge came before the answer
  kUnknownReason,  ///< a NAK whose reason this driver does not know
};

/// What arm() led to.
struct ArmResult {
  std::uint16_t arm_id = 0;
  bool armed = false;
  ArmRefusal refusal = ArmRefusal::kNone;
  std::string why_not;  ///< the sensor's reason, in words
};

/// What the robot's cycle looks at. Plain values, no words.
struct ContactSnapshot {
  bool alive = false;       ///< heard within kHeartbeatLimit (armed) or the idle limit
  bool in_contact = false;  ///< level, debounced by the sensor
  bool armed = false;
  std::uint16_t arm_id = 0;  ///< of the arming that is in force
  ArmEnd last_end = ArmEnd::kNone;
  /// Once the sensor's stamps show that this computer delivered late: how old the newest data had
  /// become [s], and how old they may. 0: not so, or not known yet.
  double delivered_late_s = 0.0, late_limit_s = 0.0;
  bool silence_open = false;  ///< as in ContactDelivery
  /// When the sensor said the level, by its own stamp: what came later it does not know yet. And how
  /// much later than that it was heard.
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
  /// A contact whose stamp cannot be: the sensor said so much later that the circuit was open, or
  /// its arming not used up. 0: nothing denies it.
  double denied_s = 0.0;
};

/// The same as the sensor gave it, before any clock map: evidence, for the record.
struct ContactRecord {
  ContactEventKind kind = ContactEventKind::kTrip;
  std::uint16_t arm_id = 0;
  std::uint8_t sequence = 0;  ///< of its frame, modulo 256
  std::uint16_t event = 0;    ///< the sensor's number of it; 0: a trip has none
  std::uint32_t ticks = 0;    ///< the first edge on the sensor's clock, 0.5 us, modulo 2^32
  std::uint16_t confirmed_after_us = 0;  ///< from the first edge to the level that held; trip: 0
  int bounces = 0;
  double sense_v = 0.0;       ///< voltage at the circuit; a trip states none: 0
  TimePoint heard{};          ///< host clock, when its frame had come
  TimePoint first_edge{};     ///< host clock, by the clock map of that moment
  double time_sigma_s = 0.0;  ///< 1 sigma of that map
  std::uint64_t lost = 0;     ///< records before this one that nobody took in time
};

/// What the robot's cycle asks of a contact sensor.
class ContactGuard {
 public:
  virtual ~ContactGuard() = default;
  virtual ContactSnapshot snapshot(TimePoint now) = 0;
  /// Oldest event not yet taken.
  virtual std::optional<ContactEvent> take_event() = 0;
  /// How long the sensor's words may be missing or late under arm, from now on. Longer than
  /// kHeartbeatLimit only while another stop path watches the contact.
  virtual void set_silence_limit(Duration) {}
};

class ContactSensor {
 public:
  virtual ~ContactSensor() = default;

  /// Opens the port and begins to identify. Throws DriverError (missing device, port in use).
  virtual void open() = 0;
  virtual ContactStatus status() const = 0;
  /// Asks for one armed search; the answer appears in poll_arm().
  virtual void arm(std::uint16_t arm_id, std::chrono::milliseconds lifetime) = 0;
  virtual std::optional<ArmResult> poll_arm() = 0;
  virtual void disarm() = 0;
  /// Makes the sensor prove itself; the outcome shows in status(), whose self_test_ok is false
  /// from this call until then.
  virtual void self_test() = 0;
  /// Oldest event not yet taken, as the sensor gave it. Nothing that moves rests on it.
  virtual std::optional<ContactRecord> take_record() = 0;
  virtual void close() = 0;
};

}  // namespace cellcal::drivers
