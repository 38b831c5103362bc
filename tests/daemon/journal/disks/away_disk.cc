#include "tests/daemon/journal/disks/away_disk.h"

#include <dlfcn.h>
#include <unistd.h>

#include <cerrno>
#include <mutex>
#include <string>

namespace cellcal::daemon::testing {

namespace {

struct Away {
  std::mutex mutex;
  std::string directory;  ///< empty: none
};
Away& away() {
  static auto* const kOne = new Away;  // outlives readers at exit
  return *kOne;
}

bool is_away(int fd) {
  const std::lock_guard lock(away().mutex);
  if (away().directory.empty()) return false;
  char name[4096];
  const ssize_t size =
      ::readlink(("/proc/self/fd/" + std::to_string(fd)).c_str(), name, sizeof name);
  return size > 0 &&
         std::string(name, static_cast<std::size_t>(size)).starts_with(away().directory);
}

}  // namespace

/// Like the system's call.
ssize_t read_unless_away(const char* call, int fd, void* to, std::size_t size, off_t at) {
  if (is_away(fd)) {
    errno = EIO;
    return -1;
  }
  using Pread = ssize_t(int, void*, std::size_t, off_t);
  return reinterpret_cast<Pread*>(::dlsym(RTLD_NEXT, call))(fd, to, size, at);
}

AwayDisk::AwayDisk(const std::filesystem::path& directory) {
  const std::lock_guard lock(away().mutex);
  away().directory = std::filesystem::canonical(directory).string() + "/";
}
AwayDisk::~AwayDisk() {
  const std::lock_guard lock(away().mutex);
  away().directory.clear();
}

}  // namespace cellcal::daemon::testing

extern "C" {

ssize_t pread64(int fd, void* to, std::size_t size, off_t at) {
  return cellcal::daemon::testing::read_unless_away("pread64", fd, to, size, at);
}
ssize_t pread(int fd, void* to, std::size_t size, off_t at) {
  return cellcal::daemon::testing::read_unless_away("pread", fd, to, size, at);
}

}  // extern "C"
