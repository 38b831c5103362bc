#include "daemon/doctor/doctor.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "daemon/api/http/http.h"
#include "daemon/cli/offline.h"
#include "daemon/config/config.h"

namespace cellcal::daemon {

namespace {

void print(const Finding& one) {
  std::string line = fmt::format("{:<8} {:<22} {}\n", to_string(one.outcome), one.check, one.found);
  if (!one.advice.empty()) line += fmt::format("{:<8} {:<22} -> {}\n", "", "", one.advice);
  std::fputs(line.c_str(), stdout);
  std::fflush(stdout);
}

nlohmann::json checks_of(const Findings& findings) {
  nlohmann::json checks = nlohmann::json::array();
  for (const Finding& one : findings.all()) checks.push_back(to_json(one));
  return checks;
}

std::string json_of(const Findings& findings) {
  // Text from devices may hold any bytes.
  return nlohmann::json{{"green", findings.green()},
                        {"ok", findings.count(Outcome::kOk)},
                        {"warnings", findings.count(Outcome::kWarning)},
                        {"failed", findings.count(Outcome::kFailed)},
                        {"skipped", findings.count(Outcome::kSkipped)},
                        {"checks", checks_of(findings)}}
             .dump(1, ' ', false, nlohmann::json::error_handler_t::replace) +
         "\n";
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

int doctor(const DoctorCommand& command) {
  DoctorRequest request;
  request.config = command.config;
  request.cell = command.cell;
  request.files = command.files;
  request.wait_s = command.wait_s;
  request.observe_s = command.observe_s;
  if (::isatty(STDERR_FILENO) == 1) {
    request.hint = [](const std::string& words) {
      std::fprintf(stderr, "... %s\n", words.c_str());
    };
  }
  Findings findings(command.json ? Findings::Listener() : print);
  examine(request, findings);
  if (command.json) {
    put(json_of(findings), {});
  } else {
    put(fmt::format("{} ok, {} warnings, {} failed, {} skipped: {}\n", findings.count(Outcome::kOk),
                    findings.count(Outcome::kWarning), findings.count(Outcome::kFailed),
                    findings.count(Outcome::kSkipped),
                    !findings.green() ? "correct what FAILED, from top to bottom"
                    : findings.count(Outcome::kWarning) > 0
                        ? "ready; read the warnings before the first motion"
                        : "ready"),
        {});
  }
  send_findings(command, findings);
  if (findings.green()) return kSuccess;
  throw std::runtime_error(names_of_failed(findings) + " failed");
}

}  // namespace cellcal::daemon
