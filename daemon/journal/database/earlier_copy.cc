#include "daemon/journal/database/earlier_copy.h"

#include <fmt/format.h>

#include "daemon/journal/database/database_copy.h"
#include "daemon/journal/database/schema.h"
#include "daemon/journal/store/error.h"

namespace cellcal::daemon {

namespace {

constexpr int kAllPages = -1;

std::filesystem::path copy_of(const Database& database, int version) {
  return fmt::format("{}.version-{}", database.name(), version);
}

}  // namespace

std::filesystem::path keep_earlier(Database& database, int version, const Head& end) {
  std::filesystem::path path = copy_of(database, version);
  // Of a take-over that was killed; the journal itself is still what counts.
  std::filesystem::remove(path);
  DatabaseCopy copy(database, path);
  while (copy.step(kAllPages)) continue;
  copy.look_through(end);
  copy.publish();
  return path;
}

std::vector<std::string> drop_earlier(Database& database) {
  std::vector<std::string> words;
  if (database.integer("SELECT count(*) FROM session WHERE state='done' AND software IS NOT NULL "
                       "AND origin IS NULL") == 0)
    return words;
  for (int version = 1; version < kSchemaVersion; ++version) {
    const std::filesystem::path path = copy_of(database, version);
    std::error_code code;
    if (std::filesystem::remove(path, code))
      words.push_back("journal " + database.name() + ": sessions of this version are done; " +
                      path.filename().string() + ", kept of the version before, was removed");
  }
  return words;
}

}  // namespace cellcal::daemon
