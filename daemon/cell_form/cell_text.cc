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

namespace {

using calib::toml_number;
using calib::toml_string;

std::string triple(const Triple& of) {
  return fmt::format("[{}, {}, {}]", toml_number(of[0]), toml_number(of[1]), toml_number(of[2]));
}

/// Rounded to 0.001 for comments.
double rounded(double value) { return std::round(value * 1e3) / 1e3; }

std::string line(const std::string& setting, const std::string& words) {
  return fmt::format("{:<37} # {}\n", setting, words);
}

std::string head(const CellForm& form) {
  std::string text =
      "# A cell: arm, tool, artefacts, surroundings. Millimetres and degrees, in the robot's base\n"
      "# frame. A line that begins with \"#\" and a key shows that key with its default: take the \"#\" away\n"
      "# to change it. Contradictions are found by 'cellcal doctor --cell FILE' and by 'cellcal plan\n"
      "# --cell FILE --touches 50 --picture cell.svg', which draws it.\n"
      "format = \"cellcal.cell/1\"\n";
  text += line("robot = " + toml_string(form.robot.reference),
               "a shipped one by name, or a file in this folder");
  text += line("#required_mm = 2.0", "largest mean error that a calibration may be published with");
  const char* const kFloor = "height of floor or table top against gravity, from the robot's foot";
  if (form.floor_mm) return text + line("floor_mm = " + toml_number(*form.floor_mm), kFloor);
  return text + line("# floor_mm = 0.0", kFloor) +
         "# Without floor_mm the axis of the hand stays at most 100 mm below the lowest target; tool and the\n"
         "# rest of the arm are not limited.\n";
}

std::string tool_text(const ToolForm& tool) {
  const Triple& xyz = tool.xyz_mm;
  const Triple half{xyz[0] / 2.0, xyz[1] / 2.0, xyz[2] / 2.0};
  std::string text =
      "\n[tool]\n# Its tip, seen from the flange. Several tips on one flange: [[tool]] in place of "
      "[tool], each with\n# its id = \"torch\"; touched is with the first.\n";
  text += line("xyz_mm = " + triple(xyz), "flange to TCP, TOOL_DATA X Y Z");
  text += line("abc_deg = " + triple(tool.abc_deg), "TOOL_DATA A B C; the tool points along its z");
  text += line(tool.xyz_sigma_mm == Triple{} ? "#xyz_sigma_mm = [0, 0, 0]"
                                             : "xyz_sigma_mm = " + triple(tool.xyz_sigma_mm),
               "1 sigma; above 0: the TCP is estimated, too");
  text += line(tool.mass_kg ? "mass_kg = " + toml_number(*tool.mass_kg) : "#mass_kg = 0.0",
               "of all that is on the flange; 0: its bending is not estimated");
  text += tool.com_mm
              ? line("com_mm = " + triple(*tool.com_mm), "centre of mass, from the flange")
              : line("#com_mm = " + triple({rounded(half[0]), rounded(half[1]), rounded(half[2])}),
                     "centre of mass; half-way to the TCP");
  text += line("#length_mm = " + toml_number(rounded(std::hypot(xyz[0], xyz[1], xyz[2]))),
               "of the cantilever that bends; |xyz_mm|");
  text += line("tip_radius_mm = " + toml_number(tool.tip_radius_mm),
               "0: a point, as a welding wire; else of its ball");
  text += tool.mass_kg
              ? line("deflection_sigma = 0.003", "1/(N m^2): how soft the tool may be; 0: stiff")
              : line("#deflection_sigma = 0.0", "1/(N m^2): how soft the tool may be; 0: stiff");
  text += line("#radius_mm = 30.0", "of the shaft: kept clear of everything");
  text += line("#tip_length_mm = 60.0", "of the slim end up to the TCP");
  text += line("#tip_diameter_mm = 8.0", "of that end");
  return text;
}

/// As keys, or named in a comment.
std::string certificate_text(const CertificateForm& of, const std::string& serial,
                             const char* comment) {
  std::string text;
  if (!serial.empty()) text += "serial = " + toml_string(serial) + "\n";
  if (!of.number.empty()) text += "certificate = " + toml_string(of.number) + "\n";
  if (!of.date.empty()) text += "certificate_date = " + toml_string(of.date) + "\n";
  return text.empty() ? comment : text;
}

std::string centre_text(const SphereForm& sphere) {
  if (!sphere.centre_mm && sphere.box_mm)
    return line("search_low_mm = " + triple((*sphere.box_mm)[0]), "its centre lies in this box") +
           line("search_high_mm = " + triple((*sphere.box_mm)[1]), "'cellcal find' finds it") +
           "# Known roughly: centre_mm = [X, Y, Z] and centre_sigma_mm = 10.0 in place of the box.\n";
  if (!sphere.centre_mm)
    return "# centre_mm = [1000.0, 0.0, 300.0]: rough place of the centre. Without it 'cellcal run' finds the sphere "
           "in a box:\n# search_low_mm = [950.0, -50.0, 250.0], search_high_mm = [1050.0, 50.0, 350.0]: two opposite corners.\n" +
           line("#centre_sigma_mm = 0.0", "1 sigma of centre_mm");
  return line("centre_mm = " +
                  triple({rounded((*sphere.centre_mm)[0]), rounded((*sphere.centre_mm)[1]),
                          rounded((*sphere.centre_mm)[2])}),
              "roughly: the touches find it") +
         line("centre_sigma_mm = " + toml_number(sphere.centre_sigma_mm), "1 sigma of that") +
         "# Not known at all: search_low_mm = [X, Y, Z] and search_high_mm = [X, Y, Z], corners of a box, in place of\n"
         "# centre_mm.\n";
}

std::string sphere_text(const SphereForm& sphere) {
  std::string text = "\n[[target]]\n";
  text += line("id = " + toml_string(sphere.id), "its name in the touches and in the report");
  text += line("kind = \"sphere\"", "or plane, point, wire, tracker: end of this file");
  text += line("diameter_mm = " + toml_number(sphere.diameter_mm), "as certified");
  text += line("diameter_sigma_mm = " + toml_number(sphere.diameter_sigma_mm), "1 sigma of that");
  text += certificate_text(
      sphere.certificate, sphere.serial,
      "# serial = \"\", certificate = \"\", certificate_date = \"2026-04-01\": what 'cellcal certificate' prints of it.\n");
  text += centre_text(sphere);
  text += line("#on = \"floor\"", "or the positioner's axis that carries it: \"E2\"");
  text += line("#stand = \"post\"", "below it; \"none\": nothing");
  text += line("#stand_diameter_mm = " + toml_number(rounded(std::min(30.0, sphere.diameter_mm))),
               "of the post");
  text +=
      line("#stand_height_mm = 250.0", "from the sphere down; to the floor where floor_mm is set");
  return text;
}

std::string length_text(const LengthForm& length) {
  return fmt::format(
      "\n[[length]]\nbetween = [{}, {}]\n{}{}{}", toml_string(length.from), toml_string(length.to),
      line("mm = " + toml_number(length.mm), "between the centres, as certified"),
      line("sigma_mm = " + toml_number(length.sigma_mm),
           "1 sigma; a certificate's U is mostly 2 sigma") +
          line("#role = \"fit\"", "\"check\": compared with the result, never fitted"),
      certificate_text(
          length.certificate, "",
          "# certificate = \"\", certificate_date = \"2026-04-01\": as printed by 'cellcal certificate'.\n"));
}

std::string obstacle_text(const ObstacleForm& obstacle) {
  std::string text = "\n[[obstacle]]\nid = " + toml_string(obstacle.id) + "\n";
  switch (obstacle.shape) {
    case calib::ObstacleShape::kBox:
      text += "shape = \"box\"\nsize_mm = " + triple(obstacle.size_mm.value_or(Triple{})) + "\n";
      break;
    case calib::ObstacleShape::kCylinder:
      text +=
          "shape = \"cylinder\"\ndiameter_mm = " + toml_number(obstacle.diameter_mm.value_or(0.0)) +
          "\n" +
          line("height_mm = " + toml_number(obstacle.height_mm.value_or(0.0)), "along its z");
      break;
    case calib::ObstacleShape::kMesh:
      text += "shape = \"mesh\"\n" + line("file = " + toml_string(obstacle.file), "STL, in mm");
      break;
  }
  const bool mesh = obstacle.shape == calib::ObstacleShape::kMesh;
  return text +
         line("xyz_mm = " + triple(obstacle.xyz_mm), mesh ? "of the file's frame" : "its middle") +
         line("abc_deg = " + triple(obstacle.abc_deg), "R = Rz(A) Ry(B) Rx(C)");
}

/// Example for a cell without certified lengths, which determine the scale of the arm.
constexpr const char* kNoLengths = R"(
# Certified distances of two centres, from a coordinate measuring machine. Without one the scale of
# the arm is not determined, and a calibration holds near the targets only.
#[[length]]
#between = ["S1", "S2"]
#mm = 500.0
#sigma_mm = 0.005
#role = "fit"                         # "check": compared with the result, never fitted
#certificate = ""
#certificate_date = "2026-04-01"
)";

