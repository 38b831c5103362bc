#include "daemon/cell_form/cell_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/json_fields.h"
#include "calib/files/robot_file.h"
#include "calib/files/text.h"
#include "calib/files/toml.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "calib/plan/plan.h"
#include "daemon/cell_form/cell_text.h"

namespace cellcal::daemon {

/// Placeholder while there is no sphere: a cell needs at least one. It causes no finding.
const SphereForm kAnySphere{.id = "sphere", .diameter_mm = 50.0};

NamedRobotFile find_robot(const std::string& given, const std::filesystem::path& cell_file) {
  NamedRobotFile found;
  // A name is searched for among the shipped robots, a path relative to the working directory.
  const bool is_path = given.find('/') != std::string::npos || given.ends_with(".toml");
  std::filesystem::path file;
  if (is_path && std::filesystem::is_regular_file(given)) {
    file = std::filesystem::absolute(given).lexically_normal();
    const auto folder = std::filesystem::absolute(cell_file).lexically_normal().parent_path();
    const auto beside = file.lexically_relative(folder);
    found.reference = !beside.empty() && *beside.begin() != ".." ? beside.string() : file.string();
  } else {
    file = calib::find_robot_file(given, {});
    found.reference = given;
  }
  found.name = file.string();
  found.text = calib::read_file(file, calib::kMostTomlBytes);
  refuse_positioner(calib::read_robot(calib::TomlTable::parse(found.text, found.name)),
                    "making a cell file by questions", "Write the cell file by hand");
  return found;
}

calib::Cell cell_of(const CellForm& form) {
  const std::string name = "new cell";
  try {
    calib::Cell cell = calib::parse_cell({name, cell_text(form), form.robot.name, form.robot.text});
    calib::load_meshes(cell, {});  // absolute paths
    return cell;
  } catch (const calib::KeyError& error) {
    if (error.file != name) throw;
    throw calib::KeyError("", "", error.path, error.reason);  // no file has the line
  }
}

calib::Cell sketch_of(const CellForm& form) {
  if (!form.spheres.empty()) return cell_of(form);
  CellForm whole = form;
  whole.spheres = {kAnySphere};
  calib::Cell cell = cell_of(whole);
  cell.targets.clear();
  return cell;
}

SuggestedPlaces suggest_places(const CellForm& form) {
  CellForm nowhere = form;
  for (SphereForm& sphere : nowhere.spheres) {
    sphere.centre_mm.reset();
    sphere.box_mm.reset();
  }
  const calib::SuggestedSpheres found =
      calib::suggest_spheres(cell_of(nowhere), {}, static_cast<int>(form.spheres.size()));
  SuggestedPlaces places{form.spheres, found.plan.predicted_mean_m * calib::kMmPerM,
                         found.plan.predicted_u95_m * calib::kMmPerM};
  for (SphereForm& sphere : places.spheres) {
    const calib::Target& target = found.cell.targets[found.cell.target_index(sphere.id)];
    const Eigen::Vector3d mm = target.centre_m * calib::kMmPerM;
    // Multiples of 10 mm, without the noise of the division.
    sphere.centre_mm = Triple{std::round(mm.x()), std::round(mm.y()), std::round(mm.z())};
    sphere.centre_sigma_mm = target.centre_sigma_m * calib::kMmPerM;
    sphere.box_mm.reset();
  }
  return places;
}

std::optional<FormFault> fault_in(const CellForm& form) {
  CellForm whole = form;
  if (whole.spheres.empty()) whole.spheres.push_back(kAnySphere);
  try {
    for (const calib::CellFault& fault : calib::faults_of(cell_of(whole)))
      if (fault.refused) {
        const std::string wrong = words(phrase(fault));
        return FormFault{wrong, key_of(fault, form), wrong};
      }
  } catch (const calib::KeyError& error) {
    return FormFault{words_at_origin(error, form), form_key(error.path), error.reason};
  } catch (const calib::FileError& error) {
    return FormFault{error.what()};
  }
  return std::nullopt;
}

std::string objection(const CellForm& form) {
  const auto fault = fault_in(form);
  return fault ? fault->words : "";
}

Triple tip_mm(const CellForm& form, const std::vector<double>& joint_deg) {
  CellForm arm = form;
  arm.spheres = {kAnySphere};
  arm.lengths.clear();
  arm.obstacles.clear();
  const calib::Cell cell = cell_of(arm);
  const auto& joints = cell.robot.joints;
  const std::size_t first = cell.robot.first_turning();
  if (joint_deg.size() != joints.size())
    throw calib::FileError(
        first > 0 ? fmt::format("there must be {} angles, A1 first, and behind them {} in mm",
                                joints.size() - first, joints[0].name)
                  : fmt::format("there must be {} angles, A1 first", joints.size()));
  std::vector<double> joint_rad;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    const calib::JointUnit unit = unit_of(joints[i]);
    const double shown = joint_deg[i < first ? joints.size() - first + i : i - first];
    joint_rad.push_back(shown / unit.per_si);
    const bool limited = joints[i].min_rad < joints[i].max_rad;
    if (limited && (joint_rad[i] < joints[i].min_rad || joint_rad[i] > joints[i].max_rad))
      throw calib::FileError(fmt::format(
          "{} at {} {unit} is beyond its limits, {:.1f} to {:.1f} {unit}. Type the angles as the pendant shows them",
          joints[i].name, shown, joints[i].min_rad * unit.per_si, joints[i].max_rad * unit.per_si,
          fmt::arg("unit", unit.name)));
  }
  const Eigen::Vector3d tip =
      calib::ArmModel(cell.robot, cell.tool).nominal_tcp(joint_rad).translation() * calib::kMmPerM;
  return {tip.x(), tip.y(), tip.z()};
}

