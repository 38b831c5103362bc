#pragma once
// User-readable text of system errors.

#include <exception>
#include <filesystem>
#include <string>
#include <string_view>

namespace cellcal::daemon {

/// Writes the file atomically, also on power failure: temporary file, fsync, rename, fsync of the directory.
/// Throws std::runtime_error naming the file; the previous content is then unchanged and no temporary file
/// remains. `kOwner`: never readable by other users (mode 0600).
enum class Readers { kAsUsual, kOwner };
void write_atomically(const std::filesystem::path& path, std::string_view text,
                      Readers readers = Readers::kAsUsual);

/// Renames what is there already to PATH.before, or PATH.before-2 ...; returns the new path, empty where nothing was
/// there. Throws std::filesystem::filesystem_error.
std::filesystem::path set_aside(const std::filesystem::path& path);

/// For a file: path, fault and remedy, where the library's text starts with a function name ("filesystem
/// error: cannot create directories: ..."). For JSON: the fault instead of "[json.exception...". Otherwise
/// the exception's own text.
std::string system_words(const std::exception& error);

/// Foreign text made safe for one line of a log or terminal: control characters, which could forge lines,
/// control the terminal or change the reading direction, are replaced by spaces (listed in
/// calib/files/text.h).
std::string printable(std::string_view text);

/// As one word of a shell, for commands that the user is to enter: quoted where it is needed.
std::string shell_word(const std::string& text);

}  // namespace cellcal::daemon
