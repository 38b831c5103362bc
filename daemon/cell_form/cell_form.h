#pragma once
// What a new cell file is made of. Millimetres and degrees, as they were typed.

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/robot.h"

namespace cellcal::daemon {

using Triple = std::array<double, 3>;

/// A robot file, as the cell file names it and as it was read.
struct NamedRobotFile {
  std::string reference;  ///< of the key `robot`
  std::string name, text;
};

/// Of a TCP that was measured with four points on the controller: 1 sigma of each of X, Y, Z [mm].
inline constexpr double kUsualTcpSigmaMm = 0.5;

struct ToolForm {
  Triple xyz_mm{}, abc_deg{};
  Triple
      xyz_sigma_mm{};  ///< above 0: the TCP is estimated, too; without it no tool frame is made of a calibration
  std::optional<double> mass_kg{};  ///< none: not known
  double tip_radius_mm = 0.0;
};

/// What vouches for a figure; empty: not stated.
struct CertificateForm {
  std::string number{}, date{};  ///< "2026-04-01"
};

struct SphereForm {
  std::string id;
  double diameter_mm = 0.0, diameter_sigma_mm = 0.002;
  std::optional<Triple> centre_mm{};
  double centre_sigma_mm = 10.0;
  std::optional<std::array<Triple, 2>>
      box_mm{};  ///< where it is looked for without a centre: two opposite corners
  std::string serial{};
  CertificateForm certificate{};
};

struct LengthForm {
  std::string from, to;
  double mm = 0.0, sigma_mm = 0.0;
  CertificateForm certificate{};
};

struct CellForm {
  NamedRobotFile robot;
  ToolForm tool;
  std::vector<SphereForm> spheres;
  std::vector<LengthForm> lengths;
};

/// By the name of a shipped robot, or by path. Throws calib::UnknownRobot where there is none,
/// calib::FileError where it cannot be read.
NamedRobotFile find_robot(const std::string& given, const std::filesystem::path& cell_file);

/// As the reader of cell files has it. Throws calib::FileError with key and reason.
calib::Cell cell_of(const CellForm& form);
/// What is wrong with it as far as it goes, and what to do; empty: nothing. Spheres may be missing yet.
std::string objection(const CellForm& form);

/// Where the tip is, on the nominal arm with this tool. Throws calib::FileError where that is no posture of it.
Triple tip_mm(const CellForm& form, const std::vector<double>& joint_deg);
/// The centre of a sphere that the tip touches from above there.
Triple centre_below(const CellForm& form, const std::vector<double>& joint_deg, double diameter_mm);

// A form as JSON: what a page sends and shows. Millimetres and degrees, as typed.

nlohmann::json to_json(const CellForm& form);
nlohmann::json to_json(const std::vector<SphereForm>& spheres);
nlohmann::json to_json(const std::vector<LengthForm>& lengths);

/// The robot by the name of a shipped one. A sphere may have "joints_deg", the axis angles with the tip on its top, in the place of
/// "centre_mm": the nominal arm says where its centre is then. `cell_file`: where the form will be written. Throws
/// calib::FileError with the key. `before`: the form that it changes, whose robot may be no shipped one; null: none.
CellForm form_from_json(const nlohmann::json& json, const std::filesystem::path& cell_file,
                        const CellForm* before = nullptr);

/// Robot, tool, spheres and lengths of any cell file; what else it has is beyond() the form (kept.h). Nothing: several tools, or what
/// else no form can show as it is. Throws calib::FileError where it is no TOML.
std::optional<CellForm> form_in(const std::string& cell_text,
                                const std::filesystem::path& cell_file);

}  // namespace cellcal::daemon
