// The daemon, its rights, and the links of its current session.

#include "daemon/doctor/doctor.h"

#include <fmt/format.h>
#include <unistd.h>

#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/model/enum_table.h"
#include "daemon/api/http/http.h"
#include "daemon/doctor/wires.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

const char* name_of(BackendKind backend) {
  using enum BackendKind;
  static constexpr EnumNames<BackendKind> kTable{{{kRsi, "rsi"}, {kEki, "eki"}, {kMock, "mock"}}};
  return kTable[backend];
}

std::optional<DaemonConfig> examine_config(const DoctorRequest& request, Findings& findings) {
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

void examine_links(const DoctorRequest& request, const DaemonConfig& config,
                   const std::optional<calib::Cell>& cell,
                   const std::optional<ProcessRights>& rights, Findings& findings) {
  if (config.backend != BackendKind::kMock)
    return examine_wires(request, config, cell, rights, findings);
  findings.warn("wires", "not checked: backend mock is an emulated cell inside the daemon",
                "for a real cell set backend = \"rsi\" or \"eki\"");
}

}  // namespace

void examine(const DoctorRequest& request, Findings& findings) {
  const std::optional<DaemonConfig> config = examine_config(request, findings);
  if (!config) return;
  const std::optional<calib::Cell> cell = examine_cell(request, *config, findings);
  examine_files(request, *config, cell, findings);
  examine_schedule(*config, findings);
  const std::optional<DaemonSeen> daemon = examine_daemon(*config, findings);
  if (daemon) examine_plant(*config, findings);
  const std::optional<ProcessRights> rights = daemon ? daemon->rights : std::nullopt;
  if (daemon && daemon->running) {
    // The daemon's session holds port and device; taking them would stop it.
    judge_realtime(*config, rights, {}, findings);
    judge_links_of(daemon->status, findings);
  } else {
    examine_links(request, *config, cell, rights, findings);
  }
}

void examine_from_within(const DoctorRequest& request, const DaemonConfig& config,
                         Findings& findings) {
  findings.ok("configuration",
              fmt::format("as loaded by cellcald, backend {}", name_of(config.backend)));
  const std::optional<calib::Cell> cell = examine_cell(request, config, findings);
  if (request.stop.stop_requested()) return;
  std::optional<ProcessRights> rights = rights_of_process(::getpid());
  // Its groups are not visible in the service's sandbox: access to a device is checked by opening it.
  if (rights) rights->uid.reset();
  examine_links(request, config, cell, rights, findings);
}

namespace {

using nlohmann::json;

std::string text(const json& value, const char* key) {
  const auto found = value.find(key);
  return found != value.end() && found->is_string() ? found->get<std::string>() : "";
}

double figure(const json& value, const char* key) {
  const auto found = value.find(key);
  return found != value.end() && found->is_number() ? found->get<double>() : 0.0;
}

std::string trimmed(std::string words) {
  while (!words.empty() && words.back() == '\n') words.pop_back();
  return words;
}

/// `words`: complaint of the device itself. `losses`: share of faulty messages.
void judge_link(const std::string& check, const std::string& words, const std::string& figures,
                double losses, Findings& findings) {
  if (!words.empty()) {
    findings.fail(check, words, "'cellcal watch' follows the session");
  } else if (losses > 0.0) {
    findings.warn(check, figures,
                  "messages were lost: run 'cellcal doctor' again after the session for details");
  } else {
    findings.ok(check, figures);
  }
}

}  // namespace

std::optional<DaemonSeen> examine_daemon(const DaemonConfig& config, Findings& findings) {
  const std::string check = "daemon";
  DaemonSeen seen;
  try {
    seen.status = http_request(config.socket, "GET", "/v1/status").body;
  } catch (const SocketPermissionError&) {
    findings.fail(check, "no permission for " + config.socket.string(),
                  "sudo adduser \"$USER\" cellcal, then log in again");
    return std::nullopt;
  } catch (const SocketError&) {
    findings.warn(check,
                  fmt::format("not running ({}): ports and device are checked directly",
                              config.socket.string()),
                  "for a session: sudo systemctl start cellcald");
    return std::nullopt;
  }
  const json status = json::parse(seen.status, nullptr, false);
  if (!status.is_object()) {
    findings.fail(check, fmt::format("{} is used by another program", config.socket.string()),
                  "set another socket in the configuration");
    return std::nullopt;
  }
  seen.running = status.value("running", json(false)) == true;
  if (const auto process = process_behind(config.socket)) seen.rights = rights_of_process(*process);
  const std::string version = text(status, "version"), own = calib::software_version();
  std::string words = seen.running
                          ? fmt::format(
                                "session {:.0f} is running ({}) and uses port and device; its "
                                "figures follow",
                                figure(status, "session"), text(status, "phase"))
                          : std::string("running and idle: port and device are free");
  if (version != own) {
    findings.warn(check, fmt::format("{}; version {}, but this tool is {}", words, version, own),
                  "sudo systemctl restart cellcald");
  } else {
    findings.ok(check, words);
  }
  return seen;
}

