#pragma once
// Codec of CTP/1 frames: bytes to typed structs and back. Never allocates, blocks or throws.

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <tuple>
#include <type_traits>
#include <utility>

#include "drivers/contact/wire/ctp.h"
#include "drivers/time.h"

namespace cellcal::drivers::ctp {

/// A frame with verified CRC and the payload size of its type.
struct Frame {
  std::uint8_t type = 0;
  std::uint8_t seq = 0;
  std::uint8_t size = 0;
  std::array<std::uint8_t, CTP_MAX_PAYLOAD> payload{};
};

/// An encoded frame with its delimiter.
struct WireBytes {
  std::array<std::uint8_t, CTP_MAX_WIRE> data{};
  std::size_t size = 0;
  std::span<const std::uint8_t> bytes() const { return {data.data(), size}; }
};

// Payloads. Each defines its type, and its fields in the order of their bytes (ctp.h); bytes behind them are 0.
struct Hello {
  static constexpr std::uint8_t kType = CTP_HELLO;
  static constexpr std::size_t kSize = CTP_HELLO_SIZE;
  std::uint8_t min = CTP_VERSION, max = CTP_VERSION;
  std::uint32_t nonce = 0;
  static constexpr auto kFields = std::tuple{&Hello::min, &Hello::max, &Hello::nonce};
};

struct Config {
  static constexpr std::uint8_t kType = CTP_CONFIG;
  static constexpr std::size_t kSize = CTP_CONFIG_SIZE;
  std::uint8_t polarity = CTP_CONTACT_IS_LOW;
  std::uint8_t confirm_samples = 5;
  std::uint16_t sample_us = 100;
  std::uint8_t heartbeat_ms = 10;
  std::uint16_t open_mv = 3500;     ///< at or above: certainly open
  std::uint16_t contact_mv = 1000;  ///< at or below: certainly in contact
  bool operator==(const Config&) const = default;
  static constexpr auto kFields =
      std::tuple{&Config::polarity,     &Config::confirm_samples, &Config::sample_us,
                 &Config::heartbeat_ms, &Config::open_mv,         &Config::contact_mv};
};

/// Configuration checksum in STATUS and IDENT.
std::uint16_t config_crc(const Config& config);

struct Arm {
  static constexpr std::uint8_t kType = CTP_ARM;
  static constexpr std::size_t kSize = CTP_ARM_SIZE;
  std::uint16_t arm_id = 0, lifetime_ms = 0;
  static constexpr auto kFields = std::tuple{&Arm::arm_id, &Arm::lifetime_ms};
};

struct Disarm {
  static constexpr std::uint8_t kType = CTP_DISARM;
  static constexpr std::size_t kSize = CTP_DISARM_SIZE;
  std::uint16_t arm_id = 0;
  static constexpr auto kFields = std::tuple{&Disarm::arm_id};
};

struct Ack {
  static constexpr std::uint8_t kType = CTP_ACK;
  static constexpr std::size_t kSize = CTP_ACK_SIZE;
  std::uint16_t event = 0;
  static constexpr auto kFields = std::tuple{&Ack::event};
};

struct Ping {
  static constexpr std::uint8_t kType = CTP_PING;
  static constexpr std::size_t kSize = CTP_PING_SIZE;
  std::uint32_t nonce = 0;
  static constexpr auto kFields = std::tuple{&Ping::nonce};
};

struct SelfTest {
  static constexpr std::uint8_t kType = CTP_SELFTEST;
  static constexpr std::size_t kSize = CTP_SELFTEST_SIZE;
  static constexpr std::tuple<> kFields{};
};

struct KeepAlive {
  static constexpr std::uint8_t kType = CTP_KEEPALIVE;
  static constexpr std::size_t kSize = CTP_KEEPALIVE_SIZE;
  static constexpr std::tuple<> kFields{};
};

/// The relay in place of plug X1.
struct Relay {
  static constexpr std::uint8_t kType = CTP_RELAY;
  static constexpr std::size_t kSize = CTP_RELAY_SIZE;
  std::uint8_t on = 0;
  static constexpr auto kFields = std::tuple{&Relay::on};
};

struct RelayState {
  static constexpr std::uint8_t kType = CTP_RELAY_STATE;
  static constexpr std::size_t kSize = CTP_RELAY_STATE_SIZE;
  std::uint8_t flags = 0;
  static constexpr auto kFields = std::tuple{&RelayState::flags};
};

struct Ident {
  static constexpr std::uint8_t kType = CTP_IDENT;
  static constexpr std::size_t kSize = CTP_IDENT_SIZE;
  std::uint8_t version = CTP_VERSION;
  std::array<std::uint8_t, 3> firmware{};
  std::uint32_t uid = 0, boot_id = 0, clock_hz = 0;
  std::uint8_t reset_cause = 0;
  std::uint32_t nonce = 0;
  std::uint16_t config_crc = CTP_CONFIG_NONE;
  static constexpr auto kFields =
      std::tuple{&Ident::version,  &Ident::firmware,    &Ident::uid,   &Ident::boot_id,
                 &Ident::clock_hz, &Ident::reset_cause, &Ident::nonce, &Ident::config_crc};
};

/// Chip settings of an ATmega328P.
struct Board {
  static constexpr std::uint8_t kType = CTP_BOARD;
  static constexpr std::size_t kSize = CTP_BOARD_SIZE;
  std::uint8_t fuses_low = 0, fuses_high = 0, fuses_extended = 0;
  std::uint16_t loader = 0xFFFF;
  static constexpr auto kFields =
      std::tuple{&Board::fuses_low, &Board::fuses_high, &Board::fuses_extended, &Board::loader};
};

struct Status {
  static constexpr std::uint8_t kType = CTP_STATUS;
  static constexpr std::size_t kSize = CTP_STATUS_SIZE;
  std::uint32_t t = 0;
  std::uint8_t flags = 0;
  std::uint16_t last_event = 0;
  std::uint8_t errors = 0;
  std::uint16_t sense_mv = 0;
  std::uint16_t config_crc = CTP_CONFIG_NONE;
  static constexpr auto kFields =
      std::tuple{&Status::t,      &Status::flags,    &Status::last_event,
                 &Status::errors, &Status::sense_mv, &Status::config_crc};
};

struct Trip {
  static constexpr std::uint8_t kType = CTP_TRIP;
  static constexpr std::size_t kSize = CTP_TRIP_SIZE;
  std::uint16_t arm_id = 0;
  std::uint32_t t = 0;
  static constexpr auto kFields = std::tuple{&Trip::arm_id, &Trip::t};
};

/// CONTACT, REVOKED and RELEASE, distinguished by the frame's type.
struct Event {
  static constexpr std::size_t kSize = CTP_EVENT_SIZE;
  std::uint16_t event = 0, arm_id = 0;
  std::uint32_t t_first = 0;
  std::uint16_t dt_confirm_us = 0;
  std::uint8_t bounces = 0, level = 0;
  std::uint16_t sense_mv = 0;
  static constexpr auto kFields =
      std::tuple{&Event::event,   &Event::arm_id, &Event::t_first, &Event::dt_confirm_us,
                 &Event::bounces, &Event::level,  &Event::sense_mv};
};

struct Pong {
  static constexpr std::uint8_t kType = CTP_PONG;
  static constexpr std::size_t kSize = CTP_PONG_SIZE;
  std::uint32_t nonce = 0, t_rx = 0, t_tx = 0;
  static constexpr auto kFields = std::tuple{&Pong::nonce, &Pong::t_rx, &Pong::t_tx};
};

struct Nak {
  static constexpr std::uint8_t kType = CTP_NAK;
  static constexpr std::size_t kSize = CTP_NAK_SIZE;
  std::uint8_t of_type = 0, reason = 0;
  static constexpr auto kFields = std::tuple{&Nak::of_type, &Nak::reason};
};

/// COBS without the delimiter. `out` holds at least in.size() + 1 bytes; in.size() <= 254.
std::size_t cobs_encode(std::span<const std::uint8_t> in, std::uint8_t* out);
/// Decodes in place or elsewhere (out may be in.data()); nullopt: not COBS.
std::optional<std::size_t> cobs_decode(std::span<const std::uint8_t> in, std::uint8_t* out);

/// Bytes that the fields of a payload take.
template <class Payload>
constexpr std::size_t kFieldBytes = std::apply(
    [](auto... field) { return (std::size_t{0} + ... + sizeof(std::declval<Payload&>().*field)); },
    Payload::kFields);

/// Little-endian.
template <class Payload>
void to_bytes(const Payload& payload, std::uint8_t* at) {
  const auto put = [&at](const auto& value) {
    if constexpr (requires { value.size(); })
      at = std::copy(value.begin(), value.end(), at);
    else
      for (std::size_t i = 0; i < sizeof value; ++i)
        *at++ = static_cast<std::uint8_t>(value >> (8 * i));
  };
  static_assert(kFieldBytes<Payload> <= Payload::kSize);
  std::fill_n(at, Payload::kSize, std::uint8_t{0});
  std::apply([&](auto... field) { (put(payload.*field), ...); }, Payload::kFields);
}

template <class Payload>
Payload from_bytes(const std::uint8_t* at) {
  Payload payload;
  const auto get = [&at](auto& value) {
    using Value = std::remove_reference_t<decltype(value)>;
    if constexpr (requires { value.size(); }) {
      std::copy_n(at, value.size(), value.begin());
    } else {
      std::uint32_t sum = 0;
      for (std::size_t i = 0; i < sizeof value; ++i) sum |= std::uint32_t{at[i]} << (8 * i);
      value = static_cast<Value>(sum);
    }
    at += sizeof value;
  };
  std::apply([&](auto... field) { (get(payload.*field), ...); }, Payload::kFields);
  return payload;
}

/// A frame of any type; a payload longer than CTP_MAX_PAYLOAD gives an empty result.
WireBytes build_frame(std::uint8_t type, std::uint8_t seq, std::span<const std::uint8_t> payload);

template <class Payload>
WireBytes build(const Payload& payload, std::uint8_t seq, std::uint8_t type) {
  std::array<std::uint8_t, CTP_MAX_PAYLOAD> raw{};
  to_bytes(payload, raw.data());
  return build_frame(type, seq, {raw.data(), Payload::kSize});
}

template <class Payload>
WireBytes build(const Payload& payload, std::uint8_t seq) {
  return build(payload, seq, Payload::kType);
}

/// The payload of a frame returned by FrameReader, which has verified its size.
template <class Payload>
Payload read(const Frame& frame) {
  return from_bytes<Payload>(frame.payload.data());
}

/// Counters of one direction of the line.
struct WireCounters {
  std::uint64_t frames = 0;
  std::uint64_t crc_errors = 0;
  std::uint64_t malformed = 0;  ///< not COBS, too short, or not the size of its type
  std::uint64_t oversize = 0;
  std::uint64_t unknown_types = 0;
  std::uint64_t gaps = 0;       ///< missing frames by sequence number
  std::uint64_t overtaken = 0;  ///< duplicated or reordered, and dropped
};

/// End of the line that a reader is at: types of the other direction are unknown to it.
enum class Direction { kFromHost, kFromSensor };

/// Ordering guarantees of a line.
enum class Order {
  kKept,  ///< a wire: bytes arrive in order, or not at all
  /// Datagrams: a frame that is not newer than the preceding one, by its sequence number, is
  /// dropped. HELLO and IDENT restart the conversation and the count.
  kAnyhow,
};

/// Assembles frames byte by byte. After an error it resynchronises at the next 0x00.
class FrameReader {
 public:
  explicit FrameReader(Direction direction, Order order = Order::kKept)
      : direction_(direction), order_(order) {}

