#pragma once
// The commands that need no daemon. Each returns its exit status and throws when the job failed.

#include <filesystem>
#include <string>
#include <vector>

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
  int touches = 40, check = 0;
  std::string region = "workspace";
  std::vector<double> from_deg;  ///< where the arm stands; empty: not known
  unsigned seed = 1;
  bool json = false;
};
int plan(const PlanCommand& command);

/// What an integrator copies onto the controller, from the daemon's configuration.
struct KukaFilesCommand {
  std::filesystem::path config = "/etc/cellcal/cellcald.toml", output;
  std::filesystem::path verify;  ///< folder to look at in place of writing
  std::string wire;              ///< "rsi", "eki", or empty: the configuration's
  bool json = false;
};
int kuka_files(const KukaFilesCommand& command);

/// What is in the way of the first motion, without moving.
struct DoctorCommand {
  std::filesystem::path config = "/etc/cellcal/cellcald.toml", cell, files;
  double wait_s = 20.0, observe_s = 10.0;
  bool json = false;
};
int doctor(const DoctorCommand& command);

/// To the file, wholly or not at all, or to standard output where no file is named.
void put(const std::string& text, const std::filesystem::path& output);

}  // namespace cellcal::daemon
