#pragma once
// Sessions as files, and copies of the journal. Each returns its exit status and throws when it
// failed.

#include <cstdint>
#include <filesystem>
#include <string>

#include "daemon/cli/client.h"

namespace cellcal::daemon {

int export_session(const Connection& daemon, std::int64_t session,
                   const std::filesystem::path& directory);
int import_session(const Connection& daemon, const std::filesystem::path& directory);
/// A session's number, or the directory of an export, which needs no daemon.
int replay_session(const Connection& daemon, const std::string& which);
int back_up(const Connection& daemon, const std::filesystem::path& file);

}  // namespace cellcal::daemon
