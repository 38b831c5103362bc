#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "daemon/cli/exit_status.h"
#include "daemon/cli/offline.h"
#include "daemon/main/config.h"
#include "daemon/session/atomic_file.h"
#include "drivers/kuka/krl_files.h"

namespace cellcal::daemon {

namespace {

/// Where a technician puts it on a KRC4.
std::string place_of(const std::string& name) {
  if (name == "CellcalEki.xml") return R"(C:\KRC\ROBOTER\Config\User\Common\EthernetKRL)";
  if (name.ends_with(".xml") || name.ends_with(".rsix")) {
    return R"(C:\KRC\ROBOTER\Config\User\Common\SensorInterface)";
  }
  if (name.ends_with(".sub")) return R"(KRC:\R1\System)";
  return R"(KRC:\R1\Program)";
}

/// What else of the controller they use.
std::string resources(const DaemonConfig& config, bool eki) {
  if (!eki) {
    return fmt::format(
        "flag {}, corrections of at most {} deg, TCP/IP address {} of this computer: check them\n",
        config.rsi_files.flag, config.rsi_files.correction_limit_deg, config.rsi_files.pc_address);
  }
  const drivers::EkiFilesConfig& c = config.controller;
  return fmt::format(
      "contact input $IN[{}], flags {} and {}, timers {} to {}, interrupts {} and {}: make sure "
      "that nobody else uses them\n",
      c.input, c.alive_flag, c.stop_flag, c.first_timer, c.first_timer + 2, c.first_interrupt,
      c.first_interrupt + 1);
}

}  // namespace

int kuka_files(const KukaFilesCommand& command) {
  const DaemonConfig config = load_config(command.config);
  const bool eki = command.wire.empty() ? wire_of(config) == WireKind::kEki : command.wire == "eki";
  const drivers::ControllerFiles files =
      eki ? drivers::eki_files(config.controller) : drivers::rsi_files(config.rsi_files);
  std::filesystem::create_directories(command.output);
  nlohmann::json list = nlohmann::json::array();
  for (const auto& [name, text] : files) {
    write_atomically(command.output / name, text);
    list.push_back({{"file", (command.output / name).string()}, {"goes_to", place_of(name)}});
  }
  if (command.json) {
    put(nlohmann::json{{"files", list}}.dump(1) + "\n", {});
    return kSuccess;
  }
  std::string words;
  for (const auto& one : list) {
    words += fmt::format("{:<40} {}\n", one["file"].get<std::string>(),
                         one["goes_to"].get<std::string>());
  }
  words += resources(config, eki);
  put(words, {});
  return kSuccess;
}

}  // namespace cellcal::daemon
