#pragma once

#include <filesystem>
#include <string_view>

namespace cellcal::daemon {

/// Writes the file atomically, also on power failure: temporary file, fsync, rename, fsync of the directory.
/// Throws std::runtime_error naming the file; the previous content is then unchanged and no temporary file
/// remains. `kOwner`: never readable by other users (mode 0600).
enum class Readers { kAsUsual, kOwner };
void write_atomically(const std::filesystem::path& path, std::string_view text,
                      Readers readers = Readers::kAsUsual);

}  // namespace cellcal::daemon
