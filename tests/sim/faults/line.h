#pragma once
// One direction of a link with faults, in virtual time: messages sent at one end arrive at the
// other, delayed, duplicated, damaged or not at all. Without faults a line only adds its transit
// time.
//
// A fault applies to messages *sent* in its time interval. Its effect depends on the kind of link:
// a dropped datagram is lost, a segment of a stream is retransmitted.

#include <cstdint>
#include <deque>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/contact/wire/ctp_codec.h"
#include "drivers/time.h"

namespace cellcal::sim {

enum class LineKind {
  kDatagrams,  ///< independent: lost, duplicated, reordered
  kFrames,     ///< a serial cable: in order, losses are final
  kStream,     ///< TCP: in order and complete, or not at all
};

enum class LineFaultKind {
  kDrop,       ///< datagram, frame: lost. Stream: retransmitted after kRepeatTime
  kDelay,      ///< by `delay`; subsequent messages wait, and arrive in a burst
  kDuplicate,  ///< repeated `delay` later. Not for streams
  kReorder,    ///< delayed by `delay`, and overtaken meanwhile. Datagrams only
  kCorrupt,    ///< one byte is changed
  kTruncate,   ///< truncated. Stream: and the connection ends there, see ended()
  kCut,        ///< unplugged: lost. Stream: held, and retransmitted when the cable is back
  kRewrite,    ///< as defined by `rewrite`
};

struct Trouble {
  LineFaultKind kind = LineFaultKind::kDrop;
  drivers::TimePoint from{}, until{};  ///< half-open interval
  double share = 1.0;                  ///< of the messages sent in it, drawn by the line's seed
  int most = -1;                       ///< maximum number; negative: all
  drivers::Duration delay{};
  std::function<void(std::string&)> rewrite{};
};

class Line {
 public:
  /// Retransmission timeout of a lost segment; common TCP stacks start with 200 ms.
  static constexpr std::chrono::milliseconds kRepeatTime{200};

  Line(LineKind kind, drivers::Duration transit, std::uint64_t seed);

  /// May start in the future. Faults are cumulative.
  void add(Trouble trouble);
  /// Clears all active and scheduled faults.
  void mend() { line_faults_.clear(); }
  void send(std::string_view bytes, drivers::TimePoint t);

  struct Message {
    drivers::TimePoint t{};  ///< of arrival
    std::string bytes;
  };
  /// Arrival of the next message; TimePoint::max(): none in transit.
  drivers::TimePoint next() const;
  /// The oldest message that has arrived by `now`.
  std::optional<Message> take(drivers::TimePoint now);

  bool is_cut(drivers::TimePoint t) const;
  /// Stream: time at which kTruncate ended the connection.
  std::optional<drivers::TimePoint> ended() const { return ended_; }
  /// Stream: a new connection; messages of the old one are discarded.
  void restart();
  /// Number of messages affected by faults.
  std::uint64_t touched() const { return touched_; }

 private:
  void put(drivers::TimePoint t, std::string bytes, bool in_order);
  void damage(std::string& bytes);

  LineKind kind_;
  drivers::Duration transit_;
  std::mt19937_64 random_;
  std::vector<Trouble> line_faults_;
  std::deque<Message> under_way_;  ///< by arrival
  drivers::TimePoint last_arrival_{};
  std::optional<drivers::TimePoint> ended_;
  std::uint64_t touched_ = 0;
};

// The sensor's line with faults in both directions, wrapping any other line.

/// Each frame sent by the device, and each write of the host, is one message of the lines.
class SerialLine final : public drivers::ByteLine {
 public:
  /// The device's own line must outlive this object.
  SerialLine(drivers::ByteLine& device, std::uint64_t seed, LineKind kind = LineKind::kFrames);

  Line& to_device() { return to_device_; }
  Line& to_host() { return to_host_; }

  void write(std::span<const std::uint8_t> bytes, drivers::TimePoint t) override;
  drivers::TimePoint next() const override;
  void advance(drivers::TimePoint t) override;
  std::size_t read(std::span<std::uint8_t> into, drivers::TimePoint& t) override;

 private:
  void listen();

  drivers::ByteLine& device_;
  LineKind kind_;
  Line to_device_, to_host_;
  drivers::TimePoint now_{};
};

}  // namespace cellcal::sim
