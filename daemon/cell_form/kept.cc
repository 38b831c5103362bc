#include "daemon/cell_form/kept.h"

#include <algorithm>
#include <array>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>

#include "calib/files/toml.h"
#include "daemon/cell_form/cell_text.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr std::array<std::string_view, 5> kOfTheTool{"xyz_mm", "abc_deg", "xyz_sigma_mm", "mass_kg",
                                                     "tip_radius_mm"};
constexpr std::array<std::string_view, 11> kOfASphere{"id",
                                                      "kind",
                                                      "diameter_mm",
                                                      "diameter_sigma_mm",
                                                      "centre_mm",
                                                      "centre_sigma_mm",
                                                      "serial",
                                                      "certificate",
                                                      "certificate_date",
                                                      "search_low_mm",
                                                      "search_high_mm"};

template <std::size_t N>
bool has(const std::array<std::string_view, N>& keys, const std::string& key) {
  return std::find(keys.begin(), keys.end(), key) != keys.end();
}

bool is_sphere(const json& target) { return target.value("kind", "") == "sphere"; }

/// Sets what the form does not state itself, and names it.
template <std::size_t N>
void keep(json& now, const json& before, const std::array<std::string_view, N>& of_the_form,
          const std::string& where, std::vector<std::string>& kept) {
  for (const auto& [key, value] : before.items()) {
    if (has(of_the_form, key) || (now.contains(key) && now[key] == value)) continue;
    now[key] = value;
    kept.push_back(where + "." + key);
  }
}

/// What a new file states beside the form and this one leaves to the reader's default.
template <std::size_t N>
void leave_out(json& now, const json& before, const std::array<std::string_view, N>& of_the_form,
               const std::string& where, std::vector<std::string>& kept) {
  for (auto one = now.begin(); one != now.end();) {
    const bool stays = has(of_the_form, one.key()) || before.contains(one.key());
    if (!stays) kept.push_back(where + "." + one.key());
    one = stays ? std::next(one) : now.erase(one);
  }
}

void keep_targets(json& now, const json& before, std::vector<std::string>& kept) {
  for (const json& target : before.value("target", json::array())) {
    if (!is_sphere(target)) {
      now["target"].push_back(target);
      kept.push_back("target " + target.value("id", ""));
      continue;
    }
    for (json& one : now["target"])
      if (one.value("id", "") == target.value("id", ""))
        keep(one, target, kOfASphere, target.value("id", ""), kept);
  }
}

/// A list of tables by the names of its entries.
void name_list(const std::string& key, const json& list, std::vector<std::string>& kept) {
  for (const json& one : list)
    kept.push_back(one.is_object() && one.contains("id") ? key + " " + one.value("id", "") : key);
}

json merged(const CellForm& form, const std::string& before_text, std::vector<std::string>& kept) {
  json now = json::parse(calib::toml_to_json(cell_text(form)));
  const json before = json::parse(calib::toml_to_json(before_text));
  const json touch = before.value("touch", json::object());
  constexpr std::array<std::string_view, 0> kNothing{};
  leave_out(now["tool"], before.at("tool"), kOfTheTool, "tool", kept);
  leave_out(now["touch"], touch, kNothing, "touch", kept);
  keep(now["tool"], before.at("tool"), kOfTheTool, "tool", kept);
  keep_targets(now, before, kept);
  keep(now["touch"], touch, kNothing, "touch", kept);
  for (const auto& [key, value] : before.items()) {
    if (now.contains(key) || key == "length") continue;
    now[key] = value;
    if (value.is_array() && !value.empty() && value.front().is_object())
      name_list(key, value, kept);
    else
      kept.push_back(key);
  }
  return now;
}

}  // namespace

std::vector<std::string> beyond(const CellForm& form, const std::string& text) {
  std::vector<std::string> kept;
  (void)merged(form, text, kept);
  return kept;
}

std::string cell_text_with(const CellForm& form, const std::string& before,
                           const std::filesystem::path& folder) {
  std::vector<std::string> kept;
  json now = merged(form, before, kept);
  if (kept.empty()) return cell_text(form);
  if (now.contains("obstacle"))
    for (json& one : now["obstacle"])
      if (one.contains("file")) one["file"] = (folder / one.value("file", "")).string();
  return "# Written by the form on the page, which keeps what it does not show.\n" +
         calib::json_to_toml(now.dump());
}

}  // namespace cellcal::daemon
