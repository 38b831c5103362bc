#pragma once
// Reading of JSON from untrusted sources.

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "calib/files/input_file.h"

namespace cellcal::calib {

/// Access by key with errors that name file and key. Numbers are always finite: JSON has no
/// non-finite ones, and nlohmann writes null for them.
class JsonReader {
 public:
  /// `file`: name of the source text in messages.
  JsonReader(const nlohmann::json& value, std::string file)
      : value_(value), where_(std::move(file)), file_letters_(where_.size()) {}

  JsonReader at(const char* key) const {
    if (!value_.is_object() || !value_.contains(key))
      fail(std::string("key \"") + key + "\" is missing");
    return {value_[key], where_ + "." + key, file_letters_};
  }
  double number() const {
    if (!value_.is_number()) fail("must be a number");
    const double v = value_.get<double>();
    if (!std::isfinite(v)) fail("must be finite");
    return v;
  }
  double not_negative() const {
    const double v = number();
    if (v < 0.0) fail("must not be negative");
    return v;
  }
  /// A nonnegative integer.
  std::size_t whole() const {
    constexpr double kMost = 1e9;  // above any file of touches, within any integer type
    const double v = number();
    if (v < 0.0 || v > kMost || v != std::floor(v)) fail("must be a whole number, 0 to 1e9");
    return static_cast<std::size_t>(v);
  }
  std::string text() const {
    if (!value_.is_string()) fail("must be a string");
    return value_.get<std::string>();
  }
  bool flag() const {
    if (!value_.is_boolean()) fail("must be true or false");
    return value_.get<bool>();
  }
  const nlohmann::json& value() const { return value_; }
  const nlohmann::json& object() const {
    if (!value_.is_object()) fail("must be an object");
    return value_;
  }
  std::vector<JsonReader> items() const {
    if (!value_.is_array()) fail("must be an array");
    std::vector<JsonReader> result;
    for (std::size_t i = 0; i < value_.size(); ++i)
      result.push_back({value_[i], where_ + "[" + std::to_string(i) + "]", file_letters_});
    return result;
  }
  /// "cal.json.parameters[3]"
  const std::string& where() const { return where_; }
  bool has(const char* key) const { return value_.is_object() && value_.contains(key); }
  [[noreturn]] void fail(const std::string& what) const {
    throw KeyError(where_.substr(0, file_letters_), "", where_.substr(file_letters_), what);
  }

 private:
  JsonReader(const nlohmann::json& value, std::string where, std::size_t file_letters)
      : value_(value), where_(std::move(where)), file_letters_(file_letters) {}

  const nlohmann::json& value_;
  std::string where_;         ///< starts with the file
  std::size_t file_letters_;  ///< length of the file name in `where_`
};

// JSON as text, both ways: parser and writer are slow to compile and instantiated only once.

/// On one line. Throws nlohmann's error for bytes that are not UTF-8.
std::string write_json(const nlohmann::json& value);

/// One value per line, as in files; bytes that are not UTF-8 are replaced.
std::string write_lines(const nlohmann::ordered_json& value);

/// Discarded (`is_discarded()`) if the text is not JSON, or nested deeper than any known document: copying
/// a value descends recursively, and hostile text could overflow the stack.
nlohmann::json parse_json(std::string_view text);

/// Throws FileError if a dotted key (TOML) or a value (JSON) is nested deeper than any known
/// document: the libraries traverse trees recursively, and hostile text could overflow the stack.
void refuse_deep_toml(std::string_view text, const std::string& name);
void refuse_deep_json(std::string_view text, const std::string& name);

}  // namespace cellcal::calib
