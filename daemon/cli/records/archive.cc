#include "daemon/cli/records/archive.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "daemon/api/http/http.h"
#include "daemon/archive/replay.h"
#include "daemon/cli/ask.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;
namespace fs = std::filesystem;

Archive fetch(const Connection& daemon, std::int64_t session) {
  const Response response = ask(daemon, "GET", fmt::format("/v1/sessions/{}/export", session));
  Archive archive = json::parse(response.body).get<Archive>();
  check_archive(archive, fmt::format("session {}", session));
  return archive;
}

bool is_number(const std::string& text) {
  return !text.empty() &&
         std::all_of(text.begin(), text.end(), [](char c) { return c >= '0' && c <= '9'; });
}

json to_json(const Replay& result) {
  json value{{"same", result.same()},
             {"touches", result.touches},
             {"values", result.values},
             {"differing", result.differing},
             {"recorded_by", result.recorded_by},
             {"replayed_by", result.replayed_by},
             {"first", nullptr}};
  if (!result.first) return value;
  value["first"] = {{"where", result.first->where},
                    {"recorded", result.first->recorded},
                    {"replayed", result.first->replayed},
                    {"by", result.first->by ? json(*result.first->by) : json()}};
  return value;
}

}  // namespace

NamedArchive archive_of(const Connection& daemon, const std::string& which) {
  if (is_number(which) && !fs::is_directory(which))
    return {"session " + which, fetch(daemon, std::stoll(which))};
  return {which, read_archive(which)};
}

int export_session(const Connection& daemon, std::int64_t session, const fs::path& directory) {
  const Archive archive = fetch(daemon, session);
  write_archive(archive, directory);
  if (daemon.json) {
    put(json{{"session", session},
             {"directory", fs::absolute(directory).string()},
             {"files", archive.size()}}
                .dump() +
            "\n",
        {});
  } else {
    put(fmt::format("session {}: {} files in {}\n", session, archive.size(), directory.string()),
        {});
  }
  return kSuccess;
}

int import_session(const Connection& daemon, const fs::path& directory) {
  const Response response = ask(daemon, "POST", "/v1/import",
                                json{{"directory", fs::absolute(directory).string()}}.dump());
  if (daemon.json) {
    put(response.body + "\n", {});
    return kSuccess;
  }
  const json answer = json::parse(response.body);
  put(answer.value("new", false)
          ? fmt::format("imported as session {}. See 'cellcal show {}'\n", answer["session"].dump(),
                        answer["session"].dump())
          : fmt::format("these rows are in the journal already, as session {}\n",
                        answer["session"].dump()),
      {});
  return kSuccess;
}

int replay_session(const Connection& daemon, const std::string& which) {
  const NamedArchive named = archive_of(daemon, which);
  const Replay result = replay(named.archive, named.from);
  put(daemon.json ? to_json(result).dump() + "\n" : in_words(result), {});
  if (result.same()) return kSuccess;
  throw std::runtime_error(fmt::format("{} of {} values differ from what was recorded",
                                       result.differing, result.values));
}

int back_up(const Connection& daemon, const fs::path& file) {
  const Response response =
      ask(daemon, "POST", "/v1/backup", json{{"file", fs::absolute(file).string()}}.dump());
  if (daemon.json) {
    put(response.body + "\n", {});
    return kSuccess;
  }
  const json answer = json::parse(response.body);
  constexpr double kBytesPerMb = 1e6;
  std::string words = fmt::format("{:.1f} MB, read back whole: {}\n",
                                  answer["bytes"].get<double>() / kBytesPerMb, file.string());
  for (const json& remark : answer["remarks"]) words += remark.get<std::string>() + "\n";
  put(words, {});
  return kSuccess;
}

}  // namespace cellcal::daemon