constexpr const char* kRest = R"(
# Who and what was there, for 'cellcal certificate':
#[identity]
#site = "Hall 3, cell 12"
#operator = "A. Name"
#robot_serial = "123456"
#controller_serial = "654321"
#sensor = "cellcal contact board"
#sensor_serial = "7"

# What the tool may hold; touches name it in their column "load", 'cellcal predict' by --load:
#[[load]]
#id = "full"
#mass_kg = 8.0
#com_mm = [0.0, 0.0, 150.0]           # from the flange, as LOAD_DATA

# What must not be hit, besides targets, stands and floor: [[obstacle]]. Everything that is not here can be hit.
# Examples:
#[[obstacle]]
#id = "table"
#shape = "box"
#size_mm = [800.0, 600.0, 20.0]
#xyz_mm = [1000.0, 0.0, 90.0]         # its middle
#abc_deg = [0, 0, 0]
#on = "floor"                         # or the positioner's axis that carries it
#[[obstacle]]
#id = "pillar"
#shape = "cylinder"
#diameter_mm = 120.0
#height_mm = 1500.0                   # along its z
#xyz_mm = [0.0, 1200.0, 750.0]
#[[obstacle]]
#id = "fixture"
#shape = "mesh"
#file = "fixture.stl"                 # in mm, in this folder
#xyz_mm = [1000.0, 0.0, 100.0]        # of its frame

