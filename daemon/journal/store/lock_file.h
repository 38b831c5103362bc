#pragma once
// One process at a time: a lock on a file that is nothing but a lock.

#include <sys/types.h>

#include <filesystem>
#include <vector>

namespace cellcal::daemon {

/// Holds an open file description lock on `path` as long as it lives. Unlike SQLite's own locks it
/// outlasts other descriptors of any file of this process. The file stays behind and means nothing.
class LockFile {
 public:
  /// Throws JournalError, which names `journal`, where another process has it or there can be none.
  LockFile(const std::filesystem::path& path, const std::filesystem::path& journal);
  ~LockFile();
  LockFile(const LockFile&) = delete;
  LockFile& operator=(const LockFile&) = delete;

 private:
  int descriptor_ = -1;
};

// The journal's files are those that were opened, whatever others do to their names.

class FileWatch {
 public:
  /// Takes the files as they are now. Throws JournalError where one is missing.
  FileWatch(std::filesystem::path journal, const std::vector<std::filesystem::path>& files);

  /// Throws JournalError where a file was removed, replaced or cut short since.
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
