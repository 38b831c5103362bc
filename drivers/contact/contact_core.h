#pragma once
// Host side of CTP/1: inputs are bytes and time, outputs are bytes and events. Owns no port, clock
// or thread; after construction it never allocates, locks, logs or throws.

#include <algorithm>
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <span>

#include "drivers/contact.h"
#include "drivers/contact/clock_map.h"
#include "drivers/contact/contact_words.h"
#include "drivers/contact/wire/ctp_codec.h"
#include "drivers/latest_value.h"

namespace cellcal::drivers {

/// Maximum silence outside an arming: three missed idle STATUS frames.
inline constexpr std::chrono::milliseconds kIdleLimit{3 * CTP_IDLE_STATUS_MS};

struct ContactOptions {
  int baud = CTP_DEFAULT_BAUD;
  /// Ethernet: frames may be duplicated and reordered, and `baud` is the bit rate.
  bool datagrams = false;
  /// A relay in place of plug X1 is required, and closed while the port is open.
  bool relay = false;
  ctp::Config wire;  ///< sent as CONFIG
  /// Largest clock uncertainty at which arming is allowed: at 2 mm/s 0.5 ms is 1 um.
  double max_clock_sigma_s = 500e-6;
  std::chrono::seconds self_test_max_age{CTP_SELF_TEST_MAX_AGE_S};
  /// Age after which the self-test is repeated automatically, while unarmed and open.
  std::chrono::seconds self_test_renew{CTP_SELF_TEST_MAX_AGE_S / 2};
};

class ContactCore : public ContactGuard {
 public:
  /// Passes the bytes of one frame to the line; must not block.
  using ByteSink = std::function<void(std::span<const std::uint8_t>)>;

  ContactCore(const ContactOptions& options, ByteSink sink);

  /// The port is open: identification starts.
  void connect(TimePoint now);
  /// The port is lost or closed: all state is discarded.
  void disconnect(TimePoint now);
  /// `t_rx`: time of reading, by which silence is judged; `arrived`: time of arrival in this
  /// computer, if known more precisely.
  void on_bytes(std::span<const std::uint8_t> bytes, TimePoint t_rx) {
    on_bytes(bytes, t_rx, t_rx);
  }
  void on_bytes(std::span<const std::uint8_t> bytes, TimePoint t_rx, TimePoint arrived);
  /// Performs due actions. To be called at or shortly after next_wake().
  void on_tick(TimePoint now);
  TimePoint next_wake() const;

  void arm(std::uint16_t arm_id, std::chrono::milliseconds lifetime, TimePoint now);
  std::optional<ArmAnswer> poll_arm() { return answers_.pop(); }
  void disarm(TimePoint now);
  /// Also acknowledges kLostState: the identification restarts.
  void self_test(TimePoint now);

  ContactFacts facts(TimePoint now) const;

  ContactSnapshot snapshot(TimePoint now) override;
  void set_silence_limit(Duration limit) override { silence_limit_ = limit; }
  std::optional<ContactEvent> pop_event() override { return events_.pop(); }
  bool has_event() const { return !events_.empty(); }
  std::optional<ContactRecord> next_record() { return records_.pop(); }

 private:
  enum class Arming { kNone, kAsking, kArmed, kDisarming };
  enum class Test { kNone, kRunning };
  struct Request {
    std::uint16_t arm_id = 0;
    std::chrono::milliseconds lifetime{0};
  };

  template <class Payload>
  void send(const Payload& payload) {
    const ctp::WireBytes wire = ctp::build(payload, seq_++);
    sink_(wire.bytes());
  }
  void on_frame(const ctp::Frame& frame, TimePoint t_rx, TimePoint arrived);
  void on_ident(const ctp::Ident& ident, TimePoint now);
  void on_status(const ctp::Status& status, TimePoint now);
  void note_delivery(std::uint32_t ticks, TimePoint now);
  void time_out_silence(Duration limit, TimePoint now);
  void settle_delivery();
  void on_status_arming(bool armed_flag, bool latched, TimePoint now);
  void on_status_test(const ctp::Status& status, TimePoint now);
  void on_trip(const ctp::Trip& trip, std::uint8_t sequence, TimePoint now);
  void on_event(const ctp::Frame& frame, TimePoint now);
  void on_pong(const ctp::Pong& pong, TimePoint now, TimePoint arrived);
  void on_nak(const ctp::Nak& nak, TimePoint now);
  void on_relay(const ctp::RelayState& state, TimePoint now);
  void tick_relay(TimePoint now);
  bool relay_to_ask() const;
  ContactFault relay_fault() const;
  bool relay_closed() const;
  bool relay_ready(TimePoint now) const;

  void on_tick_but_ping(TimePoint now);
  void enter(ContactStep step, TimePoint now);
  void identify_again(ContactFault fault, TimePoint now);
  void lose_state(TimePoint now);
  void forget_session();
  /// Event for the cycle and for the record, whose host times are filled in.
  void push_event(ContactRecord record, TimePoint now);
  void note_level(std::uint32_t ticks, TimePoint now);
  /// Time by which a later message of the sensor contradicts the stamp of a contact [s].
  double denied_s(const ContactRecord& contact) const;
  std::uint64_t damaged_frames() const;

