#include "daemon/files/system_words.h"

#include <fmt/format.h>

#include <cstddef>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "calib/files/text.h"

namespace cellcal::daemon {

std::string system_words(const std::exception& error) {
  // The library's text contains its class names and error numbers.
  if (const auto* no_json = dynamic_cast<const nlohmann::json::parse_error*>(&error))
    return fmt::format("no JSON from byte {} on", no_json->byte);
  if (dynamic_cast<const nlohmann::json::exception*>(&error) != nullptr)
    return "a value is missing or of another type than is written there";
  const auto* of_file = dynamic_cast<const std::filesystem::filesystem_error*>(&error);
  if (of_file == nullptr) return error.what();
  const auto& path = of_file->path2().empty() ? of_file->path1() : of_file->path2();
  return fmt::format("{}: {}. Check the path, its permissions and the disk", path.string(),
                     of_file->code().message());
}

std::string printable(std::string_view text) {
  std::string line(text);
  for (std::size_t i = 0; i < line.size(); ++i)
    for (std::size_t left = calib::control_at(text, i); left > 0; --left) line[i + left - 1] = ' ';
  return line;
}

}  // namespace cellcal::daemon