void judge_sparkplug(const json& line, Findings& findings) {
  const std::string check = "sparkplug";
  const bool connected = line.value("connected", json()) == true;
  const std::string found = fmt::format("{} since {}", connected ? "connected" : "not connected",
                                        printable(text(line, "since")));
  const std::string words = printable(text(line, "words"));
  if (connected)
    findings.ok(check, found);
  else
    findings.warn(
        check, found,
        words.empty() ? "wait for the first connection, then run 'cellcal doctor' again" : words);
}

void judge_plant(const std::string& plant, Findings& findings) {
  const std::string check = "plant";
  const json line = json::parse(plant, nullptr, false);
  if (!line.is_object() || !line.contains("connected")) {
    findings.skip(
        check,
        "not reported by this version of the daemon. Restart it: sudo systemctl restart cellcald");
    return;
  }
  const bool connected = line["connected"] == true;
  const double waiting = figure(line, "waiting");
  std::string found = fmt::format("{:.0f} messages queued", waiting);
  if (const std::string oldest = text(line, "oldest"); !oldest.empty())
    found += ", oldest " + printable(oldest);
  found += fmt::format("; {} since {}", connected ? "connected" : "not connected",
                       printable(text(line, "since")));
  if (const double dropped = figure(line, "dropped") + figure(line, "not_begun"); dropped > 0.0)
    found += fmt::format("; {:.0f} telemetry messages dropped (queue full)", dropped);
  const std::string words = printable(text(line, "words"));
  if (!words.empty())
    findings.warn(check, found, words);
  else if (!connected)
    findings.warn(check, found, "wait for the first connection, then run 'cellcal doctor' again");
  else
    findings.ok(check, found);
  if (const json node = line.value("sparkplug", json()); node.is_object())
    judge_sparkplug(node, findings);
}

void examine_plant(const DaemonConfig& config, Findings& findings) {
  if (!config.plant) return;
  try {
    const Response answer = http_request(config.socket, "GET", "/v1/plant");
    if (answer.status == 404)
      findings.warn("plant", "[plant] was added after the start of cellcald",
                    "sudo systemctl reload cellcald");
    else
      judge_plant(answer.body, findings);
  } catch (const SocketError& gone) {
    findings.skip("plant", gone.what());
  }
}

void judge_links_of(const std::string& status_text, Findings& findings) {
  const json status = json::parse(status_text, nullptr, false);
  const json links = status.is_object() ? status.value("links", json()) : json();
  if (!links.is_object()) {
    findings.skip("robot link", "the session has not opened its devices yet");
    findings.skip("contact link", "the session has not opened its devices yet");
    return;
  }
  const json robot = links.value("robot", json::object());
  const json contact = links.value("contact", json::object());
  judge_link("robot link", text(status, "robot"), trimmed(link_words({{"robot", robot}})),
             figure(robot, "late") + figure(robot, "gaps") + figure(robot, "bad_packets"),
             findings);
  judge_link("contact link", text(status, "contact"), trimmed(link_words({{"contact", contact}})),
             figure(contact, "crc_errors") + figure(contact, "gaps"), findings);
}

void judge_realtime(const DaemonConfig& config, const std::optional<ProcessRights>& daemon,
                    const std::vector<std::string>& own_warnings, Findings& findings) {
  const std::string check = "real time";
  if (!config.realtime) {
    findings.warn(check, "off (realtime = false)",
                  "set realtime = true for a real cell: otherwise a busy computer replies too "
                  "late");
    return;
  }
  const std::optional<ProcessRights> rights = daemon ? daemon : rights_of_unit();
  if (!rights) {
    if (own_warnings.empty()) {
      findings.ok(check, "granted to this process (no daemon runs, no service is installed)");
      return;
    }
    std::string words;
    for (const std::string& one : own_warnings) words += (words.empty() ? "" : "; ") + one;
    findings.warn(check,
                  "not granted to this process (no daemon runs, no service is installed): " + words,
                  "install systemd/cellcald.service, which grants it");
    return;
  }
  std::string lacks;
  if (!rights->realtime) lacks += "SCHED_FIFO (LimitRTPRIO=60)";
  if (!rights->locked_memory) {
    lacks += fmt::format("{}locked memory (LimitMEMLOCK=infinity)", lacks.empty() ? "" : ", ");
  }
  if (lacks.empty()) {
    findings.ok(check, rights->who + " may use SCHED_FIFO and lock its memory");
  } else {
    findings.warn(check, fmt::format("{} lacks {}", rights->who, lacks),
                  "start it as a service (systemd/cellcald.service), or grant these");
  }
}

}  // namespace cellcal::daemon
