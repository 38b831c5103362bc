#pragma once
// Sessions as files, and copies of the journal. Each returns its exit status and throws when it
// failed.

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
/// Checked. `which`: a session's number, or the directory of an export, which needs no daemon.
NamedArchive archive_of(const Connection& daemon, const std::string& which);

struct ExportCommand {
  std::int64_t session = 0;
  std::filesystem::path directory;
  std::filesystem::path key;  ///< empty: default_key(), where there is one
  bool sign = true;
};
int export_session(const Connection& daemon, const ExportCommand& command);
/// Refuses what was changed after it was signed, and says whose it is. `key`: public part of the one that signed it; empty:
/// that of default_key().
int import_session(const Connection& daemon, const std::filesystem::path& directory,
                   const std::filesystem::path& key);
/// `which` as archive_of() takes it.
int replay_session(const Connection& daemon, const std::string& which);
int back_up(const Connection& daemon, const std::filesystem::path& file);

}  // namespace cellcal::daemon
