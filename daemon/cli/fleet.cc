#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <vector>

#include "calib/files/input_file.h"
#include "calib/model/linear.h"
#include "daemon/api/http/http.h"
#include "daemon/cli/actions.h"
#include "daemon/cli/offline.h"
#include "daemon/files/atomic_file.h"
#include "daemon/plant/messages/text_fields.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

constexpr std::size_t kDay = 10;  // YYYY-MM-DD

/// Adapts socket errors to the collector.
Response ask_fleet(const Connection& fleet, const std::string& target) {
  try {
    return ask(fleet, "GET", target);
  } catch (const SocketPermissionError&) {
    throw;
  } catch (const SocketError&) {
    throw std::runtime_error(
        "no cellcal-fleet answers on " + fleet.socket.string() +
        ". Start it (sudo systemctl start cellcal-fleet), or give its socket with --socket");
  }
}

std::string text(const json& value, std::size_t most = std::string::npos) {
  return value.is_string() ? printable(value.get<std::string>()).substr(0, most) : "-";
}

std::string number(const json& value) {
  return value.is_number() ? fmt::format("{:.3f}", value.get<double>()) : "-";
}

std::string cell_name(const json& row) {
  return text(row.at("plant")) + "/" + text(row.at("cell"));
}

std::string presence(const json& cell) {
  if (!cell.at("online").is_boolean()) return "unknown";
  return cell.at("online").get<bool>() ? "online" : "offline";
}

std::string cell_line(const json& cell) {
  std::string line =
      fmt::format("{:<24}  {:<7}  {:<12}  {:<10}  {:>7}\n", cell_name(cell), presence(cell),
                  text(cell.at("state")), text(cell.at("calibrated_at"), kDay),
                  number(cell.at(cell.at("over_mm").is_null() ? "near_mm" : "over_mm")));
  for (const json& need : cell.at("needs")) line += "    " + need_words(need) + "\n";
  return line;
}

std::string fleet_words(const json& cells) {
  if (cells.empty()) return "no cell has published yet\n";
  const auto needy = std::count_if(cells.begin(), cells.end(),
                                   [](const json& c) { return !c.at("needs").empty(); });
  std::string words = fmt::format("{} of {} cells need attention\n\n", needy, cells.size());
  words += fmt::format("{:<24}  {:<7}  {:<12}  {:<10}  {:>8}\n", "cell", "", "session",
                       "calibrated", "error mm");
  for (const json& cell : cells) words += cell_line(cell);
  return words;
}

std::string overdue_words(const json& all) {
  if (all.empty()) return "nothing is overdue\n";
  std::string words = fmt::format("{:<24}  {:<12}  {:<10}  {}\n", "cell", "of", "last", "due");
  for (const json& one : all)
    words += fmt::format("{:<24}  {:<12}  {:<10}  {}\n", cell_name(one), text(one.at("of")),
                         one.at("last").is_null() ? "never" : text(one.at("last"), kDay),
                         text(one.at("due"), kDay));
  return words;
}

double median_of(const json& rows, const std::string& parameter) {
  std::vector<double> values;
  for (const json& row : rows)
    if (row.at("parameter") == parameter) values.push_back(row.at("correction").get<double>());
  return calib::median_between(std::move(values));
}

std::string compare_words(const json& compared) {
  const json& rows = compared.at("corrections");
  if (rows.empty())
    return fmt::format("no calibration in use of a \"{}\" has a joint {}\n",
                       text(compared.at("robot")), text(compared.at("joint")));
  constexpr double kExpanded = 2.0;
  std::string words = fmt::format("{:<12}  {:<24}  {:>12}  {:>10}  {:>12}  {}\n", "parameter",
                                  "cell", "correction", "U (k=2)", "from median", "unit");
  for (const json& row : rows) {
    const auto parameter = row.at("parameter").get<std::string>();
    const double correction = row.at("correction").get<double>();
    words +=
        fmt::format("{:<12}  {:<24}  {:>+12.4g}  {:>10.3g}  {:>+12.3g}  {}\n", printable(parameter),
                    cell_name(row), correction, kExpanded * row.at("sigma").get<double>(),
                    correction - median_of(rows, parameter), text(row.at("unit")));
  }
  return words;
}

