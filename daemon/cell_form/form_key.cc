// Fields of the form for keys of files and faults of cells.

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <map>

#include "calib/files/input_file.h"
#include "calib/model/enum_table.h"
#include "daemon/cell_form/cell_form.h"

namespace cellcal::daemon {

namespace {

/// Table of the cell file or of the form's JSON.
struct Rows {
  const char* name;   ///< in the form
  std::size_t first;  ///< number of its first row in the path
};

const Rows* rows_named(std::string_view name) {
  static const std::map<std::string_view, Rows> kRows{
      {"target", {"spheres", 1}},  {"length", {"lengths", 1}},  {"obstacle", {"obstacles", 1}},
      {"spheres", {"spheres", 0}}, {"lengths", {"lengths", 0}}, {"obstacles", {"obstacles", 0}}};
  const auto found = kRows.find(name);
  return found == kRows.end() ? nullptr : &found->second;
}

std::string field_named(std::string_view key) {
  static const std::map<std::string_view, std::string_view> kFields{
      {"search_low_mm", "box_mm"}, {"search_high_mm", "box_mm"}, {"between", "from"}};
  const auto found = kFields.find(key);
  return std::string(found == kFields.end() ? key : found->second);
}

enum class Place { kNone, kSphere, kLength, kTool, kObstacle };

struct FaultyField {
  Place place = Place::kNone;
  const char* field = "";
};

FaultyField field_of(calib::CellFaultKind kind) {
  using enum calib::CellFaultKind;
  static constexpr EnumTable<calib::CellFaultKind, FaultyField> kTable{
      {{kLength, {Place::kLength, "mm"}},
       {kSurfaces, {Place::kLength, "mm"}},
       {kDecimalPoint, {Place::kLength, "mm"}},
       {kCentresExchanged, {Place::kSphere, "centre_mm"}},
       {kCentre, {Place::kSphere, "centre_mm"}},
       {kLengthTooShort, {Place::kLength, "mm"}},
       {kTwoLengths, {Place::kLength, "mm"}},
       {kLengthTwice, {Place::kLength, "mm"}},
       {kTriangle, {Place::kLength, "mm"}},
       {kOverlap, {Place::kSphere, "centre_mm"}},
       {kInside, {Place::kSphere, "centre_mm"}},
       {kOutOfReach, {Place::kSphere, "centre_mm"}},
       {kCentreInMetres, {Place::kSphere, "centre_mm"}},
       {kToolInMetres, {Place::kTool, "xyz_mm"}},
       {kDiameterInMetres, {Place::kSphere, "diameter_mm"}},
       {kUnusualDiameter, {Place::kSphere, "diameter_mm"}},
       {kRoughCentre, {Place::kSphere, "centre_sigma_mm"}},
       {kMeshInMetres, {Place::kObstacle, "file"}},
       {kTouchSigma, {}},
       {kCertifiedSigma, {Place::kLength, "sigma_mm"}},
       {kToolTooHeavy, {Place::kTool, "mass_kg"}},
       {kInColumn, {Place::kSphere, "centre_mm"}},
       {kLargeBall, {Place::kTool, "tip_radius_mm"}},
       {kShaftTouchesFirst, {Place::kTool, "xyz_mm"}},
       {kShankTouchesFirst, {Place::kTool, "tip_radius_mm"}},
       {kPositionerUnloaded, {}},
       {kToolAcross, {Place::kTool, "xyz_mm"}},
       {kDescription, {}},
       {kGoal, {}},
       {kRequired, {}},
       {kRadiusOffset, {}}}};
  return kTable[kind];
}

std::string in_row(const char* rows, std::ptrdiff_t row, std::ptrdiff_t of, const char* field) {
  return row == of ? "" : std::string(rows) + '.' + std::to_string(row) + '.' + field;
}

std::string in_row_of(const char* name, const auto& rows, const std::string& id,
                      const char* field) {
  const auto found = std::ranges::find_if(rows, [&](const auto& one) { return one.id == id; });
  return in_row(name, found - rows.begin(), std::ssize(rows), field);
}

std::string in_length(const CellForm& form, const std::vector<std::string>& ids,
                      const char* field) {
  const auto joins = [&](const LengthForm& one) {
    return (one.from == ids[0] && one.to == ids[1]) || (one.from == ids[1] && one.to == ids[0]);
  };
  const auto found = std::ranges::find_if(form.lengths, joins);
  return in_row("lengths", found - form.lengths.begin(), std::ssize(form.lengths), field);
}

}  // namespace

std::string form_key(std::string_view path) {
  if (path.starts_with('.')) path.remove_prefix(1);
  const std::size_t open = path.find('['), close = path.find(']');
  if (open == std::string_view::npos || path.find('.') < open)
    return std::string(path.substr(0, open));
  if (close == std::string_view::npos || close < open) return {};
  const Rows* rows = rows_named(path.substr(0, open));
  std::size_t row = 0;
  const auto [end, error] = std::from_chars(path.data() + open + 1, path.data() + close, row);
  if (rows == nullptr || error != std::errc() || end != path.data() + close || row < rows->first)
    return {};
  std::string_view field = path.substr(close + 1);
  if (field.starts_with('.')) field.remove_prefix(1);
  field = field.substr(0, field.find_first_of(".["));
  return std::string(rows->name) + '.' + std::to_string(row - rows->first) +
         (field.empty() ? "" : '.' + field_named(field));
}

std::string words_at_origin(const calib::KeyError& error, const CellForm& form) {
  const auto origin_in = [key = form_key(error.path) + '.'](const char* name, const auto& rows) {
    for (std::size_t i = 0; i < rows.size(); ++i)
      if (key.starts_with(fmt::format("{}.{}.", name, i))) return rows[i].origin;
    return std::string();
  };
  const std::string origin =
      origin_in("spheres", form.spheres) + origin_in("lengths", form.lengths);
  if (origin.empty()) return error.what();
  const std::string key = error.path.substr(error.path.rfind('.') + 1);
  return fmt::format("{}: {}: {}", origin, key == "between" ? "from, to" : key, error.reason);
}

std::string key_of(const calib::CellFault& fault, const CellForm& form) {
  const FaultyField field = field_of(fault.kind);
  if (field.place == Place::kTool) return std::string("tool.") + field.field;
  if (field.place == Place::kNone || fault.ids.empty()) return {};
  if (field.place == Place::kSphere)
    return in_row_of("spheres", form.spheres, fault.ids[0], field.field);
  if (field.place == Place::kObstacle)
    return in_row_of("obstacles", form.obstacles, fault.ids[0], field.field);
  if (fault.ids.size() > 1) return in_length(form, fault.ids, field.field);
  if (fault.kind != calib::CellFaultKind::kCertifiedSigma) return {};
  return in_row_of("spheres", form.spheres, fault.ids[0], "diameter_sigma_mm");
}

}  // namespace cellcal::daemon
