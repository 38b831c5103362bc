#pragma once
// The rate of a terminal's line as the kernel holds it, also one without a B constant (250000).

namespace cellcal::drivers {

/// False: this terminal does not take it.
bool set_line_rate(int fd, int baud);
/// 0: not known. Of a pseudo-terminal's other end, too.
int line_rate(int fd);

}  // namespace cellcal::drivers
