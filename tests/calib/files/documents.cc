#include "tests/calib/files/documents.h"

#include <gtest/gtest.h>

#include <algorithm>

namespace cellcal::calib::testing {

const char* const kRobot = R"(format = "cellcal.robot/1"
name = "Two axes"
source = "made up"
gravity = [0.0, 0.1, -9.8]

[tolerance]
length_mm = 0.7
angle_deg = 0.035

[[joint]]
name = "A1"
sign = -1
offset_deg = 12.5
d_mm = 400.0
a_mm = 180
alpha_deg = -90.0
beta_deg = 1.5
errors = ["theta", "d", "a", "alpha"]
min_deg = -155.0
max_deg = 155.0
max_speed_deg_s = 154.0
tolerance_length_mm = 1.25
tolerance_angle_deg = 0.07
mass_kg = 20.5
com_mm = [10.0, -20.0, 30.5]
compliance_sigma_rad_per_nm = 1.5e-6
gear_ratio = -120.5
harmonics = [1, 2]
harmonic_sigma_arcsec = 10.0

[[joint]]
name = "A2"
d_mm = 0.0
a_mm = 600.0
alpha_deg = 0.0
errors = ["theta", "beta"]
min_deg = -180.0
max_deg = 65.0
max_speed_deg_s = 154.0

[base]
xyz_mm = [1.0, 2.0, 3.0]
abc_deg = [10.0, 20.0, 30.0]

[flange]
xyz_mm = [0.0, 0.0, 80.0]
)";

const char* const kCell = R"(format = "cellcal.cell/1"
robot = "two.toml"

[tool]
xyz_mm = [59.9, 50.5, 410.3]
abc_deg = [38.84, 3.59, 0.5]
xyz_sigma_mm = [0.5, 0, 0.25]
mass_kg = 1.535
com_mm = [30.0, 25.0, 205.0]
length_mm = 417.7
tip_radius_mm = 0.6
deflection_sigma = 0.003

[[target]]
id = "S1"
kind = "sphere"
diameter_mm = 61.4
diameter_sigma_mm = 0.002
centre_mm = [1340.0, 240.0, 350.0]
centre_sigma_mm = 10.0

[[target]]
id = "S2"
kind = "sphere"
diameter_mm = 38.1

[[target]]
id = "W"
kind = "wire"
centre_sigma_mm = 5.0

[[length]]
between = ["S1", "S2"]
mm = 500.012
sigma_mm = 0.005

[touch]
sigma_mm = 0.03
radius_offset_sigma_mm = 0.3
)";

const char* const kTouches = R"(# two axes
A1,A2,target,set,sigma_mm,radius_mm,time
10.5,-20.25,S1,fit,,,2024-09-24T10:00:00Z
-11,+3.5e1,S2,check,0.05,,
12,0,W,,,812.345,
)";

Robot robot() { return read_robot(TomlTable::parse(kRobot, "robot.toml")); }

Cell cell() { return cell_of(kCell); }

Cell cell_of(const std::string& document) {
  return read_cell(TomlTable::parse(document, "cell.toml"), robot());
}

std::string with(std::string_view document, std::string_view from, std::string_view to) {
  std::string text(document);
  const auto at = text.find(from);
  if (at == std::string::npos) {
    ADD_FAILURE() << "the document does not hold: " << from;
    return text;
  }
  return text.replace(at, from.size(), to);
}

std::string without(std::string_view document, std::string_view line) {
  return with(document, std::string(line) + "\n", "");
}

int line_of(std::string_view document, std::string_view text) {
  const auto at = document.find(text);
  if (at == std::string_view::npos) ADD_FAILURE() << "the document does not hold: " << text;
  return 1 +
         static_cast<int>(std::count(
             document.begin(),
             document.begin() + static_cast<std::ptrdiff_t>(std::min(at, document.size())), '\n'));
}

std::string refusal(const std::function<void()>& read, const std::string& file) {
  try {
    read();
  } catch (const FileError& error) {
    EXPECT_NE(error.file, "") << error.what();
    if (!file.empty()) {
      EXPECT_EQ(error.file, file) << error.what();
    }
    return error.what();
  }
  ADD_FAILURE() << "was not refused";
  return {};
}

std::string robot_refusal(const std::string& document) {
  return refusal([&] { (void)read_robot(TomlTable::parse(document, "robot.toml")); }, "robot.toml");
}

std::string cell_refusal(const std::string& document) {
  return refusal([&] { (void)cell_of(document); }, "cell.toml");
}

std::string touches_refusal(const std::string& text) {
  return refusal([&] { (void)parse_touches(text, "touches.csv", cell()); }, "touches.csv");
}

void expect_words(const std::string& message, std::initializer_list<std::string_view> words) {
  for (const std::string_view word : words)
    EXPECT_NE(message.find(word), std::string::npos) << '"' << word << "\" is not in: " << message;
}

}  // namespace cellcal::calib::testing
