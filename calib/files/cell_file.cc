#include "calib/files/cell_file.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <set>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/files/toml.h"
#include "calib/model/kinematics.h"
#include "calib/model/robot.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

constexpr std::string_view kCellFormat = "cellcal.cell/1";
constexpr Range kLengthMm{-1e5, 1e5};
constexpr Range kSigmaMm{0.0, 1e4};
constexpr std::size_t kMaxTargets = 1000, kMaxLoads = 16;

Eigen::Vector3d vector_m(const std::vector<double>& mm) {
  return Eigen::Vector3d(mm[0], mm[1], mm[2]) / kMmPerM;
}

Tool read_tool(const TomlTable& t) {
  Tool tool;
  FrameMmDeg frame;
  const auto xyz = t.numbers("xyz_mm", 3, kLengthMm);
  const auto abc = t.numbers_or("abc_deg", {0, 0, 0}, {-3600.0, 3600.0});
  std::copy(xyz.begin(), xyz.end(), frame.xyz_mm.begin());
  std::copy(abc.begin(), abc.end(), frame.abc_deg.begin());
  tool.tcp = to_isometry(frame);
  tool.tcp_sigma_m = vector_m(t.numbers_or("xyz_sigma_mm", {0, 0, 0}, kSigmaMm));
  tool.mass_kg = t.number_or("mass_kg", 0.0, {0.0, 1e4});
  const std::vector<double> half = {xyz[0] / 2, xyz[1] / 2, xyz[2] / 2};
  tool.com_m = vector_m(t.numbers_or("com_mm", half, kLengthMm));
  tool.length_m = t.number_or("length_mm", vector_m(xyz).norm() * kMmPerM, {0.0, 1e4}) / kMmPerM;
  tool.tip_radius_m = t.number_or("tip_radius_mm", 0.0, {0.0, 1e3}) / kMmPerM;
  tool.deflection_sigma = t.number_or("deflection_sigma", 0.0, {0.0, 1e3});
  const Tool usual;
  tool.radius_m = t.number_or("radius_mm", usual.radius_m * kMmPerM, {0.0, 1e3}) / kMmPerM;
  tool.slim_length_m =
      t.number_or("tip_length_mm", usual.slim_length_m * kMmPerM, {0.0, 1e4}) / kMmPerM;
  tool.slim_radius_m =
      t.number_or("tip_diameter_mm", 2.0 * usual.slim_radius_m * kMmPerM, {0.0, 1e3}) / 2.0 /
      kMmPerM;
  t.refuse_unknown();
  return tool;
}

void read_normal(const TomlTable& t, Target& target) {
  constexpr double kShortest = 1e-3;
  target.normal_sigma_rad = t.number_or("normal_sigma_deg", 0.0, {0.0, 90.0}) * kRadPerDeg;
  target.has_normal = t.has("normal");
  if (!target.has_normal) {
    if (target.normal_sigma_rad > 0.0)
      t.fail("normal_sigma_deg", "is of a normal that is not stated. Add normal");
    return;
  }
  const auto n = t.numbers("normal", 3, kLengthMm);
  target.normal = Eigen::Vector3d(n[0], n[1], n[2]);
  if (target.normal.norm() < kShortest)
    t.fail("normal", "is not a direction. Give the one from the plane to the side of the tool");
  target.normal.normalize();
}

void read_extent(const TomlTable& t, Target& target) {
  if (!t.has("extent_mm")) return;
  target.extent_m = t.number("extent_mm", {1.0, 1e4}) / kMmPerM;
  if (!target.has_centre || !target.has_normal)
    t.fail("extent_mm", "is of a place that is not stated. Add centre_mm and normal");
}

