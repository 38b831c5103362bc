#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "daemon/api/http/http.h"
#include "daemon/cli/backup.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/offline.h"
#include "daemon/config/config.h"
#include "daemon/doctor/doctor.h"
#include "daemon/doctor/machine.h"
#include "daemon/files/atomic_file.h"
#include "drivers/error.h"
#include "drivers/kuka/krl/krl_read.h"

namespace cellcal::daemon {

namespace {

/// Folder within an iiQWorks.Sim project (RSI 6).
std::string place_in_project(const std::string& name) {
  if (name.ends_with(".src")) return "Program, KRC/R1/Program";
  return std::string("Devices, Option packages, iiQKA.RobotSensorInterface, ") +
         (name.ends_with(".rsix") ? "Context" : "Ethernet configurations");
}

/// Folder on a KRC4.
std::string place_of(const std::string& name) {
  if (name == "CellcalEki.xml") return R"(C:\KRC\ROBOTER\Config\User\Common\EthernetKRL)";
  if (name.ends_with(".xml") || name.ends_with(".rsix") || name.ends_with(".rsi") ||
      name.ends_with(".diagram")) {
    return R"(C:\KRC\ROBOTER\Config\User\Common\SensorInterface)";
  }
  if (name.ends_with(".sub")) return R"(KRC:\R1\System)";
  return R"(KRC:\R1\Program)";
}

/// A deployment replaces the controller's files by those of the project.
constexpr const char* kIntoProject =
    "with a WorkVisual project: add the files to the project, too, its next deployment may remove "
    "what was only copied (drivers/kuka/krl/README.md, 'WorkVisual')\n";

/// RSI 6 supports no other way.
constexpr const char* kImport =
    "import each file into the iiQWorks.Sim project there, and deploy it "
    "(drivers/kuka/krl/README.md, 'iiQKA.OS2')\n";

/// Other resources of the controller in use.
std::string resources(const DaemonConfig& config, bool eki) {
  if (!eki) {
    return fmt::format(
        "check: flag {} is free, corrections of at most {} deg are wanted, this computer's "
        "address is {}\n",
        config.rsi_files.flag, config.rsi_files.correction_limit_deg, config.rsi_files.pc_address);
  }
  const drivers::EkiFilesConfig& c = config.controller;
  return fmt::format(
      "check that no other program uses: contact input $IN[{}], flags {} and {}, timers {} to "
      "{}, interrupts {} to {}\n",
      c.input, c.alive_flag, c.stop_flag, c.first_timer, c.first_timer + 2, c.first_interrupt,
      c.first_interrupt + 2);
}

/// Files of a folder, a backup, or a ZIP archive of either.
drivers::ControllerFiles read_controller_files(const std::filesystem::path& place) {
  constexpr std::size_t kMostBytes = 256u << 20;
  if (calib::krl::lower_case(place.extension().string()) != ".zip")
    return drivers::read_controller_folder(place);
  drivers::ControllerFiles files;
  for (ZippedFile& one : unzip(calib::read_file(place, kMostBytes), place.string(),
                               drivers::is_generated, kMostBytes))
    drivers::add_file(one.path, std::move(one.text), files);
  return files;
}

/// Exit status 1 with the first rejection as the reason, where a file must not be used.
int verify_installed(const KukaFilesCommand& command, const DaemonConfig& config, bool eki,
                     const std::optional<calib::Cell>& cell) {
  const auto objections = verify_files(config, eki ? WireKind::kEki : WireKind::kRsi,
                                       read_controller_files(command.verify), cell);
  nlohmann::json list = nlohmann::json::array();
  std::string words, first;
  std::size_t refused = 0;
  for (const drivers::FileFinding& one : objections) {
    list.push_back(
        {{"file", one.file}, {"line", one.line}, {"words", one.words}, {"refused", one.refused}});
    words += fmt::format("{:<8} {}\n", one.refused ? "FAILED" : "warning", to_string(one));
    if (one.refused && first.empty()) first = to_string(one);
    refused += one.refused ? 1 : 0;
  }
  if (objections.empty()) {
    words = fmt::format("ok       {} fits {}\n", command.verify.string(), command.config.string());
  }
  put(command.json ? json_text({{"fits", refused == 0}, {"objections", list}}) : words, {});
  if (refused == 0) return kSuccess;
  throw std::runtime_error(refused == 1 ? first
                                        : fmt::format("{} (and {} more)", first, refused - 1));
}

/// Requires a configured address; the error lists the addresses of this computer.
void require_address(const DaemonConfig& config, const std::filesystem::path& file) {
  const std::string& address = config.rsi_files.pc_address;
  if (!address.empty() && address != "0.0.0.0") return;
  throw drivers::ConfigError(fmt::format(
      "{}: pc_address is missing: bind = \"{}\" of [rsi] means every address, but the "
      "controller sends to one. Below [controller] write pc_address = \"A.B.C.D\" with this "
      "computer's address in the controller's RSI subnet (this computer has {})",
      file.string(), config.rsi.bind_address, fmt::join(own_addresses(), ", ")));
}

void print(const Finding& one, const calib::Language& language) {
  // English output has the names that --json has.
  const std::string check =
      language == calib::Language()
          ? one.check
          : calib::sentence_of("check." + one.check, language).value_or(one.check);
  std::string line =
      fmt::format("{:<8} {:<22} {}\n",
                  calib::words(std::string("say.outcome.") + to_string(one.outcome), language),
                  check, words(one.found, language));
  if (!one.advice.empty())
    line += fmt::format("{:<8} {:<22} -> {}\n", "", "", words(one.advice, language));
  std::fputs(line.c_str(), stdout);
  std::fflush(stdout);
}

calib::Phrase summary(const Findings& findings) {
  return {"say.doctor.summary",
          {{"ok", findings.count(Outcome::kOk)},
           {"warnings", findings.count(Outcome::kWarning)},
           {"failed", findings.count(Outcome::kFailed)},
           {"skipped", findings.count(Outcome::kSkipped)},
           {"what", !findings.green()                       ? "say.doctor.summary.failed"
                    : findings.count(Outcome::kWarning) > 0 ? "say.doctor.summary.warned"
                                                            : "say.doctor.summary.ready"}}};
}

nlohmann::json checks_of(const Findings& findings) {
  nlohmann::json checks = nlohmann::json::array();
  for (const Finding& one : findings.all()) checks.push_back(to_json(one));
  return checks;
}

std::string json_of(const Findings& findings) {
  return json_text({{"green", findings.green()},
                    {"ok", findings.count(Outcome::kOk)},
                    {"warnings", findings.count(Outcome::kWarning)},
                    {"failed", findings.count(Outcome::kFailed)},
                    {"skipped", findings.count(Outcome::kSkipped)},
                    {"checks", checks_of(findings)}});
}

/// Sends the findings to the daemon for the page's guide. Ignored where the daemon does not run, has another
/// configuration or refuses this user.
void send_findings(const DoctorCommand& command, const Findings& findings) {
  if (command.cell.empty()) return;
  try {
    const DaemonConfig config = load_config(command.config);
    const std::filesystem::path cell = std::filesystem::absolute(command.cell).lexically_normal();
    const calib::CellText text = calib::read_cell_text(cell);
    const nlohmann::json body{
        {"cell", cell.string()},
        {"cell_sha256", calib::sha256(text.cell_text + '\0' + text.robot_text)},
        {"config_sha256", config.text_sha256},
        {"checks", checks_of(findings)}};
    http_request(config.socket, "POST", "/v1/doctor/result",
                 body.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace));
  } catch (const std::exception&) {
    return;
  }
}

std::string names_of_failed(const Findings& findings) {
  std::string names;
  for (const Finding& one : findings.all()) {
    if (one.outcome != Outcome::kFailed || names.find(one.check) != std::string::npos) continue;
    names += (names.empty() ? "" : ", ") + one.check;
  }
  return names;
}

}  // namespace

