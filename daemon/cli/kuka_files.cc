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
  if (name.ends_with(".sub")) return R"(KRC:\R1\System)";
  return R"(KRC:\R1\Program)";
}

}  // namespace

int kuka_files(const KukaFilesCommand& command) {
  const DaemonConfig config = load_config(command.config);
  const drivers::ControllerFiles files = drivers::eki_files(config.controller);
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
  words += fmt::format(
      "contact input $IN[{}], flags {} and {}, timers {} to {}, interrupts {} and {}: make sure "
      "that nobody else uses them\n",
      config.controller.input, config.controller.alive_flag, config.controller.stop_flag,
      config.controller.first_timer, config.controller.first_timer + 2,
      config.controller.first_interrupt, config.controller.first_interrupt + 1);
  put(words, {});
  return kSuccess;
}

}  // namespace cellcal::daemon