  /// The frame completed by this byte, valid until the next call; otherwise nullptr.
  const Frame* feed(std::uint8_t byte);
  const WireCounters& counters() const { return counters_; }
  /// Discards a partial frame and the sequence, keeps the counters: for a new peer.
  void resync();

 private:
  const Frame* finish();
  bool in_order(std::uint8_t type, std::uint8_t seq);

  Direction direction_;
  Order order_;
  std::array<std::uint8_t, CTP_MAX_WIRE> buffer_{};
  std::size_t size_ = 0;
  bool skipping_ = false;
  std::optional<std::uint8_t> last_seq_;
  Frame frame_;
  WireCounters counters_;
};

}  // namespace cellcal::drivers::ctp

namespace cellcal::drivers {

// Rate of a terminal's line as stored by the kernel, including rates without a B constant (250000).

/// False: not supported by this terminal.
bool set_line_rate(int fd, int baud);
/// 0: unknown. Also works at the other end of a pseudo-terminal.
int line_rate(int fd);

// A serial line in virtual time, seen from the host.

/// The peer runs while the line is advanced; nothing happens between calls.
class ByteLine {
 public:
  virtual ~ByteLine() = default;
  /// The host starts sending these bytes at t, which is not before the last advance().
  virtual void write(std::span<const std::uint8_t> bytes, TimePoint t) = 0;
  /// Time of the peer's next action or delivery; TimePoint::max(): none.
  virtual TimePoint next() const = 0;
  /// Runs the peer until t.
  virtual void advance(TimePoint t) = 0;
  /// Reads bytes whose last bit has arrived by the last advance(); sets `t` to its arrival. Returns
  /// the number of bytes; 0: none. `into` holds at least one frame (CTP_MAX_WIRE).
  virtual std::size_t read(std::span<std::uint8_t> into, TimePoint& t) = 0;
};

}  // namespace cellcal::drivers
