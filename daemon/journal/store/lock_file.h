#pragma once
// Exclusive access of one process by a lock on a separate file.

#include <sys/types.h>

#include <filesystem>
#include <vector>

namespace cellcal::daemon {

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
  void look();

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
