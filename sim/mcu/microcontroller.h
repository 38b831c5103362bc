#pragma once
// The device side of CTP/1, without input or output of its own, in virtual time.
//
// Physical edges come with their exact instants. The wire to the host is part of the model: every
// byte takes ten bit times in both directions, and frames wait for the one that is being sent.

#include <array>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <span>

#include "drivers/contact/ctp_codec.h"
#include "drivers/time.h"

namespace cellcal::sim {

using drivers::Duration;
using drivers::TimePoint;

struct McuOptions {
  int baud = CTP_DEFAULT_BAUD;
  double drift_ppm = 0.0;         ///< how much faster than nominal its clock runs
  std::uint32_t first_ticks = 0;  ///< of its clock at power on
  std::uint32_t uid = 0x4D435531;
  std::uint32_t boot_id = 1;  ///< the first; every reset takes the next
  std::uint8_t version = CTP_VERSION;
  std::array<std::uint8_t, 3> firmware{1, 0, 0};
  std::uint16_t open_mv = 4800, contact_mv = 60;  ///< what its input measures
  std::chrono::microseconds turnaround{40};       ///< line free for a PONG to its first bit
};

/// What is wrong with it. All settable at any time.
struct McuFaults {
  bool wire_broken = false;                              ///< reads as contact
  bool stuck_open = false;                               ///< the input never sees an edge
  bool silent = false;                                   ///< hangs: neither hears nor speaks
  std::optional<std::uint16_t> sense_mv = std::nullopt;  ///< measured instead of the true voltage
};

class Microcontroller {
 public:
  Microcontroller(const McuOptions& options, TimePoint power_on);

  /// The touch circuit closes or opens at t, which may lie ahead or slightly behind; edges are
  /// processed in the order of their times, and the stamp is that of t in any case.
  void edge(TimePoint t, bool closed);
  /// The host begins to send these bytes at t (or when the wire is free).
  void receive(std::span<const std::uint8_t> bytes, TimePoint t);
  /// Lives until t.
  void advance(TimePoint t);
  /// When it next does something by itself; call advance() then.
  TimePoint next_event() const;

  struct Output {
    TimePoint t{};  ///< when the last bit is on the wire
    drivers::ctp::WireBytes frame;
  };
  /// The next frame that was complete on the wire by the last advance().
  std::optional<Output> next_output();

  void set_faults(const McuFaults& faults, TimePoint t);
  const McuFaults& faults() const { return faults_; }
  /// Its clock runs so much faster than nominal from t on, without a jump.
  void set_drift(double ppm, TimePoint t);
  /// Restarts at t: new boot id, clock from zero, no configuration, not armed.
  void reset(TimePoint t, std::uint8_t cause = CTP_RESET_PIN);

  // What a test may look at.
  bool armed() const { return arm_id_ != 0; }
  std::uint32_t boot_id() const { return boot_id_; }
  std::uint32_t ticks(TimePoint t) const;
  std::uint64_t repeats() const { return repeats_; }
  const drivers::ctp::WireCounters& received() const { return reader_.counters(); }

 private:
  struct Arrival {
    TimePoint t{};
    std::uint8_t byte = 0;
  };
  /// An edge that is being confirmed.
  struct Candidate {
    TimePoint first{}, next_sample{};
    bool target = false;
    std::uint16_t arm_id = 0;
    int hits = 0, misses = 0, bounces = 0;
  };
  struct PendingEvent {
    std::uint8_t type = 0;
    drivers::ctp::Event event;
    TimePoint due{};
    bool sent = false;
  };

  void process(TimePoint t);
  TimePoint next_internal() const;
  bool level() const;
  std::uint16_t sense_mv() const;
  Duration byte_time() const;
  Duration frame_time(std::size_t payload) const;
  Duration repeat_time() const;

  void on_edge(TimePoint t);
  void on_sample(TimePoint t);
  void on_wire_byte(TimePoint t);
  void check_deadlines(TimePoint t);
  void on_frame(const drivers::ctp::Frame& frame, TimePoint t);
  void on_hello(const drivers::ctp::Hello& hello);
  void on_config(const drivers::ctp::Config& config);
  void on_arm(const drivers::ctp::Arm& arm, TimePoint t);
  void on_self_test(TimePoint t);
  void finish_self_test(TimePoint t);
  void raise(std::uint8_t type, const Candidate& candidate, TimePoint t);
  void disarm();
  void announce(std::uint32_t nonce);
  void nak(std::uint8_t of_type, std::uint8_t reason);
  std::uint8_t flags() const;
  void transmit(TimePoint t);
  template <class Payload>
  void start_frame(const Payload& payload, std::uint8_t type, TimePoint t);

  McuOptions options_;
  McuFaults faults_;
  TimePoint now_, clock_from_;  ///< of the clock: boot, or its last change of speed
  std::uint32_t first_ticks_, boot_id_;
  std::uint8_t reset_cause_ = CTP_RESET_POWER;

  // inputs on their way
  std::multimap<TimePoint, bool> edges_;  ///< equal times keep the order they came in
  std::deque<Arrival> arrivals_;
  TimePoint rx_free_{};
  drivers::ctp::FrameReader reader_{drivers::ctp::Direction::kFromHost};

  // the touch circuit
  bool closed_ = false;      ///< truth
  bool seen_level_ = false;  ///< at the input pin
  bool contact_ = false;     ///< debounced
  std::optional<Candidate> candidate_;
  std::uint16_t contact_arm_id_ = 0;

  // conversation
  bool greeted_ = false;
  drivers::ctp::Config config_;
  std::uint16_t config_crc_ = CTP_CONFIG_NONE;
  std::uint16_t arm_id_ = 0, used_arm_id_ = 0;
  bool latched_ = false, loop_ok_ = false, self_test_ok_ = false;
  TimePoint arm_until_{}, keepalive_until_{}, self_test_at_{};
  std::optional<TimePoint> self_test_until_, pulled_until_;
  bool self_test_saw_edge_ = false;

  // output
  std::uint8_t tx_seq_ = 0;
  TimePoint tx_free_{}, next_status_{};
  bool status_due_ = false;
  std::optional<drivers::ctp::Trip> trip_;
  std::deque<PendingEvent> events_;
  std::uint16_t last_event_ = 0;
  struct PendingPong {
    std::uint32_t nonce = 0, t_rx = 0;
  };
  std::deque<PendingPong> pongs_;
  std::deque<drivers::ctp::Nak> naks_;
  std::optional<std::uint32_t> ident_nonce_;
  std::deque<Output> output_;
  std::uint64_t repeats_ = 0;
};

}  // namespace cellcal::sim
