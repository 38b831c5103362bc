#include "daemon/files/system_words.h"

#include <fmt/format.h>

#include <filesystem>

namespace cellcal::daemon {

std::string system_words(const std::exception& error) {
  const auto* of_file = dynamic_cast<const std::filesystem::filesystem_error*>(&error);
  if (of_file == nullptr) return error.what();
  const auto& path = of_file->path2().empty() ? of_file->path1() : of_file->path2();
  return fmt::format("{}: {}. Check the path, its permissions and the disk", path.string(),
                     of_file->code().message());
}

}  // namespace cellcal::daemon
