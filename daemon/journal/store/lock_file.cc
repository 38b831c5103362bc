#include "daemon/journal/store/lock_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>

#include "daemon/journal/store/error.h"

namespace cellcal::daemon {

namespace {

constexpr mode_t kLockMode = 0640;

/// True if `path` still refers to the locked file.
bool is_at(const std::filesystem::path& path, int descriptor) {
  struct stat by_name {
  }, by_descriptor{};
  return ::stat(path.c_str(), &by_name) == 0 && ::fstat(descriptor, &by_descriptor) == 0 &&
         by_name.st_dev == by_descriptor.st_dev && by_name.st_ino == by_descriptor.st_ino;
}

}  // namespace

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

namespace {

struct stat look_at(const std::filesystem::path& file, const std::filesystem::path& journal) {
  struct stat info {};
  if (::stat(file.c_str(), &info) == 0) return info;
  throw JournalError("journal " + journal.string() + ": " + file.filename().string() +
                     " is gone (" + std::strerror(errno) +
                     ") while this daemon writes to it. Put it back, and restart cellcald");
}

}  // namespace

FileWatch::FileWatch(std::filesystem::path journal, const std::vector<std::filesystem::path>& files)
    : journal_(std::move(journal)) {
  for (const auto& path : files) {
    const struct stat info = look_at(path, journal_);
    files_.push_back({path, info.st_dev, info.st_ino, info.st_size});
  }
}

void FileWatch::look() {
  for (File& file : files_) {
    const struct stat info = look_at(file.path, journal_);
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
