#include "calib/files/input_file.h"

#include <fcntl.h>
#include <openssl/evp.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <boost/algorithm/hex.hpp>
#include <cerrno>
#include <cstring>
#include <mutex>
#include <utility>
#include <vector>

#include "calib/model/error.h"

namespace cellcal::calib {

namespace {

using Identity = std::pair<dev_t, ino_t>;

struct WithheldFiles {
  std::mutex mutex;
  std::vector<Identity> files;
};

WithheldFiles& withheld() {
  static WithheldFiles all;
  return all;
}

bool is_withheld(const struct stat& info) {
  WithheldFiles& all = withheld();
  const std::lock_guard lock(all.mutex);
  return std::find(all.files.begin(), all.files.end(), Identity(info.st_dev, info.st_ino)) !=
         all.files.end();
}

const char* kind_of(mode_t mode) {
  if (S_ISDIR(mode)) return "is a directory";
  if (S_ISFIFO(mode)) return "is a pipe";
  if (S_ISSOCK(mode)) return "is a socket";
  return "is a device";
}

void refuse_other_than_files(const std::string& name, const struct stat& info,
                             std::size_t max_bytes) {
  if (!S_ISREG(info.st_mode))
    throw FileError(name, std::string(": ") + kind_of(info.st_mode) + "; name a file");
  if (is_withheld(info))
    throw FileError(name, ": is the journal of this daemon; choose another file");
  if (static_cast<std::uintmax_t>(info.st_size) > max_bytes)
    throw FileError(name, ": larger than " + std::to_string(max_bytes) +
                              " bytes. Check that it is the right file");
}

class Descriptor {
 public:
  explicit Descriptor(int number) : number_(number) {}
  ~Descriptor() {
    if (number_ >= 0) ::close(number_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int number() const { return number_; }

 private:
  int number_;
};

std::string& advice_for_missing_files() {
  static std::string advice;
  return advice;
}

thread_local UsedFiles* used_files = nullptr;

}  // namespace

Withheld::Withheld(const std::filesystem::path& path) {
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0) return;
  device_ = info.st_dev;
  inode_ = info.st_ino;
  WithheldFiles& all = withheld();
  const std::lock_guard lock(all.mutex);
  all.files.emplace_back(device_, inode_);
}

Withheld::~Withheld() {
  WithheldFiles& all = withheld();
  const std::lock_guard lock(all.mutex);
  const auto own = std::find(all.files.begin(), all.files.end(), Identity(device_, inode_));
  if (own != all.files.end()) all.files.erase(own);
}

UsedFiles::UsedFiles() { used_files = this; }

UsedFiles::~UsedFiles() { used_files = nullptr; }

void UsedFiles::note(const std::filesystem::path& file, As as) {
  if (used_files != nullptr) used_files->files_.emplace_back(file, as);
}

std::optional<UsedFiles::As> UsedFiles::of(const std::filesystem::path& file) {
  if (used_files == nullptr) return {};
  std::error_code missing;
  for (const auto& [used, as] : used_files->files_)
    if (std::filesystem::equivalent(used, file, missing)) return as;
  return {};
}

void set_advice_for_missing_files(std::string advice) {
  advice_for_missing_files() = std::move(advice);
}

std::string read_file(const std::filesystem::path& path, std::size_t max_bytes) {
  const std::string name = path.string();
  struct stat info {};
  if (::stat(path.c_str(), &info) != 0)
    throw FileError(name, (errno == ENOENT || errno == ENOTDIR
                               ? ": no such file; check the path"
                               : ": cannot be inspected (" + std::string(std::strerror(errno)) +
                                     "); check the path and its permissions") +
                              advice_for_missing_files());
  // Checked before opening (opening a pipe blocks, opening a device may have side effects) and
  // again afterwards (the path may have been replaced).
  refuse_other_than_files(name, info, max_bytes);
  const Descriptor file(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK | O_NOCTTY));
  if (file.number() < 0 || ::fstat(file.number(), &info) != 0)
    throw FileError(name, ": cannot be opened; check its permissions");
  refuse_other_than_files(name, info, max_bytes);
  UsedFiles::note(path, UsedFiles::As::kRead);
  std::string text;
  std::array<char, 1 << 16> block;
  while (true) {
    const ssize_t got = ::read(file.number(), block.data(), block.size());
    if (got < 0 && errno == EINTR) continue;
    if (got < 0)
      throw FileError(name, ": reading failed (" + std::string(std::strerror(errno)) + ")");
    if (got == 0) return text;
    text.append(block.data(), static_cast<std::size_t>(got));
    if (text.size() > max_bytes)
      throw FileError(name, ": larger than " + std::to_string(max_bytes) +
                                " bytes. Check that it is the right file");
  }
}

std::string sha256(std::string_view bytes) {
  std::string digest(kSha256Digits / 2, '\0');
  auto* const start = reinterpret_cast<unsigned char*>(digest.data());
  if (EVP_Digest(bytes.data(), bytes.size(), start, nullptr, EVP_sha256(), nullptr) != 1)
    throw std::runtime_error("SHA-256 is not available in this OpenSSL");
  return boost::algorithm::hex_lower(digest);
}

bool is_sha256(std::string_view text) {
  return text.size() == kSha256Digits &&
         text.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

}  // namespace cellcal::calib
