// Any text as a certificate (CSV, or XML of a DCC), a list of spheres, a cell file whose tool is set, a cell file of
// another computer, and a form: refused with FileError, or read with numbers valid for a certificate; a value
// set is a line of its own; files named in the text are not opened.

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "calib/model/error.h"
#include "daemon/cell_form/cell_text.h"

namespace {

using namespace cellcal;  // NOLINT: a fuzz target's own file

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "broken promise: %s\n", what);
  std::abort();
}

void read_certificate(std::string_view text) try {
  for (const daemon::LengthForm& one : daemon::certificate_in(text, "fuzz.csv")) {
    require(std::isfinite(one.mm), "lengths are finite");
    require(one.sigma_mm <= 1.0, "a sigma of a certificate");
  }
} catch (const calib::FileError&) {
}

void read_spheres(std::string_view text) try {
  for (const daemon::SphereForm& one : daemon::spheres_in(text, "fuzz.csv")) {
    require(std::isfinite(one.diameter_mm), "diameters are finite");
    require(one.diameter_sigma_mm <= 1.0, "a sigma of a certificate");
  }
} catch (const calib::FileError&) {
}

void set_tool(std::string_view text) try {
  const daemon::ToolForm tool{.xyz_mm = {1, 2, 300}, .mass_kg = 4.0, .com_mm = {{5, 6, 7}}};
  const std::string set = daemon::with_tool(std::string(text), "fuzz.toml", tool);
  for (const auto& [key, value] : daemon::tool_keys(tool))
    require(set.find(key + " = " + value) != std::string::npos, "each key is set");
  require(daemon::with_tool(set, "fuzz.toml", tool) == set, "setting it again changes nothing");
} catch (const calib::FileError&) {
}

void open_form(std::string_view text) try {
  const daemon::UploadedCell read = daemon::uploaded_cell(std::string(text), "fuzz.toml");
  for (const daemon::ObstacleForm& one : read.form.obstacles)
    require(one.file.empty(), "files of another computer are not here");
  const auto same =
      daemon::form_from_json(daemon::to_json(read.form), "/none/cell.toml", &read.form);
  require(daemon::to_json(same) == daemon::to_json(read.form),
          "a form survives the way to the page");
} catch (const calib::FileError&) {
}

void parse_form(std::string_view text) try {
  const auto json = nlohmann::json::parse(text, nullptr, false);
  for (const daemon::ObstacleForm& one : daemon::form_from_json(json, "/none/cell.toml").obstacles)
    require(one.file.empty(), "no STL file is kept there");
} catch (const calib::FileError&) {
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  read_certificate(text);
  read_spheres(text);
  set_tool(text);
  open_form(text);
  parse_form(text);
  return 0;
}
