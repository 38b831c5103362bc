#pragma once
// A serial line in virtual time, seen from the host.

#include <cstddef>
#include <cstdint>
#include <span>

#include "drivers/time.h"

namespace cellcal::drivers {

/// The peer runs when the line is advanced; nothing happens between calls.
class ByteLine {
 public:
  virtual ~ByteLine() = default;
  /// The host begins to send these bytes at t, which is not before the last advance().
  virtual void write(std::span<const std::uint8_t> bytes, TimePoint t) = 0;
  /// When the peer next does or delivers something; TimePoint::max(): never by itself.
  virtual TimePoint next() const = 0;
  /// Lets the peer live until t.
  virtual void advance(TimePoint t) = 0;
  /// Takes bytes whose last bit has arrived by the last advance(); sets when it did. Returns how
  /// many; 0: none. `into` holds at least one frame (CTP_MAX_WIRE).
  virtual std::size_t read(std::span<std::uint8_t> into, TimePoint& t) = 0;
};

}  // namespace cellcal::drivers
