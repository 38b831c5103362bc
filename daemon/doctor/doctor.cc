// The daemon, its rights, and the links of its current session.

#include "daemon/doctor/doctor.h"

#include <unistd.h>

#include <cerrno>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/files/json.h"
#include "daemon/api/http/http.h"
#include "daemon/doctor/wires.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

using calib::Phrase;

std::optional<DaemonConfig> examine_config(const DoctorRequest& request, Findings& findings) {
  try {
    DaemonConfig config = load_config(request.config);
    findings.ok("configuration",
                {"say.doctor.config",
                 {{"file", request.config.string()}, {"backend", to_string(config.backend)}}});
    return config;
  } catch (const std::exception& error) {
    findings.fail("configuration", error.what(), "say.doctor.config.do");
    return std::nullopt;
  }
}

void examine_links(const DoctorRequest& request, const DaemonConfig& config,
                   const std::optional<calib::Cell>& cell,
                   const std::optional<ProcessRights>& rights, Findings& findings) {
  if (config.backend != BackendKind::kMock)
    return examine_wires(request, config, cell, rights, findings);
  findings.warn("wires", "say.doctor.wires.mock", "say.doctor.wires.mock.do");
}

/// Sessions of a few nights.
constexpr double kFewMegabytes = 100.0;

using nlohmann::json;

/// `words`: complaint of the device itself. `losses`: share of faulty messages.
/// `up`: it delivers, so that `words` speak of its losses.
void judge_link(const std::string& check, const std::string& words, bool up, const Phrase& figures,
                double losses, Findings& findings) {
  if (!words.empty()) {
    up ? findings.warn(check, words, "say.doctor.link.losses.do")
       : findings.fail(check, words, "say.doctor.link.do");
  } else if (losses > 0.0) {
    findings.warn(check, figures, "say.doctor.link.losses.do");
  } else {
    findings.ok(check, figures);
  }
}

}  // namespace

void examine(const DoctorRequest& request, Findings& findings) {
  const std::optional<DaemonConfig> config = examine_config(request, findings);
  if (!config) return;
  const std::optional<calib::Cell> cell = examine_cell(request, *config, findings);
  examine_files(request, *config, cell, findings);
  examine_schedule(*config, findings);
  examine_state_dir(config->state_dir, findings);
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
              {"say.doctor.config.loaded", {{"backend", to_string(config.backend)}}});
  const std::optional<calib::Cell> cell = examine_cell(request, config, findings);
  if (request.stop.stop_requested()) return;
  examine_state_dir(config.state_dir, findings);
  std::optional<ProcessRights> rights = rights_of_process(::getpid());
  // Its groups are not visible in the service's sandbox: access to a device is checked by opening it.
  if (rights) rights->uid.reset();
  examine_links(request, config, cell, rights, findings);
}

void judge_state_dir(const std::filesystem::path& directory, double free_bytes, bool written,
                     Findings& findings) {
  const std::string check = "state directory";
  const double mb = free_bytes / 1e6;
  const Phrase found("say.doctor.state_dir", {{"mb", mb}, {"directory", directory.string()}});
  if (mb < kFewMegabytes)
    findings.warn(check, found, "say.doctor.state_dir.few.do");
  else if (written)
    findings.ok(check, found);
  else
    findings.skip(check, {"say.doctor.state_dir.unwritten", {{"free", found}}});
}

void examine_state_dir(const std::filesystem::path& directory, Findings& findings) try {
  if (!std::filesystem::exists(directory))
    return findings.skip("state directory",
                         {"say.doctor.state_dir.none", {{"directory", directory.string()}}});
  const bool may_write = ::access(directory.c_str(), W_OK) == 0 || errno != EACCES;
  if (may_write) {
    const auto probe = directory / ("doctor-" + std::to_string(::getpid()));
    write_atomically(probe, std::string(4096, '\n'));
    std::filesystem::remove(probe);
  }
  const std::filesystem::space_info space = std::filesystem::space(directory);
  judge_state_dir(directory, static_cast<double>(space.available), may_write, findings);
} catch (const std::exception& error) {
  findings.fail("state directory", system_words(error), "say.doctor.state_dir.do");
}

std::optional<DaemonSeen> examine_daemon(const DaemonConfig& config, Findings& findings) {
  const std::string check = "daemon";
  DaemonSeen seen;
  try {
    seen.status = http_request(config.socket, "GET", "/v1/status").body;
  } catch (const SocketPermissionError&) {
    findings.fail(check, {"say.doctor.daemon.permission", {{"socket", config.socket.string()}}},
                  "say.doctor.daemon.permission.do");
    return std::nullopt;
  } catch (const SocketError&) {
    findings.warn(check, {"say.doctor.daemon.stopped", {{"socket", config.socket.string()}}},
                  "say.doctor.daemon.stopped.do");
    return std::nullopt;
  }
  const json status = calib::parse_json(seen.status);
  if (!status.is_object()) {
    findings.fail(check, {"say.doctor.daemon.other", {{"socket", config.socket.string()}}},
                  "say.doctor.daemon.other.do");
    return std::nullopt;
  }
  seen.running = status.value("running", json(false)) == true;
  if (const auto process = process_behind(config.socket)) seen.rights = rights_of_process(*process);
  const std::string version = text_in(status, "version"), own = calib::software_version();
  const Phrase found = seen.running ? Phrase("say.doctor.daemon.busy",
                                             {{"session", number_in(status, "session")},
                                              {"phase", "say.phase." + text_in(status, "phase")}})
                                    : Phrase("say.doctor.daemon.idle");
  if (version != own) {
    findings.warn(
        check,
        {"say.doctor.daemon.version", {{"found", found}, {"version", version}, {"own", own}}},
        "sudo systemctl restart cellcald");
  } else {
    findings.ok(check, found);
  }
  return seen;
}

