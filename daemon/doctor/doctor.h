#pragma once
// Examination of a cell without motion. The arm is held in place: over RSI the adapter answers by its rule
// for new sessions, over EKI only heartbeats are sent. No move is ever begun.

#include <filesystem>
#include <functional>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "daemon/config/config.h"
#include "daemon/doctor/examiner.h"
#include "daemon/doctor/machine.h"
#include "drivers/kuka/krl/krl_read.h"
#include "drivers/kuka/krl/krl_verify.h"

namespace cellcal::daemon {

struct DoctorRequest {
  std::filesystem::path config;
  std::filesystem::path cell;   ///< empty: robot and cell files are not checked
  std::filesystem::path files;  ///< controller files to compare; empty: none
  std::function<drivers::ControllerFiles(const std::filesystem::path&)> read_files =
      drivers::read_controller_folder;
  double wait_s = 20.0;     ///< for the controller's first packet or state
  double observe_s = 10.0;  ///< observation period of the links, once they are up
  /// Operator action required now, and the time left for it.
  std::function<void(const calib::Phrase&)> hint = [](const calib::Phrase&) {};
  std::stop_token stop{};  ///< when requested, ends soon with incomplete findings
};

/// Runs all checks, ordered so that the first failure is the first to resolve. Throws nothing that a cell
/// could cause.
void examine(const DoctorRequest& request, Findings& findings);

struct DaemonConfig;
/// The same within the daemon, with its active configuration and its own rights. No session may be under way.
void examine_from_within(const DoctorRequest& request, const DaemonConfig& config,
                         Findings& findings);

// Checks of the doctor, in their order. Each reports its own findings.

/// Cell and robot file, and the wire's support for that robot. None: not given, or unusable.
std::optional<calib::Cell> examine_cell(const DoctorRequest& request, const DaemonConfig& config,
                                        Findings& findings);

/// Faults of the controller files, for the wire. Without a cell the axis ranges are not compared.
std::vector<drivers::FileFinding> verify_files(const DaemonConfig& config, WireKind wire,
                                               const drivers::ControllerFiles& files,
                                               const std::optional<calib::Cell>& cell);
void examine_files(const DoctorRequest& request, const DaemonConfig& config,
                   const std::optional<calib::Cell>& cell, Findings& findings);

/// Start of the controller's program in unattended operation.
void examine_schedule(const DaemonConfig& config, Findings& findings);

/// Place of the journal: a small file is written there and flushed, unless this user has no permission.
void examine_state_dir(const std::filesystem::path& directory, Findings& findings);
/// `written`: such a file was.
void judge_state_dir(const std::filesystem::path& directory, double free_bytes, bool written,
                     Findings& findings);

/// The daemon on its socket. None: no answer.
struct DaemonSeen {
  std::string status;    ///< JSON of GET /v1/status
  bool running = false;  ///< a session holds the ports
  std::optional<ProcessRights> rights;
};
std::optional<DaemonSeen> examine_daemon(const DaemonConfig& config, Findings& findings);
/// Connection to the plant, as in GET /v1/plant; never FAILED, since no cell depends on it.
void judge_plant(const std::string& plant, Findings& findings);
void examine_plant(const DaemonConfig& config, Findings& findings);
/// Links of the session under way, by the daemon's figures.
void judge_links_of(const std::string& status, Findings& findings);

/// Real-time rights: of the running daemon, otherwise of the unit, otherwise of this process.
void judge_realtime(const DaemonConfig& config, const std::optional<ProcessRights>& daemon,
                    const std::vector<std::string>& own_warnings, Findings& findings);

/// Sensor and controller on their wires. Opens both, moves nothing, closes both.
void examine_wires(const DoctorRequest& request, const DaemonConfig& config,
                   const std::optional<calib::Cell>& cell,
                   const std::optional<ProcessRights>& daemon, Findings& findings);

}  // namespace cellcal::daemon
