#pragma once
// The commands that need no daemon. Each returns its exit status and throws when the job failed.

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "calib/result/calibration.h"

namespace cellcal::calib {
struct PlanOptions;
}

namespace cellcal::daemon {

struct IdentifyCommand {
  std::filesystem::path cell, touches, output;
  std::filesystem::path last;  ///< calibration to compare with; empty: none
  bool accept_change = false;
  std::string method = "map";
  bool json = false, verbose = false;
};
int identify(const IdentifyCommand& command);

struct PredictCommand {
  std::filesystem::path calibration, joints, output;
  bool nominal = false, json = false;
  bool withheld = false;  ///< also where the verdict withholds the calibration
};
int predict(const PredictCommand& command);

struct PlanCommand {
  std::filesystem::path cell, output, picture;
  int touches = 50, check = 0;
  std::string region = "workspace";
  std::vector<double> from_deg;  ///< where the arm stands; empty: not known
  unsigned seed = 1;
  int suggest_spheres = 0;  ///< so many places for spheres in place of a plan; 0: a plan
  bool json = false;
};
int plan(const PlanCommand& command);
/// Places for spheres that serve the region, with the predicted accuracy beside today's.
int suggest_spheres(const PlanCommand& command, const calib::Cell& cell,
                    const calib::PlanOptions& options);

/// The robots that a cell file may name, and where their files are looked for.
struct RobotsCommand {
  bool json = false;
};
int robots(const RobotsCommand& command);

/// What an integrator copies onto the controller, from the daemon's configuration.
struct KukaFilesCommand {
  std::filesystem::path config = "/etc/cellcal/cellcald.toml", output;
  std::filesystem::path verify;  ///< folder to look at in place of writing
  std::filesystem::path cell;    ///< whose axis ranges RSI's program keeps; empty: none
  std::string wire;              ///< "rsi", "eki", or empty: the configuration's
  bool json = false;
};
int kuka_files(const KukaFilesCommand& command);

/// The calibrated arm for other programs.
struct ExportRobotCommand {
  std::filesystem::path calibration, urdf, output;
  std::string as = "urdf";  ///< urdf, yaml, dh, json
  std::string tip;          ///< link of the given URDF; empty: chosen
  bool withheld = false;    ///< also where the verdict withholds the calibration
};
int export_robot(const ExportRobotCommand& command);

/// A robot file out of what other programs hold.
struct ImportRobotCommand {
  std::filesystem::path urdf, robot, output;
  std::string tip;
  std::vector<std::filesystem::path> machine_data;
};
int import_robot(const ImportRobotCommand& command);

/// What is in the way of the first motion, without moving.
struct DoctorCommand {
  std::filesystem::path config = "/etc/cellcal/cellcald.toml", cell, files;
  double wait_s = 20.0, observe_s = 10.0;
  bool json = false;
};
int doctor(const DoctorCommand& command);

// A calibration file, looked at before any command uses it (usable_calibration.cc).

/// Says on standard error where the file has no sum. Throws calib::FileError.
calib::Calibration read_calibration(const std::filesystem::path& file);
/// Throws calib::FileError where a correction is one that no arm has.
void refuse_far(const calib::Calibration& calibration, const std::filesystem::path& file);
/// Both; none where it was withheld, unless that was asked for: standard error says why. Throws calib::FileError.
std::optional<calib::Calibration> usable_calibration(const std::string& command,
                                                     const std::filesystem::path& file,
                                                     bool withheld);

/// Says on standard error how a table was read that is not in the plain form (calib/files/csv.h).
void tell_reading(const std::filesystem::path& csv);

/// To the file, wholly or not at all, or to standard output where no file is named.
void put(const std::string& text, const std::filesystem::path& output);

// A promise to scripts.
inline constexpr int kSuccess = 0;
inline constexpr int kJobFailed = 1;
inline constexpr int kWrongUsage = 2;
inline constexpr int kNotPublishable = 3;

}  // namespace cellcal::daemon
