#pragma once
// Checks of the doctor, in their order. Each reports its own findings.

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/model/robot.h"
#include "daemon/config/config.h"
#include "daemon/doctor/doctor.h"
#include "daemon/doctor/machine.h"
#include "drivers/kuka/krl/krl_verify.h"

namespace cellcal::daemon {

/// Cell and robot file, and the wire's support for that robot. None: not given, or unusable.
std::optional<calib::Cell> look_at_cell(const DoctorRequest& request, const DaemonConfig& config,
                                        Findings& findings);

/// Faults of the controller files in a folder, for the wire. Without a cell the axis ranges are not compared.
std::vector<drivers::FileFinding> verify_folder(const DaemonConfig& config, WireKind wire,
                                                const std::filesystem::path& folder,
                                                const std::optional<calib::Cell>& cell);
void look_at_files(const DoctorRequest& request, const DaemonConfig& config,
                   const std::optional<calib::Cell>& cell, Findings& findings);

/// Start of the controller's program in unattended operation.
void look_at_schedule(const DaemonConfig& config, Findings& findings);

/// The daemon on its socket. None: no answer.
struct DaemonSeen {
  std::string status;    ///< JSON of GET /v1/status
  bool running = false;  ///< a session holds the ports
  std::optional<ProcessRights> rights;
};
std::optional<DaemonSeen> look_at_daemon(const DaemonConfig& config, Findings& findings);
/// Connection to the plant, as in GET /v1/plant; never FAILED, since no cell depends on it.
void judge_plant(const std::string& plant, Findings& findings);
void look_at_plant(const DaemonConfig& config, Findings& findings);
/// Links of the session under way, by the daemon's figures.
void judge_links_of(const std::string& status, Findings& findings);

/// Real-time rights: of the running daemon, otherwise of the unit, otherwise of this process.
void judge_realtime(const DaemonConfig& config, const std::optional<ProcessRights>& daemon,
                    const std::vector<std::string>& own_warnings, Findings& findings);

/// Sensor and controller on their wires. Opens both, moves nothing, closes both.
void look_at_wires(const DoctorRequest& request, const DaemonConfig& config,
                   const std::optional<calib::Cell>& cell,
                   const std::optional<ProcessRights>& daemon, Findings& findings);

}  // namespace cellcal::daemon
