#include "tests/daemon/api/schema.h"

#include <algorithm>
#include <fstream>
#include <set>

namespace cellcal::daemon::testing {

namespace {

using nlohmann::json;

const std::set<std::string> kKnown{"$ref",        "additionalProperties",
                                   "description", "enum",
                                   "items",       "maxItems",
                                   "minItems",    "minimum",
                                   "oneOf",       "properties",
                                   "required",    "type"};

bool is_of(const json& value, const std::string& type) {
  if (type == "null") return value.is_null();
  if (type == "boolean") return value.is_boolean();
  if (type == "string") return value.is_string();
  if (type == "integer") return value.is_number_integer();
  if (type == "number") return value.is_number();
  if (type == "array") return value.is_array();
  return type == "object" && value.is_object();
}

}  // namespace

Description::Description(const std::string& file) {
  std::ifstream stream(file);
  document_ = json::parse(stream);
}

std::string Description::complaint(const json& value, const json& schema) const {
  std::string words;
  check(value, schema, "$", words);
  return words;
}

std::string Description::complaint(const json& value, const std::string& schema_name) const {
  return complaint(value, document_.at("components").at("schemas").at(schema_name));
}

void Description::check(const json& value, const json& schema, const std::string& at,
                        std::string& words) const {
  const auto complain = [&](const std::string& what) { words += at + ": " + what + "\n"; };
  for (const auto& [key, unused] : schema.items()) {
    if (!kKnown.contains(key)) complain("the schema has " + key + ", which nobody checks");
  }
  if (schema.contains("$ref")) {
    const std::string ref = schema["$ref"];
    return check(value, document_.at(json::json_pointer(ref.substr(1))), at, words);
  }
  if (schema.contains("oneOf")) {
    const auto fits = std::count_if(schema["oneOf"].begin(), schema["oneOf"].end(),
                                    [&](const json& one) { return complaint(value, one).empty(); });
    if (fits == 1) return;
    complain("fits " + std::to_string(fits) + " of the alternatives");
    for (const json& one : schema["oneOf"]) words += complaint(value, one);
    return;
  }
  if (schema.contains("type")) {
    const json& type = schema["type"];
    const bool fits = type.is_string()
                          ? is_of(value, type)
                          : std::any_of(type.begin(), type.end(),
                                        [&](const json& one) { return is_of(value, one); });
    if (!fits) return complain("is " + value.dump().substr(0, 60) + ", not " + type.dump());
  }
  if (schema.contains("enum") &&
      std::find(schema["enum"].begin(), schema["enum"].end(), value) == schema["enum"].end()) {
    complain("is " + value.dump());
  }
  if (schema.contains("minimum") && value.is_number() &&
      value.get<double>() < schema["minimum"].get<double>()) {
    complain("is " + value.dump());
  }
  if (value.is_array()) {
    if (value.size() < schema.value("minItems", std::size_t{0}) ||
        value.size() > schema.value("maxItems", value.size())) {
      complain("has " + std::to_string(value.size()) + " items");
    }
    for (std::size_t i = 0; i < value.size(); ++i) {
      if (schema.contains("items"))
        check(value[i], schema["items"], at + "[" + std::to_string(i) + "]", words);
    }
  }
  if (!value.is_object()) return;
  for (const json& key : schema.value("required", json::array())) {
    if (!value.contains(key.get<std::string>())) complain("lacks " + key.get<std::string>());
  }
  const json properties = schema.value("properties", json::object());
  for (const auto& [key, inner] : value.items()) {
    if (properties.contains(key)) {
      check(inner, properties[key], at + "." + key, words);
    } else if (!schema.value("additionalProperties", true)) {
      complain("has " + key + ", which is not described");
    }
  }
}

}  // namespace cellcal::daemon::testing
