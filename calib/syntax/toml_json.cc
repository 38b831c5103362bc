#include "calib/syntax/toml_json.h"

#include <fmt/format.h>
#include <toml++/toml.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

#include "calib/syntax/json_text.h"
#include "calib/syntax/nesting.h"
#include "calib/syntax/toml_access.h"

namespace cellcal::calib {

namespace {

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
  if (const auto* number = node.as_floating_point()) return number->get();
  if (const auto* flag = node.as_boolean()) return flag->get();
  throw FileError("a date or time cannot stand in a robot or cell file");
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
    throw FileError(name, ": " + key + ": null cannot stand here");
}

}  // namespace

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

std::string toml_to_json(std::string_view text) {
  try {
    return write_json(to_json(toml::parse(text)));
  } catch (const toml::parse_error& e) {
    throw FileError("not valid TOML: " + std::string(e.description()));
  }
}

std::string json_to_toml(std::string_view text) {
  refuse_deep_json(text, "JSON");
  std::ostringstream out;
  out << toml::toml_formatter(to_table(json::parse(text), "JSON"));
  return out.str() + "\n";
}

TomlTable table_from_json(std::string_view text, const std::string& name) {
  refuse_deep_json(text, name);
  const json document = parse_json(text);
  if (!document.is_object()) throw FileError(name, ": must be a JSON object");
  return TomlAccess::table(to_table(document, name), name);
}

}  // namespace cellcal::calib
