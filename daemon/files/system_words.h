#pragma once
// An error of the system in a person's words.

#include <exception>
#include <string>

namespace cellcal::daemon {

/// Of a file: its path, what is wrong and what to check, where the library's own text names its function first
/// ("filesystem error: cannot create directories: ..."). Of JSON what is wrong with it, in place of "[json.exception...".
/// Of anything else its text.
std::string system_words(const std::exception& error);

}  // namespace cellcal::daemon
