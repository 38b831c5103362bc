#include "tests/bench/plant/collector_process.h"

#include <fmt/format.h>
#include <stdlib.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <pqxx/pqxx>
#include <sstream>
#include <stdexcept>
#include <thread>

#include "daemon/api/http/http.h"

namespace cellcal::bench {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds kGiveUp{120};
constexpr std::chrono::milliseconds kPollInterval{50};

/// 0 while the database is down.
std::size_t touches_in(const std::string& database, std::int64_t session) {
  try {
    pqxx::connection connection(database);
    return pqxx::nontransaction(connection)
        .exec("SELECT count(*) FROM fleet.touches WHERE session = " + std::to_string(session))[0][0]
        .as<std::size_t>();
  } catch (const pqxx::broken_connection&) {
    return 0;
  }
}

}  // namespace

Folder::Folder() {
  std::string name = (std::filesystem::temp_directory_path() / "cellcal-bench-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error(name + ": cannot be made");
  path = name;
}

Folder::~Folder() {
  std::error_code ignored;
  std::filesystem::remove_all(path, ignored);
}

std::filesystem::path Folder::write(const std::string& name, const std::string& text) const {
  std::ofstream(path / name) << text;
  return path / name;
}

CollectorProcess::CollectorProcess(const std::string& program, const Folder& folder,
                                   std::uint16_t broker, const std::string& database, int number,
                                   bool wait, const std::string& broker_host)
    : socket_(folder.path / fmt::format("{}.sock", number)),
      process_({program, "--config",
                folder
                    .write(fmt::format("{}.toml", number),
                           fmt::format(
                               "format = \"cellcal.fleet/1\"\n[broker]\nhost = \"{}\"\nport = {}\n"
                               "client = \"bench-{}\"\n[limits]\nmessages_per_s = 1000\n"
                               "[database]\nconnection = \"{}\"\n[http]\nsocket = \"{}\"\n",
                               broker_host, broker, number, database, socket_.string()))
                    .string()},
               folder.path / "collectors.log") {
  const auto begun = Clock::now();
  while (wait && !is_up()) {
    if (Clock::now() - begun > kGiveUp) throw std::runtime_error(program + " does not come up");
    std::this_thread::sleep_for(kPollInterval);
  }
}

bool CollectorProcess::is_up() const {
  try {
    return daemon::http_request(socket_, "GET", "/metrics")
               .body.find("\ncellcal_fleet_broker_up 1") != std::string::npos;
  } catch (const daemon::SocketError&) {
    return false;
  }
}

double CollectorProcess::megabytes() const {
  constexpr double kKilo = 1024.0;
  std::ifstream status(fmt::format("/proc/{}/status", process_.working()));
  for (std::string line; std::getline(status, line);)
    if (line.starts_with("VmHWM:")) return std::stod(line.substr(6)) / kKilo;
  return 0.0;
}

double CollectorProcess::cpu_s() const {
  std::ifstream file(fmt::format("/proc/{}/stat", process_.working()));
  std::string text;
  std::getline(file, text);
  std::istringstream rest(text.substr(text.rfind(')') + 2));
  std::string field;
  double ticks = 0.0;
  // utime and stime are fields 14 and 15; the first remaining field is the 3rd.
  for (int i = 3; i <= 15 && rest >> field; ++i)
    if (i >= 14) ticks += std::stod(field);
  return ticks / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

void wait_for_touches(const std::string& database, std::int64_t session, std::size_t count) {
  const auto begun = Clock::now();
  while (true) {
    const std::size_t there = touches_in(database, session);
    if (there >= count) return;
    if (Clock::now() - begun > kGiveUp)
      throw std::runtime_error(fmt::format("{} of {} messages are in the table", there, count));
    std::this_thread::sleep_for(kPollInterval);
  }
}

}  // namespace cellcal::bench
