#include <fmt/format.h>
#include <fmt/ranges.h>

#include <nlohmann/json.hpp>

#include "daemon/certificate/certificate.h"
#include "daemon/certificate/signing/signed_files.h"
#include "daemon/cli/offline/exit_status.h"
#include "daemon/cli/offline/offline.h"
#include "daemon/cli/records/certificate.h"

namespace cellcal::daemon {

namespace {

using nlohmann::json;
using signing::NotVerified;

/// Nobody can say whether they are; else they are not.
bool is_open(NotVerified::Why why) {
  return why == NotVerified::Why::kNoSignature || why == NotVerified::Why::kMissingFile;
}

std::string or_not_stated(const std::string& text) { return text.empty() ? "not stated" : text; }

}  // namespace

int verify(const VerifyCommand& command) try {
  const signing::PublicKey key(command.key.empty() ? signing::public_part(default_key())
                                                   : command.key);
  const signing::Verified verified = signing::verify_files(command.file, key);
  const signing::Statement& is = verified.statement;
  const bool emulated = is.certificate.starts_with(certificate::kEmulatedNumber);
  put(command.json
          ? json{{"verified", true},
                 {"failure", nullptr},
                 {"certificate", is.certificate},
                 {"emulated", emulated},
                 {"signed_by", is.by},
                 {"signed_at", is.utc},
                 {"key", is.key},
                 {"files", verified.files}}
                    .dump() +
                "\n"
          : fmt::format(
                "verified: {}{}\n{}signed by: {}\nsigned at: {}\nkey: {}\nfiles: {}\n",
                verified.kind == signing::Kind::kExport ? "" : "certificate ", is.certificate,
                emulated
                    ? "emulated cell: a simulation, no real robot was touched. It certifies no "
                      "robot\n"
                    : "",
                or_not_stated(is.by), is.utc, is.key, fmt::join(verified.files, ", ")),
      {});
  return kSuccess;
} catch (const NotVerified& error) {
  if (command.json)
    put(json{{"verified", false},
             {"failure", signing::to_string(error.why)},
             {"words", error.what()}}
                .dump() +
            "\n",
        {});
  std::fprintf(stderr, "cellcal verify: %s\n", error.what());
  return is_open(error.why) ? kJobFailed : kNotPublishable;
}

}  // namespace cellcal::daemon