Triple centre_below(const CellForm& form, const std::vector<double>& joint_deg,
                    double diameter_mm) {
  const Triple tip = tip_mm(form, joint_deg);
  const calib::Robot robot =
      calib::read_robot(calib::TomlTable::parse(form.robot.text, form.robot.name));
  const Eigen::Vector3d down = robot.gravity_m_s2.norm() > 0.0
                                   ? Eigen::Vector3d(robot.gravity_m_s2.normalized())
                                   : Eigen::Vector3d(-Eigen::Vector3d::UnitZ());
  const double depth_mm = diameter_mm / 2.0 + form.tool.tip_radius_mm;
  return {tip[0] + depth_mm * down.x(), tip[1] + depth_mm * down.y(), tip[2] + depth_mm * down.z()};
}

namespace {

namespace fields = calib::fields;
using calib::JsonReader;
using fields::field;
using fields::Json;
using fields::Table;
using fields::Value;

constexpr std::size_t kMostSpheres = 100, kMostLengths = 1000, kMostObstacles = 1000,
                      kLongestWord = 100, kLongestPath = 1000;
/// Axes of the arm and external axes.
constexpr std::size_t kMostAxes = 20;

Value<std::string> word(std::size_t longest = kLongestWord) {
  return {[](const std::string& text) { return text; },
          [=](const JsonReader& reader) {
            std::string text = reader.text();
            if (text.size() > longest || calib::has_control(text))
              reader.fail(fmt::format("must have {} characters at most, on one line", longest));
            return text;
          }};
}

Value<Triple> triple() {
  return {[](const Triple& of) { return Json(of); },
          [](const JsonReader& reader) {
            const auto items = reader.items();
            if (items.size() != 3) reader.fail("must hold three numbers");
            return Triple{items[0].number(), items[1].number(), items[2].number()};
          }};
}

Value<std::array<Triple, 2>> box() {
  return {[](const std::array<Triple, 2>& of) { return Json(of); },
          [](const JsonReader& reader) {
            const auto corners = reader.items();
            if (corners.size() != 2) reader.fail("must hold two corners");
            return std::array{triple().from(corners[0]), triple().from(corners[1])};
          }};
}

template <class V>
Value<std::vector<V>> few(Value<V> one, std::size_t most) {
  const Value<std::vector<V>> all = fields::list(one);
  return {all.to, [=](const JsonReader& reader) {
            if (reader.items().size() > most)
              reader.fail("must have " + std::to_string(most) + " rows at most");
            return all.from(reader);
          }};
}

const Table<CertificateForm>& certificate_fields() {
  using T = CertificateForm;
  static const Table<T> kTable{fields::optional(field("certificate", &T::number, word())),
                               fields::optional(field("certificate_date", &T::date, word()))};
  return kTable;
}

const Table<SphereForm>& sphere_fields() {
  using T = SphereForm;
  static const Table<T> kTable = fields::joined(
      Table<T>{
          field("id", &T::id, word()), field("diameter_mm", &T::diameter_mm, fields::number()),
          fields::optional(field("diameter_sigma_mm", &T::diameter_sigma_mm, fields::number())),
          fields::maybe("centre_mm", &T::centre_mm, triple()),
          fields::optional(field("centre_sigma_mm", &T::centre_sigma_mm, fields::number())),
          fields::maybe("box_mm", &T::box_mm, box()),
          fields::optional(field("serial", &T::serial, word()))},
      fields::of_member(&T::certificate, certificate_fields()));
  return kTable;
}

const Table<LengthForm>& length_fields() {
  using T = LengthForm;
  static const Table<T> kTable =
      fields::joined(Table<T>{field("from", &T::from, word()), field("to", &T::to, word()),
                              field("mm", &T::mm, fields::number()),
                              field("sigma_mm", &T::sigma_mm, fields::number())},
                     fields::of_member(&T::certificate, certificate_fields()));
  return kTable;
}

template <calib::ObstacleShape kShape>
bool is_of(const ObstacleForm& obstacle) {
  return obstacle.shape == kShape;
}

template <class V>
Value<std::optional<V>> stated(Value<V> one) {
  return {[one](const std::optional<V>& of) { return one.to(of.value_or(V{})); },
          [one](const JsonReader& reader) { return std::optional(one.from(reader)); }};
}

const Table<ObstacleForm>& obstacle_fields() {
  using T = ObstacleForm;
  using Shape = calib::ObstacleShape;
  static const Table<T> kTable{
      field("id", &T::id, word()),
      field("shape", &T::shape, fields::named<Shape>()),
      fields::only_of<T>(is_of<Shape::kBox>, field("size_mm", &T::size_mm, stated(triple()))),
      fields::only_of<T>(is_of<Shape::kCylinder>,
                         field("diameter_mm", &T::diameter_mm, stated(fields::number()))),
      fields::only_of<T>(is_of<Shape::kCylinder>,
                         field("height_mm", &T::height_mm, stated(fields::number()))),
      fields::only_of<T>(is_of<Shape::kMesh>, field("file", &T::file, word(kLongestPath))),
      field("xyz_mm", &T::xyz_mm, triple()),
      fields::optional(field("abc_deg", &T::abc_deg, triple()))};
  return kTable;
}

const Table<ToolForm>& tool_fields() {
  using T = ToolForm;
  static const Table<T> kTable{
      field("xyz_mm", &T::xyz_mm, triple()),
      fields::optional(field("abc_deg", &T::abc_deg, triple())),
      fields::optional(field("xyz_sigma_mm", &T::xyz_sigma_mm, triple())),
      fields::maybe("mass_kg", &T::mass_kg, fields::number()),
      fields::maybe("com_mm", &T::com_mm, triple()),
      fields::optional(field("tip_radius_mm", &T::tip_radius_mm, fields::number()))};
  return kTable;
}

/// No file is read from a folder named over the network.
NamedRobotFile robot_named(const JsonReader& reader, const std::filesystem::path& cell_file,
                           const CellForm* before) {
  const std::string name = reader.text();
  if (before != nullptr && name == before->robot.reference) return before->robot;
  if (is_kept(name, std::filesystem::absolute(cell_file).parent_path(), kRobotEnding))
    return find_robot(name, cell_file);
  const auto robots = calib::shipped_robots();
  if (std::ranges::none_of(robots, [&](const auto& one) { return one.file == name; }))
    reader.fail("\"" + calib::shown(name) +
                "\" is not a shipped robot. 'cellcal robots' lists them");
  return find_robot(name, cell_file);
}

/// A shipped robot by its name, a file in the cell's folder by its absolute path: the form may be written to
/// another folder.
NamedRobotFile robot_of(const std::string& reference, const std::filesystem::path& cell_file) {
  const std::filesystem::path folder = std::filesystem::absolute(cell_file).parent_path();
  const std::filesystem::path file = calib::find_robot_file(reference, folder);
  const bool own = std::filesystem::path(reference).is_absolute() || file == folder / reference;
  NamedRobotFile robot = find_robot(own ? file.string() : reference, "/");
  if (own) robot.reference = file.string();
  return robot;
}

void refuse_unknown(const JsonReader& reader, const std::vector<const char*>& known) {
  for (const auto& [key, value] : reader.object().items())
    if (std::ranges::none_of(known, [&](const char* one) { return key == one; }))
      reader.fail("\"" + calib::shown(key) + "\" is not known here");
}

/// All keys of the table, and those that are read otherwise.
template <class T>
void refuse_unknown(const JsonReader& reader, const Table<T>& table,
                    std::vector<const char*> known = {}) {
  for (const auto& row : table) known.push_back(row.key);
  refuse_unknown(reader, known);
}

std::vector<double> joints_of(const JsonReader& reader) {
  const auto items = reader.items();
  if (items.empty() || items.size() > kMostAxes) reader.fail("must hold the angle of each axis");
  std::vector<double> joints;
  for (const JsonReader& one : items) joints.push_back(one.number());
  return joints;
}

/// Their mesh files are stored in the cell file's folder or taken from the previous form.
std::vector<ObstacleForm> obstacles_in(const JsonReader& reader,
                                       const std::filesystem::path& cell_file,
                                       const CellForm* before) {
  std::vector<ObstacleForm> all =
      few(fields::object(obstacle_fields()), kMostObstacles).from(reader);
  const auto rows = reader.items();
  const std::filesystem::path folder = std::filesystem::absolute(cell_file).parent_path();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    refuse_unknown(rows[i], obstacle_fields());
    const std::string& file = all[i].file;
    const auto is_that = [&](const ObstacleForm& one) { return one.file == file; };
    const bool was_there = before != nullptr && std::ranges::any_of(before->obstacles, is_that);
    if (all[i].shape == calib::ObstacleShape::kMesh && !was_there &&
        !is_kept(file, folder, kMeshEnding))
      rows[i].at("file").fail("\"" + calib::shown(file) +
                              "\" is no STL file that was sent here. Choose the file again");
  }
  return all;
}

