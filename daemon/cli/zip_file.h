#pragma once
// Files out of a ZIP archive.

#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace cellcal::daemon {

struct ZippedFile {
  std::string path, text;
};

/// Those of the archive whose path is wanted. Throws calib::FileError naming `name` for what is damaged,
/// encrypted, of another method than deflate, or larger than `most_bytes` in all.
std::vector<ZippedFile> unzip(std::string_view archive, const std::string& name,
                              const std::function<bool(std::string_view)>& wanted,
                              std::size_t most_bytes);

}  // namespace cellcal::daemon
