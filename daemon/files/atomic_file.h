#pragma once

#include <filesystem>
#include <string_view>

namespace cellcal::daemon {

/// Writes the file wholly or not at all, also when the power fails: temporary file, fsync, rename,
/// fsync of the directory. Throws std::runtime_error naming the file; then nothing of it is left
/// behind, and what was there before is there still.
/// `kOwner`: nobody else may read it at any time (mode 0600).
enum class Readers { kAsUsual, kOwner };
void write_atomically(const std::filesystem::path& path, std::string_view text,
                      Readers readers = Readers::kAsUsual);

}  // namespace cellcal::daemon
