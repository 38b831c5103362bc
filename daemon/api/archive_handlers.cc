// Sessions out of the journal and into it, and a copy of all of it.

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <nlohmann/json.hpp>

#include "daemon/api/handlers.h"
#include "daemon/api/http/json_text.h"
#include "daemon/api/network_files.h"
#include "daemon/archive/archive.h"
#include "daemon/files/printable.h"
#include "daemon/files/system_words.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;

std::filesystem::path path_in(const std::string& body, const char* key) {
  const json object = json::parse(body, nullptr, false);
  const bool fits =
      object.is_object() && object.size() == 1 && object.contains(key) && object[key].is_string();
  if (!fits)
    throw RequestError(fmt::format("the body must be {{\"{}\": \"/absolute/path\"}}", key));
  const std::string text = object[key];
  const std::filesystem::path path = text;
  if (!path.is_absolute() || printable(text) != text)
    throw RequestError(
        fmt::format("\"{}\" must be an absolute path without control characters", key));
  return path;
}

/// What is wrong with a file that was named is its sender's matter.
template <class Act>
auto as_request(Act act) {
  try {
    return act();
  } catch (const ArchiveError& wrong) {
    throw RequestError(wrong.what());
  } catch (const JournalError& wrong) {
    throw RequestError(wrong.what());
  } catch (const std::filesystem::filesystem_error& wrong) {
    throw RequestError(system_words(wrong));
  }
}

/// Write access to the folder of imports does not extend to reading other files.
void refuse_links_in(const std::filesystem::path& directory) {
  for (const auto& entry : std::filesystem::directory_iterator(directory))
    if (entry.is_symlink())
      throw RequestError(entry.path().string() +
                         ": is a link, and is not followed for a request over the network");
}

}  // namespace

std::optional<Response> Api::export_session(const Call& call) {
  const std::int64_t session = find(call).id;
  return as_request([&] {
    return Response{.body =
                        dump(json(make_archive(journal_, session, service_.results_dir(session))))};
  });
}

std::optional<Response> Api::import_session(const Call& call) {
  const std::filesystem::path directory = path_in(call.request.body, "directory");
  keep_within(call.request, directory,
              {"an export to be imported",
               "Place it there, or use 'cellcal import' on the cell's computer",
               {service_.imports_dir()}});
  Imported imported;
  as_request([&] {
    if (call.request.is_from_network()) refuse_links_in(directory);
    const Archive archive = read_archive(directory);
    service_.alone("an import", [&] {
      imported = import_archive(journal_, archive, directory.string(), [&](std::int64_t session) {
        return service_.results_dir(session);
      });
    });
  });
  if (imported.is_new)
    spdlog::info("session {} imported from {}", imported.session, directory.string());
  return Response{201, "application/json",
                  dump({{"session", imported.session}, {"new", imported.is_new}})};
}

std::optional<Response> Api::back_up(const Call& call) {
  const std::filesystem::path file = path_in(call.request.body, "file");
  keep_within(call.request, file,
              {"a backup",
               "Name a file there, or use 'cellcal backup' on the cell's computer",
               {service_.backups_dir()}});
  return as_request([&] {
    if (call.request.is_from_network()) std::filesystem::create_directories(service_.backups_dir());
    const std::vector<std::string> remarks = journal_.backup(file);
    for (const std::string& remark : remarks) spdlog::warn("{}", remark);
    spdlog::info("journal copied to {}", file.string());
    return Response{201, "application/json",
                    dump({{"file", file.string()},
                          {"bytes", std::filesystem::file_size(file)},
                          {"remarks", remarks}})};
  });
}

}  // namespace cellcal::daemon
