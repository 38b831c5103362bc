#include "daemon/cell_form/lists.h"

#include <fmt/format.h>

#include <array>

#include "calib/files/csv.h"
#include "calib/files/input_file.h"

namespace cellcal::daemon {

namespace {

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
  calib::CsvTable table(text, name);
  table.refuse_unknown(known);
  std::vector<decltype(row(table, name))> all;
  while (table.next()) {
    if (all.size() == kMostRows) throw calib::FileError(name, ": more than 1000 rows");
    all.push_back(row(table, name));
  }
  if (all.empty()) throw calib::FileError(name, ": no row after the header");
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

}  // namespace

std::vector<SphereForm> spheres_in(std::string_view csv, const std::string& file) {
  return rows(csv, file,
              {"id", "diameter_mm", "diameter_sigma_mm", "x_mm", "y_mm", "z_mm", "centre_sigma_mm",
               "serial", "certificate", "certificate_date"},
              [](const calib::CsvTable& table, const std::string& name) {
                SphereForm sphere;
                sphere.id = table.text(needed(table, "id", name));
                sphere.diameter_mm = table.number(needed(table, "diameter_mm", name));
                take(table, "diameter_sigma_mm", sphere.diameter_sigma_mm);
                sphere.centre_mm = centre(table, name);
                take(table, "centre_sigma_mm", sphere.centre_sigma_mm);
                take(table, "serial", sphere.serial);
                take(table, "certificate", sphere.certificate.number);
                take(table, "certificate_date", sphere.certificate.date);
                return sphere;
              });
}

std::vector<LengthForm> certificate_in(std::string_view csv, const std::string& file) {
  return rows(csv, file, {"from", "to", "mm", "sigma_mm", "certificate", "certificate_date"},
              [](const calib::CsvTable& table, const std::string& name) {
                LengthForm length;
                length.from = table.text(needed(table, "from", name));
                length.to = table.text(needed(table, "to", name));
                length.mm = table.number(needed(table, "mm", name));
                length.sigma_mm = table.number(needed(table, "sigma_mm", name));
                take(table, "certificate", length.certificate.number);
                take(table, "certificate_date", length.certificate.date);
                return length;
              });
}

std::vector<SphereForm> load_spheres(const std::filesystem::path& csv) {
  return spheres_in(calib::read_file(csv, kMostBytes), csv.string());
}

std::vector<LengthForm> load_certificate(const std::filesystem::path& csv) {
  return certificate_in(calib::read_file(csv, kMostBytes), csv.string());
}

}  // namespace cellcal::daemon
