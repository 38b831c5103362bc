#include "calib/words/phrase_json.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace cellcal::calib {

namespace {

using nlohmann::json;

Phrase phrase_of(const json& value, int depth) {
  if (value.is_string()) return value.get<std::string>();
  if (depth == kMostNested || !value.is_object() || value.size() != 2 || !value.contains("id") ||
      !value["id"].is_string() || !value.contains("values") || !value["values"].is_object())
    throw std::invalid_argument(R"(a phrase must be a text or {"id": ..., "values": {...}})");
  std::vector<PhraseValue> values;
  for (const auto& [name, one] : value["values"].items()) {
    if (one.is_number_integer())
      values.emplace_back(name, one.get<std::int64_t>());
    else if (one.is_number())
      values.emplace_back(name, one.get<double>());
    else
      values.emplace_back(name, phrase_of(one, depth + 1));
  }
  return {value["id"].get<std::string>(), std::move(values)};
}

json value_of(std::int64_t number) { return number; }
json value_of(double number) {
  return std::isfinite(number) ? json(number) : json(std::to_string(number));
}
json value_of(const Phrase& phrase) { return to_json(phrase); }

}  // namespace

json to_json(const Phrase& phrase) {
  if (phrase.values().empty()) return phrase.id();
  json values = json::object();
  for (const PhraseValue& one : phrase.values())
    values[one.name] = std::visit([](const auto& value) { return value_of(value); }, one.value);
  return {{"id", phrase.id()}, {"values", values}};
}

std::vector<std::string> all_words(const std::vector<Phrase>& phrases, const Language& language) {
  std::vector<std::string> all;
  for (const Phrase& one : phrases) all.push_back(words(one, language));
  return all;
}

Phrase phrase_of(const json& value) { return phrase_of(value, 0); }

}  // namespace cellcal::calib
