// Any text as a KRL program, its points or the controller's $config.dat: correction results in files that
// differ only in numbers, in refusals, or in an error that names the file. So does rewriting its motions for
// a correction at run time; the original is restored byte for byte.
// The input is these three files in order, each terminated by a byte 1.

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <string>
#include <string_view>
#include <vector>

#include "calib/files/files.h"
#include "calib/model/error.h"
#include "daemon/krl/correct_program.h"
#include "daemon/krl/run_time_program.h"

namespace {

using namespace cellcal;
using daemon::krl::CorrectedProgram;

void require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "program_fuzz: %s\n", what);
  std::abort();
}

/// The demo cell's arm, with an error of one milliradian in its second axis.
const calib::Calibration& calibration() {
  static const calib::Calibration c = [] {
    calib::Calibration one;
    one.cell = calib::load_cell(CELLCAL_DEMO_CELL);
    one.level = {0.0, 0.0, 0.0, 0.0};
    one.parameters.push_back({calib::joint_parameter(calib::ParameterKind::kTheta, 1), "deg",
                              calib::kDegPerRad, 0.0, 1e-3, 1e-5, calib::DecidedBy::kData});
    one.verdict.judged = one.verdict.workspace = true;
    return one;
  }();
  return c;
}

/// The same arm on a linear unit E1, with a positioner E2.
const calib::Calibration& carried() {
  static const calib::Calibration c = [] {
    calib::Calibration one = calibration();
    for (auto& parameter : one.parameters) ++parameter.key.joint;
    calib::Joint unit;
    unit.name = "E1";
    unit.max_rad = 3.0;
    unit.guide.emplace().along = Eigen::Vector3d::UnitY();
    one.cell.robot.joints.insert(one.cell.robot.joints.begin(), unit);
    calib::PositionerAxis axis;
    axis.name = "E2";
    axis.frame.translation() = Eigen::Vector3d(0.9, 0.0, 0.3);
    axis.place_sigma_m = 1e-3;
    axis.mass_kg = 200.0;
    axis.com_m = Eigen::Vector3d(0.1, 0.0, 0.2);
    axis.compliance_sigma_rad_per_nm = 1e-6;
    one.cell.robot.positioner.push_back(axis);
    one.parameters.push_back({calib::positioner_parameter(0, calib::AxisError::kX), "mm", 1e3, 0.0,
                              1e-3, 1e-5, calib::DecidedBy::kData});
    one.parameters.push_back({calib::positioner_parameter(0, calib::AxisError::kCompliance),
                              "rad/(N m)", 1.0, 0.0, 1e-6, 1e-7, calib::DecidedBy::kData});
    return one;
  }();
  return c;
}

/// Without digits and signs, and without 'B110' and 'H6'.
std::string without_numbers(std::string_view text) {
  std::string rest;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const auto close = text[i] == '\'' ? text.find('\'', i + 1) : std::string_view::npos;
    if (close != std::string_view::npos &&
        daemon::krl::based_constant(text.substr(i, close - i + 1)))
      i = close;
    else if (std::string_view("0123456789+-.eE").find(text[i]) == std::string_view::npos)
      rest += text[i];
  }
  return rest;
}

void rewrite(const daemon::krl::ProgramFiles& files) {
  daemon::krl::BackupFiles all;
  all.modules.push_back({files.src, files.dat, {}, {}});
  all.controller = files.controller;
  static const std::vector<std::vector<std::string>> axes = {{}, {"E1", "E2"}};
  for (const std::vector<std::string>& external : axes) {
    const auto result = rewrite_motions(all, {}, external);
    for (const auto& file : result.files)
      require(daemon::krl::restored(file) == files.src.text, "what comes back");
    require(result.files.size() <= 1, "more files than modules");
  }
}

void correct(const calib::Calibration& c, const daemon::krl::ProgramFiles& files) {
  const CorrectedProgram result = correct_program(c, files);
  require(result.files.empty() != result.refusals.empty(), "files beside refusals, or neither");
  for (const auto& one : result.refusals) require(!words(one, c.cell.robot).empty(), "no words");
  if (result.files.empty()) return;
  require(without_numbers(result.files[0].text) == without_numbers(files.src.text), "the .src");
  require(without_numbers(result.files[1].text) == without_numbers(files.dat->text), "the .dat");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  std::string parts[3];
  for (std::string& part : parts) {
    const auto end = rest.find('\1');
    part = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  }
  daemon::krl::ProgramFiles files;
  files.src = {"p.src", parts[0]};
  files.dat = daemon::krl::KrlFile{"p.dat", parts[1]};
  files.controller = {{"c.dat", parts[2]}};
  const auto named = [](const calib::FileError& error) {
    require(error.file == "p.src" || error.file == "p.dat" || error.file == "c.dat",
            "an error without its file");
  };
  try {
    rewrite(files);
  } catch (const calib::FileError& error) {
    named(error);
  }
  for (const calib::Calibration* c : {&calibration(), &carried()}) try {
      correct(*c, files);
    } catch (const calib::FileError& error) {
      named(error);
    }
  return 0;
}
