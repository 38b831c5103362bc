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

/// Whether `path` still leads to the file that was locked: another may stand there by now.
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

}  // namespace cellcal::daemon
