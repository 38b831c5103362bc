#pragma once

#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>

namespace cellcal::daemon::testing {

/// Content of a file; "" if it does not exist.
inline std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

}  // namespace cellcal::daemon::testing
