#pragma once
// A directory that goes with what was looked at in it.

#include <filesystem>

namespace cellcal::daemon {

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