/// Search box of a sphere whose centre is not stated.
void read_box(const TomlTable& t, Target& target) {
  target.has_box = t.has("search_low_mm") || t.has("search_high_mm");
  if (!target.has_box) return;
  if (target.has_centre)
    t.fail("search_low_mm", "is for a sphere of unknown place. Give either it or centre_mm");
  target.low_m = vector_m(t.numbers("search_low_mm", 3, kLengthMm));
  target.high_m = vector_m(t.numbers("search_high_mm", 3, kLengthMm));
  constexpr double kLargestM = 1.0;
  const Eigen::Vector3d size = target.high_m - target.low_m;
  if (!(size.minCoeff() >= 0.0) || size.maxCoeff() > kLargestM)
    t.fail("search_high_mm",
           "must be search_low_mm or above it in every axis, and less than 1 m from it");
}

/// Identifier that rows of touches refer to.
std::string read_id(const TomlTable& t) {
  const std::string id = t.string("id");
  if (id.empty() || id.find_first_of(",\"\r\n#") != std::string::npos || id.front() == ' ' ||
      id.back() == ' ')
    t.fail("id", "must not be empty or hold commas, quotes or '#': it is written to a CSV");
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
  target.kind = target_kind(t.word("kind", {"sphere", "wire", "plane", "point", "tracker"}))
                    .value_or(TargetKind::kSphere);
  read_on(t, robot, target);
  if (target.kind == TargetKind::kSphere) {
    target.diameter_m = t.number("diameter_mm", {1e-3, 1e5}) / kMmPerM;
    target.diameter_sigma_m = t.number_or("diameter_sigma_mm", 0.0, kSigmaMm) / kMmPerM;
  }
  if (target.kind == TargetKind::kPlane) read_normal(t, target);
  if (target.kind == TargetKind::kTracker) {  // the touches determine its frame
    t.refuse_unknown();
    return target;
  }
  if (t.has("centre_mm")) {
    target.has_centre = true;
    target.centre_m = vector_m(t.numbers("centre_mm", 3, kLengthMm));
  }
  if (target.kind == TargetKind::kPlane) read_extent(t, target);
  if (target.kind == TargetKind::kSphere) read_box(t, target);
  target.centre_sigma_m = t.number_or("centre_sigma_mm", 0.0, kSigmaMm) / kMmPerM;
  if (has_a_centre(target.kind)) read_stand(t, target);
  t.refuse_unknown();
  return target;
}

std::string vec_mm(const Eigen::Vector3d& v) {
  return fmt::format("[{}, {}, {}]", toml_number(v.x() * kMmPerM), toml_number(v.y() * kMmPerM),
                     toml_number(v.z() * kMmPerM));
}

std::string taught_to_toml(const Target& target) {
  std::vector<std::string> deg;
  for (const double rad : target.taught_rad) deg.push_back(toml_number(rad * kDegPerRad));
  return fmt::format("taught_deg = [{}]\n", fmt::join(deg, ", "));
}

/// Keys of a tool's body that differ from the defaults.
std::string body_of(const Tool& tool) {
  const Tool usual;
  std::string out;
  const auto add = [&](const char* key, double value, double default_value, double unit) {
    if (value != default_value) out += fmt::format("{} = {}\n", key, toml_number(value * unit));
  };
  add("radius_mm", tool.radius_m, usual.radius_m, kMmPerM);
  add("tip_length_mm", tool.slim_length_m, usual.slim_length_m, kMmPerM);
  add("tip_diameter_mm", tool.slim_radius_m, usual.slim_radius_m, 2.0 * kMmPerM);
  return out;
}

std::string tool_to_toml(const Tool& tool) {
  const FrameMmDeg tcp = to_frame(tool.tcp);
  const std::string head =
      tool.id.empty() ? "[tool]\n" : fmt::format("[[tool]]\nid = {}\n", toml_string(tool.id));
  return fmt::format(
      "\n{}xyz_mm = [{}, {}, {}]\nabc_deg = [{}, {}, {}]\n"
      "xyz_sigma_mm = {}\nmass_kg = {}\ncom_mm = {}\nlength_mm = {}\ntip_radius_mm = {}\n"
      "deflection_sigma = {}\n{}",
      head, toml_number(tcp.xyz_mm[0]), toml_number(tcp.xyz_mm[1]), toml_number(tcp.xyz_mm[2]),
      toml_number(tcp.abc_deg[0]), toml_number(tcp.abc_deg[1]), toml_number(tcp.abc_deg[2]),
      vec_mm(tool.tcp_sigma_m), toml_number(tool.mass_kg), vec_mm(tool.com_m),
      toml_number(tool.length_m * kMmPerM), toml_number(tool.tip_radius_m * kMmPerM),
      toml_number(tool.deflection_sigma), body_of(tool));
}

