#include "daemon/files/atomic_file.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "calib/files/text.h"

namespace cellcal::daemon {

namespace {

[[noreturn]] void fail(const std::filesystem::path& file, const char* what, int code) {
  throw std::runtime_error(file.string() + ": " + what + ": " + std::strerror(code));
}

class File {
 public:
  /// `named`: the user's file name, for error messages.
  File(const std::filesystem::path& path, std::filesystem::path named, int flags)
      : named_(std::move(named)), fd_(::open(path.c_str(), flags | O_CLOEXEC, 0644)) {
    if (fd_ < 0) fail(named_, "cannot be opened", errno);
  }
  ~File() {
    if (fd_ >= 0) ::close(fd_);
  }
  File(const File&) = delete;
  File& operator=(const File&) = delete;

  void write_all(std::string_view text) {
    while (!text.empty()) {
      const ssize_t written = ::write(fd_, text.data(), text.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) fail(named_, "cannot be written", errno);
      text.remove_prefix(static_cast<std::size_t>(written));
    }
  }
  /// Before any content is written. A file left by a killed process may have another mode.
  void close_to_others() {
    if (::fchmod(fd_, S_IRUSR | S_IWUSR) != 0) fail(named_, "cannot be kept from others", errno);
  }
  void sync() {
    if (::fsync(fd_) != 0) fail(named_, "cannot be written to disk", errno);
  }

 private:
  std::filesystem::path named_;
  int fd_;
};

/// Removes the temporary file unless it was renamed.
class Unfinished {
 public:
  explicit Unfinished(std::filesystem::path path) : path_(std::move(path)) {}
  ~Unfinished() {
    std::error_code ignored;  // the original error is reported
    if (!finished_) std::filesystem::remove(path_, ignored);
  }
  Unfinished(const Unfinished&) = delete;
  Unfinished& operator=(const Unfinished&) = delete;

  void becomes(const std::filesystem::path& path) {
    std::error_code code;
    std::filesystem::rename(path_, path, code);
    if (code) fail(path, "cannot be replaced", code.value());
    finished_ = true;
  }

 private:
  std::filesystem::path path_;
  bool finished_ = false;
};

}  // namespace

void write_atomically(const std::filesystem::path& path, std::string_view text, Readers readers) {
  std::filesystem::path temporary = path;
  temporary += ".part";
  {
    // A file left by a killed process is removed; a foreign link is not written through.
    std::error_code ignored;  // opening it reports the error
    if (!std::filesystem::is_directory(temporary, ignored))
      std::filesystem::remove(temporary, ignored);
    File file(temporary, path, O_WRONLY | O_CREAT | O_EXCL | O_NOFOLLOW);
    Unfinished begun(temporary);  // owned from here on
    if (readers == Readers::kOwner) file.close_to_others();
    file.write_all(text);
    file.sync();
    begun.becomes(path);
  }
  const std::filesystem::path parent = path.parent_path();
  File(parent.empty() ? "." : parent, path, O_RDONLY | O_DIRECTORY).sync();
}

std::filesystem::path set_aside(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path)) return {};
  std::filesystem::path aside = path.string() + ".before";
  for (int n = 2; std::filesystem::exists(aside); ++n)
    aside = path.string() + ".before-" + std::to_string(n);
  std::filesystem::rename(path, aside);
  return aside;
}

std::string system_words(const std::exception& error) {
  // The library's text contains its class names and error numbers.
  if (const auto* no_json = dynamic_cast<const nlohmann::json::parse_error*>(&error))
    return fmt::format("no JSON from byte {} on", no_json->byte);
  if (dynamic_cast<const nlohmann::json::exception*>(&error) != nullptr)
    return "a value is missing or of another type than is written there";
  const auto* of_file = dynamic_cast<const std::filesystem::filesystem_error*>(&error);
  if (of_file == nullptr) return error.what();
  const auto& path = of_file->path2().empty() ? of_file->path1() : of_file->path2();
  return fmt::format("{}: {}. Check the path, its permissions and the disk", path.string(),
                     of_file->code().message());
}

std::string printable(std::string_view text) {
  std::string line(text);
  for (std::size_t i = 0; i < line.size(); ++i)
    for (std::size_t left = calib::control_at(text, i); left > 0; --left) line[i + left - 1] = ' ';
  return line;
}

std::string shell_word(const std::string& text) {
  const auto is_plain = [](unsigned char c) {
    return std::isalnum(c) != 0 ||
           std::string_view("/._-+:,@%").find(static_cast<char>(c)) != std::string_view::npos;
  };
  if (!text.empty() && std::ranges::all_of(text, is_plain)) return text;
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

}  // namespace cellcal::daemon
