#pragma once

#include <string>
#include <string_view>

namespace cellcal::daemon {

/// Foreign text as it may stand in one line of a log or on a terminal: control characters, which
/// could forge a line or steer the terminal, are spaces. C1 as UTF-8 writes it, too.
std::string printable(std::string_view text);

}  // namespace cellcal::daemon
