#pragma once
// Sessions as files, and copies of the journal. Each returns its exit status and throws when it
// failed.

#include <cstdint>
#include <filesystem>
#include <string>

#include "daemon/cli/client.h"
#include "daemon/archive/archive.h"

namespace cellcal::daemon {

struct NamedArchive {
  std::string from;  ///< "session 7", or the directory
  Archive archive;
};
/// Checked. `which`: a session's number, or the directory of an export, which needs no daemon.
NamedArchive archive_of(const Connection& daemon, const std::string& which);

int export_session(const Connection& daemon, std::int64_t session,
                   const std::filesystem::path& directory);
int import_session(const Connection& daemon, const std::filesystem::path& directory);
/// `which` as archive_of() takes it.
int replay_session(const Connection& daemon, const std::string& which);
int back_up(const Connection& daemon, const std::filesystem::path& file);

}  // namespace cellcal::daemon
