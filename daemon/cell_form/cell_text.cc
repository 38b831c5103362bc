#include "daemon/cell_form/cell_text.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <nlohmann/json.hpp>

#include "calib/files/csv.h"
#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/files/toml.h"
#include "calib/model/units.h"
#include "calib/plan/cell_check.h"

namespace cellcal::daemon {

/// cell.toml.in, compiled in by the build.
extern const std::string_view kCellTemplate;

namespace {

using calib::toml_number;
using calib::toml_string;
using fmt::arg;

std::string triple(const Triple& of) {
  return fmt::format("[{}, {}, {}]", toml_number(of[0]), toml_number(of[1]), toml_number(of[2]));
}

/// Rounded to 0.001 for comments.
double rounded(double value) { return std::round(value * 1e3) / 1e3; }

/// A part of cell.toml.in, from "@NAME" up to the next one, with its {places} filled.
template <typename... Places>
std::string part(std::string_view name, const Places&... places) {
  const std::string_view all = kCellTemplate;
  const std::size_t begin = all.find('\n', all.find(fmt::format("@{}\n", name))) + 1;
  return fmt::vformat(all.substr(begin, all.find("\n@", begin) - begin + 1),
                      fmt::make_format_args(places...));
}

std::string head(const CellForm& form) {
  const std::string text =
      part("head", arg("robot", toml_string(form.robot.reference)),
           arg("floor", form.floor_mm ? "floor_mm = " + toml_number(*form.floor_mm)
                                      : std::string("# floor_mm = 0.0")));
  return form.floor_mm ? text : text + part("no floor");
}

std::string tool_text(const ToolForm& tool) {
  const auto& [x, y, z] = tool.xyz_mm;
  const Triple half{rounded(x / 2.0), rounded(y / 2.0), rounded(z / 2.0)};
  return part(
      "tool", arg("xyz", triple(tool.xyz_mm)), arg("abc", triple(tool.abc_deg)),
      arg("xyz_sigma", tool.xyz_sigma_mm == Triple{}
                           ? "#xyz_sigma_mm = [0, 0, 0]"
                           : "xyz_sigma_mm = " + triple(tool.xyz_sigma_mm)),
      arg("mass",
          tool.mass_kg ? "mass_kg = " + toml_number(*tool.mass_kg) : std::string("#mass_kg = 0.0")),
      arg("com", tool.com_mm ? "com_mm = " + triple(*tool.com_mm) : "#com_mm = " + triple(half)),
      arg("com_words",
          tool.com_mm ? "centre of mass, from the flange" : "centre of mass; half-way to the TCP"),
      arg("length", toml_number(rounded(std::hypot(x, y, z)))),
      arg("tip_radius", toml_number(tool.tip_radius_mm)),
      arg("deflection", tool.mass_kg ? "deflection_sigma = 0.003" : "#deflection_sigma = 0.0"));
}

/// As keys, or named in a comment.
std::string certificate_text(const CertificateForm& of, const std::string& serial,
                             std::string_view comment) {
  std::string text;
  if (!serial.empty()) text += "serial = " + toml_string(serial) + "\n";
  if (!of.number.empty()) text += "certificate = " + toml_string(of.number) + "\n";
  if (!of.date.empty()) text += "certificate_date = " + toml_string(of.date) + "\n";
  return text.empty() ? part(comment) : text;
}

std::string centre_text(const SphereForm& sphere) {
  if (sphere.centre_mm) {
    const auto& [x, y, z] = *sphere.centre_mm;
    return part("centre", arg("centre", triple({rounded(x), rounded(y), rounded(z)})),
                arg("sigma", toml_number(sphere.centre_sigma_mm)));
  }
  if (!sphere.box_mm) return part("no centre");
  const auto& [low, high] = *sphere.box_mm;
  return part("centre in a box", arg("low", triple(low)), arg("high", triple(high)));
}

std::string sphere_text(const SphereForm& sphere) {
  return part("sphere", arg("id", toml_string(sphere.id)),
              arg("diameter", toml_number(sphere.diameter_mm)),
              arg("diameter_sigma", toml_number(sphere.diameter_sigma_mm))) +
         certificate_text(sphere.certificate, sphere.serial, "no certificate of a sphere") +
         centre_text(sphere) +
         part("stand of a sphere",
              arg("diameter", toml_number(rounded(std::min(30.0, sphere.diameter_mm)))));
}

std::string length_text(const LengthForm& length) {
  return part("length", arg("from", toml_string(length.from)), arg("to", toml_string(length.to)),
              arg("mm", toml_number(length.mm)), arg("sigma", toml_number(length.sigma_mm))) +
         certificate_text(length.certificate, "", "no certificate of a length");
}

std::string shape_text(const ObstacleForm& obstacle) {
  const std::string id = toml_string(obstacle.id);
  switch (obstacle.shape) {
    case calib::ObstacleShape::kBox:
      return part("box", arg("id", id), arg("size", triple(obstacle.size_mm.value_or(Triple{}))));
    case calib::ObstacleShape::kCylinder:
      return part("cylinder", arg("id", id),
                  arg("diameter", toml_number(obstacle.diameter_mm.value_or(0.0))),
                  arg("height", toml_number(obstacle.height_mm.value_or(0.0))));
    case calib::ObstacleShape::kMesh: break;
  }
  return part("mesh", arg("id", id), arg("file", toml_string(obstacle.file)));
}

std::string obstacle_text(const ObstacleForm& obstacle) {
  const bool mesh = obstacle.shape == calib::ObstacleShape::kMesh;
  return shape_text(obstacle) + part("place of an obstacle", arg("xyz", triple(obstacle.xyz_mm)),
                                     arg("xyz_words", mesh ? "of the file's frame" : "its middle"),
                                     arg("abc", triple(obstacle.abc_deg)));
}

/// Lines with their ends.
std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = std::min(text.find('\n', at), text.size() - 1) + 1;
    lines.push_back(text.substr(at, end - at));
    at = end;
  }
  return lines;
}

