#pragma once
// Bytes received by a serial port at a baud rate other than the sender's.

#include <cstdint>
#include <span>
#include <vector>

namespace cellcal::sim {

/// Bytes sent back to back, 8N1, sampled in the middle of the listener's bits. A missing stop bit
/// yields a 0 byte, as from a terminal in raw mode.
std::vector<std::uint8_t> as_heard(std::span<const std::uint8_t> bytes, int sent_baud,
                                   int heard_baud);

}  // namespace cellcal::sim
