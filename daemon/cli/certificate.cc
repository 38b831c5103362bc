#include "daemon/certificate/certificate.h"

#include <fmt/format.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <vector>

#include "calib/files/calibration_json.h"
#include "calib/files/input_file.h"
#include "calib/model/enum_table.h"
#include "daemon/api/http/http.h"
#include "daemon/cli/actions.h"
#include "daemon/cli/commands.h"
#include "daemon/cli/offline.h"
#include "daemon/files/atomic_file.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/runner/backend.h"

namespace cellcal::daemon {

namespace {

namespace fs = std::filesystem;

constexpr int kNotNew = 200;  ///< of POST .../certificate; 201 if new

/// Never overwrites an earlier certificate.
void make_directory(const fs::path& directory) {
  std::error_code code;
  if (fs::exists(directory / signing::kSums, code))
    throw std::runtime_error(
        directory.string() +
        ": contains a signed certificate. Choose another directory with --out DIR");
  if (fs::exists(directory, code) && !fs::is_empty(directory, code))
    throw std::runtime_error(directory.string() +
                             ": exists and is not empty. Choose another with --out DIR");
  fs::create_directories(directory);
}

/// $CELLCAL_KEY
std::optional<fs::path> named_key() {
  const char* set = std::getenv("CELLCAL_KEY");
  if (set == nullptr || *set == '\0') return std::nullopt;
  return set;
}

/// Signing requires that the rows are the recorded ones, not only that the figures follow from them.
void refuse_unless_proven(const Connection& daemon, const CertificateCommand& command,
                          const NamedArchive& named, const SigningKey& key) {
  const auto refuse = [&](const std::string& why) {
    throw certificate::Refused(
        certificate::Refused::Why::kNotProven,
        fmt::format(
            "{}: {}. Use the session at the daemon that recorded it, or an export signed there: "
            "'--export-key FILE.pub'. Unsigned: --no-sign",
            named.from, why));
  };
  if (named.session) {
    const Response shown = ask(daemon, "GET", fmt::format("/v1/sessions/{}", *named.session));
    if (!nlohmann::json::parse(shown.body).at("imported").is_null())
      refuse("imported from another journal, and not signed there for all that this one knows");
    return;
  }
  try {
    const signing::PublicKey by(
        command.export_key.empty() ? signing::public_part(key.file) : command.export_key,
        "--export-key");
    signing::verify_files(named.from, by, signing::Kind::kExport);
  } catch (const signing::NotVerified& not_proven) {
    refuse(not_proven.what());
  }
}

/// Returns why there is no PDF; the certificate is then complete without it, and signed so.
std::string add_pdf(const fs::path& directory, const std::string& html, const std::string& pdf,
                    std::vector<std::string>& names) try {
  certificate::write_pdf(directory / html, directory / pdf);
  names.push_back(pdf);
  return {};
} catch (const std::runtime_error& error) {
  return error.what();
}

/// SHA-256 of content and signer, independent of the date of issue.
std::string content_of(certificate::CertificateData data, const std::string& rows,
                       const std::vector<std::string>& names,
                       const std::optional<signing::PrivateKey>& key) {
  data.content["issued"] = data.content["issued_local"] = certificate::Entry();
  std::string all = certificate::to_json(data) + calib::sha256(rows);
  for (const std::string& name : names) all += '\n' + name;
  if (key) all += '\n' + key->fingerprint();
  return calib::sha256(all);
}

enum class Announced {
  kNo,   ///< the daemon belongs to no plant, or the session came from a directory
  kNow,  ///< queued
  kBefore
};

/// Notifies the plant of a signed or unsigned certificate.
Announced send_to_plant(const Connection& daemon, const std::string& session,
                        const std::string& number, const std::string& content,
                        const fs::path& directory, const std::vector<std::string>& names) {
  if (session.find_first_not_of("0123456789") != std::string::npos) return Announced::kNo;
  if (http_request(daemon.socket, "GET", "/v1/plant").status == 404) return Announced::kNo;
  std::vector<plant::CertificateFile> files;
  for (const std::string& name : names) files.push_back({name, calib::read_file(directory / name)});
  try {
    const plant::FactBody fact = plant::certificate_fact(number, std::move(files));
    nlohmann::json body = plant::json_of(fact);
    body["content"] = content;
    const Response answer =
        ask(daemon, "POST", "/v1/sessions/" + session + "/certificate", body.dump());
    return answer.status == kNotNew ? Announced::kBefore : Announced::kNow;
  } catch (const std::exception& error) {
    throw std::runtime_error(fmt::format("certificate {} is in {}, but not sent to the plant: {}",
                                         number, directory.string(), error.what()));
  }
}

const char* words_of(Announced announced) {
  using enum Announced;
  static constexpr EnumNames<Announced> kTable{
      {{kNo, ""}, {kNow, ", on its way to the plant"}, {kBefore, ", already sent to the plant"}}};
  return kTable[announced];
}

void print_outcome(const Connection& daemon, const std::string& number, const fs::path& directory,
                   bool is_signed, Announced plant) {
  print_result(
      daemon.json,
      {{"number", number},
       {"directory", fs::absolute(directory).string()},
       {"signed", is_signed},
       {"plant", plant != Announced::kNo}},
      fmt::format(
          "certificate {} in {}{}, {}\n", number, directory.string(), words_of(plant),
          is_signed ? "signed" : "not signed. Make a key once: 'cellcal certificate --make-key'"));
}

}  // namespace

fs::path default_key() { return named_key().value_or("/etc/cellcal/certificate.key"); }

std::optional<SigningKey> signing_key(const fs::path& named, bool sign) {
  if (!sign) return std::nullopt;
  if (!named.empty()) return SigningKey{signing::PrivateKey(named), named};
  if (named_key()) return SigningKey{signing::PrivateKey(*named_key()), *named_key()};
  auto usual = signing::key_if_there(default_key());
  return usual ? std::optional(SigningKey{std::move(*usual), default_key()}) : std::nullopt;
}

int make_certificate_key(const fs::path& key, bool json) {
  signing::make_key(key);
  const fs::path other = signing::public_part(key);
  const std::string fingerprint = signing::PublicKey(other).fingerprint();
  return print_result(
      json, {{"key", key.string()}, {"public", other.string()}, {"fingerprint", fingerprint}},
      fmt::format(
          "private key {}: keep it readable by you only\npublic key {}, fingerprint {}: give it "
          "to those who verify\n",
          key.string(), other.string(), fingerprint));
}

int certify(const Connection& daemon, const CertificateCommand& command) try {
  const NamedArchive named = archive_of(daemon, command.session);
  const certificate::CertificateData data = certificate::make_certificate(
      named.archive, named.from, {wall_clock_utc(), command.issued_by, calib::software_version()});
  const std::string number = data.entry("number").text;
  const fs::path directory =
      command.output.empty() ? fs::path("certificate-" + number) : command.output;
  // An unusable key is reported before anything is written.
  const auto signer = signing_key(command.key, command.sign);
  certificate::refuse_unless_reproduced(named.archive, named.from);
  if (signer) refuse_unless_proven(daemon, command, named, *signer);
  const std::optional<signing::PrivateKey> key = signer ? std::optional(signer->key) : std::nullopt;
  make_directory(directory);
  write_atomically(directory / "certificate.json", certificate::to_json(data));
  const calib::Language language = language_of(daemon.language);
  const std::string html = certificate::document_name(language, "html");
  write_atomically(directory / html, certificate::to_html(data, language));
  write_atomically(directory / "certificate.dcc.xml", certificate::to_dcc(data));
  // Raw data from which every figure can be recomputed.
  write_atomically(directory / "rows.jsonl", named.archive.at("rows.jsonl"));
  std::vector<std::string> names{"certificate.json", html, "certificate.dcc.xml", "rows.jsonl"};
  const std::string no_pdf =
      command.pdf ? add_pdf(directory, html, certificate::document_name(language, "pdf"), names)
                  : "";
  if (key)
    signing::sign_files(directory, names,
                        {number, data.entry("issued_by").text, data.entry("issued").text, ""},
                        *key);
  if (key) names.insert(names.end(), {signing::kSums, signing::kSignature});
  const std::string content = content_of(data, named.archive.at("rows.jsonl"), names, key);
  const Announced announced =
      send_to_plant(daemon, command.session, number, content, directory, names);
  print_outcome(daemon, number, directory, key.has_value(), announced);
  if (!no_pdf.empty())
    throw std::runtime_error(
        no_pdf + fmt::format("\nThe other files are in {}{}. For a PDF issue it again: --out DIR",
                             directory.string(), key ? ", signed without it" : ""));
  return kSuccess;
} catch (const certificate::Refused& refused) {
  if (refused.why == certificate::Refused::Why::kNoCalibration) throw;
  std::fprintf(stderr, "cellcal certificate: %s\n", refused.what());
  return kNotPublishable;
}

}  // namespace cellcal::daemon
