#pragma once
// The bytes of a file that is named as input, and files that are none whatever names them.

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <string>
#include <string_view>

namespace cellcal::calib {

/// Whole file as text. Throws FileError (calib/model/error.h) for directories, devices, missing files
/// and more than `max_bytes`.
std::string read_file(const std::filesystem::path& path, std::size_t max_bytes = 256u << 20);

/// Lower-case hexadecimal SHA-256.
std::string sha256(std::string_view bytes);
inline constexpr std::size_t kSha256Digits = 64;
/// Whether the text is one.
bool is_sha256(std::string_view text);

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
