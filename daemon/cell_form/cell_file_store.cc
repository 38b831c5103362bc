#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cctype>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/robot_file.h"
#include "calib/files/text.h"
#include "calib/files/toml.h"
#include "calib/model/units.h"
#include "calib/plan/cell_check.h"
#include "daemon/cell_form/cell_form.h"
#include "daemon/cell_form/cell_text.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using Why = CellNotWritten::Why;

constexpr std::size_t kLongestName = 64, kMostFiles = 1000, kMostMeshes = 50;
constexpr std::size_t kDigits = 8;  ///< of a sum in a name

bool is_file_name(const std::string& name) {
  const auto fits = [](char c) {
    return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9') || c == '_' ||
           c == '-';
  };
  return !name.empty() && name.size() <= kLongestName && std::ranges::all_of(name, fits);
}

std::size_t kept_in(const std::filesystem::path& folder, std::string_view ending) {
  std::size_t count = 0;
  std::error_code none;
  for (std::filesystem::directory_iterator at(folder, none), end; !none && at != end;
       at.increment(none))
    count += is_kept(at->path(), folder, ending) ? 1 : 0;
  return count;
}

/// Throws CellNotWritten (kStorage).
void write_kept(const std::filesystem::path& file, const std::string& content) {
  try {
    std::filesystem::create_directories(file.parent_path());
    write_atomically(file, content);
  } catch (const std::exception& failed) {
    throw CellNotWritten(Why::kStorage, system_words(failed) + ". Let cellcald write there");
  }
}

}  // namespace

bool is_kept(const std::filesystem::path& file, const std::filesystem::path& folder,
             std::string_view ending) {
  const std::string name = file.filename().string();
  std::error_code none;
  return file == folder / name && name.ends_with(ending) &&
         is_file_name(name.substr(0, name.size() - ending.size())) &&
         std::filesystem::symlink_status(file, none).type() == std::filesystem::file_type::regular;
}

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
    if (!is_kept(at->path(), folder_, kRobotEnding)) continue;
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
  const std::filesystem::path file =
      folder_ / fmt::format("{}-{}{}", name.empty() ? "robot" : name,
                            calib::sha256(text).substr(0, kDigits), kRobotEnding);
  calib::read_robot(calib::TomlTable::parse(text, file.string()));
  write_kept(file, text);
  return file;
}

CellFileStore::KeptMesh CellFileStore::keep_mesh(const std::string& bytes,
                                                 const std::string& name) const {
  const calib::Mesh mesh = calib::parse_stl(bytes, name);
  KeptMesh kept{
      .file = folder_ / fmt::format("{}{}", calib::sha256(bytes).substr(0, kDigits), kMeshEnding),
      .triangles = mesh.triangles.size()};
  Eigen::AlignedBox3d around;
  for (const Eigen::Vector3d& vertex : mesh.vertices_m) around.extend(vertex);
  for (Eigen::Index k = 0; k < 3; ++k) {
    kept.low_mm[static_cast<std::size_t>(k)] = around.min()[k] * calib::kMmPerM;
    kept.high_mm[static_cast<std::size_t>(k)] = around.max()[k] * calib::kMmPerM;
  }
  if (!is_kept(kept.file, folder_, kMeshEnding) && kept_in(folder_, kMeshEnding) >= kMostMeshes)
    throw CellNotWritten(Why::kMore, fmt::format("{} holds {} STL files. Remove those that no cell "
                                                 "names, then send it again",
                                                 folder_.string(), kMostMeshes));
  write_kept(kept.file, bytes);
  return kept;
}

std::optional<CellFileStore::Shown> CellFileStore::find(const std::string& name) const {
  const std::filesystem::path path = file(name);
  std::error_code none;
  if (!std::filesystem::exists(path, none)) return std::nullopt;
  return read(path);
}

CellFileStore::Shown CellFileStore::read(const std::filesystem::path& path) {
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

std::vector<calib::Phrase> CellFileStore::validate(const CellForm& form) {
  if (auto wrong = fault_in(form)) throw CellNotWritten(std::move(*wrong));
  try {
    return calib::refuse_faulty(cell_of(form));
  } catch (const std::exception& wrong) {
    throw CellNotWritten(Why::kUnusable, wrong.what());
  }
}

std::filesystem::path CellFileStore::write(const std::string& name, const CellForm& form,
                                           const std::string& instead_of,
                                           const std::string& origin) const {
  const std::filesystem::path path = file(name);
  validate(form);
  try {
    const auto there = find(name);
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
    if (const std::string& before = there ? there->text : origin; !before.empty())
      text = cell_text_with(form, before);
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