  ContactQuality quality() const;

  ArmRefusal refusal(const Request& request, TimePoint now) const;
  void ask(const Request& request, TimePoint now);
  void answer(ArmRefusal refusal, std::uint16_t arm_id, TimePoint now);
  void end_arming(ArmEnd end, TimePoint now);
  void note_end(ArmEnd end);
  void begin_disarm(TimePoint now);
  void use_up_arming(std::uint16_t arm_id, TimePoint now);
  bool keeps_alive() const;  ///< prevents the arming from expiring in the sensor
  void tick_arming(TimePoint now);

  void begin_test(TimePoint now);
  void tick_test(TimePoint now);
  void tick_ping(TimePoint now);
  LoopFlaw loop_flaw(const ctp::Status& status) const;
  bool clock_good(TimePoint now) const;
  bool self_test_fresh(TimePoint now) const;
  void fail_test(ContactFault fault, TimePoint now);
  bool test_due(TimePoint now) const;
  bool deaf(TimePoint now) const;
  std::uint32_t random();

  ContactOptions options_;
  ByteSink sink_;
  std::uint16_t config_crc_;
  Duration answer_time_;  ///< until an unanswered request is repeated
  ctp::FrameReader reader_;
  std::uint8_t seq_ = 0;
  std::uint32_t random_ = 1;

  // identification
  ContactStep step_ = ContactStep::kClosed;
  ContactFault fault_ = ContactFault::kNone;
  TimePoint step_since_{}, next_send_{};
  std::uint32_t hello_nonce_ = 0;
  std::optional<ctp::Ident> ident_;
  BoardFlaws board_;
  bool was_ready_ = false;  ///< since the port was opened

  // reception
  bool heard_ = false;
  std::uint64_t bytes_ = 0;
  TimePoint last_frame_{};
  Duration silence_limit_{kHeartbeatLimit};  ///< under an arming
  Duration idle_limit() const { return std::max<Duration>(kIdleLimit, silence_limit_); }
  std::optional<ctp::Status> status_;
  TimePoint contact_since_{};
  std::optional<bool> in_contact_;
  TimePoint said_{};  ///< time of the level, by the sensor's stamp
  double said_late_s_ = 0.0;
  /// Ticks of the newest heartbeat with an open circuit, and of the newest one with an active
  /// arming.
  std::optional<std::uint32_t> open_ticks_, armed_ticks_;

  // clock
  ClockMap clock_;
  /// Clock map at the beginning of the sensor's silence: determines whether later data was sent in
  /// time.
  ClockMap clock_before_;
  TimePoint next_ping_{}, ping_sent_{}, last_pong_{};
  std::uint32_t ping_nonce_ = 0;
  bool ping_out_ = false;

  // self-test
  Test test_ = Test::kNone;
  bool test_wanted_ = false, test_passed_ = false, test_saw_clear_ = false, touching_ = false;
  TimePoint test_sent_{}, test_passed_at_{}, next_test_{};
  int test_tries_ = 0;
  std::uint64_t damaged_before_test_ = 0;
  bool heard_since_test_ = false;  ///< a heartbeat sent after the expected end of the test

  // relay
  std::optional<ctp::RelayState> relay_;
  TimePoint relay_asked_{}, relay_next_{}, relay_since_{};

  // arming
  Arming arming_ = Arming::kNone;
  Request request_;                 ///< active or pending
  std::optional<Request> waiting_;  ///< until the preceding arming has ended
  TimePoint asked_at_{}, next_try_{}, next_keepalive_{}, expires_{};
  ArmEnd last_end_ = ArmEnd::kNone;
  double end_late_s_ = 0.0, end_limit_s_ = 0.0;  ///< delivered_late_s_ and its limit at that end

  static constexpr std::size_t kRememberedEvents = 16;
  static constexpr std::size_t kEvents = 64;
  static constexpr std::size_t kAnswers = 4;
  FixedRing<std::uint16_t, kRememberedEvents> seen_;
  std::optional<std::uint16_t> newest_event_;  ///< that the level allows for
  FixedRing<ContactEvent, kEvents> events_;
  FixedRing<ContactRecord, kEvents> records_;
  FixedRing<ArmAnswer, kAnswers> answers_;
  std::uint64_t lost_events_ = 0, lost_records_ = 0, bounces_ = 0;
  double contact_v_ = 0.0;
  double delay_mean_s_ = 0.0, delay_var_s2_ = 0.0;  ///< of heartbeats relative to their stamps

  // this computer's share of the heartbeats' delay
  static constexpr std::size_t kLateKept = 256;
  double status_wire_s_;
  std::array<float, kLateKept> late_s_{};
  std::size_t late_count_ = 0;  ///< since the port was opened
  double late_worst_s_ = 0.0;
  TimeHistogram late_times_;
  std::optional<TimePoint> given_up_at_;  ///< end of a silence, until a stamp shows its origin
  TimePoint silent_since_{};
  Duration given_up_limit_{0};
  double delivered_late_s_ = 0.0, late_limit_s_ = 0.0;
  std::uint32_t deliveries_late_ = 0, silences_ = 0;
};

}  // namespace cellcal::drivers
