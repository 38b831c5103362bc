#pragma once
// An error of the system in a person's words.

#include <exception>
#include <string>
#include <string_view>

namespace cellcal::daemon {

/// Of a file: its path, what is wrong and what to check, where the library's own text names its function first
/// ("filesystem error: cannot create directories: ..."). Of JSON what is wrong with it, in place of "[json.exception...".
/// Of anything else its text.
std::string system_words(const std::exception& error);

/// Foreign text as it may stand in one line of a log or on a terminal: control characters, which
/// could forge a line, steer the terminal or turn the direction of reading, are spaces (calib/files/text.h names them).
std::string printable(std::string_view text);

}  // namespace cellcal::daemon
