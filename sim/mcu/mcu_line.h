#pragma once
// The emulated sensor as a line for drivers::ContactInline.

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <deque>
#include <span>
#include <vector>

#include "drivers/contact/wire/ctp.h"
#include "drivers/contact/wire/ctp_codec.h"
#include "drivers/time.h"
#include "sim/mcu/microcontroller.h"

namespace cellcal::sim {

/// Address of the host for a board on Ethernet.
inline constexpr host_address kThisComputer{0x0100007F, 49'000};

/// The microcontroller must outlive this object.
class McuLine : public drivers::ByteLine {
 public:
  explicit McuLine(Microcontroller& mcu) : mcu_(mcu) {}

  void write(std::span<const std::uint8_t> bytes, TimePoint t) override;
  TimePoint next() const override;
  void advance(TimePoint t) override;
  std::size_t read(std::span<std::uint8_t> into, TimePoint& t) override;

 private:
  Microcontroller& mcu_;
};

// A line whose bytes a busy computer processes late, in order and in bursts.

/// The wrapped line must outlive this object.
class LateLine final : public drivers::ByteLine {
 public:
  explicit LateLine(drivers::ByteLine& line) : line_(line) {}

  /// Delays delivery until `until`.
  void hold(drivers::TimePoint until) { until_ = until; }
  /// Delays all bytes from now on by this.
  void delay(drivers::Duration late) { late_ = late; }
  /// Suspends delivery for `spell` once per period `every` after `from`, at a varying phase. every 0:
  /// never. The first period is undisturbed.
  void stall(drivers::TimePoint from, drivers::Duration every, drivers::Duration spell) {
    from_ = from;
    every_ = every;
    spell_ = spell;
  }

  void write(std::span<const std::uint8_t> bytes, drivers::TimePoint t) override {
    line_.write(bytes, t);
  }
  drivers::TimePoint next() const override {
    return waiting_.empty() ? line_.next() : std::min(line_.next(), waiting_.front().t);
  }
  void advance(drivers::TimePoint t) override {
    line_.advance(t);
    now_ = t;
    std::array<std::uint8_t, CTP_MAX_WIRE> bytes{};
    drivers::TimePoint came;
    while (const std::size_t size = line_.read(bytes, came))
      waiting_.push_back({delivered(came), {bytes.begin(), bytes.begin() + size}});
  }
  std::size_t read(std::span<std::uint8_t> into, drivers::TimePoint& t) override {
    if (waiting_.empty() || waiting_.front().t > now_) return 0;
    const Piece piece = waiting_.front();
    waiting_.pop_front();
    std::copy(piece.bytes.begin(), piece.bytes.end(), into.begin());
    t = piece.t;
    return piece.bytes.size();
  }

 private:
  struct Piece {
    drivers::TimePoint t{};
    std::vector<std::uint8_t> bytes;
  };

  drivers::TimePoint delivered(drivers::TimePoint came) const {
    const drivers::TimePoint held = std::max(came + late_, until_);
    if (every_ <= drivers::Duration{0} || came < from_ + every_) return held;
    const auto number = static_cast<std::uint64_t>((came - from_) / every_);
    // Low-discrepancy sequence by the golden ratio: not synchronous with any period.
    const double share = std::fmod(0.6180339887 * static_cast<double>(number), 1.0);
    const drivers::TimePoint begins =
        from_ + static_cast<std::int64_t>(number) * every_ +
        std::chrono::duration_cast<drivers::Duration>(share * (every_ - spell_));
    const bool in_it = came >= begins && came < begins + spell_;
    return in_it ? std::max(held, begins + spell_) : held;
  }

  drivers::ByteLine& line_;
  std::deque<Piece> waiting_;
  drivers::TimePoint now_{}, until_{}, from_{};
  drivers::Duration late_{0}, every_{0}, spell_{0};
};

// Bytes received by a serial port at a baud rate other than the sender's.

/// Bytes sent back to back, 8N1, sampled in the middle of the listener's bits. A missing stop bit
/// yields a 0 byte, as from a terminal in raw mode.
std::vector<std::uint8_t> received_as(std::span<const std::uint8_t> bytes, int sent_baud,
                                      int receiver_baud);

}  // namespace cellcal::sim
