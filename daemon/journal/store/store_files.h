#pragma once
// Newest entry of the journal, stored outside of it to detect a lost tail.

#include <sys/types.h>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace cellcal::daemon {

struct Head {
  std::int64_t entries = 0;  ///< of the chain
  std::string sum;           ///< of the last one
};

/// Two lines of fixed length, written in turn: one of them is whole whenever the power fails.
class HeadFile {
 public:
  /// Opens or creates the file. Throws JournalError, which names `journal`.
  HeadFile(std::filesystem::path path, std::filesystem::path journal);
  ~HeadFile();
  HeadFile(const HeadFile&) = delete;
  HeadFile& operator=(const HeadFile&) = delete;

  /// The newer line; nothing from an empty file. Throws JournalError where no line is whole.
  std::optional<Head> read();
  /// Returns when it is on disk. Throws JournalError.
  void write(const Head& head);

 private:
  [[noreturn]] void fail(const std::string& words) const;

  std::filesystem::path path_, journal_;
  int descriptor_ = -1;
  int next_line_ = 0;
};

// Exclusive access of one process: a lock on a file of its own.

/// Holds an open file description lock on `path` during its lifetime. Unlike SQLite's own locks it is
/// independent of other descriptors of this process. The empty file is not removed.
class LockFile {
 public:
  /// Throws JournalError naming `journal` if another process holds the lock or locking fails.
  LockFile(const std::filesystem::path& path, const std::filesystem::path& journal);
  ~LockFile();
  LockFile(const LockFile&) = delete;
  LockFile& operator=(const LockFile&) = delete;

 private:
  int descriptor_ = -1;
};

// Detects journal files that were removed, replaced or truncated.

class FileWatch {
 public:
  /// Records the current files. Throws JournalError if one is missing.
  FileWatch(std::filesystem::path journal, const std::vector<std::filesystem::path>& files);

  /// Throws JournalError if a file was removed, replaced or truncated since.
  void check();

 private:
  struct File {
    std::filesystem::path path;
    dev_t device = 0;
    ino_t inode = 0;
    off_t size = 0;  ///< these files never shrink
  };
  std::filesystem::path journal_;
  std::vector<File> files_;
};

}  // namespace cellcal::daemon
