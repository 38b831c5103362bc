#pragma once
// Strict reading of TOML: every key is requested by name and range, and any other key is an error.
// Messages read "FILE:LINE: KEY: what is wrong; what to do". Throws FileError. Numbers smaller than
// 1e-30 are read as 0.

#include <cstddef>
#include <filesystem>
#include <initializer_list>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/error.h"

namespace cellcal::calib {

struct Range {
  double min, max;  ///< both included
};
inline constexpr Range kAnyNumber{-1e12, 1e12};
inline constexpr Range kNotNegative{0.0, 1e12};
inline constexpr Range kPositive{1e-12, 1e12};

/// Far above the size of any valid file.
inline constexpr std::size_t kMostTomlBytes = 4u << 20;

/// One table of a document. Copies share the document.
class TomlTable {
 public:
  static TomlTable parse(std::string_view text, const std::string& file_name);
  static TomlTable load(const std::filesystem::path& path);

  bool has(std::string_view key) const;
  double number(std::string_view key, Range range) const;
  double number_or(std::string_view key, double fallback, Range range) const;
  long integer(std::string_view key, long min, long max) const;
  long integer_or(std::string_view key, long fallback, long min, long max) const;
  bool boolean_or(std::string_view key, bool fallback) const;
  /// Rejects control characters: ids and paths appear in tables, messages and logs.
  std::string string(std::string_view key) const;
  std::string string_or(std::string_view key, std::string_view fallback) const;
  /// Free text, which may contain line breaks and tabs.
  std::string text_or(std::string_view key, std::string_view fallback) const;
  /// One of the given words.
  std::string word(std::string_view key, std::initializer_list<std::string_view> allowed) const;
  /// Array of exactly `count` numbers (0: any count).
  std::vector<double> numbers(std::string_view key, std::size_t count, Range range) const;
  std::vector<std::string> strings(std::string_view key) const;

  /// Sub-table; table_or_empty returns an empty one if it is absent.
  TomlTable table(std::string_view key) const;
  TomlTable table_or_empty(std::string_view key) const;
  /// True if it is written as [[key]].
  bool is_list(std::string_view key) const;
  /// [[key]]; empty if absent.
  std::vector<TomlTable> tables(std::string_view key) const;

  /// Throws for the first key that was never requested. Must be called last, on every table.
  void refuse_unknown() const;
  /// Throws, with this table's (or the key's) location as prefix.
  [[noreturn]] void fail(std::string_view key, const std::string& what) const;

 private:
  /// Fails for a missing key, and suggests a similar one that was not requested.
  [[noreturn]] void missing(std::string_view key, const std::string& wanted) const;

  friend TomlTable table_from_json(const nlohmann::json& object, const std::string& name);
  struct Node;
  explicit TomlTable(std::shared_ptr<Node> node) : node_(std::move(node)) {}
  std::shared_ptr<Node> node_;
};

// TOML documents as JSON and back, so that one strict reader serves both.

/// 14 digits: preserves predictions to 1e-12 m and hides the rounding of unit conversion in the
/// last two (38.84 deg stays 38.84).
std::string toml_number(double value);
/// Quoted and escaped as a TOML basic string.
std::string toml_string(std::string_view text);

/// TOML text as JSON; null for numbers that are not finite. Throws FileError.
nlohmann::json toml_to_json(std::string_view toml);
/// JSON object as TOML text, keys in alphabetical order. Throws FileError.
std::string json_to_toml(const nlohmann::json& object);
/// JSON object as a table for the strict reader. Throws FileError.
TomlTable table_from_json(const nlohmann::json& object, const std::string& name);

}  // namespace cellcal::calib