bool sets(const std::string& one, const std::string& key) {
  const std::string_view words = calib::trimmed(one);
  return words.starts_with(key) && calib::trimmed(words.substr(key.size())).starts_with('=');
}

/// The line with another value, and its comment.
std::string with_value(const std::string& old, const std::string& setting) {
  const auto comment = old.find('#');
  const std::string end = old.ends_with("\r\n") ? "\r\n" : "\n";
  if (comment == std::string::npos) return setting + end;
  return fmt::format("{:<37} {}", setting, std::string_view(old).substr(comment));
}

using nlohmann::json;

constexpr std::array<std::string_view, 6> kOfTheTool{"xyz_mm",  "abc_deg",       "xyz_sigma_mm",
                                                     "mass_kg", "tip_radius_mm", "com_mm"};
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

/// Sets the keys that the form does not state itself, and lists them.
template <std::size_t N>
void keep(json& now, const json& before, const std::array<std::string_view, N>& of_the_form,
          const std::string& where, std::vector<std::string>& kept) {
  for (const auto& [key, value] : before.items()) {
    if (has(of_the_form, key) || (now.contains(key) && now[key] == value)) continue;
    now[key] = value;
    kept.push_back(where + "." + key);
  }
}

/// Removes keys that a new file states but that this one leaves at the reader's default.
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

void keep_lengths(json& now, const json& before, std::vector<std::string>& kept) {
  constexpr std::array<std::string_view, 5> kOfALength{"between", "mm", "sigma_mm", "certificate",
                                                       "certificate_date"};
  if (!now.contains("length")) return;
  for (const json& length : before.value("length", json::array()))
    for (json& one : now["length"])
      if (one.at("between") == length.at("between") && one.at("mm") == length.at("mm"))
        keep(one, length, kOfALength, "length", kept);
}

/// Lists the entries of an array of tables by name.
void name_list(const std::string& key, const json& list, std::vector<std::string>& kept) {
  for (const json& one : list)
    kept.push_back(one.is_object() && one.contains("id") ? key + " " + one.value("id", "") : key);
}