/// All but the robot; files of meshes as they are named. Throws what the conversion throws.
CellForm content_of(const nlohmann::json& file, const std::string& name) {
  CellForm form;
  nlohmann::json spheres = nlohmann::json::array(), lengths = nlohmann::json::array();
  for (nlohmann::json target : file.value("target", nlohmann::json::array())) {
    if (target.value("kind", "") != "sphere") continue;  // cell_text.h
    // Defaults of the file reader, which differ from those of a new form.
    target.emplace("diameter_sigma_mm", 0.0);
    if (target.contains("centre_mm")) target.emplace("centre_sigma_mm", 0.0);
    if (target.contains("search_low_mm"))
      target["box_mm"] = {target.at("search_low_mm"), target.at("search_high_mm")};
    spheres.push_back(std::move(target));
  }
  for (nlohmann::json length : file.value("length", nlohmann::json::array())) {
    length["from"] = length.at("between").at(0);
    length["to"] = length.at("between").at(1);
    lengths.push_back(std::move(length));
  }
  fields::from_json(tool_fields(), JsonReader(file.at("tool"), name), form.tool);
  form.spheres = few(fields::object(sphere_fields()), kMostSpheres).from({spheres, name});
  form.lengths = few(fields::object(length_fields()), kMostLengths).from({lengths, name});
  const nlohmann::json obstacles = file.value("obstacle", nlohmann::json::array());
  form.obstacles = few(fields::object(obstacle_fields()), kMostObstacles).from({obstacles, name});
  if (file.contains("floor_mm")) form.floor_mm = file.at("floor_mm").get<double>();
  return form;
}

}  // namespace

