#pragma once
// Reading of input files; refuses paths that are not regular files.

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace cellcal::calib {

/// Whole file as text. Throws FileError (calib/model/error.h) for directories, devices, missing files
/// and files larger than `max_bytes`.
std::string read_file(const std::filesystem::path& path, std::size_t max_bytes = 256u << 20);

/// Lower-case hexadecimal SHA-256.
std::string sha256(std::string_view bytes);
inline constexpr std::size_t kSha256Digits = 64;
/// True if the text is a SHA-256 in this form.
bool is_sha256(std::string_view text);

/// During its lifetime read_file() refuses the file without opening it, under any name. For files
/// on which the process holds POSIX locks: closing any descriptor of such a file drops them.
class Withheld {
 public:
  /// The file must exist; otherwise nothing is withheld.
  explicit Withheld(const std::filesystem::path& path);
  ~Withheld();
  Withheld(const Withheld&) = delete;
  Withheld& operator=(const Withheld&) = delete;

 private:
  dev_t device_ = 0;
  ino_t inode_ = 0;
};

}  // namespace cellcal::calib
