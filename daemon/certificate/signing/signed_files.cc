#include "daemon/certificate/signing/signed_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <sstream>

#include "calib/files/files.h"
#include "calib/syntax/input_file.h"
#include "daemon/files/atomic_file.h"
#include "daemon/files/printable.h"

namespace cellcal::daemon::signing {

namespace {

namespace fs = std::filesystem;
using Why = NotVerified::Why;

constexpr const char* kFormat = "# cellcal.signature/1";
constexpr std::size_t kShaDigits = 64;
constexpr std::size_t kMostLines = 100;

struct Sums {
  Statement statement;
  std::vector<std::pair<std::string, std::string>> files;  ///< name, SHA-256
};

std::string text_of(const Sums& sums) {
  std::string text =
      fmt::format("{}\n# certificate: {}\n# signed at: {}\n# signed by: {}\n# key: {}\n", kFormat,
                  printable(sums.statement.certificate), printable(sums.statement.utc),
                  printable(sums.statement.by), sums.statement.key);
  for (const auto& [name, sum] : sums.files) text += fmt::format("{}  {}\n", sum, name);
  return text;
}

std::optional<std::string> behind(const std::string& line, const std::string& mark) {
  if (!line.starts_with(mark)) return std::nullopt;
  return line.substr(mark.size());
}

bool is_sum(const std::string& text) {
  return text.size() == kShaDigits &&
         text.find_first_not_of("0123456789abcdef") == std::string::npos;
}

/// Nothing where it is none of ours.
std::optional<Sums> sums_of(const std::string& text) {
  Sums sums;
  std::istringstream lines(text);
  std::string line;
  if (!std::getline(lines, line) || line != kFormat) return std::nullopt;
  for (std::size_t i = 0; i < kMostLines && std::getline(lines, line); ++i) {
    if (const auto value = behind(line, "# certificate: "))
      sums.statement.certificate = *value;
    else if (const auto at = behind(line, "# signed at: "))
      sums.statement.utc = *at;
    else if (const auto by = behind(line, "# signed by: "))
      sums.statement.by = *by;
    else if (const auto key = behind(line, "# key: "))
      sums.statement.key = *key;
    else if (line.size() > kShaDigits + 2 && is_sum(line.substr(0, kShaDigits)))
      sums.files.emplace_back(line.substr(kShaDigits + 2), line.substr(0, kShaDigits));
    else
      return std::nullopt;
  }
  if (sums.files.empty() || !is_sum(sums.statement.key)) return std::nullopt;
  return sums;
}

std::string read_or_refuse(const fs::path& path) {
  std::error_code code;
  if (!fs::exists(path, code))
    throw NotVerified(
        Why::kNoSignature,
        path.string() +
            ": is missing: not signed. Ask the issuer for all files of the certificate");
  return calib::read_file(path);
}

Sums signed_sums(const fs::path& directory, const PublicKey& key) {
  const std::string text = read_or_refuse(directory / kSums),
                    signature = read_or_refuse(directory / kSignature);
  const auto sums = sums_of(text);
  if (!sums)
    throw NotVerified(Why::kDamagedSignature,
                      (directory / kSums).string() +
                          ": damaged. Ask the issuer for all files of the certificate");
  if (sums->statement.key != key.fingerprint())
    throw NotVerified(
        Why::kOtherKey,
        fmt::format("{}: signed by another key, {}; expected {}. Name the issuer's: --key FILE",
                    (directory / kSums).string(), sums->statement.key, key.fingerprint()));
  if (!key.verifies(text, signature))
    throw NotVerified(
        Why::kDamagedSignature,
        fmt::format("{}: the signature is not of {}: one of them was changed after it was signed. "
                    "Ask the issuer for all files of the certificate",
                    (directory / kSignature).string(), kSums));
  return *sums;
}

void verify_one(const fs::path& file, const Sums& sums, Verified& verified) {
  const std::string sum = calib::sha256(calib::read_file(file));
  if (std::ranges::any_of(sums.files, [&](const auto& one) { return one.second == sum; })) {
    verified.files.push_back(file.filename().string());
    return;
  }
  const bool listed = std::ranges::any_of(
      sums.files, [&](const auto& one) { return one.first == file.filename(); });
  throw NotVerified(
      listed ? Why::kChangedFile : Why::kNotListed,
      file.string() + (listed ? ": was changed after it was signed. Ask the issuer for it"
                              : ": is none of the files that were signed"));
}

}  // namespace

const char* to_string(Why why) {
  switch (why) {
    case Why::kNoSignature:
      return "no_signature";
    case Why::kDamagedSignature:
      return "damaged_signature";
    case Why::kOtherKey:
      return "other_key";
    case Why::kChangedFile:
      return "changed_file";
    case Why::kNotListed:
      return "not_listed";
    case Why::kMissingFile:
      return "missing_file";
  }
  return "";
}

void sign_files(const fs::path& directory, const std::vector<std::string>& names,
                Statement statement, const PrivateKey& key) {
  statement.key = key.fingerprint();
  Sums sums{std::move(statement), {}};
  for (const std::string& name : names)
    sums.files.emplace_back(name, calib::sha256(calib::read_file(directory / name)));
  const std::string text = text_of(sums);
  write_atomically(directory / kSignature, key.sign(text));
  write_atomically(directory / kSums, text);
}

Verified verify_files(const fs::path& file, const PublicKey& key) {
  std::error_code code;
  const bool whole = fs::is_directory(file, code);
  const fs::path directory = whole                    ? file
                             : file.has_parent_path() ? file.parent_path()
                                                      : fs::path(".");
  if (!whole) (void)calib::read_file(file);  // what is not there is not unsigned
  const Sums sums = signed_sums(directory, key);
  Verified verified{sums.statement, {}};
  if (!whole) {
    verify_one(file, sums, verified);
    return verified;
  }
  for (const auto& [name, sum] : sums.files) {
    const fs::path one = directory / fs::path(name).filename();
    if (!fs::exists(one, code))
      throw NotVerified(Why::kMissingFile,
                        one.string() + ": was signed, and is missing. Ask the issuer for it");
    verify_one(one, sums, verified);
  }
  return verified;
}

}  // namespace cellcal::daemon::signing
