#include "daemon/plant/desk/desk_client.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "calib/model/error.h"

namespace cellcal::daemon::plant {

namespace {

/// Below the keep-alive limit of a broker, above the time to compose a large calibration on a slow computer.
constexpr std::chrono::seconds kMost{30};

/// Body of the answer. Throws SocketError.
std::string asked(const std::filesystem::path& socket, const char* method,
                  const std::string& target, const std::string& body = "") {
  Response answer = http_request(socket, method, target, body, kMost);
  if (answer.status == 200) return std::move(answer.body);
  const auto words = nlohmann::json::parse(answer.body, nullptr, false);
  throw OutboxError(words.is_object() && words.contains("error") && words["error"].is_string()
                        ? words["error"].get<std::string>()
                        : fmt::format("cellcald answered {}", answer.status));
}

template <class Read>
auto read_as(Read read) try {
  return read();
} catch (const SocketError& away) {
  throw OutboxError(away.what());
} catch (const calib::FileError& other) {
  throw OutboxError(std::string(other.what()) +
                    ". Check that cellcald and cellcal-plant are of the same version");
}

}  // namespace

Orders report_to_desk(const std::filesystem::path& socket, const LinesStatus& lines) {
  const std::string answer = asked(socket, "POST", "/v1/line", to_json(lines));
  return read_as([&] { return orders_from_json(answer); });
}

DeskClient::DeskClient(std::filesystem::path socket, const PlantConfig& as)
    : socket_(std::move(socket)), as_("?as=" + as.plant + "/" + as.cell) {}

WaitingCount DeskClient::count() {
  return read_as([&] { return count_from_json(asked(socket_, "GET", "/v1/count" + as_)); });
}

std::vector<WaitingFact> DeskClient::facts(std::int64_t after, std::size_t most) {
  return read_as([&] {
    return facts_from_lines(
        asked(socket_, "GET", fmt::format("/v1/facts{}&after={}&most={}", as_, after, most)));
  });
}

void DeskClient::acknowledge(const std::vector<std::int64_t>& rows) {
  for (std::size_t from = 0; from < rows.size(); from += kMostDeskRows) {
    const std::vector<std::int64_t> some(
        rows.begin() + static_cast<std::ptrdiff_t>(from),
        rows.begin() + static_cast<std::ptrdiff_t>(std::min(rows.size(), from + kMostDeskRows)));
    read_as([&] { return asked(socket_, "POST", "/v1/stored" + as_, rows_to_json(some)); });
  }
}

bool DeskClient::propose(const Proposal& proposal) {
  return read_as([&] {
    const std::string answer =
        asked(socket_, "POST", "/v1/proposals/" + proposal.id + as_, to_json(proposal));
    const auto json = nlohmann::json::parse(answer, nullptr, false);
    return json.is_object() && json.value("answered", nlohmann::json(false)) == true;
  });
}

}  // namespace cellcal::daemon::plant
