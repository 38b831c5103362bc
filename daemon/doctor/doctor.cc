#include "daemon/doctor/doctor.h"

#include <fmt/format.h>
#include <unistd.h>

#include "daemon/doctor/parts.h"

namespace cellcal::daemon {

namespace {

const char* name_of(BackendKind backend) {
  switch (backend) {
    case BackendKind::kRsi:
      return "rsi";
    case BackendKind::kEki:
      return "eki";
    case BackendKind::kMock:
      break;
  }
  return "mock";
}

std::optional<DaemonConfig> look_at_config(const DoctorRequest& request, Findings& findings) {
  try {
    DaemonConfig config = load_config(request.config);
    findings.ok("configuration",
                fmt::format("{}, backend {}", request.config.string(), name_of(config.backend)));
    return config;
  } catch (const std::exception& error) {
    findings.fail("configuration", error.what(),
                  "correct the file (keys: daemon/main/README.md); 'cellcald --check' checks "
                  "it alone");
    return std::nullopt;
  }
}

void look_at_links(const DoctorRequest& request, const DaemonConfig& config,
                   const std::optional<calib::Cell>& cell,
                   const std::optional<ProcessRights>& rights, Findings& findings) {
  if (config.backend != BackendKind::kMock)
    return look_at_wires(request, config, cell, rights, findings);
  findings.warn("wires", "not checked: backend mock is an emulated cell inside the daemon",
                "for a real cell set backend = \"rsi\" or \"eki\"");
}

}  // namespace

void examine(const DoctorRequest& request, Findings& findings) {
  const std::optional<DaemonConfig> config = look_at_config(request, findings);
  if (!config) return;
  const std::optional<calib::Cell> cell = look_at_cell(request, *config, findings);
  look_at_files(request, *config, cell, findings);
  look_at_schedule(*config, findings);
  const std::optional<DaemonSeen> daemon = look_at_daemon(*config, findings);
  if (daemon) look_at_plant(*config, findings);
  const std::optional<ProcessRights> rights = daemon ? daemon->rights : std::nullopt;
  if (daemon && daemon->running) {
    // The daemon's session holds port and device; taking them would stop it.
    judge_realtime(*config, rights, {}, findings);
    judge_links_of(daemon->status, findings);
  } else {
    look_at_links(request, *config, cell, rights, findings);
  }
}

void examine_from_within(const DoctorRequest& request, const DaemonConfig& config,
                         Findings& findings) {
  findings.ok("configuration",
              fmt::format("as loaded by cellcald, backend {}", name_of(config.backend)));
  const std::optional<calib::Cell> cell = look_at_cell(request, config, findings);
  if (request.stop.stop_requested()) return;
  std::optional<ProcessRights> rights = rights_of_process(::getpid());
  // Its groups are not visible in the service's sandbox: access to a device is checked by opening it.
  if (rights) rights->uid.reset();
  look_at_links(request, config, cell, rights, findings);
}

}  // namespace cellcal::daemon
