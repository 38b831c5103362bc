#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <vector>

#include "daemon/api/http/http.h"
#include "daemon/certificate/signed_files.h"
#include "daemon/cli/actions.h"
#include "daemon/cli/offline.h"
#include "daemon/runner/backend.h"

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
  constexpr std::size_t kMostDigits = 18;  // of a 64-bit number
  return !text.empty() && text.size() <= kMostDigits &&
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

/// Signer of an export.
struct Signature {
  bool there = false;
  std::optional<signing::Statement> by;  ///< verified
  std::string words;                     ///< why it is not verified
};

/// Throws NotVerified where the files differ from the signed ones.
Signature signature_of(const fs::path& directory, const fs::path& key) {
  Signature result{signing::has_signature(directory, signing::Kind::kExport), {}, {}};
  if (!result.there) return result;
  try {
    const signing::PublicKey by(key.empty() ? signing::public_part(default_key()) : key);
    result.by = signing::verify_files(directory, by, signing::Kind::kExport).statement;
  } catch (const signing::KeyError& none) {
    result.words = none.what();
  } catch (const signing::NotVerified& other) {
    if (other.why != signing::NotVerified::Why::kOtherKey) throw;
    result.words = other.what();
  }
  return result;
}

json to_json(const Signature& signature) {
  if (!signature.there) return nullptr;
  const auto stated = [&](std::string signing::Statement::*member) {
    return signature.by ? json(*signature.by.*member) : json();
  };
  return {{"verified", signature.by.has_value()},
          {"signed_by", stated(&signing::Statement::by)},
          {"signed_at", stated(&signing::Statement::utc)},
          {"key", stated(&signing::Statement::key)},
          {"words", signature.words}};
}

std::string in_words(const Signature& signature) {
  if (!signature.there) return "not signed: origin of its rows not verified\n";
  if (!signature.by) return "signed, not verified: " + signature.words + "\n";
  return fmt::format("signed by {} at {}, key {}\n", signature.by->by, signature.by->utc,
                     signature.by->key);
}

}  // namespace

NamedArchive archive_of(const Connection& daemon, const std::string& which) {
  if (is_number(which) && !fs::is_directory(which))
    return {"session " + which, fetch(daemon, std::stoll(which)), std::stoll(which)};
  return {which, read_archive(which), {}};
}

int export_session(const Connection& daemon, const ExportCommand& command) {
  const auto signer = signing_key(command.key, command.sign);
  const Archive archive = fetch(daemon, command.session);
  write_archive(archive, command.directory);
  if (signer) {
    std::vector<std::string> names;
    for (const auto& [name, text] : archive) names.push_back(name);
    signing::sign_files(
        command.directory, names,
        {fmt::format("export of session {}", command.session), user_name(), wall_clock_utc(), ""},
        signer->key, signing::Kind::kExport);
  }
  return print_result(
      daemon.json,
      {{"session", command.session},
       {"directory", fs::absolute(command.directory).string()},
       {"files", archive.size()},
       {"signed", signer.has_value()}},
      fmt::format("session {}: {} files in {}, {}\n", command.session, archive.size(),
                  command.directory.string(), signer ? "signed" : "not signed"));
}

int import_session(const Connection& daemon, const fs::path& directory, const fs::path& key) {
  const Signature signature = signature_of(directory, key);
  const Response response = ask(daemon, "POST", "/v1/import",
                                json{{"directory", fs::absolute(directory).string()}}.dump());
  json answer = json::parse(response.body);
  answer["signature"] = to_json(signature);
  const std::string session = answer["session"].dump();
  return print_result(
      daemon.json, answer,
      (answer.value("new", false)
           ? fmt::format("imported as session {}. See 'cellcal show {}'\n", session, session)
           : fmt::format("these rows are in the journal already, as session {}\n", session)) +
          in_words(signature));
}

int replay_session(const Connection& daemon, const std::string& which) {
  const NamedArchive named = archive_of(daemon, which);
  const Replay result = replay(named.archive, named.from);
  print_result(daemon.json, to_json(result), in_words(result));
  if (result.same()) return kSuccess;
  throw std::runtime_error(fmt::format("{} of {} values differ from what was recorded",
                                       result.differing, result.values));
}

int back_up(const Connection& daemon, const fs::path& file) {
  const Response response =
      ask(daemon, "POST", "/v1/backup", json{{"file", fs::absolute(file).string()}}.dump());
  if (is_missing(file))
    throw std::runtime_error(
        file.string() +
        ": written where only the daemon sees it; the service has a /tmp of its own. Name a file "
        "elsewhere, such as /var/lib/cellcal/" +
        file.filename().string());
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
