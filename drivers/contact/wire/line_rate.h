#pragma once
// Rate of a terminal's line as stored by the kernel, including rates without a B constant (250000).

namespace cellcal::drivers {

/// False: not supported by this terminal.
bool set_line_rate(int fd, int baud);
/// 0: unknown. Also works at the other end of a pseudo-terminal.
int line_rate(int fd);

}  // namespace cellcal::drivers
