#include "daemon/journal/store/store_files.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <cstring>

#include "calib/files/files.h"
#include "calib/files/input_file.h"
#include "daemon/journal/store/sqlite.h"

namespace cellcal::daemon {

namespace {

constexpr mode_t kMode = 0640;
constexpr std::size_t kNumber = 19, kSum = 64, kCheck = 16;
constexpr std::string_view kFormat = "cellcal.journal-head/1 ";
constexpr std::size_t kLine = kFormat.size() + kNumber + 1 + kSum + 1 + kCheck + 1;

std::string line_of(const Head& head) {
  const std::string words = fmt::format("{}{:019} {} ", kFormat, head.entries, head.sum);
  return words + calib::sha256(words).substr(0, kCheck) + "\n";
}

/// nullopt for an incomplete line.
std::optional<Head> head_of(std::string_view line) {
  if (line.size() != kLine) return std::nullopt;
  Head head;
  const char* number = line.data() + kFormat.size();
  if (std::from_chars(number, number + kNumber, head.entries).ec != std::errc()) {
    return std::nullopt;
  }
  head.sum = line.substr(kFormat.size() + kNumber + 1, kSum);
  if (line_of(head) != line) return std::nullopt;
  return head;
}

constexpr mode_t kLockMode = 0640;

/// True if `path` still refers to the locked file.
bool is_at(const std::filesystem::path& path, int descriptor) {
  struct stat by_name {
  }, by_descriptor{};
  return ::stat(path.c_str(), &by_name) == 0 && ::fstat(descriptor, &by_descriptor) == 0 &&
         by_name.st_dev == by_descriptor.st_dev && by_name.st_ino == by_descriptor.st_ino;
}

struct stat stat_of(const std::filesystem::path& file, const std::filesystem::path& journal) {
  struct stat info {};
  if (::stat(file.c_str(), &info) == 0) return info;
  throw JournalError("journal " + journal.string() + ": " + file.filename().string() +
                     " is gone (" + std::strerror(errno) +
                     ") while this daemon writes to it. Put it back, and restart cellcald");
}

}  // namespace

HeadFile::HeadFile(std::filesystem::path path, std::filesystem::path journal)
    : path_(std::move(path)), journal_(std::move(journal)) {
  descriptor_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kMode);
  if (descriptor_ < 0) fail(std::string("cannot be opened (") + std::strerror(errno) + ")");
}

HeadFile::~HeadFile() { ::close(descriptor_); }

void HeadFile::fail(const std::string& words) const {
  throw JournalError("journal " + journal_.string() + ": " + path_.filename().string() + " " +
                     words);
}

std::optional<Head> HeadFile::read() {
  std::array<char, 2 * kLine> bytes{};
  const ssize_t got = ::pread(descriptor_, bytes.data(), bytes.size(), 0);
  if (got < 0) fail(std::string("cannot be read (") + std::strerror(errno) + "); check the disk");
  if (got == 0) return std::nullopt;
  const std::string_view text(bytes.data(), static_cast<std::size_t>(got));
  const std::optional<Head> first = head_of(text.substr(0, kLine));
  const std::optional<Head> second =
      text.size() > kLine ? head_of(text.substr(kLine, kLine)) : std::nullopt;
  if (!first && !second) {
    fail("is damaged, so lost newest rows cannot be detected. Remove it to continue");
  }
  const bool first_is_newer = first && (!second || first->entries > second->entries);
  next_line_ = first_is_newer ? 1 : 0;
  return first_is_newer ? first : second;
}

void HeadFile::write(const Head& head) {
  const std::string line = line_of(head);
  const off_t at = next_line_ * static_cast<off_t>(kLine);
  ssize_t put = -1;
  do {
    put = ::pwrite(descriptor_, line.data(), line.size(), at);
  } while (put < 0 && errno == EINTR);
  if (put != static_cast<ssize_t>(line.size()) || ::fdatasync(descriptor_) != 0) {
    fail(std::string("cannot be written (") + std::strerror(errno) +
         "). Make room, or check the disk");
  }
  next_line_ = 1 - next_line_;
}

LockFile::LockFile(const std::filesystem::path& path, const std::filesystem::path& journal) {
  const std::string name = "journal " + journal.string();
  while (true) {
    descriptor_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kLockMode);
    if (descriptor_ < 0) {
      throw JournalError(name + ": " + path.string() + " cannot be opened (" +
                         std::strerror(errno) +
                         "). Check that the directory exists and that the daemon may write there");
    }
    struct flock whole {};
    whole.l_type = F_WRLCK;
    if (::fcntl(descriptor_, F_OFD_SETLK, &whole) != 0) {
      const int code = errno;
      ::close(descriptor_);
      if (code == EAGAIN || code == EACCES) {
        throw JournalError(name +
                           ": locked by another program. Check whether a second cellcald runs");
      }
      throw JournalError(name + ": " + path.string() + " cannot be locked (" + std::strerror(code) +
                         "). Put the state directory on a local disk");
    }
    if (is_at(path, descriptor_)) return;
    ::close(descriptor_);
  }
}

LockFile::~LockFile() { ::close(descriptor_); }

FileWatch::FileWatch(std::filesystem::path journal, const std::vector<std::filesystem::path>& files)
    : journal_(std::move(journal)) {
  for (const auto& path : files) {
    const struct stat info = stat_of(path, journal_);
    files_.push_back({path, info.st_dev, info.st_ino, info.st_size});
  }
}

void FileWatch::check() {
  for (File& file : files_) {
    const struct stat info = stat_of(file.path, journal_);
    const bool replaced = info.st_dev != file.device || info.st_ino != file.inode;
    if (replaced || info.st_size < file.size) {
      throw JournalError("journal " + journal_.string() + ": " + file.path.filename().string() +
                         " was " + (replaced ? "replaced by another file" : "cut short") +
                         " while this daemon writes to it. Put the old file back, and restart "
                         "cellcald");
    }
    file.size = info.st_size;
  }
}

}  // namespace cellcal::daemon
