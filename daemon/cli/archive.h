#pragma once
// Sessions as files, and backups of the journal. Each function returns its exit status and throws on failure.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "daemon/archive/archive.h"
#include "daemon/cli/client.h"

namespace cellcal::daemon {

struct NamedArchive {
  std::string from;  ///< "session 7", or the directory
  Archive archive;
  std::optional<std::int64_t> session;  ///< none: from a directory
};
/// Validated. `which`: a session number, or the directory of an export, which needs no daemon.
NamedArchive archive_of(const Connection& daemon, const std::string& which);

struct ExportCommand {
  std::int64_t session = 0;
  std::filesystem::path directory;
  std::filesystem::path key;  ///< empty: default_key(), if it exists
  bool sign = true;
};
int export_session(const Connection& daemon, const ExportCommand& command);
/// Refuses files changed after signing, and reports the signer. `key`: public part of the signing key; empty:
/// that of default_key().
int import_session(const Connection& daemon, const std::filesystem::path& directory,
                   const std::filesystem::path& key);
/// `which`: as for archive_of().
int replay_session(const Connection& daemon, const std::string& which);
int back_up(const Connection& daemon, const std::filesystem::path& file);

}  // namespace cellcal::daemon