int kuka_files(const KukaFilesCommand& command) {
  const DaemonConfig config = load_config(command.config);
  const bool eki = command.wire.empty() ? wire_of(config) == WireKind::kEki : command.wire == "eki";
  std::optional<calib::Cell> cell;
  if (!command.cell.empty()) cell = calib::load_cell(command.cell);
  if (eki && config.rsi_files.rsi_version == 6) {
    throw drivers::ConfigError(command.config.string() +
                               ": rsi_version = 6 (iiQKA.OS2) has no --wire eki: EthernetKRL 6 is "
                               "not supported. Use RSI");
  }
  if (!command.verify.empty()) return verify_installed(command, config, eki, cell);
  if (!eki) require_address(config, command.config);
  const drivers::ControllerFiles files = eki    ? drivers::eki_files(config.controller)
                                         : cell ? drivers::rsi_files(rsi_files_for(config, *cell))
                                                : drivers::rsi_files(config.rsi_files);
  const bool six = config.rsi_files.rsi_version == 6;
  std::filesystem::create_directories(command.output);
  nlohmann::json list = nlohmann::json::array();
  for (const auto& [name, text] : files) {
    write_atomically(command.output / name, text);
    list.push_back({{"file", (command.output / name).string()},
                    {"goes_to", six ? place_in_project(name) : place_of(name)}});
  }
  if (command.json) {
    put(json_text({{"files", list}}), {});
    return kSuccess;
  }
  std::string words;
  for (const auto& one : list) {
    words += fmt::format("{:<40} {}\n", one["file"].get<std::string>(),
                         one["goes_to"].get<std::string>());
  }
  words += resources(config, eki) + (six ? kImport : kIntoProject);
  if (!eki && !cell && !config.rsi_files.space.on) {
    words +=
        "no --cell CELL: the program keeps the axes within the software limit switches, not "
        "within the ranges of the cell's robot\n";
  }
  put(words, {});
  return kSuccess;
}

int doctor(const DoctorCommand& command) {
  const calib::Language language = language_of(command.language, command.config);
  DoctorRequest request;
  request.config = command.config;
  request.cell = command.cell;
  request.files = command.files;
  request.read_files = read_controller_files;
  request.wait_s = command.wait_s;
  request.observe_s = command.observe_s;
  if (::isatty(STDERR_FILENO) == 1) {
    request.hint = [language](const calib::Phrase& hint) {
      std::fprintf(stderr, "... %s\n", words(hint, language).c_str());
    };
  }
  Findings findings(command.json ? Findings::Listener()
                                 : [&](const Finding& one) { print(one, language); });
  examine(request, findings);
  if (command.json) {
    put(json_of(findings), {});
  } else {
    put(words(summary(findings), language) + "\n", {});
  }
  send_findings(command, findings);
  if (findings.green()) return kSuccess;
  throw std::runtime_error(names_of_failed(findings) + " failed");
}

}  // namespace cellcal::daemon
