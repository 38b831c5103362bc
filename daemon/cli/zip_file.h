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

/// Files whose path is wanted. Throws calib::FileError with `name` for archives and files that are damaged,
/// encrypted, of an unsupported method, or larger than `most_bytes` in all.
std::vector<ZippedFile> unzip(std::string_view archive, const std::string& name,
                              const std::function<bool(std::string_view)>& wanted,
                              std::size_t most_bytes);

}  // namespace cellcal::daemon
