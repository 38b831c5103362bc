#include "calib/files/parts/unidentifiable_json.h"

#include "calib/syntax/shown.h"

namespace cellcal::calib {

namespace {

using ordered = nlohmann::ordered_json;

ParameterKey named(const Cell& cell, const std::string& name, const JsonReader& item) {
  if (const auto key = parameter_key(cell, name)) return *key;
  item.fail("\"" + shown(name) +
            "\" is no parameter of the robot and cell in this file (they are named as A1.theta or "
            "S1.x); was a joint or target renamed by hand? Identify again from the touches");
}

}  // namespace

ParameterKey parameter_from_json(const Cell& cell, const JsonReader& item) {
  return named(cell, item.text(), item);
}

ordered unidentifiable_to_json(const Cell& cell, const UnidentifiableDirection& d) {
  ordered direction = ordered::object();
  for (const auto& [key, share] : d.direction) direction[parameter_name(cell, key)] = share;
  ordered out = {
      {"words", words(cell, d)}, {"direction", std::move(direction)}, {"kind", to_string(d.kind)}};
  if (d.kind == UnidentifiableKind::kRecorded) return out;
  out["parameters"] = ordered::array();
  for (const ParameterKey& key : d.parameters)
    out["parameters"].push_back(parameter_name(cell, key));
  if (d.more_parameters > 0) out["more_parameters"] = d.more_parameters;
  if (d.more_as_weak > 0) out["more_as_weak"] = d.more_as_weak;
  return out;
}

UnidentifiableDirection unidentifiable_from_json(const Cell& cell, const JsonReader& item) {
  UnidentifiableDirection d;
  const JsonReader direction = item.at("direction");
  for (const auto& entry : direction.object().items())
    d.direction.emplace_back(named(cell, entry.key(), direction),
                             direction.at(entry.key().c_str()).number());
  const auto kind = item.has("kind") ? unidentifiable_kind(item.at("kind").text()) : std::nullopt;
  if (kind.value_or(UnidentifiableKind::kRecorded) == UnidentifiableKind::kRecorded) {
    d.text = item.at("words").text();
    return d;
  }
  d.kind = *kind;
  for (const JsonReader& one : item.at("parameters").items())
    d.parameters.push_back(parameter_from_json(cell, one));
  if (item.has("more_parameters")) d.more_parameters = item.at("more_parameters").whole();
  if (item.has("more_as_weak")) d.more_as_weak = item.at("more_as_weak").whole();
  return d;
}

}  // namespace cellcal::calib