/// "KR 5" percent-encoded for a query.
std::string escaped(const std::string& plain) {
  std::string out;
  for (const char c : plain) {
    const bool letter = ('a' <= c && c <= 'z') || ('A' <= c && c <= 'Z') ||
                        ('0' <= c && c <= '9') || c == '-' || c == '_';
    out += letter ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return out;
}

const char* list_of(Exported what) { return what == Exported::kCheck ? "checks" : "calibrations"; }

bool is_asked_for(const json& row, const FleetExport& command) {
  return (!command.session || row.at("session") == *command.session) &&
         (command.journal.empty() || row.at("journal") == command.journal) &&
         (command.what != Exported::kCertificate || row.at("certificate").get<bool>());
}

/// The newest matching row of the cell's list.
json find_row(const Connection& fleet, const FleetExport& command) {
  const json cell = parse(ask_fleet(fleet, "/v1/fleet/cells/" + command.cell));
  for (const json& row : cell.at(list_of(command.what)))
    if (is_asked_for(row, command)) return row;
  throw std::runtime_error(command.cell +
                           ": not found. See 'cellcal fleet status --json' and the cell's own "
                           "history");
}

void require_sum(const std::string& bytes, const std::string& sum, const std::string& name) {
  if (calib::sha256(bytes) != sum)
    throw std::runtime_error(printable(name) + ": damaged, SHA-256 does not match. Try again");
}

/// "check_touches, rank" as words.
std::string finding_words(std::string_view names) {
  std::string words;
  for (std::size_t at = 0; at < names.size();) {
    const std::size_t end = std::min(names.find(',', at), names.size());
    const std::string name(names.substr(at, end - at)), id = "finding." + name;
    words += (words.empty() ? "" : ", ") +
             (calib::sentence_of(id) ? calib::words(calib::Phrase(id)) : name);
    at = end + 2;
  }
  return words;
}

/// By the need; the detail takes the place of {}.
const std::map<std::string, const char*> kNeedWords{
    {"interrupted", "session interrupted ({}). At the cell: cellcal status"},
    {"failed", "session failed: {}"},
    {"drifted", "drift alarm: {}. Calibrate again"},
    {"check-not-held", "check: calibration does not hold{}. Calibrate again"},
    {"offline", "offline: {}"},
    {"gap", "{} messages missing or refused. At the cell: cellcal history; refused ones: view fleet.refusals"},
    {"withheld", "newest calibration withheld{}"},
    {"overdue", "{} due"}};

}  // namespace

int fleet_status(const Connection& fleet) {
  const Response response = ask_fleet(fleet, "/v1/fleet/cells");
  put(fleet.json ? response.body + "\n" : fleet_words(parse(response).at("cells")), {});
  return kSuccess;
}

int fleet_overdue(const Connection& fleet) {
  const Response response = ask_fleet(fleet, "/v1/fleet/overdue");
  const json all = parse(response).at("overdue");
  put(fleet.json ? response.body + "\n" : overdue_words(all), {});
  return all.empty() ? kSuccess : kNotPublishable;
}

int fleet_compare(const Connection& fleet, const std::string& robot, const std::string& joint) {
  const Response response =
      ask_fleet(fleet, "/v1/fleet/compare?robot=" + escaped(robot) + "&joint=" + escaped(joint));
  put(fleet.json ? response.body + "\n" : compare_words(parse(response)), {});
  return kSuccess;
}

int fleet_export(const Connection& fleet, const FleetExport& command) {
  const json row = find_row(fleet, command);
  const std::string target =
      fmt::format("/{}/{}", row.at("journal").get<std::string>(), row.at("session").dump());
  const std::string of_cell = "/v1/fleet/cells/" + command.cell + "/";
  if (command.what == Exported::kCertificate) {
    const json files = parse(ask_fleet(fleet, of_cell + "certificates" + target)).at("files");
    std::filesystem::create_directories(command.output);
    for (const json& file : files) {
      const std::string bytes =
          plant::from_base64(file.at("base64").get<std::string>()).value_or("");
      const std::string name = std::filesystem::path(file.at("name").get<std::string>()).filename();
      require_sum(bytes, file.at("sha256").get<std::string>(), name);
      write_atomically(command.output / name, bytes);
    }
    return kSuccess;
  }
  const Response document = ask_fleet(fleet, of_cell + list_of(command.what) + target);
  require_sum(document.body, row.at("sha256").get<std::string>(), command.cell);
  put(document.body, command.output);
  return kSuccess;
}

std::string need_words(const json& need) {
  constexpr std::size_t kDay = 10;  // YYYY-MM-DD
  const std::string what = need.value("what", "");
  std::string detail = need.at("detail").is_string() ? need.at("detail").get<std::string>() : "";
  if (what == "check-not-held" && !detail.empty()) detail = ", likely " + detail;
  if (what == "withheld" && !detail.empty()) detail = ": " + finding_words(detail);
  if (what == "offline")
    detail = detail == "farewell" ? "shut down" : "connection lost. Check network and power";
  const auto known = kNeedWords.find(what);
  std::string words =
      known == kNeedWords.end() ? what : fmt::format(fmt::runtime(known->second), detail);
  const json& since = need.at("since");
  if (since.is_string()) words += " (since " + since.get<std::string>().substr(0, kDay) + ")";
  return printable(words);
}

}  // namespace cellcal::daemon
