#pragma once
// Content of a new cell file, in millimetres and degrees as typed.

#include <array>
#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "calib/model/robot.h"

namespace cellcal::daemon {

using Triple = std::array<double, 3>;

/// Robot file: its name within the cell file, and its content.
struct NamedRobotFile {
  std::string reference;  ///< of the key `robot`
  std::string name, text;
};

/// For a TCP measured by the controller's four-point method: 1 sigma of each of X, Y, Z [mm].
inline constexpr double kUsualTcpSigmaMm = 0.5;

struct ToolForm {
  Triple xyz_mm{}, abc_deg{};
  /// Above 0: the TCP is estimated too; otherwise the calibration gives no tool frame.
  Triple xyz_sigma_mm{};
  std::optional<double> mass_kg{};  ///< none: unknown
  double tip_radius_mm = 0.0;
  std::optional<Triple> com_mm{};  ///< none: half-way to the TCP. Not part of the page's form
};

/// Certificate of a value; empty: not stated.
struct CertificateForm {
  std::string number{}, date{};  ///< "2026-04-01"
};

struct SphereForm {
  std::string id;
  double diameter_mm = 0.0, diameter_sigma_mm = 0.002;
  std::optional<Triple> centre_mm{};
  double centre_sigma_mm = 10.0;
  /// Search volume of a sphere without a centre: two opposite corners.
  std::optional<std::array<Triple, 2>> box_mm{};
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
  std::vector<std::string> notes{};  ///< comment lines behind the tool
};

/// By name of a shipped robot, or by path. Throws calib::UnknownRobot where it does not exist,
/// calib::FileError where it cannot be read.
NamedRobotFile find_robot(const std::string& given, const std::filesystem::path& cell_file);

/// The cell as read from the form's file. Throws calib::FileError with key and reason.
calib::Cell cell_of(const CellForm& form);
/// First fault of the incomplete form and its remedy; empty: none. Spheres may still be missing.
std::string objection(const CellForm& form);

/// Tip position of the nominal arm with this tool. Throws calib::FileError for an invalid posture.
Triple tip_mm(const CellForm& form, const std::vector<double>& joint_deg);
/// Centre of a sphere whose top the tip touches at these angles.
Triple centre_below(const CellForm& form, const std::vector<double>& joint_deg, double diameter_mm);

// JSON representation of a form, as exchanged with the page. Millimetres and degrees, as typed.

nlohmann::json to_json(const CellForm& form);
nlohmann::json to_json(const std::vector<SphereForm>& spheres);
nlohmann::json to_json(const std::vector<LengthForm>& lengths);

/// The robot is given by the name of a shipped one. A sphere may have "joints_deg", the axis angles with the
/// tip on its top, instead of "centre_mm"; the centre follows from the nominal arm. `cell_file`: destination
/// of the form. `before`: form being changed, whose robot need not be a shipped one; null: none. Throws
/// calib::FileError with the key.
CellForm form_from_json(const nlohmann::json& json, const std::filesystem::path& cell_file,
                        const CellForm* before = nullptr);

/// Robot, tool, spheres and lengths of any cell file; its remaining content is beyond() the form (cell_text.h).
/// None: several tools, or other content that no form can represent. Throws calib::FileError for invalid
/// TOML.
std::optional<CellForm> form_in(const std::string& cell_text,
                                const std::filesystem::path& cell_file);

// Folder of cell files created over the network, by name.

/// Nothing was written; the reason.
struct CellNotWritten : std::runtime_error {
  enum class Why {
    kName,      ///< 1 to 64 of A-Z a-z 0-9 _ -
    kUnusable,  ///< contradictory or unreadable content
    kThere,     ///< the file exists, and replacing it was not confirmed
    kChanged,   ///< the file has changed since it was displayed
    kMore,      ///< not representable by a form (several tools): replacing it would lose content
    kStorage,
  };
  CellNotWritten(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  Why why;
};

class CellFileStore {
 public:
  explicit CellFileStore(std::filesystem::path folder) : folder_(std::move(folder)) {}

  const std::filesystem::path& folder() const { return folder_; }
  /// Names without ".toml", sorted.
  std::vector<std::string> names() const;
  std::filesystem::path file(const std::string& name) const;

  /// Robot files kept here, by absolute path, sorted.
  std::vector<calib::NamedRobot> robots() const;
  /// Writes MODEL-SUM.robot.toml and returns its path. Throws CellNotWritten (kStorage), calib::FileError for a robot
  /// that cannot be read back.
  std::filesystem::path keep(const calib::Robot& robot) const;

  struct Shown {
    std::string text{}, sha256{};     ///< of the file
    std::optional<CellForm> form{};   ///< none: several tools, or not a cell file
    std::vector<std::string> kept{};  ///< content beyond the form
  };
  /// Any cell file. Throws calib::FileError where it cannot be read.
  static Shown look_at(const std::filesystem::path& file);
  /// None: the file does not exist. Throws CellNotWritten (kName), calib::FileError where it cannot be read.
  std::optional<Shown> look(const std::string& name) const;

  /// Non-fatal findings. Throws CellNotWritten (kUnusable).
  static std::vector<std::string> look_through(const CellForm& form);
  /// Writes atomically. `instead_of`: SHA-256 of the file to replace, which is kept as NAME.toml.before;
  /// empty: a new file. Content beyond the form is kept, from the replaced file or from `from`, which is left
  /// unchanged. Throws CellNotWritten.
  std::filesystem::path write(const std::string& name, const CellForm& form,
                              const std::string& instead_of,
                              const std::filesystem::path& from = {}) const;

 private:
  std::filesystem::path folder_;
};

}  // namespace cellcal::daemon
