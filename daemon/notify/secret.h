#pragma once

#include <filesystem>
#include <string>

namespace cellcal::daemon {

/// The file's first line; empty where none is configured. Throws std::runtime_error: missing, empty, readable by
/// everybody, or no line that a header can hold.
std::string read_secret(const std::filesystem::path& file);

}  // namespace cellcal::daemon
