#include "daemon/cell_form/cell_shelf.h"

#include <algorithm>

#include "calib/files/cell_file.h"
#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "calib/files/text.h"
#include "calib/plan/cell_check.h"
#include "daemon/cell_form/cell_form.h"
#include "daemon/cell_form/cell_text.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using Why = CellNotWritten::Why;

constexpr std::size_t kLongestName = 64, kMostFiles = 1000;

bool is_file_name(const std::string& name) {
  const auto fits = [](char c) {
    return ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') || ('0' <= c && c <= '9') || c == '_' ||
           c == '-';
  };
  return !name.empty() && name.size() <= kLongestName && std::ranges::all_of(name, fits);
}

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
  } catch (const std::runtime_error& wrong) {
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
