#pragma once
// Files that are no input, whatever names them.

#include <sys/types.h>

#include <filesystem>

namespace cellcal::calib {

/// As long as this lives, read_file() refuses the file without opening it, under any name. For
/// files that the process holds POSIX locks on: closing any descriptor of such a file drops them.
class Withheld {
 public:
  /// The file must exist; one that does not is not withheld.
  explicit Withheld(const std::filesystem::path& path);
  ~Withheld();
  Withheld(const Withheld&) = delete;
  Withheld& operator=(const Withheld&) = delete;

 private:
  dev_t device_ = 0;
  ino_t inode_ = 0;
};

}  // namespace cellcal::calib