/// Latch delay of [touch]; limited to one second.
void read_delay(const TomlTable& touch, Cell& cell) {
  constexpr Range kDelayMs{-1e3, 1e3}, kDelaySigmaMs{0.0, 1e3};
  if (touch.has("delay_ms")) cell.latch_delay_s = touch.number("delay_ms", kDelayMs) / kMsPerS;
  if (touch.has("delay_sigma_ms"))
    cell.latch_delay_sigma_s = touch.number("delay_sigma_ms", kDelaySigmaMs) / kMsPerS;
}

/// Keys of the latch delay that differ from the defaults.
/// [[load]]: what the tools may hold.
void read_loads(const TomlTable& document, Cell& cell) {
  for (const TomlTable& table : document.tables("load")) {
    if (cell.loads.size() == kMaxLoads)
      document.fail("load", fmt::format("at most {} [[load]] tables", kMaxLoads));
    Load load{read_id(table), table.number("mass_kg", {0.0, 1e4}),
              vector_m(table.numbers("com_mm", 3, kLengthMm))};
    if (std::ranges::find(cell.loads, load.id, &Load::id) != cell.loads.end())
      table.fail("id", "\"" + shown(load.id) + "\" occurs twice");
    table.refuse_unknown();
    cell.loads.push_back(std::move(load));
  }
}

std::string load_to_toml(const Load& load) {
  return fmt::format("\n[[load]]\nid = {}\nmass_kg = {}\ncom_mm = {}\n", toml_string(load.id),
                     toml_number(load.mass_kg), vec_mm(load.com_m));
}

