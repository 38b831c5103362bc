#pragma once
// Content of a new cell file, in millimetres and degrees as typed.

#include <array>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/files/input_file.h"
#include "calib/model/robot.h"
#include "calib/plan/cell_check.h"

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
  std::optional<Triple> com_mm{};  ///< none: half-way to the TCP
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
  std::string origin{};  ///< "spheres.csv:3"; empty: not of a file
};

struct LengthForm {
  std::string from, to;
  double mm = 0.0, sigma_mm = 0.0;
  CertificateForm certificate{};
  std::string origin{};  ///< as of a sphere
};

/// A static object to be avoided. Of the sizes those of its shape are used.
struct ObstacleForm {
  std::string id;
  calib::ObstacleShape shape = calib::ObstacleShape::kBox;
  std::optional<Triple> size_mm{};                   ///< box
  std::optional<double> diameter_mm{}, height_mm{};  ///< cylinder, along its z
  std::string file{};                                ///< mesh: absolute path of an STL file in mm
  Triple xyz_mm{}, abc_deg{};                        ///< of its frame: the middle; the file's own
};

struct CellForm {
  NamedRobotFile robot;
  ToolForm tool;
  std::vector<SphereForm> spheres;
  std::vector<LengthForm> lengths;
  std::vector<ObstacleForm> obstacles{};
  std::optional<double> floor_mm{};  ///< height that nothing goes below; none: not stated
  std::vector<std::string> notes{};  ///< comment lines behind the tool
};

/// By name of a shipped robot, or by path. Throws calib::UnknownRobot where it does not exist,
/// calib::FileError where it cannot be read.
NamedRobotFile find_robot(const std::string& given, const std::filesystem::path& cell_file);

/// The cell as read from the form's file, with its meshes. Throws calib::FileError with key and reason.
calib::Cell cell_of(const CellForm& form);
/// The unfinished form as far as it can be drawn: spheres may be missing. Throws calib::FileError.
calib::Cell sketch_of(const CellForm& form);
/// Why a form is refused, and the field to change.
struct FormFault {
  std::string words{};  ///< fault and remedy, after the row's origin
  std::string key{};    ///< of form_from_json(): "spheres.1.diameter_mm"; empty: of no single field
  std::string reason{};  ///< to be shown at the field: `words` without file and line
};
/// First fault of the incomplete form; none: it can be written. Spheres may still be missing.
std::optional<FormFault> fault_in(const CellForm& form);
/// Its words; empty: none.
std::string objection(const CellForm& form);
/// Key of the form for that of a cell file or of the form's JSON: "target[2].diameter_mm" is "spheres.1.diameter_mm".
std::string form_key(std::string_view path);
/// The error, at the row of a list that the value was read from.
std::string words_at_origin(const calib::KeyError& error, const CellForm& form);

/// Tip position of the nominal arm with this tool, at the angles as the pendant shows them: A1 first, a linear unit
/// [mm] behind the arm's. Throws calib::FileError for an invalid posture.
Triple tip_mm(const CellForm& form, const std::vector<double>& joint_deg);
/// Centre of a sphere whose top the tip touches at these angles.
Triple centre_below(const CellForm& form, const std::vector<double>& joint_deg, double diameter_mm);

struct SuggestedPlaces {
  std::vector<SphereForm> spheres;     ///< those of the form, with centres
  double mean_mm = 0.0, u95_mm = 0.0;  ///< predicted after 100 touches
};
/// Places for the form's spheres for the whole workspace (calib/plan/plan.h); stated places are
/// not regarded. Takes seconds. Throws calib::PlanError, calib::FileError.
SuggestedPlaces suggest_places(const CellForm& form);

// JSON representation of a form, as exchanged with the page. Millimetres and degrees, as typed.

nlohmann::json to_json(const CellForm& form);
nlohmann::json to_json(const std::vector<SphereForm>& spheres);
nlohmann::json to_json(const std::vector<LengthForm>& lengths);

