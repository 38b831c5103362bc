#pragma once
// A session as plain files, format "cellcal.export/1": can be stored, read, replayed and imported without the
// journal that recorded it.
//
//   export.json       list of the other files with their SHA-256
//   rows.jsonl        the journal's rows with their checksums (daemon/journal/rows.h): the evidence
//   cell.toml, robot.toml, options.json       inputs of the session (also in the rows)
//   touches.csv, calibration.json             results (also in the rows)
//   compared.json     the earlier calibration that the result was compared with
//   report.html
//
// The same session gives the same files; exports are identified by the sum of their rows.

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <stdexcept>
#include <string>

#include "daemon/journal/journal.h"

namespace cellcal::daemon {

/// The text names the file and the fault.
struct ArchiveError : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Name to content.
using Archive = std::map<std::string, std::string>;

/// Throws JournalError; ArchiveError where the session does not exist.
Archive make_archive(Journal& journal, std::int64_t session,
                     const std::filesystem::path& results_dir);

/// Throws ArchiveError where a file is missing, damaged, altered or of a newer format. `from`: prefix of the
/// names in messages.
void check_archive(const Archive& archive, const std::string& from);
/// Reads and validates a directory.
Archive read_archive(const std::filesystem::path& directory);
/// Writes all files or none, into a new or empty directory.
void write_archive(const Archive& archive, const std::filesystem::path& directory);

struct Imported {
  std::int64_t session = 0;
  bool is_new = false;  ///< false: the journal already contains these rows
};
/// The archive has to be validated. Writes the result's files into the directory as well, except for the
/// report: foreign content is not shown as the daemon's own. Throws JournalError.
Imported import_archive(Journal& journal, const Archive& archive, const std::string& from,
                        const std::function<std::filesystem::path(std::int64_t)>& results_dir);

// Temporary directory, removed with its content.

class ScratchDirectory {
 public:
  /// Throws ArchiveError where it cannot be created.
  ScratchDirectory();
  ~ScratchDirectory();
  ScratchDirectory(const ScratchDirectory&) = delete;
  ScratchDirectory& operator=(const ScratchDirectory&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// Retention rule for raw data of old sessions.

struct RetentionRule {
  std::optional<int> days;          ///< drops raw rows of sessions that ended earlier
  std::optional<double> megabytes;  ///< drops the oldest raw rows until the journal is not larger

  bool any() const { return days || megabytes; }
  bool operator==(const RetentionRule&) const = default;
};

/// `now`: seconds since 1970, UTC.
RetentionLimits limits_of(const RetentionRule& rule, std::int64_t now);

// Recomputation of a recorded session: identical to the bit, or the differences.

/// First value in which two results differ.
struct Difference {
  std::string where;  ///< JSON pointer into calibration.json, "/parameters/3/correction"
  std::string recorded, replayed;  ///< as JSON; "" where missing
  std::optional<double> by;        ///< replayed minus recorded, of numbers
};

struct Replay {
  std::string recorded_by, replayed_by;  ///< software versions
  std::size_t touches = 0;
  std::size_t values = 0;     ///< compared values
  std::size_t differing = 0;  ///< 0: identical to the bit
  std::optional<Difference> first;

  bool same() const { return differing == 0; }
};

/// Compares two calibrations' JSON value by value; software versions are reported, not compared.
Replay compare(const std::string& recorded, const std::string& replayed);

/// From its rows: inputs, touches, identification, verdict. Throws ArchiveError without a recorded
/// calibration, JournalError and calib::FileError where its rows cannot be read.
Replay replay(const Archive& archive, const std::string& from);

/// One or a few lines, for display.
std::string in_words(const Replay& replay);

}  // namespace cellcal::daemon
