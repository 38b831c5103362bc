#pragma once
// Reading of input files; refuses paths that are not regular files.

#include <sys/types.h>

#include <cstddef>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "calib/model/error.h"

namespace cellcal::calib {

/// Whole file as text. Throws FileError (calib/model/error.h) for directories, devices, missing files
/// and files larger than `max_bytes`.
std::string read_file(const std::filesystem::path& path, std::size_t max_bytes = 256u << 20);

/// Ends the message of a missing file, of a process that does not see all folders. Before other threads read.
void set_advice_for_missing_files(std::string advice);

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

/// During its lifetime, the files that read_file() reads on this thread are noted, so that a program can
/// refuse to replace them. Only one at a time; without one nothing is noted.
class UsedFiles {
 public:
  enum class As { kRead, kWritten };

  UsedFiles();
  ~UsedFiles();
  UsedFiles(const UsedFiles&) = delete;
  UsedFiles& operator=(const UsedFiles&) = delete;

  static void note(const std::filesystem::path& file, As as);
  /// Use of the file that has this name, under any name; nullopt: unused.
  static std::optional<As> of(const std::filesystem::path& file);

 private:
  std::vector<std::pair<std::filesystem::path, As>> files_;
};

// A refused value of a file whose place in the document is known.

struct KeyError : FileError {
  /// The message is `about` + `place` + `path_in_file` + ": " + `what_is_wrong`; place ":12: ".
  KeyError(const std::string& about, const std::string& place, std::string path_in_file,
           std::string what_is_wrong)
      : FileError(about, place + path_in_file + ": " + what_is_wrong),
        path(std::move(path_in_file)),
        reason(std::move(what_is_wrong)) {}

  std::string
      path;  ///< TOML, counted from 1: "target[2].diameter_mm"; JSON, from 0: ".spheres[1].mm"
  std::string reason;  ///< without the place
};

}  // namespace cellcal::calib
