#include "daemon/api/network_files.h"

#include <fmt/format.h>

#include <algorithm>

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;

bool is_link(const fs::path& path) {
  std::error_code none;
  return fs::is_symlink(path, none);
}

}  // namespace

void keep_within(const Request& request, const fs::path& file, const NetworkFiles& allowed) {
  if (!request.is_from_network()) return;
  std::string places;
  for (const fs::path& one : allowed.folders) {
    const fs::path folder = fs::absolute(one / "").lexically_normal().parent_path();
    const bool directly =
        file.has_filename() && file.parent_path() == folder && file.lexically_normal() == file;
    if (directly && !is_link(folder) && !is_link(file)) return;
    places += (places.empty() ? "" : " or ") + folder.string();
  }
  throw RequestError(fmt::format("over the network {} lies directly in {}, and is no link. {}",
                                 allowed.what, places, allowed.instead));
}

}  // namespace cellcal::daemon
