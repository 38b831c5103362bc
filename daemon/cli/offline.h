#pragma once
// Commands without a daemon. Each returns its exit status and throws on failure.

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "calib/export/urdf.h"
#include "calib/model/touch.h"
#include "calib/result/calibration.h"

namespace cellcal::calib {
struct PlanOptions;
}

namespace cellcal::daemon {

struct IdentifyCommand {
  std::filesystem::path cell, touches, output;
  std::filesystem::path last;  ///< calibration for comparison; empty: none
  bool accept_change = false;
  std::string method = "map";
  bool json = false, verbose = false;
};
int identify(const IdentifyCommand& command);

struct PredictCommand {
  std::filesystem::path calibration, joints, output;
  bool nominal = false, json = false;
  bool withheld = false;  ///< also a calibration withheld by its verdict
  /// Id of a load in the cell file, or mass [kg] and centre [mm, flange frame]; empty: the tools.
  std::vector<std::string> load;
  std::string tool;  ///< id in the cell file, or X,Y,Z,A,B,C; empty: the first
  std::string on;    ///< axis of the positioner whose frame the poses are in; empty: the base frame
};
int predict(const PredictCommand& command);

struct PlanCommand {
  std::filesystem::path cell, output, picture;
  std::filesystem::path last;     ///< previous calibration of the arm; empty: none
  int touches = 200, check = 0;   ///< with a goal the most touches
  std::optional<double> goal_mm;  ///< u95, mean over the region
  std::string region = "workspace";
  std::vector<std::filesystem::path> programs;    ///< KRL, whose points are the region
  std::vector<std::filesystem::path> controller;  ///< $config.dat, $machine.dat of the programs
  std::vector<std::string> leave, still;          ///< points and routines, as in CorrectCommand
  std::vector<double> from_deg;                   ///< current position of the arm; empty: unknown
  unsigned seed = 1;
  int suggest_spheres = 0;  ///< number of sphere positions to suggest instead of a plan; 0: a plan
  bool json = false;
};
int plan(const PlanCommand& command);
/// Suggests sphere positions for the region, with the predicted accuracy and that of today's cell.
int suggest_spheres(const PlanCommand& command, const calib::Cell& cell,
                    const calib::PlanOptions& options);

/// Lists the robots that a cell file may name, and the search path of their files.
struct RobotsCommand {
  bool json = false;
};
int robots(const RobotsCommand& command);

/// Writes the files to copy onto the controller, from the daemon's configuration.
struct KukaFilesCommand {
  std::filesystem::path config = "/etc/cellcal/cellcald.toml", output;
  std::filesystem::path verify;  ///< folder to verify instead of writing
  std::filesystem::path cell;    ///< cell whose axis ranges limit the RSI program; empty: none
  std::string wire;              ///< "rsi", "eki"; empty: as configured
  bool json = false;
};
int kuka_files(const KukaFilesCommand& command);

/// Exports the calibrated arm for other programs.
struct ExportRobotCommand {
  std::filesystem::path calibration, urdf, output;
  std::string as = "urdf";  ///< urdf, yaml, dh, json
  calib::UrdfEnds ends;     ///< links of the given URDF
  bool withheld = false;    ///< also a calibration withheld by its verdict
};
int export_robot(const ExportRobotCommand& command);

/// Creates a robot file from data of other programs, or puts a controller's tool into a cell file.
struct ImportRobotCommand {
  std::filesystem::path urdf, robot, output;
  calib::UrdfEnds ends;
  std::vector<std::string> xacro_arguments;  ///< NAME:=VALUE
  std::vector<std::filesystem::path> machine_data;
  std::filesystem::path cell;  ///< cell file whose [tool] becomes TOOL_DATA[tool]; empty: none
  int tool = 0;
};
int import_robot(const ImportRobotCommand& command);

/// Checks the prerequisites of the first motion, without moving.
struct DoctorCommand {
  std::filesystem::path config = "/etc/cellcal/cellcald.toml", cell, files;
  double wait_s = 20.0, observe_s = 10.0;
  std::string language;  ///< empty: of the configuration
  bool json = false;
};
int doctor(const DoctorCommand& command);

// Calibration files, validated before use.

/// Warns on standard error if the file has no checksum. Throws calib::FileError.
calib::Calibration read_calibration(const std::filesystem::path& file);
/// Throws calib::FileError for corrections beyond any real arm.
void refuse_far(const calib::Calibration& calibration, const std::filesystem::path& file);
/// Reads and validates. nullopt for a withheld calibration, unless requested; the reason is printed
/// on standard error. Throws calib::FileError.
std::optional<calib::Calibration> usable_calibration(const std::string& command,
                                                     const std::filesystem::path& file,
                                                     bool withheld);

/// Prints on standard error how a table was interpreted, unless in the plain form
/// (calib/files/csv.h).
void report_reading(const std::filesystem::path& csv, const calib::Robot& robot);
/// Warns on standard error where the angles of a table's rows are so small that they may be radians.
void warn_of_radians(const std::filesystem::path& csv, const calib::Robot& robot,
                     std::span<const calib::JointVector> rows);

/// Throws std::runtime_error, with the remedy, where no file of this name can be made.
void require_output_folder(const std::filesystem::path& output);
/// Writes the file, completely or not at all, or standard output if no file is given.
void put(const std::string& text, const std::filesystem::path& output);
/// Indented, with a last newline. Bytes that are no UTF-8, as of a path or from a device, are replaced.
std::string json_text(const nlohmann::json& value);
/// The value as one line of JSON, or the words, on standard output. Returns kSuccess.
int print_result(bool as_json, const nlohmann::json& value, const std::string& words);

// Stable interface for scripts.
inline constexpr int kSuccess = 0;
inline constexpr int kJobFailed = 1;
inline constexpr int kWrongUsage = 2;
inline constexpr int kNotPublishable = 3;
inline constexpr int kDetached =
    130;  ///< Ctrl-C: the session continues, and nothing is known of its end

// Human-readable results.

enum class Detail {
  kSummary,  ///< about ten lines
  kAll       ///< chi^2, noise, observability, correlations, outliers and other findings
};

/// Delay of the latched angles, from fast and slow contacts only.
struct ContactsDelay {
  double delay_s = 0.0, sigma_s = 0.0;
  int touches = 0;
};

/// Latch delay in one line, U with k = 2: from the fit where its touches determine it, from the contacts
/// where they were compared, and the agreement of both. Empty without either.
std::string delay_words(const calib::Calibration* fit,
                        const std::optional<ContactsDelay>& contacts);

/// Residuals before and after, predicted accuracy, outliers, and the verdict with its reasons. Ends with a
/// line break. `touches`: those of the calibration, if known, to locate outliers in their file.
std::string result_words(const calib::Calibration& calibration,
                         std::span<const calib::Touch> touches = {},
                         Detail detail = Detail::kSummary,
                         const std::optional<ContactsDelay>& contacts = {});

// Files go through the reader of their kind before they are written: a file that its own program refuses is
// never left behind.

/// Reads a text as one kind of file, of that name. Throws calib::FileError.
using Reader = std::function<void(const std::string& text, const std::string& name)>;

void as_robot(const std::string& text, const std::string& name);
void as_krl(const std::string& text, const std::string& name);

/// Throws calib::FileError for a text that its reader refuses: nothing is to be written then.
void read_back(const std::string& text, const std::filesystem::path& output, const Reader& reader);
/// As put(), after read_back().
void put_as(const Reader& reader, const std::string& text, const std::filesystem::path& output);

}  // namespace cellcal::daemon
