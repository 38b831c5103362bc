#include "calib/files/toml.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "calib/files/input_file.h"
#include "calib/files/json.h"
#include "calib/files/text.h"

namespace cellcal::calib {

struct TomlTable::Node {
  std::shared_ptr<const toml::table> document;
  const toml::table* table = nullptr;  // inside document, or empty
  std::string file;
  std::string path;  // of this table, for messages
  mutable std::set<std::string, std::less<>> asked;

  const toml::node* find(std::string_view key) const {
    asked.emplace(key);
    return table->get(key);
  }
  /// An unused key similar to `key`: "; similar: "diametre_mm" in line 7";
  /// empty if there is none.
  std::string similar_key(std::string_view key,
                          bool (*is_like)(std::string_view, std::string_view)) const;
  std::string full(std::string_view key) const {
    return path.empty() ? std::string(key) : path + (key.empty() ? "" : ".") + std::string(key);
  }
  /// A table of the same document.
  TomlTable child(const toml::table* of, std::string at) const {
    return TomlTable(std::make_shared<Node>(Node{document, of, file, std::move(at), {}}));
  }
  /// The value, finite and in the range; 0 below 1e-30.
  static double within(const TomlTable& table, std::string_view key, double value, Range range);
  static std::string text(const TomlTable& table, std::string_view key, const toml::node& node);
  static TomlTable root(toml::table of, const std::string& file_name) {
    const auto whole = std::make_shared<const toml::table>(std::move(of));
    return TomlTable(std::make_shared<Node>(Node{whole, whole.get(), file_name, "", {}}));
  }
};

namespace {

std::string kind_of(const toml::node& node) {
  constexpr std::pair<toml::node_type, const char*> kKinds[] = {
      {toml::node_type::table, "a table"},     {toml::node_type::array, "an array"},
      {toml::node_type::string, "a string"},   {toml::node_type::integer, "an integer"},
      {toml::node_type::boolean, "a boolean"}, {toml::node_type::floating_point, "a number"}};
  for (const auto& [type, words] : kKinds)
    if (node.type() == type) return words;
  return "a date or time";
}

/// Flushes to zero below any value of the formats. Powers of such values would be denormal, which
/// are about a hundred times slower.
double flushed_to_zero(double value) {
  constexpr double kDust = 1e-30;
  return std::abs(value) < kDust ? 0.0 : value;
}

/// Without the unit suffix.
std::string_view without_unit(std::string_view key) {
  for (const std::string_view unit : {"_mm", "_cm", "_m", "_um", "_deg", "_rad", "_kg", "_g", "_s"})
    if (key.size() > unit.size() && key.ends_with(unit))
      return key.substr(0, key.size() - unit.size());
  return key;
}

/// One letter wrong, missing or extra, or two exchanged.
bool one_typo_apart(std::string_view a, std::string_view b) {
  if (a.size() < b.size()) std::swap(a, b);
  if (a.size() > b.size() + 1) return false;
  const auto at =
      static_cast<std::size_t>(std::mismatch(b.begin(), b.end(), a.begin()).first - b.begin());
  if (a.size() > b.size()) return a.substr(at + 1) == b.substr(at);
  if (at + 1 < a.size() && a[at] == b[at + 1] && a[at + 1] == b[at] &&
      a.substr(at + 2) == b.substr(at + 2))
    return true;
  return at == a.size() || a.substr(at + 1) == b.substr(at + 1);
}

/// Likely misspellings of another key: another unit or none, upper case, or a typo. A typo in a
/// short key makes another key.
bool is_similar_key(std::string_view key, std::string_view other) {
  constexpr std::size_t kLongEnough = 5;
  const std::string a = lower_case(key), b = lower_case(other);
  return without_unit(a) == without_unit(b) ||
         (std::min(a.size(), b.size()) >= kLongEnough && one_typo_apart(a, b));
}

/// Table names are short and few, so a typo is accepted at any length.
bool is_similar_table(std::string_view name, std::string_view other) {
  constexpr std::size_t kLongEnough = 4;
  return std::min(name.size(), other.size()) >= kLongEnough &&
         one_typo_apart(lower_case(name), lower_case(other));
}

constexpr std::size_t kShownKey = 80;  // a key with the path of its tables
constexpr std::size_t kShownDescription = 300;
constexpr const char* kNoControl =
    "must not hold control characters (line ends, tabs, escapes, marks of direction): tables, messages and logs name "
    "it";

/// Line by its number, counted from 1; empty past the end.
std::string_view line_of(std::string_view text, std::size_t number) {
  for (; number > 1; --number) {
    const std::size_t end = text.find('\n');
    if (end == std::string_view::npos) return {};
    text.remove_prefix(end + 1);
  }
  return text.substr(0, text.find('\n'));
}

/// The line without quoted strings and comment; empty if a quote is not closed.
std::optional<std::string> without_texts(std::string_view line) {
  // Multi-line strings are not examined.
  if (line.find("\"\"\"") != std::string_view::npos || line.find("'''") != std::string_view::npos)
    return "";
  std::string rest;
  char open = '\0';
  for (std::size_t i = 0; i < line.size(); ++i) {
    const char c = line[i];
    if (open == '"' && c == '\\') {
      ++i;
    } else if (open != '\0') {
      if (c == open) open = '\0';
    } else if (c == '"' || c == '\'') {
      open = c;
    } else if (c == '#') {
      break;
    } else {
      rest += c;
    }
  }
  return open == '\0' ? std::optional(rest) : std::nullopt;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// Digits, a comma, digits, after "=" and outside an array.
bool has_decimal_comma(std::string_view line) {
  const std::size_t value = line.find('=');
  if (value == std::string_view::npos || line.find('[', value) != std::string_view::npos)
    return false;
  for (std::size_t i = value + 1; i + 2 < line.size(); ++i)
    if (is_digit(line[i]) && line[i + 1] == ',' && is_digit(line[i + 2])) return true;
  return false;
}

/// Common cause of a syntax error; the parser's description if there is none.
std::string common_syntax_error(std::string_view text, std::size_t line,
                                std::string_view description) {
  if (description.starts_with("Encountered") && description.find("utf-8") != std::string_view::npos)
    return "not UTF-8 text, but of another encoding (Windows-1252, UTF-16). Save it as UTF-8";
  // The parser reports an unterminated string at the end of its line, or at the start of the next.
  for (const std::size_t number : {line, line - 1}) {
    if (number == 0 || without_texts(line_of(text, number))) continue;
    const std::string at = number == line ? "" : " (line " + std::to_string(number) + ")";
    return "a quote is missing" + at + ": a text begins and ends with \" on one line";
  }
  if (has_decimal_comma(without_texts(line_of(text, line)).value_or("")))
    return "a decimal comma; the decimal mark is '.': 38.1, not 38,1";
  return "not valid TOML: " + shown(std::string(description), kShownDescription);
}

using nlohmann::json;

json to_json(const toml::node& node) {
  if (const auto* table = node.as_table()) {
    json object = json::object();
    for (const auto& [key, value] : *table) object[std::string(key.str())] = to_json(value);
    return object;
  }
  if (const auto* array = node.as_array()) {
    json list = json::array();
    for (const toml::node& item : *array) list.push_back(to_json(item));
    return list;
  }
  if (const auto* text = node.as_string()) return text->get();
  if (const auto* number = node.as_integer()) return number->get();
  if (const auto* number = node.as_floating_point())
    return std::isfinite(number->get()) ? json(number->get()) : json();
  if (const auto* flag = node.as_boolean()) return flag->get();
  throw FileError("dates and times are not allowed in a robot or cell file");
}

void insert(toml::table& table, const std::string& key, const json& value, const std::string& name);

toml::table to_table(const json& object, const std::string& name) {
  toml::table table;
  for (const auto& [key, value] : object.items()) insert(table, key, value, name);
  return table;
}

toml::array to_array(const json& list, const std::string& key, const std::string& name) {
  toml::array array;
  for (const json& item : list) {
    if (item.is_object())
      array.push_back(to_table(item, name));
    else if (item.is_string())
      array.push_back(item.get<std::string>());
    else if (item.is_number())
      array.push_back(item.get<double>());
    else
      throw FileError(name, ": " + key + ": an array may hold tables, strings or numbers only");
  }
  return array;
}

void insert(toml::table& table, const std::string& key, const json& value,
            const std::string& name) {
  if (value.is_object())
    table.insert(key, to_table(value, name));
  else if (value.is_array())
    table.insert(key, to_array(value, key, name));
  else if (value.is_string())
    table.insert(key, value.get<std::string>());
  else if (value.is_number_integer())
    table.insert(key, value.get<std::int64_t>());
  else if (value.is_number())
    table.insert(key, value.get<double>());
  else if (value.is_boolean())
    table.insert(key, value.get<bool>());
  else
    throw FileError(name, ": " + key + ": null is not allowed here");
}

}  // namespace

std::string TomlTable::Node::similar_key(std::string_view key,
                                         bool (*is_like)(std::string_view,
                                                         std::string_view)) const {
  for (const auto& [other, value] : *table) {
    if (asked.contains(other.str()) || !is_like(key, other.str())) continue;
    std::string words = "; similar: \"" + shown(other.str()) + "\"";
    if (const auto line = value.source().begin.line; line != 0)
      words += " in line " + std::to_string(line);
    return words;
  }
  return {};
}

TomlTable TomlTable::parse(std::string_view text, const std::string& file_name) {
  refuse_deep_toml(text, file_name);
  try {
    return Node::root(toml::parse(text, file_name), file_name);
  } catch (const toml::parse_error& e) {
    const std::size_t line = e.source().begin.line;
    throw FileError(file_name, ":" + std::to_string(line) + ": " +
                                   common_syntax_error(text, line, e.description()));
  }
}

TomlTable TomlTable::load(const std::filesystem::path& path) {
  return parse(read_file(path, kMostTomlBytes), path.string());
}

void TomlTable::fail(std::string_view key, const std::string& what) const {
  const toml::node* at = key.empty() ? nullptr : node_->table->get(key);
  const auto line = at ? at->source().begin.line : node_->table->source().begin.line;
  // Line 0: the table comes from a JSON file, where only the key is known.
  const std::string place = line == 0 ? ": " : ":" + std::to_string(line) + ": ";
  throw KeyError(node_->file, place, shown(node_->full(key), kShownKey), what);
}

void TomlTable::missing(std::string_view key, const std::string& wanted) const {
  fail(key, "missing; " + wanted + " is needed here" + node_->similar_key(key, is_similar_key));
}

bool TomlTable::has(std::string_view key) const { return node_->find(key) != nullptr; }

double TomlTable::Node::within(const TomlTable& table, std::string_view key, double value,
                               Range range) {
  if (!std::isfinite(value)) table.fail(key, "must be finite");
  const double number = flushed_to_zero(value);
  if (number < range.min || number > range.max)
    table.fail(key, fmt::format("{:g} is out of range, allowed are {:g} to {:g}", value, range.min,
                                range.max));
  return number;
}

double TomlTable::number(std::string_view key, Range range) const {
  const toml::node* node = node_->find(key);
  if (!node) missing(key, "a number");
  const auto value = node->value<double>();
  if (!value || !node->is_number()) fail(key, "must be a number, but is " + kind_of(*node));
  return Node::within(*this, key, *value, range);
}

double TomlTable::number_or(std::string_view key, double fallback, Range range) const {
  return node_->find(key) ? number(key, range) : fallback;
}

long TomlTable::integer(std::string_view key, long min, long max) const {
  const toml::node* node = node_->find(key);
  if (!node) missing(key, "an integer");
  if (!node->is_integer()) fail(key, "must be an integer, but is " + kind_of(*node));
  const long value = static_cast<long>(*node->value<int64_t>());
  if (value < min || value > max)
    fail(key, std::to_string(value) + " is out of range, allowed are " + std::to_string(min) +
                  " to " + std::to_string(max));
  return value;
}

long TomlTable::integer_or(std::string_view key, long fallback, long min, long max) const {
  return node_->find(key) ? integer(key, min, max) : fallback;
}

bool TomlTable::boolean_or(std::string_view key, bool fallback) const {
  const toml::node* node = node_->find(key);
  if (!node) return fallback;
  if (!node->is_boolean()) fail(key, "must be true or false, but is " + kind_of(*node));
  return *node->value<bool>();
}

std::string TomlTable::Node::text(const TomlTable& table, std::string_view key,
                                  const toml::node& node) {
  if (!node.is_string()) table.fail(key, "must be a string, but is " + kind_of(node));
  return *node.value<std::string>();
}

std::string TomlTable::string(std::string_view key) const {
  const toml::node* node = node_->find(key);
  if (!node) missing(key, "a string");
  std::string value = Node::text(*this, key, *node);
  if (has_control(value)) fail(key, kNoControl);
  return value;
}

std::string TomlTable::string_or(std::string_view key, std::string_view fallback) const {
  return node_->find(key) ? string(key) : std::string(fallback);
}

std::string TomlTable::text_or(std::string_view key, std::string_view fallback) const {
  const toml::node* node = node_->find(key);
  if (!node) return std::string(fallback);
  std::string value = Node::text(*this, key, *node), line = value;
  std::erase_if(line, [](char c) { return c == '\n' || c == '\r' || c == '\t'; });
  if (has_control(line))
    fail(key, "must not hold control characters other than line ends and tabs");
  return value;
}

std::string TomlTable::word(std::string_view key,
                            std::initializer_list<std::string_view> allowed) const {
  const std::string value = string(key);
  std::string list;
  for (std::string_view word : allowed) {
    if (word == value) return value;
    list += (list.empty() ? "\"" : ", \"") + std::string(word) + "\"";
  }
  fail(key, "\"" + shown(value) + "\" is not known here; use one of " + list);
}

std::vector<double> TomlTable::numbers(std::string_view key, std::size_t count, Range range) const {
  const toml::node* node = node_->find(key);
  const std::string wanted =
      count == 0 ? "an array of numbers" : "an array of " + std::to_string(count) + " numbers";
  if (!node) missing(key, wanted);
  const toml::array* array = node->as_array();
  if (!array) fail(key, "must be " + wanted + ", but is " + kind_of(*node));
  if (count != 0 && array->size() != count)
    fail(key, "must be " + wanted + ", but has " + std::to_string(array->size()) +
                  (array->size() > count ? "; the decimal mark is '.', commas separate" : ""));
  std::vector<double> values;
  for (const toml::node& item : *array) {
    if (!item.is_number()) fail(key, "must hold numbers only, but holds " + kind_of(item));
    values.push_back(Node::within(*this, key, *item.value<double>(), range));
  }
  return values;
}

std::vector<std::string> TomlTable::strings(std::string_view key) const {
  const toml::node* node = node_->find(key);
  if (!node) missing(key, "an array of strings");
  const toml::array* array = node->as_array();
  if (!array) fail(key, "must be an array of strings, but is " + kind_of(*node));
  std::vector<std::string> values;
  for (const toml::node& item : *array) {
    if (!item.is_string()) fail(key, "must hold strings only, but holds " + kind_of(item));
    values.push_back(*item.value<std::string>());
    if (has_control(values.back())) fail(key, kNoControl);
  }
  return values;
}

TomlTable TomlTable::table(std::string_view key) const {
  const toml::node* node = node_->find(key);
  if (!node)
    fail(key, "the table [" + shown(node_->full(key), kShownKey) + "] is missing" +
                  node_->similar_key(key, is_similar_table));
  if (!node->is_table()) fail(key, "must be a table, but is " + kind_of(*node));
  return node_->child(node->as_table(), node_->full(key));
}

TomlTable TomlTable::table_or_empty(std::string_view key) const {
  static const toml::table kEmpty;
  return node_->find(key) ? table(key) : node_->child(&kEmpty, node_->full(key));
}

bool TomlTable::is_list(std::string_view key) const {
  const toml::node* node = node_->find(key);
  return node != nullptr && node->is_array();
}

std::vector<TomlTable> TomlTable::tables(std::string_view key) const {
  const toml::node* node = node_->find(key);
  std::vector<TomlTable> result;
  if (!node) return result;
  const toml::array* array = node->as_array();
  if (!array) fail(key, "must be an array of tables, [[" + std::string(key) + "]]");
  for (std::size_t i = 0; i < array->size(); ++i) {
    const toml::table* item = (*array)[i].as_table();
    if (!item) fail(key, "must hold tables only, [[" + std::string(key) + "]]");
    result.push_back(node_->child(item, node_->full(key) + "[" + std::to_string(i + 1) + "]"));
  }
  return result;
}

void TomlTable::refuse_unknown() const {
  for (const auto& [key, value] : *node_->table) {
    if (node_->asked.contains(key.str())) continue;
    std::string known, meant;
    for (const auto& name : node_->asked) {
      known += (known.empty() ? "" : ", ") + name;
      const bool like = is_similar_key(name, key.str()) || is_similar_table(name, key.str());
      if (like && meant.empty() && !has(name)) meant = " (similar: \"" + name + "\")";
    }
    fail(key.str(), "unknown key" + meant + "; known here are: " + known);
  }
}

std::string toml_number(double value) {
  std::string text = fmt::format("{:.14g}", value == 0.0 ? 0.0 : value);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

std::string toml_string(std::string_view text) {
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      out += '\\';
      out += c;
    } else if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) {
      out += fmt::format("\\u{:04X}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    } else {
      out += c;
    }
  }
  return out + '"';
}

json toml_to_json(std::string_view text) {
  try {
    return to_json(toml::parse(text));
  } catch (const toml::parse_error& e) {
    throw FileError("not valid TOML: " + std::string(e.description()));
  }
}

std::string json_to_toml(const json& object) {
  std::ostringstream out;
  out << toml::toml_formatter(to_table(object, "JSON"));
  return out.str() + "\n";
}

TomlTable table_from_json(const json& object, const std::string& name) {
  return TomlTable::Node::root(to_table(object, name), name);
}

}  // namespace cellcal::calib
