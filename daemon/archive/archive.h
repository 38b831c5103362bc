#pragma once
// A session as plain files, format "cellcal.export/1": to be kept, read, replayed and imported
// without the journal that recorded it.
//
//   export.json       what the others are, with their SHA-256
//   rows.jsonl        the journal's rows with their checksums (daemon/journal/rows.h): the evidence
//   cell.toml, robot.toml, options.json       what the session worked on (also in the rows)
//   touches.csv, calibration.json             what came of it (also in the rows)
//   compared.json     the earlier calibration that the result was held against
//   report.html
//
// The same session gives the same files, so they are told apart by the sum of their rows.

#include <filesystem>
#include <functional>
#include <map>
#include <stdexcept>
#include <string>

#include "daemon/journal/journal.h"

namespace cellcal::daemon {

/// Names the file, and says what is wrong with it.
struct ArchiveError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Name to content.
using Archive = std::map<std::string, std::string>;

/// Throws JournalError; ArchiveError where there is no such session.
Archive make_archive(Journal& journal, std::int64_t session,
                     const std::filesystem::path& results_dir);

/// Throws ArchiveError where a file is missing, damaged, altered or of a newer format. `from` stands
/// before the names.
void check_archive(const Archive& archive, const std::string& from);
/// From a directory, checked.
Archive read_archive(const std::filesystem::path& directory);
/// All of it or nothing, into a directory that is not there yet or empty.
void write_archive(const Archive& archive, const std::filesystem::path& directory);

struct Imported {
  std::int64_t session = 0;
  bool is_new = false;  ///< false: these rows are in the journal already
};
/// Checked before. Its result's files as well, into this directory; the report stays where it is:
/// what another made is not shown as the daemon's own. Throws JournalError.
Imported import_archive(Journal& journal, const Archive& archive, const std::string& from,
                        const std::function<std::filesystem::path(std::int64_t)>& results_dir);

// A directory that goes with what was looked at in it.

class ScratchDirectory {
 public:
  /// Throws ArchiveError where none can be made.
  ScratchDirectory();
  ~ScratchDirectory();
  ScratchDirectory(const ScratchDirectory&) = delete;
  ScratchDirectory& operator=(const ScratchDirectory&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace cellcal::daemon
