#include "calib/files/cell_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <map>
#include <set>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/model/kinematics.h"

namespace cellcal::calib {

namespace {

constexpr std::string_view kCellFormat = "cellcal.cell/1";
constexpr Range kSigmaMm{0.0, 1e4};
constexpr Range kMassKg{0.0, 1e4};
constexpr std::size_t kMaxTargets = 1000, kMaxLoads = 16;
constexpr const char* kOfATool = "is the id of a tool. Give the target another";

constexpr NumberKey<Tool> kTool[] = {
    {"tip_radius_mm", &Tool::tip_radius_m, kMilli, {0.0, 1e3}, kAlways},
    {"deflection_sigma", &Tool::deflection_sigma, kSi, {0.0, 1e3}, kAlways},
    {"radius_mm", &Tool::radius_m, kMilli, {0.0, 1e3}},
    {"tip_length_mm", &Tool::slim_length_m, kMilli, {0.0, 1e4}},
    {"tip_diameter_mm", &Tool::slim_radius_m, kDiameterMm, {0.0, 1e3}}};

constexpr NumberKey<Target> kSphere[] = {
    {"diameter_mm", &Target::diameter_m, kMilli, {1e-3, 1e5}, kNeeded},
    {"diameter_sigma_mm", &Target::diameter_sigma_m, kMilli, kSigmaMm, kAlways}};
constexpr NumberKey<Target> kNormal[] = {
    {"normal_sigma_deg", &Target::normal_sigma_rad, kDeg, {0.0, 90.0}, kAlways}};
constexpr NumberKey<Target> kCentre[] = {
    {"centre_sigma_mm", &Target::centre_sigma_m, kMilli, kSigmaMm, kAlways}};
constexpr NumberKey<Target> kPlane[] = {{"extent_mm", &Target::extent_m, kMilli, {1.0, 1e4}}};

constexpr NumberKey<CertifiedLength> kLength[] = {
    {"mm", &CertifiedLength::length_m, kMilli, {1e-3, 1e5}, kNeeded},
    {"sigma_mm", &CertifiedLength::sigma_m, kMilli, {1e-6, 1e4}, kNeeded}};

constexpr NumberKey<Cell> kTouch[] = {
    {"sigma_mm", &Cell::touch_sigma_m, kMilli, {1e-9, 1e3}, kNeeded},
    {"radius_offset_sigma_mm", &Cell::radius_offset_sigma_m, kMilli, kSigmaMm, kAlways},
    {"turn_sigma_deg", &Cell::turn_sigma_rad, kDeg, {1e-6, 90.0}},
    {"delay_ms", &Cell::latch_delay_s, kMilli, {-1e3, 1e3}},
    {"delay_sigma_ms", &Cell::latch_delay_sigma_s, kMilli, {0.0, 1e3}}};

Eigen::Vector3d read_place(const TomlTable& t, std::string_view key) {
  return read_vector(t, key, kLengthMm) / kMmPerM;
}

Tool read_tool(const TomlTable& t) {
  Tool tool;
  tool.tcp = read_frame(t);
  const Eigen::Vector3d tcp_m = tool.tcp.translation();
  if (t.has("xyz_sigma_mm")) tool.tcp_sigma_m = read_vector(t, "xyz_sigma_mm", kSigmaMm) / kMmPerM;
  tool.com_m = tcp_m / 2.0;
  read_mass(t, tool.mass_kg, tool.com_m);
  tool.length_m = t.number_or("length_mm", tcp_m.norm() * kMmPerM, {0.0, 1e4}) / kMmPerM;
  read_numbers(t, kTool, tool);
  t.refuse_unknown();
  return tool;
}

void read_normal(const TomlTable& t, Target& target) {
  constexpr double kShortest = 1e-3;
  read_numbers(t, kNormal, target);
  target.has_normal = t.has("normal");
  if (!target.has_normal) {
    if (target.normal_sigma_rad > 0.0)
      t.fail("normal_sigma_deg", "is of a normal that is not stated. Add normal");
    return;
  }
  target.normal = read_vector(t, "normal", kLengthMm);
  if (target.normal.norm() < kShortest)
    t.fail("normal", "is not a direction. Give the one from the plane to the side of the tool");
  target.normal.normalize();
}

void read_extent(const TomlTable& t, Target& target) {
  read_numbers(t, kPlane, target);
  if (target.extent_m > 0.0 && (!target.has_centre || !target.has_normal))
    t.fail("extent_mm", "is of a place that is not stated. Add centre_mm and normal");
}

/// Search box of a sphere whose centre is not stated.
void read_box(const TomlTable& t, Target& target) {
  target.has_box = t.has("search_low_mm") || t.has("search_high_mm");
  if (!target.has_box) return;
  if (target.has_centre)
    t.fail("search_low_mm", "is for a sphere of unknown place. Give either it or centre_mm");
  target.low_m = read_place(t, "search_low_mm");
  target.high_m = read_place(t, "search_high_mm");
  constexpr double kLargestM = 1.0;
  const Eigen::Vector3d size = target.high_m - target.low_m;
  if (!(size.minCoeff() >= 0.0) || size.maxCoeff() > kLargestM)
    t.fail("search_high_mm",
           "must be search_low_mm or above it in every axis, and less than 1 m from it");
}

/// Identifier that rows of touches refer to.
std::string read_id(const TomlTable& t) {
  const std::string id = t.string("id");
  if (id.empty() || id.find_first_of(",\"\r\n#") != std::string::npos)
    t.fail("id", "must not be empty or hold commas, quotes or '#': it is written to a CSV");
  if (id.front() == ' ' || id.back() == ' ')
    t.fail("id", "must not begin or end with a blank: it is written to a CSV");
  if (id == "tool") t.fail("id", "must not be \"tool\": the tool's parameters are named so");
  return id;
}

/// [tool], or one [[tool]] per tool on the flange, each with an id.
void read_tools(const TomlTable& document, Cell& cell) {
  if (!document.is_list("tool")) {
    cell.tool = read_tool(document.table("tool"));
    return;
  }
  const std::vector<TomlTable> tables = document.tables("tool");
  if (tables.empty() || tables.size() > kMaxTools)
    document.fail("tool", fmt::format("a flange carries 1 to {} [[tool]] tables, but there are {}",
                                      kMaxTools, tables.size()));
  std::set<std::string> taken{"touch"};
  for (const Joint& joint : cell.robot.joints) taken.insert(joint.name);
  for (const PositionerAxis& axis : cell.robot.positioner) taken.insert(axis.name);
  for (const TomlTable& table : tables) {
    const std::string id = read_id(table);
    if (!taken.insert(id).second)
      table.fail("id", "\"" + shown(id) +
                           "\" names other parameters: another tool's, a joint's or the touch's");
    Tool tool = read_tool(table);
    tool.id = id;
    if (&table == &tables.front())
      cell.tool = std::move(tool);
    else
      cell.other_tools.push_back(std::move(tool));
  }
}

/// Places of carried targets are in the axis' frame, and only those of spheres are used.
void read_on(const TomlTable& t, const Robot& robot, Target& target) {
  target.carried_by = read_carrier(t, robot);
  if (target.carried_by == 0) return;
  if (target.kind != TargetKind::kSphere)
    t.fail("on", "only spheres may be on a positioner. Put the target on the floor");
  if (!t.has("taught_deg")) return;
  const auto axes = static_cast<std::size_t>(target.carried_by);
  for (const double deg : t.numbers("taught_deg", axes, {-3600.0, 3600.0}))
    target.taught_rad.push_back(deg * kRadPerDeg);
}

Target read_target(const TomlTable& t, const Robot& robot) {
  Target target;
  target.id = read_id(t);
  check_artefact(t);
  target.kind =
      by_own_name<TargetKind>(t.word("kind", {"sphere", "wire", "plane", "point", "tracker"}))
          .value_or(TargetKind::kSphere);
  read_on(t, robot, target);
  if (target.kind == TargetKind::kSphere) read_numbers(t, kSphere, target);
  if (target.kind == TargetKind::kPlane) read_normal(t, target);
  if (target.kind == TargetKind::kTracker) {  // the touches determine its frame
    t.refuse_unknown();
    return target;
  }
  if (t.has("centre_mm")) {
    target.has_centre = true;
    target.centre_m = read_place(t, "centre_mm");
  }
  if (target.kind == TargetKind::kPlane) read_extent(t, target);
  if (target.kind == TargetKind::kSphere) read_box(t, target);
  read_numbers(t, kCentre, target);
  if (has_a_centre(target.kind)) read_stand(t, target);
  t.refuse_unknown();
  return target;
}

std::string mm(const Eigen::Vector3d& m) { return vector_to_toml(m * kMmPerM); }

std::string taught_to_toml(const Target& target) {
  std::vector<std::string> deg;
  for (const double rad : target.taught_rad) deg.push_back(toml_number(rad * kDegPerRad));
  return fmt::format("taught_deg = [{}]\n", fmt::join(deg, ", "));
}

std::string tool_to_toml(const Tool& tool) {
  return fmt::format(
      "\n{}{}xyz_sigma_mm = {}\n{}length_mm = {}\n{}",
      tool.id.empty() ? "[tool]\n" : fmt::format("[[tool]]\nid = {}\n", toml_string(tool.id)),
      frame_to_toml(tool.tcp), mm(tool.tcp_sigma_m), mass_to_toml(tool.mass_kg, tool.com_m),
      toml_number(tool.length_m * kMmPerM), numbers_to_toml(kTool, tool));
}

/// [[load]]: what the tools may hold.
void read_loads(const TomlTable& document, Cell& cell) {
  for (const TomlTable& table : document.tables("load")) {
    if (cell.loads.size() == kMaxLoads)
      document.fail("load", fmt::format("at most {} [[load]] tables", kMaxLoads));
    Load load{read_id(table), table.number("mass_kg", kMassKg), read_place(table, "com_mm")};
    if (std::ranges::find(cell.loads, load.id, &Load::id) != cell.loads.end())
      table.fail("id", "\"" + shown(load.id) + "\" occurs twice");
    table.refuse_unknown();
    cell.loads.push_back(std::move(load));
  }
}

std::string load_to_toml(const Load& load) {
  return fmt::format("\n[[load]]\nid = {}\n", toml_string(load.id)) +
         mass_to_toml(load.mass_kg, load.com_m);
}

/// Longer texts would fill a certificate's page.
constexpr std::size_t kLongest = 200;

void check_name(const TomlTable& table, const char* key) {
  if (table.string_or(key, "").size() > kLongest)
    table.fail(key, "must not be longer than 200 bytes");
}

bool is_day(const std::string& text) {
  if (text.find_first_not_of("0123456789-") != std::string::npos) return false;
  int year = 0;
  unsigned month = 0, day = 0;
  char more = 0;
  constexpr std::string_view kForm = "YYYY-MM-DD";
  if (text.size() != kForm.size() ||
      std::sscanf(text.c_str(), "%4d-%2u-%2u%c", &year, &month, &day, &more) != 3)
    return false;
  return std::chrono::year_month_day(std::chrono::year(year), std::chrono::month(month),
                                     std::chrono::day(day))
      .ok();
}

}  // namespace

std::string number_line(const char* key, double value) {
  return fmt::format("{} = {}\n", key, toml_number(value));
}

Eigen::Vector3d read_vector(const TomlTable& table, std::string_view key, Range range) {
  return Eigen::Vector3d(table.numbers(key, 3, range).data());
}

std::string vector_to_toml(const Eigen::Vector3d& v) {
  return fmt::format("[{}, {}, {}]", toml_number(v.x()), toml_number(v.y()), toml_number(v.z()));
}

Eigen::Isometry3d read_frame(const TomlTable& table, bool needs_place) {
  FrameMmDeg frame;
  if (needs_place || table.has("xyz_mm"))
    std::ranges::copy(read_vector(table, "xyz_mm", kLengthMm), frame.xyz_mm.begin());
  if (table.has("abc_deg"))
    std::ranges::copy(read_vector(table, "abc_deg", kAngleDeg), frame.abc_deg.begin());
  return to_isometry(frame);
}

std::string frame_to_toml(const Eigen::Isometry3d& frame) {
  const FrameMmDeg f = to_frame(frame);
  return fmt::format("xyz_mm = {}\nabc_deg = {}\n",
                     vector_to_toml(Eigen::Vector3d(f.xyz_mm.data())),
                     vector_to_toml(Eigen::Vector3d(f.abc_deg.data())));
}

void read_mass(const TomlTable& table, double& mass_kg, Eigen::Vector3d& com_m) {
  mass_kg = table.number_or("mass_kg", 0.0, kMassKg);
  if (table.has("com_mm")) com_m = read_place(table, "com_mm");
}

std::string mass_to_toml(double mass_kg, const Eigen::Vector3d& com_m) {
  return number_line("mass_kg", mass_kg) + fmt::format("com_mm = {}\n", mm(com_m));
}

Robot load_named_robot(const std::string& name) { return load_robot(find_robot_file(name, {})); }

Cell read_cell(const TomlTable& document, Robot robot) {
  document.word("format", {kCellFormat});
  document.string("robot");
  Cell cell;
  cell.robot = std::move(robot);
  read_tools(document, cell);
  read_loads(document, cell);
  const auto targets = document.tables("target");
  if (targets.empty() || targets.size() > kMaxTargets)
    document.fail(
        "", "a cell needs 1 to 1000 [[target]] tables, but has " + std::to_string(targets.size()));
  std::map<std::string, const char*> taken;
  for (const PositionerAxis& axis : cell.robot.positioner)
    taken[axis.name] = "is an axis of the positioner. Give the target another";
  if (!cell.tool.id.empty()) taken[cell.tool.id] = kOfATool;
  for (const Tool& tool : cell.other_tools) taken[tool.id] = kOfATool;
  for (const TomlTable& table : targets) {
    const Target& target = cell.targets.emplace_back(read_target(table, cell.robot));
    const auto [other, is_new] = taken.try_emplace(target.id, "occurs twice");
    if (!is_new) table.fail("id", "\"" + shown(target.id) + "\" " + other->second);
  }
  for (const TomlTable& table : document.tables("length")) {
    CertifiedLength length;
    const auto between = table.strings("between");
    if (between.size() != 2 || between[0] == between[1])
      table.fail("between", "must name two different targets");
    for (const std::string& id : between)
      if (std::ranges::find(cell.targets, id, &Target::id) == cell.targets.end())
        table.fail("between", "there is no target \"" + shown(id) + "\"");
      else if (!has_a_centre(cell.targets[cell.target_index(id)].kind))
        table.fail("between", "\"" + shown(id) +
                                  "\" has no centre to measure from; a length lies between "
                                  "spheres, wires and points");
    length.from = between[0];
    length.to = between[1];
    if (cell.targets[cell.target_index(length.from)].carried_by !=
        cell.targets[cell.target_index(length.to)].carried_by)
      table.fail("between",
                 "the positioner moves one end against the other. A length lies between "
                 "targets on the same axis, or on the floor");
    read_numbers(table, kLength, length);
    length.is_check = table.has("role") && table.word("role", {"fit", "check"}) == "check";
    check_certificate(table);
    table.refuse_unknown();
    cell.lengths.push_back(length);
  }
  check_identity(document);
  cell.obstacles = read_obstacles(document, cell.robot);
  if (document.has("floor_mm")) cell.floor_m = document.number("floor_mm", kLengthMm) / kMmPerM;
  if (document.has("required_mm"))
    cell.required_m = document.number("required_mm", {1e-3, 1e3}) / kMmPerM;
  const TomlTable touch = document.table("touch");
  read_numbers(touch, kTouch, cell);
  touch.refuse_unknown();
  document.refuse_unknown();
  return cell;
}

CellText read_cell_text(const std::filesystem::path& path) {
  CellText text;
  text.cell_name = path.string();
  text.cell_text = read_file(path, kMostTomlBytes);
  const TomlTable document = TomlTable::parse(text.cell_text, text.cell_name);
  document.word("format", {kCellFormat});
  const std::string name = document.string("robot");
  std::filesystem::path robot;
  try {
    robot = find_robot_file(name, path.parent_path());
  } catch (const FileError& nowhere) {
    document.fail("robot", nowhere.what());
  }
  text.robot_name = robot.string();
  text.robot_text = read_file(robot, kMostTomlBytes);
  return text;
}

Cell parse_cell(const CellText& text) {
  Robot robot = read_robot(TomlTable::parse(text.robot_text, text.robot_name));
  return read_cell(TomlTable::parse(text.cell_text, text.cell_name), std::move(robot));
}

Cell load_cell(const std::filesystem::path& path) {
  Cell cell = parse_cell(read_cell_text(path));
  load_meshes(cell, path.parent_path());
  return cell;
}

std::string cell_to_toml(const Cell& cell, const std::string& robot_reference) {
  std::string out =
      fmt::format("format = \"{}\"\nrobot = {}\n{}{}", kCellFormat, toml_string(robot_reference),
                  cell.floor_m ? number_line("floor_mm", *cell.floor_m * kMmPerM) : "",
                  cell.required_m ? number_line("required_mm", *cell.required_m * kMmPerM) : "");
  out += tool_to_toml(cell.tool);
  for (const Tool& tool : cell.other_tools) out += tool_to_toml(tool);
  for (const Load& load : cell.loads) out += load_to_toml(load);
  for (const Target& target : cell.targets) {
    out += fmt::format("\n[[target]]\nid = {}\nkind = \"{}\"\n", toml_string(target.id),
                       to_string(target.kind));
    if (target.kind == TargetKind::kSphere) out += numbers_to_toml(kSphere, target);
    out += carrier_to_toml(target.carried_by, cell.robot);
    if (!target.taught_rad.empty()) out += taught_to_toml(target);
    if (target.has_normal)
      out += fmt::format("normal = {}\n", vector_to_toml(target.normal)) +
             numbers_to_toml(kNormal, target);
    if (target.kind == TargetKind::kTracker) continue;
    if (target.has_centre) out += fmt::format("centre_mm = {}\n", mm(target.centre_m));
    if (target.has_box)
      out += fmt::format("search_low_mm = {}\nsearch_high_mm = {}\n", mm(target.low_m),
                         mm(target.high_m));
    out += numbers_to_toml(kCentre, target) + numbers_to_toml(kPlane, target);
    if (has_a_centre(target.kind)) out += stand_to_toml(target);
  }
  for (const CertifiedLength& length : cell.lengths)
    out += fmt::format("\n[[length]]\nbetween = [{}, {}]\n{}{}", toml_string(length.from),
                       toml_string(length.to), numbers_to_toml(kLength, length),
                       length.is_check ? "role = \"check\"\n" : "");
  return out + obstacles_to_toml(cell.obstacles, cell.robot) + "\n[touch]\n" +
         numbers_to_toml(kTouch, cell);
}

void check_identity(const TomlTable& document) {
  const TomlTable identity = document.table_or_empty("identity");
  for (const char* key :
       {"site", "operator", "robot_serial", "controller_serial", "sensor", "sensor_serial"})
    check_name(identity, key);
  identity.refuse_unknown();
}

void check_certificate(const TomlTable& artefact) {
  check_name(artefact, "certificate");
  if (!artefact.has("certificate_date")) return;
  if (!is_day(artefact.string("certificate_date")))
    artefact.fail("certificate_date", "must be a day as \"2026-04-01\"");
}

void check_artefact(const TomlTable& target) {
  check_name(target, "serial");
  check_certificate(target);
}

}  // namespace cellcal::calib