std::string delay_to_toml(const Cell& cell) {
  const Cell usual;
  std::string out;
  if (cell.latch_delay_s != usual.latch_delay_s)
    out += fmt::format("delay_ms = {}\n", toml_number(cell.latch_delay_s * kMsPerS));
  if (cell.latch_delay_sigma_s != usual.latch_delay_sigma_s)
    out += fmt::format("delay_sigma_ms = {}\n", toml_number(cell.latch_delay_sigma_s * kMsPerS));
  return out;
}

}  // namespace

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
  std::set<std::string> ids, tools;
  if (!cell.tool.id.empty()) tools.insert(cell.tool.id);
  for (const Tool& tool : cell.other_tools) tools.insert(tool.id);
  for (const TomlTable& table : targets) {
    cell.targets.push_back(read_target(table, cell.robot));
    if (tools.contains(cell.targets.back().id))
      table.fail("id", "\"" + shown(cell.targets.back().id) +
                           "\" is the id of a tool. Give the target another");
    if (std::ranges::find(cell.robot.positioner, cell.targets.back().id, &PositionerAxis::name) !=
        cell.robot.positioner.end())
      table.fail("id", "\"" + shown(cell.targets.back().id) +
                           "\" is an axis of the positioner. Give the target another");
    if (!ids.insert(cell.targets.back().id).second)
      table.fail("id", "\"" + shown(cell.targets.back().id) + "\" occurs twice");
  }
  for (const TomlTable& table : document.tables("length")) {
    CertifiedLength length;
    const auto between = table.strings("between");
    if (between.size() != 2 || between[0] == between[1])
      table.fail("between", "must name two different targets");
    for (const std::string& id : between)
      if (!ids.contains(id))
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
    length.length_m = table.number("mm", {1e-3, 1e5}) / kMmPerM;
    length.sigma_m = table.number("sigma_mm", {1e-6, 1e4}) / kMmPerM;
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
  cell.touch_sigma_m = touch.number("sigma_mm", {1e-9, 1e3}) / kMmPerM;
  cell.radius_offset_sigma_m = touch.number_or("radius_offset_sigma_mm", 0.0, kSigmaMm) / kMmPerM;
  if (touch.has("turn_sigma_deg"))
    cell.turn_sigma_rad = touch.number("turn_sigma_deg", {1e-6, 90.0}) * kRadPerDeg;
  read_delay(touch, cell);
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
  std::string out = fmt::format(
      "format = \"{}\"\nrobot = {}\n{}{}", kCellFormat, toml_string(robot_reference),
      cell.floor_m ? fmt::format("floor_mm = {}\n", toml_number(*cell.floor_m * kMmPerM)) : "",
      cell.required_m ? fmt::format("required_mm = {}\n", toml_number(*cell.required_m * kMmPerM))
                      : "");
  out += tool_to_toml(cell.tool);
  for (const Tool& tool : cell.other_tools) out += tool_to_toml(tool);
  for (const Load& load : cell.loads) out += load_to_toml(load);
  for (const Target& target : cell.targets) {
    out += fmt::format("\n[[target]]\nid = {}\nkind = \"{}\"\n", toml_string(target.id),
                       to_string(target.kind));
    if (target.kind == TargetKind::kSphere)
      out += fmt::format("diameter_mm = {}\ndiameter_sigma_mm = {}\n",
                         toml_number(target.diameter_m * kMmPerM),
                         toml_number(target.diameter_sigma_m * kMmPerM));
    out += carrier_to_toml(target.carried_by, cell.robot);
    if (!target.taught_rad.empty()) out += taught_to_toml(target);
    if (target.has_normal)
      out += fmt::format("normal = [{}, {}, {}]\nnormal_sigma_deg = {}\n",
                         toml_number(target.normal.x()), toml_number(target.normal.y()),
                         toml_number(target.normal.z()),
                         toml_number(target.normal_sigma_rad * kDegPerRad));
    if (target.kind == TargetKind::kTracker) continue;
    if (target.has_centre) out += fmt::format("centre_mm = {}\n", vec_mm(target.centre_m));
    if (target.has_box)
      out += fmt::format("search_low_mm = {}\nsearch_high_mm = {}\n", vec_mm(target.low_m),
                         vec_mm(target.high_m));
    out += fmt::format("centre_sigma_mm = {}\n", toml_number(target.centre_sigma_m * kMmPerM));
    if (target.extent_m > 0.0)
      out += fmt::format("extent_mm = {}\n", toml_number(target.extent_m * kMmPerM));
    if (has_a_centre(target.kind)) out += stand_to_toml(target);
  }
  for (const CertifiedLength& length : cell.lengths)
    out += fmt::format(
        "\n[[length]]\nbetween = [{}, {}]\nmm = {}\nsigma_mm = {}\n{}", toml_string(length.from),
        toml_string(length.to), toml_number(length.length_m * kMmPerM),
        toml_number(length.sigma_m * kMmPerM), length.is_check ? "role = \"check\"\n" : "");
  return out + obstacles_to_toml(cell.obstacles, cell.robot) +
         fmt::format("\n[touch]\nsigma_mm = {}\nradius_offset_sigma_mm = {}\n",
                     toml_number(cell.touch_sigma_m * kMmPerM),
                     toml_number(cell.radius_offset_sigma_m * kMmPerM)) +
         (cell.turn_sigma_rad > 0.0
              ? fmt::format("turn_sigma_deg = {}\n", toml_number(cell.turn_sigma_rad * kDegPerRad))
              : "") +
         delay_to_toml(cell);
}

namespace {

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
  constexpr std::size_t kLength = 10;  // YYYY-MM-DD
  if (text.size() != kLength ||
      std::sscanf(text.c_str(), "%4d-%2u-%2u%c", &year, &month, &day, &more) != 3)
    return false;
  return std::chrono::year_month_day(std::chrono::year(year), std::chrono::month(month),
                                     std::chrono::day(day))
      .ok();
}

}  // namespace

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
