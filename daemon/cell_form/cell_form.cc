#include "daemon/cell_form/cell_form.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/json_fields.h"
#include "calib/files/robot_file.h"
#include "calib/files/text.h"
#include "calib/files/toml.h"
#include "calib/model/kinematics.h"
#include "calib/model/units.h"
#include "calib/plan/cell_check.h"
#include "daemon/cell_form/cell_text.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

/// Placeholder while there is no sphere: a cell needs at least one. It causes no finding.
const SphereForm kAnySphere{.id = "sphere", .diameter_mm = 50.0};

}  // namespace

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
  refuse_linear_unit(calib::read_robot(calib::TomlTable::parse(found.text, found.name)),
                     "making a cell file by questions", "Write the cell file by hand");
  return found;
}

calib::Cell cell_of(const CellForm& form) {
  return calib::parse_cell({"new cell", cell_text(form), form.robot.name, form.robot.text});
}

std::string objection(const CellForm& form) {
  CellForm whole = form;
  if (whole.spheres.empty()) whole.spheres.push_back(kAnySphere);
  try {
    for (const calib::CellFault& fault : calib::faults_of(cell_of(whole)))
      if (fault.refused) return words(fault);
  } catch (const calib::FileError& error) {
    return error.what();
  }
  return {};
}

Triple tip_mm(const CellForm& form, const std::vector<double>& joint_deg) {
  CellForm arm = form;
  arm.spheres = {kAnySphere};
  arm.lengths.clear();
  const calib::Cell cell = cell_of(arm);
  const auto& joints = cell.robot.joints;
  if (joint_deg.size() != joints.size())
    throw calib::FileError(fmt::format("there must be {} angles, A1 first", joints.size()));
  std::vector<double> joint_rad;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    joint_rad.push_back(joint_deg[i] * calib::kRadPerDeg);
    const bool limited = joints[i].min_rad < joints[i].max_rad;
    if (limited && (joint_rad[i] < joints[i].min_rad || joint_rad[i] > joints[i].max_rad))
      throw calib::FileError(fmt::format(
          "{} at {} deg is beyond its limits, {:.1f} to {:.1f} deg. Type the angles as the pendant shows them",
          joints[i].name, joint_deg[i], joints[i].min_rad * calib::kDegPerRad,
          joints[i].max_rad * calib::kDegPerRad));
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

constexpr std::size_t kMostSpheres = 100, kMostLengths = 1000, kLongestWord = 100;
/// Axes of the arm and external axes.
constexpr std::size_t kMostAxes = 20;

Value<std::string> word() {
  return {[](const std::string& text) { return text; },
          [](const JsonReader& reader) {
            std::string text = reader.text();
            if (text.size() > kLongestWord || calib::has_control(text))
              reader.fail("must have 100 characters at most, on one line");
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

const Table<ToolForm>& tool_fields() {
  using T = ToolForm;
  static const Table<T> kTable{
      field("xyz_mm", &T::xyz_mm, triple()),
      fields::optional(field("abc_deg", &T::abc_deg, triple())),
      fields::optional(field("xyz_sigma_mm", &T::xyz_sigma_mm, triple())),
      fields::maybe("mass_kg", &T::mass_kg, fields::number()),
      fields::optional(field("tip_radius_mm", &T::tip_radius_mm, fields::number()))};
  return kTable;
}

constexpr std::string_view kRobotEnding = ".robot.toml";
constexpr std::size_t kLongestName = 64, kMostFiles = 1000;

bool is_file_name(const std::string& name) {
  const auto fits = [](char c) {
    return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9') || c == '_' ||
           c == '-';
  };
  return !name.empty() && name.size() <= kLongestName && std::ranges::all_of(name, fits);
}

/// True for a regular file of CellFileStore::keep() in this folder.
bool is_kept_robot(const std::filesystem::path& file, const std::filesystem::path& folder) {
  const std::string name = file.filename().string();
  std::error_code none;
  return file == folder / name && name.ends_with(kRobotEnding) &&
         is_file_name(name.substr(0, name.size() - kRobotEnding.size())) &&
         std::filesystem::symlink_status(file, none).type() == std::filesystem::file_type::regular;
}

/// No file is read from a folder named over the network.
NamedRobotFile robot_named(const JsonReader& reader, const std::filesystem::path& cell_file,
                           const CellForm* before) {
  const std::string name = reader.text();
  if (before != nullptr && name == before->robot.reference) return before->robot;
  if (is_kept_robot(name, std::filesystem::absolute(cell_file).parent_path()))
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

void refuse_unknown(const JsonReader& reader, std::initializer_list<const char*> known) {
  for (const auto& [key, value] : reader.object().items())
    if (std::ranges::none_of(known, [&](const char* one) { return key == one; }))
      reader.fail("\"" + calib::shown(key) + "\" is not known here");
}

std::vector<double> joints_of(const JsonReader& reader) {
  const auto items = reader.items();
  if (items.empty() || items.size() > kMostAxes) reader.fail("must hold the angle of each axis");
  std::vector<double> joints;
  for (const JsonReader& one : items) joints.push_back(one.number());
  return joints;
}

}  // namespace

nlohmann::json to_json(const std::vector<SphereForm>& spheres) {
  return few(fields::object(sphere_fields()), kMostSpheres).to(spheres);
}

nlohmann::json to_json(const std::vector<LengthForm>& lengths) {
  return few(fields::object(length_fields()), kMostLengths).to(lengths);
}

nlohmann::json to_json(const CellForm& form) {
  return {{"robot", form.robot.reference},
          {"tool", fields::to_json(tool_fields(), form.tool)},
          {"spheres", to_json(form.spheres)},
          {"lengths", to_json(form.lengths)}};
}

CellForm form_from_json(const nlohmann::json& json, const std::filesystem::path& cell_file,
                        const CellForm* before) {
  const JsonReader reader(json, "form");
  refuse_unknown(reader, {"robot", "tool", "spheres", "lengths"});
  CellForm form;
  form.robot = robot_named(reader.at("robot"), cell_file, before);
  refuse_unknown(reader.at("tool"),
                 {"xyz_mm", "abc_deg", "xyz_sigma_mm", "mass_kg", "tip_radius_mm"});
  fields::from_json(tool_fields(), reader.at("tool"), form.tool);
  const JsonReader spheres = reader.at("spheres");
  form.spheres = few(fields::object(sphere_fields()), kMostSpheres).from(spheres);
  const auto rows = spheres.items();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    refuse_unknown(rows[i],
                   {"id", "diameter_mm", "diameter_sigma_mm", "centre_mm", "centre_sigma_mm",
                    "box_mm", "serial", "certificate", "certificate_date", "joints_deg"});
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
    for (const JsonReader& row : reader.at("lengths").items())
      refuse_unknown(row, {"from", "to", "mm", "sigma_mm", "certificate", "certificate_date"});
  }
  return form;
}

std::optional<CellForm> form_in(const std::string& text, const std::filesystem::path& cell_file) {
  const auto file = nlohmann::json::parse(calib::toml_to_json(text));
  CellForm form;
  try {
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
    const std::string name = cell_file.string();
    form.robot = robot_of(file.at("robot").get<std::string>(), cell_file);
    fields::from_json(tool_fields(), JsonReader(file.at("tool"), name), form.tool);
    form.spheres = few(fields::object(sphere_fields()), kMostSpheres).from({spheres, name});
    form.lengths = few(fields::object(length_fields()), kMostLengths).from({lengths, name});
  } catch (const std::exception&) {  // not written by a form
    return std::nullopt;
  }
  return form;
}

namespace {

using Why = CellNotWritten::Why;

}  // namespace

std::filesystem::path CellFileStore::file(const std::string& name) const {
  if (!is_file_name(name))
    throw CellNotWritten(
        Why::kName, "name: \"" + calib::shown(name) + "\" must have 1 to 64 of A-Z a-z 0-9 _ -");
  return folder_ / (name + ".toml");
}

std::vector<std::string> CellFileStore::names() const {
  std::vector<std::string> names;
  std::error_code none;
  for (std::filesystem::directory_iterator at(folder_, none), end;
       !none && at != end && names.size() < kMostFiles; at.increment(none)) {
    const std::string name = at->path().stem().string();
    if (at->path().extension() == ".toml" && is_file_name(name)) names.push_back(name);
  }
  std::ranges::sort(names);
  return names;
}

std::vector<calib::NamedRobot> CellFileStore::robots() const {
  std::vector<calib::NamedRobot> all;
  std::error_code none;
  for (std::filesystem::directory_iterator at(folder_, none), end;
       !none && at != end && all.size() < kMostFiles; at.increment(none)) {
    if (!is_kept_robot(at->path(), folder_)) continue;
    try {
      all.push_back({at->path().string(), calib::load_robot(at->path())});
    } catch (const calib::FileError&) {  // altered by hand: not offered
    }
  }
  std::ranges::sort(all, {}, &calib::NamedRobot::file);
  return all;
}

std::filesystem::path CellFileStore::keep(const calib::Robot& robot) const {
  const std::string text = calib::robot_to_toml(robot);
  std::string name;
  for (const char c : robot.name) {
    constexpr std::size_t kMost = 40;
    if (name.size() == kMost) break;
    if (std::isalnum(static_cast<unsigned char>(c)) != 0)
      name += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  constexpr std::size_t kDigits = 8;
  const std::filesystem::path file =
      folder_ / fmt::format("{}-{}{}", name.empty() ? "robot" : name,
                            calib::sha256(text).substr(0, kDigits), kRobotEnding);
  calib::read_robot(calib::TomlTable::parse(text, file.string()));
  try {
    std::filesystem::create_directories(folder_);
    write_atomically(file, text);
  } catch (const std::exception& failed) {
    throw CellNotWritten(Why::kStorage, system_words(failed) + ". Let cellcald write there");
  }
  return file;
}

std::optional<CellFileStore::Shown> CellFileStore::look(const std::string& name) const {
  const std::filesystem::path path = file(name);
  std::error_code none;
  if (!std::filesystem::exists(path, none)) return std::nullopt;
  return look_at(path);
}

CellFileStore::Shown CellFileStore::look_at(const std::filesystem::path& path) {
  Shown shown;
  shown.text = calib::read_file(path, calib::kMostTomlBytes);
  shown.sha256 = calib::sha256(shown.text);
  try {
    shown.form = form_in(shown.text, path);
    if (shown.form) shown.kept = beyond(*shown.form, shown.text);
  } catch (const calib::FileError&) {  // a foreign file without valid TOML is not replaced
    shown.form.reset();
  }
  return shown;
}

std::vector<std::string> CellFileStore::look_through(const CellForm& form) {
  if (const std::string wrong = objection(form); !wrong.empty())
    throw CellNotWritten(Why::kUnusable, wrong);
  try {
    return calib::refuse_faulty(cell_of(form));
  } catch (const std::exception& wrong) {
    throw CellNotWritten(Why::kUnusable, wrong.what());
  }
}

std::filesystem::path CellFileStore::write(const std::string& name, const CellForm& form,
                                           const std::string& instead_of,
                                           const std::filesystem::path& from) const {
  const std::filesystem::path path = file(name);
  look_through(form);
  try {
    const auto there = look(name);
    if (there && instead_of.empty())
      throw CellNotWritten(Why::kThere, path.string() +
                                            " exists. Choose another name, or "
                                            "open it first to change it");
    if ((!there && !instead_of.empty()) || (there && there->sha256 != instead_of))
      throw CellNotWritten(Why::kChanged,
                           path.string() + " has changed since it was shown. Open it again");
    if (there && !there->form)
      throw CellNotWritten(
          Why::kMore,
          path.string() + " has several tools, or cannot be read. Change it in an editor");
    std::string text = cell_text(form);
    if (there) text = cell_text_with(form, there->text, folder_);
    if (!there && !from.empty())
      if (const Shown origin = look_at(from); origin.form)
        text = cell_text_with(form, origin.text, from.parent_path());
    calib::parse_cell({path.string(), text, form.robot.name, form.robot.text});
    std::filesystem::create_directories(folder_);
    if (there) write_atomically(path.string() + ".before", there->text);
    write_atomically(path, text);
  } catch (const CellNotWritten&) {
    throw;
  } catch (const std::exception& failed) {
    throw CellNotWritten(Why::kStorage,
                         system_words(failed) +
                             ". Let cellcald write there, or make the file in a terminal: "
                             "'cellcal new-cell -o FILE'");
  }
  return path;
}

}  // namespace cellcal::daemon
