#pragma once
// Values of cellcald.toml that are text with a form: names on the wire, addresses, paths. All throw
// calib::FileError with file, line and key, what is allowed and what to do.

#include <filesystem>
#include <string>

#include "calib/files/toml.h"
#include "daemon/config/config.h"

namespace cellcal::daemon {

enum class Emptiness { kRefused, kMeansNone };
/// An XML tag, or SENTYPE.
std::string read_name(const calib::TomlTable& table, const char* key, const std::string& usual,
                      Emptiness empty = Emptiness::kRefused);

enum class Addresses {
  kOwn,            ///< one of this computer's, or all of them
  kThisComputers,  ///< one of this computer's, as the controller sees it
  kControllers,
};
/// An IPv4 address, which is all that controllers speak.
std::string read_address(const calib::TomlTable& table, const char* key, const std::string& usual,
                         Addresses whose);

/// Absolute, without control characters.
std::filesystem::path read_path(const calib::TomlTable& table, const char* key);

/// A key's or password's file that every user of this computer may read: throws std::runtime_error with what to do. No path
/// and no file are somebody else's to refuse.
void refuse_secret_of_all(const std::filesystem::path& file);

/// Two elements of one telegram cannot have one name.
void refuse_equal_tags(const calib::TomlTable& rsi, const drivers::RsiConfig& config);

/// What is left for the adapters to object to, before a session begins.
void refuse_what_a_session_would(const calib::TomlTable& document, const DaemonConfig& config);

}  // namespace cellcal::daemon