json merged(const CellForm& form, const std::string& before_text, std::vector<std::string>& kept) {
  json now = calib::toml_to_json(cell_text(form));
  const json before = calib::toml_to_json(before_text);
  const json touch = before.value("touch", json::object());
  constexpr std::array<std::string_view, 0> kNothing{};
  leave_out(now["tool"], before.at("tool"), kOfTheTool, "tool", kept);
  leave_out(now["touch"], touch, kNothing, "touch", kept);
  keep(now["tool"], before.at("tool"), kOfTheTool, "tool", kept);
  keep_targets(now, before, kept);
  keep_lengths(now, before, kept);
  keep(now["touch"], touch, kNothing, "touch", kept);
  for (const auto& [key, value] : before.items()) {
    if (now.contains(key) || key == "length" || key == "obstacle" || key == "floor_mm") continue;
    now[key] = value;
    if (value.is_array() && !value.empty() && value.front().is_object())
      name_list(key, value, kept);
    else
      kept.push_back(key);
  }
  return now;
}

constexpr std::size_t kMostRows = 1000, kMostBytes = 1u << 20;

int needed(const calib::CsvTable& table, const char* column, const std::string& name) {
  const int found = table.find(column);
  if (found < 0)
    throw calib::FileError(
        name, fmt::format(":{}: column \"{}\" is missing", table.header_line(), column));
  return found;
}

template <typename Row>
auto rows(std::string_view text, const std::string& name, const std::vector<std::string>& known,
          Row row) {
  if (text.size() > kMostBytes) throw calib::FileError(name, ": has more than 1 MB");
  calib::CsvTable table(text, name, fmt::format("{}", fmt::join(known, ",")));
  table.refuse_unknown(known);
  std::vector<decltype(row(table, name))> all;
  while (table.next()) {
    if (all.size() == kMostRows) throw calib::FileError(name, ": more than 1000 rows");
    all.push_back(row(table, name));
    all.back().origin = fmt::format("{}:{}", name, table.line());
  }
  return all;
}

std::optional<Triple> centre(const calib::CsvTable& table, const std::string& name) {
  if (table.find("x_mm") < 0 && table.find("y_mm") < 0 && table.find("z_mm") < 0)
    return std::nullopt;
  Triple xyz{};
  int empty = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const int column = needed(table, std::array{"x_mm", "y_mm", "z_mm"}[i], name);
    if (table.text(column).empty())
      ++empty;
    else
      xyz[i] = table.number(column);
  }
  if (empty == 3) return std::nullopt;
  if (empty > 0) table.fail(table.find("x_mm"), "x_mm, y_mm and z_mm are stated all three or none");
  return xyz;
}

/// Text of the column, if present.
void take(const calib::CsvTable& table, const char* column, std::string& value) {
  if (const int found = table.find(column); found >= 0) value = table.text(found);
}

/// Number of the column, if the column is present and the field is not empty.
void take(const calib::CsvTable& table, const char* column, double& value) {
  if (const int found = table.find(column); found >= 0 && !table.text(found).empty())
    value = table.number(found);
}

template <typename Forms>
Forms of_file(Forms all, const std::string& name) {
  for (auto& one : all) one.origin = name;
  return all;
}

void refuse_micrometres(const calib::CsvTable& table, const char* column, double sigma_mm) {
  if (sigma_mm <= calib::kMostCertifiedSigmaM * calib::kMmPerM) return;
  table.fail(table.find(column),
             fmt::format("{} mm is above any certificate's sigma (mostly 0.0002 to 0.1 mm). In "
                         "micrometres say so in its name: [um] in place of _mm",
                         toml_number(sigma_mm)));
}

}  // namespace

std::string cell_text(const CellForm& form) {
  std::string text = head(form) + tool_text(form.tool);
  if (!form.notes.empty()) text += "\n";
  for (const std::string& note : form.notes) text += "# " + note + "\n";
  for (const SphereForm& sphere : form.spheres) text += sphere_text(sphere);
  for (const LengthForm& length : form.lengths) text += length_text(length);
  if (form.lengths.empty()) text += part("no lengths");
  for (const ObstacleForm& obstacle : form.obstacles) text += obstacle_text(obstacle);
  return text + part("end");
}

std::vector<std::pair<std::string, std::string>> tool_keys(const ToolForm& tool) {
  std::vector<std::pair<std::string, std::string>> keys = {{"xyz_mm", triple(tool.xyz_mm)},
                                                           {"abc_deg", triple(tool.abc_deg)}};
  if (tool.mass_kg) keys.emplace_back("mass_kg", toml_number(*tool.mass_kg));
  if (tool.com_mm) keys.emplace_back("com_mm", triple(*tool.com_mm));
  return keys;
}