# Other targets. Examples:
#[[target]]
#id = "plate"
#kind = "plane"
#centre_mm = [1200.0, 0.0, 300.0]     # a point on it
#centre_sigma_mm = 5.0                # along its normal
#normal = [0, 0, 1]                   # to the side of the tool
#normal_sigma_deg = 1.0
#extent_mm = 200.0                    # touched inside this circle; without it not at all
#[[target]]
#id = "socket"
#kind = "point"                       # the tip is seated in it by hand
#centre_mm = [1100.0, 300.0, 300.0]
#[[target]]
#id = "encoder"
#kind = "wire"                        # a draw-wire encoder; its lengths come with the touches
#centre_mm = [1500.0, 0.0, 500.0]
#[[target]]
#id = "tracker"
#kind = "tracker"                     # its frame is found
)";

constexpr const char* kTouch = R"(
# One touch. 'cellcal qualify' measures all of these in two minutes.
[touch]
)";

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
  if (form.lengths.empty()) text += kNoLengths;
  for (const ObstacleForm& obstacle : form.obstacles) text += obstacle_text(obstacle);
  text += kTouch;
  text += line("sigma_mm = 0.03", "1 sigma of one touch");
  text += line("radius_offset_sigma_mm = 0.3", "1 sigma of the offset of the effective radius");
  text += line("#delay_ms = 0.0", "contact to latched angles");
  text += line("#delay_sigma_ms = 0.2", "1 sigma of it; with [eki] stop = \"flag\" 5");
  text += "# turn_sigma_deg = 0.01: 1 sigma of a tracker's turns, where there is one.\n";
  return text + kRest;
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
