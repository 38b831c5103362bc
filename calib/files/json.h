#pragma once
// Reading JSON that others may have written.

#include <cmath>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "calib/model/error.h"

namespace cellcal::calib {

/// Access by key with an error that names file and key. Non-finite numbers cannot come in: JSON
/// has none, and nlohmann writes null for them.
class JsonReader {
 public:
  /// `file`: what messages call the text that the value was read from.
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
  /// A count or an index.
  std::size_t whole() const {
    constexpr double kMost = 1e9;  // beyond any file of touches, inside any integer
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
    throw FileError(where_.substr(0, file_letters_), where_.substr(file_letters_) + ": " + what);
  }

 private:
  JsonReader(const nlohmann::json& value, std::string where, std::size_t file_letters)
      : value_(value), where_(std::move(where)), file_letters_(file_letters) {}

  const nlohmann::json& value_;
  std::string where_;         ///< begins with the file
  std::size_t file_letters_;  ///< of `where_`
};

// JSON as text, both ways: the parser and the writer take the compiler long, so they stand once.

/// Discarded (`is_discarded()`) where the text is not JSON.
nlohmann::json parse_json(std::string_view text);

/// Of JSON that is known to be valid; keys keep their order.
nlohmann::ordered_json parse_ordered_json(std::string_view text);

/// In one line. Throws what nlohmann throws at bytes that are not UTF-8.
std::string write_json(const nlohmann::json& value);

/// A value a line, as files have it; bytes that are not UTF-8 are replaced.
std::string write_lines(const nlohmann::ordered_json& value);

/// Throws FileError when a dotted key (TOML) or a value (JSON) is nested deeper than any of our
/// documents: their libraries walk such trees by recursion, which hostile text could let overflow.
void refuse_deep_toml(std::string_view text, const std::string& name);
void refuse_deep_json(std::string_view text, const std::string& name);

}  // namespace cellcal::calib