/// The robot is given by the name of a shipped one. A sphere may have "joints_deg", the axis angles with the
/// tip on its top, instead of "centre_mm"; the centre follows from the nominal arm. `cell_file`: destination
/// of the form. `before`: form being changed, whose robot need not be a shipped one, nor its meshes files kept
/// here; null: none. Throws calib::FileError with the key.
CellForm form_from_json(const nlohmann::json& json, const std::filesystem::path& cell_file,
                        const CellForm* before = nullptr);

/// Robot, tool, spheres, lengths and obstacles of any cell file; its remaining content is beyond() the form (cell_text.h).
/// None: several tools, or other content that no form can represent. Throws calib::FileError for invalid
/// TOML.
std::optional<CellForm> form_in(const std::string& cell_text,
                                const std::filesystem::path& cell_file);

/// A cell file of another computer.
struct UploadedCell {
  CellForm form;
  std::vector<std::string> kept{};  ///< content beyond the form
  std::vector<std::string>
      missing{};  ///< files that it names and that are not here; empty in the form
};
/// Its robot is a shipped one, and no file that it names is opened. Throws calib::FileError with line and key, also
/// for content that no form can represent.
UploadedCell uploaded_cell(const std::string& cell_text, const std::string& name);

// Folder of cell files created over the network, by name.

/// Nothing was written; the reason.
struct CellNotWritten : std::runtime_error {
  enum class Why {
    kName,      ///< 1 to 64 of A-Z a-z 0-9 _ -
    kUnusable,  ///< contradictory or unreadable content
    kThere,     ///< the file exists, and replacing it was not confirmed
    kChanged,   ///< the file has changed since it was displayed
    kMore,      ///< replacing it would lose content, or the folder holds too many files
    kStorage,
  };
  CellNotWritten(Why reason, const std::string& words) : std::runtime_error(words), why(reason) {}
  explicit CellNotWritten(FormFault its_fault)
      : std::runtime_error(its_fault.words), why(Why::kUnusable), fault(std::move(its_fault)) {}
  Why why;
  FormFault fault;  ///< kUnusable
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

  struct KeptMesh {
    std::filesystem::path file;
    std::size_t triangles = 0;
    Triple low_mm{}, high_mm{};  ///< extent, in the file's frame
  };
  /// Writes SUM.mesh.stl from the content of an STL file in mm. `name`: for messages. Throws CellNotWritten
  /// (kStorage; kMore beyond 50 of them), calib::FileError for what is no STL file.
  KeptMesh keep_mesh(const std::string& bytes, const std::string& name) const;

  struct Shown {
    std::string text{}, sha256{};     ///< of the file
    std::optional<CellForm> form{};   ///< none: several tools, or not a cell file
    std::vector<std::string> kept{};  ///< content beyond the form
  };
  /// Any cell file. Throws calib::FileError where it cannot be read.
  static Shown read(const std::filesystem::path& file);
  /// None: the file does not exist. Throws CellNotWritten (kName), calib::FileError where it cannot be read.
  std::optional<Shown> find(const std::string& name) const;

  /// Non-fatal findings. Throws CellNotWritten (kUnusable).
  static std::vector<calib::Phrase> validate(const CellForm& form);
  /// Writes atomically. `instead_of`: SHA-256 of the file to replace, which is kept as NAME.toml.before;
  /// empty: a new file. Content beyond the form is kept, from the replaced file or from `origin`, the text of
  /// another cell file. Throws CellNotWritten.
  std::filesystem::path write(const std::string& name, const CellForm& form,
                              const std::string& instead_of, const std::string& origin = {}) const;

 private:
  std::filesystem::path folder_;
};

// Field of the form that a contradiction of the cell is about.

/// As FormFault::key. Empty: of no single field.
std::string key_of(const calib::CellFault& fault, const CellForm& form);

// Files of the cells' folder that a request may name: robots and meshes that came over the network.

inline constexpr std::string_view kRobotEnding = ".robot.toml", kMeshEnding = ".mesh.stl";

/// True for a regular file NAME + `ending` directly in this folder.
bool is_kept(const std::filesystem::path& file, const std::filesystem::path& folder,
             std::string_view ending);

}  // namespace cellcal::daemon
