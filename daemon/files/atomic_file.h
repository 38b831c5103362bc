#pragma once

#include <filesystem>
#include <string_view>

namespace cellcal::daemon {

/// Writes the file wholly or not at all, also when the power fails: temporary file, fsync, rename,
/// fsync of the directory. Throws std::runtime_error naming the file; then nothing of it is left
/// behind, and what was there before is there still.
void write_atomically(const std::filesystem::path& path, std::string_view text);

}  // namespace cellcal::daemon
