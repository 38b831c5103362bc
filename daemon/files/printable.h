#pragma once

#include <string>
#include <string_view>

namespace cellcal::daemon {

/// Foreign text as it may stand in one line of a log or on a terminal: control characters, which
/// could forge a line, steer the terminal or turn the direction of reading, are spaces (calib/files/text.h names them).
std::string printable(std::string_view text);

}  // namespace cellcal::daemon
