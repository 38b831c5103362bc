#pragma once
// The journal's files are those that were opened, whatever others do to their names.

#include <sys/types.h>

#include <filesystem>
#include <vector>

namespace cellcal::daemon {

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
