#pragma once
// One process at a time: a lock on a file that is nothing but a lock.

#include <filesystem>

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

}  // namespace cellcal::daemon
