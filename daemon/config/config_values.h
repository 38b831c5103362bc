#pragma once
// Formatted text values of cellcald.toml: names on the wire, addresses, paths. All functions throw
// calib::FileError with file, line and key, the permitted values and the remedy.

#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>

#include "calib/files/toml.h"
#include "daemon/config/config.h"

namespace cellcal::daemon {

enum class Emptiness { kRefused, kMeansNone };
/// An XML tag, or SENTYPE.
std::string read_name(const calib::TomlTable& table, const char* key, const std::string& usual,
                      Emptiness empty = Emptiness::kRefused);

enum class Addresses {
  kOwn,            ///< one of this computer's, or the wildcard address
  kThisComputers,  ///< one of this computer's, as seen by the controller
  kControllers,
};
/// An IPv4 address; controllers support no other.
std::string read_address(const calib::TomlTable& table, const char* key, const std::string& usual,
                         Addresses whose);

/// Absolute, without control characters.
std::filesystem::path read_path(const calib::TomlTable& table, const char* key);
/// Two paths, both or neither: a certificate and its key.
void read_pair(const calib::TomlTable& table, const char* first_key, std::filesystem::path& first,
               const char* second_key, std::filesystem::path& second);

int integer_or(const calib::TomlTable& table, const char* key, int usual, int low, int high);

/// For a message: in quotes, without control characters.
std::string in_quotes(const std::string& text);
bool is_visible_ascii(const std::string& text);
/// Letters and digits of ASCII, and these.
bool has_letters_digits_and(std::string_view others, const std::string& text);
/// Decimal port number from 1; none: no such number.
std::optional<std::uint16_t> port_of(const std::string& text);

/// `needed`: the key without which these have no effect, and what to do.
void refuse_without(const calib::TomlTable& table, const std::string& needed,
                    std::initializer_list<const char*> keys);

/// Throws std::runtime_error with the remedy where a file of a key or password is readable by every user.
/// Empty and missing paths are not checked here.
void refuse_secret_of_all(const std::filesystem::path& file);

/// Throws std::runtime_error with the remedy where this process may not read the file. Empty paths are not checked.
void refuse_unreadable(const std::filesystem::path& file);

/// Two elements of one telegram must not share a name.
void refuse_equal_tags(const calib::TomlTable& rsi, const drivers::RsiConfig& config);

/// Remaining checks by the adapters, made before a session begins.
void refuse_unusable_by_session(const calib::TomlTable& document, const DaemonConfig& config);

}  // namespace cellcal::daemon
