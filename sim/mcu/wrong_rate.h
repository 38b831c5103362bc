#pragma once
// What a serial port hears of bytes that were sent at another rate than it listens at.

#include <cstdint>
#include <span>
#include <vector>

namespace cellcal::sim {

/// Bytes sent back to back, 8N1, sampled in the middle of the listener's bits. A stop bit that is
/// not there makes the byte a 0, as a terminal in raw mode passes it on.
std::vector<std::uint8_t> as_heard(std::span<const std::uint8_t> bytes, int sent_baud,
                                   int heard_baud);

}  // namespace cellcal::sim