nlohmann::json to_json(const std::vector<SphereForm>& spheres) {
  return few(fields::object(sphere_fields()), kMostSpheres).to(spheres);
}

nlohmann::json to_json(const std::vector<LengthForm>& lengths) {
  return few(fields::object(length_fields()), kMostLengths).to(lengths);
}

nlohmann::json to_json(const CellForm& form) {
  nlohmann::json json{
      {"robot", form.robot.reference},
      {"tool", fields::to_json(tool_fields(), form.tool)},
      {"spheres", to_json(form.spheres)},
      {"lengths", to_json(form.lengths)},
      {"obstacles", few(fields::object(obstacle_fields()), kMostObstacles).to(form.obstacles)}};
  if (form.floor_mm) json["floor_mm"] = *form.floor_mm;
  return json;
}

CellForm form_from_json(const nlohmann::json& json, const std::filesystem::path& cell_file,
                        const CellForm* before) {
  const JsonReader reader(json, "form");
  refuse_unknown(reader, {"robot", "tool", "spheres", "lengths", "obstacles", "floor_mm"});
  CellForm form;
  form.robot = robot_named(reader.at("robot"), cell_file, before);
  refuse_unknown(reader.at("tool"), tool_fields());
  fields::from_json(tool_fields(), reader.at("tool"), form.tool);
  const JsonReader spheres = reader.at("spheres");
  form.spheres = few(fields::object(sphere_fields()), kMostSpheres).from(spheres);
  const auto rows = spheres.items();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    refuse_unknown(rows[i], sphere_fields(), {"joints_deg"});
    if (!rows[i].has("joints_deg")) continue;
    if (form.spheres[i].centre_mm) rows[i].fail("has both centre_mm and joints_deg: give one");
    const JsonReader taught = rows[i].at("joints_deg");
    try {
      form.spheres[i].centre_mm =
          centre_below(form, joints_of(taught), form.spheres[i].diameter_mm);
    } catch (const calib::FileError& wrong) {
      taught.fail(wrong.what());
    }
  }
  if (reader.has("lengths")) {
    form.lengths = few(fields::object(length_fields()), kMostLengths).from(reader.at("lengths"));
    for (const JsonReader& row : reader.at("lengths").items()) refuse_unknown(row, length_fields());
  }
  if (reader.has("obstacles"))
    form.obstacles = obstacles_in(reader.at("obstacles"), cell_file, before);
  if (reader.has("floor_mm")) form.floor_mm = reader.at("floor_mm").number();
  return form;
}