std::string with_tool(const std::string& text, const std::string& name, const ToolForm& tool) {
  std::vector<std::string> lines = lines_of(text);
  const auto head = std::ranges::find_if(
      lines, [](const std::string& one) { return calib::trimmed(one).starts_with("[tool]"); });
  if (head == lines.end())
    throw calib::FileError(name,
                           ": no [tool] table, or several tools ([[tool]]). Set the tool by hand");
  auto end = std::find_if(head + 1, lines.end(), [](const std::string& one) {
    return calib::trimmed(one).starts_with('[');
  });
  std::string added;
  for (const auto& [key, value] : tool_keys(tool)) {
    const auto at =
        std::find_if(head + 1, end, [&](const std::string& one) { return sets(one, key); });
    const std::string setting = key + " = " + value;
    if (at == end)
      added += setting + (head->ends_with("\r\n") ? "\r\n" : "\n");
    else if (at->find('[') != std::string::npos && at->find(']') == std::string::npos)
      throw calib::FileError(name, fmt::format(":{}: {} goes over several lines. Put it on one",
                                               at - lines.begin() + 1, key));
    else
      *at = with_value(*at, setting);
  }
  if (!head->ends_with('\n')) *head += "\n";
  *head += added;
  std::string all;
  for (const std::string& one : lines) all += one;
  return all;
}

std::vector<std::string> beyond(const CellForm& form, const std::string& text) {
  std::vector<std::string> kept;
  (void)merged(form, text, kept);
  return kept;
}

std::string cell_text_with(const CellForm& form, const std::string& before) {
  std::vector<std::string> kept;
  const json now = merged(form, before, kept);
  if (kept.empty()) return cell_text(form);
  return "# Written by the form on the page, which keeps what it does not show.\n" +
         calib::json_to_toml(now);
}

std::vector<SphereForm> spheres_in(std::string_view csv, const std::string& file) {
  if (is_xml(csv)) return of_file(spheres_in_dcc(csv, file), file);
  return rows(csv, file,
              {"id", "diameter_mm", "diameter_sigma_mm", "x_mm", "y_mm", "z_mm", "centre_sigma_mm",
               "serial", "certificate", "certificate_date"},
              [](const calib::CsvTable& table, const std::string& name) {
                SphereForm sphere;
                sphere.id = table.text(needed(table, "id", name));
                sphere.diameter_mm = table.number(needed(table, "diameter_mm", name));
                take(table, "diameter_sigma_mm", sphere.diameter_sigma_mm);
                refuse_micrometres(table, "diameter_sigma_mm", sphere.diameter_sigma_mm);
                sphere.centre_mm = centre(table, name);
                take(table, "centre_sigma_mm", sphere.centre_sigma_mm);
                take(table, "serial", sphere.serial);
                take(table, "certificate", sphere.certificate.number);
                take(table, "certificate_date", sphere.certificate.date);
                return sphere;
              });
}

std::vector<LengthForm> certificate_in(std::string_view csv, const std::string& file) {
  if (is_xml(csv)) return of_file(lengths_in_dcc(csv, file), file);
  return rows(csv, file, {"from", "to", "mm", "sigma_mm", "certificate", "certificate_date"},
              [](const calib::CsvTable& table, const std::string& name) {
                LengthForm length;
                length.from = table.text(needed(table, "from", name));
                length.to = table.text(needed(table, "to", name));
                length.mm = table.number(needed(table, "mm", name));
                length.sigma_mm = table.number(needed(table, "sigma_mm", name));
                refuse_micrometres(table, "sigma_mm", length.sigma_mm);
                take(table, "certificate", length.certificate.number);
                take(table, "certificate_date", length.certificate.date);
                return length;
              });
}

std::vector<SphereForm> load_spheres(const std::filesystem::path& csv) {
  return spheres_in(calib::read_file(csv, kMostCertificateBytes), csv.string());
}

std::vector<LengthForm> load_certificate(const std::filesystem::path& csv) {
  return certificate_in(calib::read_file(csv, kMostCertificateBytes), csv.string());
}

}  // namespace cellcal::daemon
