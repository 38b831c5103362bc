#pragma once
// A serial line in virtual time, seen from the host.

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/time.h"

namespace cellcal::drivers {

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