std::optional<CellForm> form_in(const std::string& text, const std::filesystem::path& cell_file) {
  const auto file = calib::toml_to_json(text);
  try {
    CellForm form = content_of(file, cell_file.string());
    form.robot = robot_of(file.at("robot").get<std::string>(), cell_file);
    const std::filesystem::path folder = std::filesystem::absolute(cell_file).parent_path();
    for (ObstacleForm& one : form.obstacles)
      if (!one.file.empty()) one.file = (folder / one.file).string();
    return form;
  } catch (const std::exception&) {  // not written by a form
    return std::nullopt;
  }
}

UploadedCell uploaded_cell(const std::string& text, const std::string& name) {
  const calib::TomlTable document = calib::TomlTable::parse(text, name);
  const auto file = calib::toml_to_json(text);
  if (file.contains("tool") && file["tool"].is_array())
    document.fail("tool", "several tools ([[tool]]); the form has one. Make it [tool]");
  const std::string robot = document.string("robot");
  const auto shipped = calib::shipped_robots();
  const auto found = std::ranges::find(shipped, robot, &calib::NamedRobot::file);
  UploadedCell uploaded;
  if (found != shipped.end())
    uploaded.form.robot = find_robot(robot, "/");
  else
    uploaded.missing.push_back(robot);
  // Line and key of what is wrong are the reader's, which needs an arm of some kind.
  const NamedRobotFile any = found != shipped.end() ? uploaded.form.robot
                             : !shipped.empty()     ? find_robot(shipped.front().file, "/")
                                                    : NamedRobotFile{};
  calib::parse_cell({name, text, any.name, any.text});
  const NamedRobotFile own = uploaded.form.robot;
  uploaded.form = content_of(file, name);
  uploaded.form.robot = own;
  uploaded.kept = beyond(uploaded.form, text);
  for (ObstacleForm& one : uploaded.form.obstacles)
    if (!one.file.empty()) uploaded.missing.push_back(std::exchange(one.file, {}));
  return uploaded;
}

}  // namespace cellcal::daemon
