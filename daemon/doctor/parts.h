#pragma once
// The doctor's examinations, in their order. Each says itself what it found.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "daemon/doctor/doctor.h"
#include "daemon/doctor/machine.h"
#include "daemon/config/config.h"
#include "drivers/kuka/krl/krl_verify.h"

namespace cellcal::daemon {

/// Cell and robot file, and whether the wire can drive that robot. Nothing: not given, or unusable.
std::optional<calib::Cell> look_at_cell(const DoctorRequest& request, const DaemonConfig& config,
                                        Findings& findings);

/// What can be said against the controller's files in a folder, for the wire. Without a cell the
/// ranges of its axes are not compared.
std::vector<drivers::FileFinding> verify_folder(const DaemonConfig& config, WireKind wire,
                                                const std::filesystem::path& folder,
                                                const std::optional<calib::Cell>& cell);
void look_at_files(const DoctorRequest& request, const DaemonConfig& config,
                   const std::optional<calib::Cell>& cell, Findings& findings);

/// Whether the controller's program comes to run where nobody is there to start it.
void look_at_schedule(const DaemonConfig& config, Findings& findings);

/// The daemon on its socket. Nothing: it does not answer.
struct DaemonSeen {
  std::string status;    ///< JSON of GET /v1/status
  bool running = false;  ///< a session holds the ports
  std::optional<ProcessRights> rights;
};
std::optional<DaemonSeen> look_at_daemon(const DaemonConfig& config, Findings& findings);
/// The line to the plant, as GET /v1/plant has it; never FAILED, as no cell depends on it.
void judge_plant(const std::string& plant, Findings& findings);
void look_at_plant(const DaemonConfig& config, Findings& findings);
/// The links of a session that is under way, by the daemon's own figures.
void judge_links_of(const std::string& status, Findings& findings);

/// Real-time rights: the daemon's where it runs, else the unit's, else this process'.
void judge_realtime(const DaemonConfig& config, const std::optional<ProcessRights>& daemon,
                    const std::vector<std::string>& own_warnings, Findings& findings);

/// Sensor and controller on their wires. Opens both, moves nothing, closes both.
void look_at_wires(const DoctorRequest& request, const DaemonConfig& config,
                   const std::optional<calib::Cell>& cell,
                   const std::optional<ProcessRights>& daemon, Findings& findings);

}  // namespace cellcal::daemon