Phrase connected_since(const json& line, bool connected) {
  return {connected ? "say.doctor.plant.connected" : "say.doctor.plant.not_connected",
          {{"time", printable(text_in(line, "since"))}}};
}

void judge_sparkplug(const json& line, Findings& findings) {
  const std::string check = "sparkplug";
  const bool connected = line.value("connected", json()) == true;
  const Phrase found = connected_since(line, connected);
  if (connected)
    findings.ok(check, found);
  else
    findings.warn(check, found,
                  or_else(printable(text_in(line, "words")), "say.doctor.plant.wait.do"));
}

void judge_plant(const std::string& plant, Findings& findings) {
  const std::string check = "plant";
  const json line = calib::parse_json(plant);
  if (!line.is_object() || !line.contains("connected")) {
    findings.skip(check, "say.doctor.plant.unknown");
    return;
  }
  const bool connected = line["connected"] == true;
  const double waiting = number_in(line, "waiting");
  Phrase found{"say.doctor.plant.queued", {{"messages", waiting}}};
  if (const std::string oldest = text_in(line, "oldest"); !oldest.empty())
    found =
        joined("say.join.comma", found, {"say.doctor.plant.oldest", {{"time", printable(oldest)}}});
  found = joined("say.join.semicolon", found, connected_since(line, connected));
  if (const double dropped = number_in(line, "dropped") + number_in(line, "not_begun");
      dropped > 0.0)
    found =
        joined("say.join.semicolon", found, {"say.doctor.plant.dropped", {{"messages", dropped}}});
  const std::string words = printable(text_in(line, "words"));
  if (!words.empty() || !connected)
    findings.warn(check, found, or_else(words, "say.doctor.plant.wait.do"));
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
      findings.warn("plant", "say.doctor.plant.added", "sudo systemctl reload cellcald");
    else
      judge_plant(answer.body, findings);
  } catch (const SocketError& gone) {
    findings.skip("plant", gone.what());
  }
}

void judge_links_of(const std::string& status_text, Findings& findings) {
  const json status = calib::parse_json(status_text);
  const json links = status.is_object() ? status.value("links", json()) : json();
  if (!links.is_object()) {
    findings.skip("robot link", "say.doctor.link.closed");
    findings.skip("contact link", "say.doctor.link.closed");
    return;
  }
  const json robot = links.value("robot", json::object());
  const json contact = links.value("contact", json::object());
  const bool arm_seen = motion_of(status.value("arm", json())) != ArmMotion::kUnknown;
  judge_link("robot link", text_in(status, "robot"), arm_seen, robot_link_phrase(robot),
             number_in(robot, "late") + number_in(robot, "gaps") + number_in(robot, "bad_packets"),
             findings);
  judge_link("contact link", text_in(status, "contact"), false, contact_link_phrase(contact),
             number_in(contact, "crc_errors") + number_in(contact, "gaps"), findings);
}

void judge_realtime(const DaemonConfig& config, const std::optional<ProcessRights>& daemon,
                    const std::vector<std::string>& own_warnings, Findings& findings) {
  const std::string check = "real time";
  if (!config.realtime) {
    findings.warn(check, "say.doctor.realtime.off", "say.doctor.realtime.off.do");
    return;
  }
  const std::optional<ProcessRights> rights = daemon ? daemon : rights_of_unit();
  if (!rights) {
    if (own_warnings.empty()) {
      findings.ok(check, "say.doctor.realtime.own");
      return;
    }
    Phrase warnings;
    for (const std::string& one : own_warnings)
      warnings = joined("say.join.semicolon", warnings, one);
    findings.warn(check, {"say.doctor.realtime.own.not", {{"warnings", warnings}}},
                  "say.doctor.realtime.own.not.do");
    return;
  }
  Phrase lacks;
  if (!rights->realtime) lacks = "SCHED_FIFO (LimitRTPRIO=60)";
  if (!rights->locked_memory) lacks = joined("say.join.comma", lacks, "say.doctor.realtime.memory");
  if (lacks.empty()) {
    findings.ok(check, {"say.doctor.realtime", {{"who", rights->who}}});
  } else {
    findings.warn(check, {"say.doctor.realtime.lacks", {{"who", rights->who}, {"lacks", lacks}}},
                  "say.doctor.realtime.lacks.do");
  }
}

}  // namespace cellcal::daemon
