#include "tests/daemon/journal/disks/losing_disk.h"

#include <dlfcn.h>
#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <map>
#include <mutex>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace cellcal::daemon::testing {
namespace {

constexpr off_t kSector = 512;

template <class Function>
Function* real(const char* name) {
  return reinterpret_cast<Function*>(::dlsym(RTLD_NEXT, name));
}
using Pwrite = ssize_t(int, const void*, std::size_t, off_t);
using Write = ssize_t(int, const void*, std::size_t);
using Truncate = int(int, off_t);
using Sync = int(int);

ssize_t real_pwrite(int fd, const void* from, std::size_t size, off_t at) {
  static auto* const call = real<Pwrite>("pwrite64");
  return call(fd, from, size, at);
}
int real_truncate(int fd, off_t size) {
  static auto* const call = real<Truncate>("ftruncate64");
  return call(fd, size);
}

/// Content of a file before writes that are not synchronized yet.
struct File {
  int fd = -1;  ///< for reading and restoring; never closed, as that would release locks
  off_t synced_size = 0;
  struct Before {
    off_t at = 0;
    std::string bytes;
  };
  std::vector<Before> before;  ///< oldest first
};

class Disk {
 public:
  void insert(const Cut& cut) {
    const std::lock_guard lock(mutex_);
    cut_ = cut;
    directory_ = std::filesystem::canonical(cut.directory).string() + "/";
    left_ = cut.at;
    in_ = true;
  }

  void insert_failing(const std::filesystem::path& directory, long at, int error) {
    insert({directory, at});
    const std::lock_guard lock(mutex_);
    error_ = error;
    failed_ = false;
  }
  void remove() {
    const std::lock_guard lock(mutex_);
    in_ = false;
    error_ = 0;
    files_.clear();
  }
  bool has_failed() {
    const std::lock_guard lock(mutex_);
    return failed_;
  }

  /// Called before `size` bytes of the file change from `at` on; size 0: its length or name
  /// changes. False: they must not, errno states why.
  bool changes(int fd, off_t at, off_t size) {
    const std::lock_guard lock(mutex_);
    if (!in_ || !is_watched(fd)) return true;
    if (left_-- <= 0) return fail_or_cut_off();
    if (size > 0 && error_ == 0) remember(fd, at, size);
    return true;
  }
  bool name_changes(const char* path) {
    const std::lock_guard lock(mutex_);
    std::error_code code;
    const auto whole = std::filesystem::absolute(path, code).string();
    if (in_ && whole.starts_with(directory_) && left_-- <= 0) return fail_or_cut_off();
    return true;
  }
  void is_synced(int fd) {
    const std::lock_guard lock(mutex_);
    struct stat info {};
    if (!in_ || ::fstat(fd, &info) != 0) return;
    if (const auto file = files_.find(info.st_ino); file != files_.end()) {
      file->second.before.clear();
      file->second.synced_size = info.st_size;
    }
  }

 private:
  bool is_watched(int fd) const {
    struct stat info {};
    if (::fstat(fd, &info) != 0 || !S_ISREG(info.st_mode)) return false;
    char name[4096];
    const ssize_t size =
        ::readlink(("/proc/self/fd/" + std::to_string(fd)).c_str(), name, sizeof name);
    return size > 0 && std::string(name, static_cast<std::size_t>(size)).starts_with(directory_);
  }

  void remember(int fd, off_t at, off_t size) {
    struct stat info {};
    ::fstat(fd, &info);
    auto [found, is_new] = files_.try_emplace(info.st_ino);
    File& file = found->second;
    if (is_new) {
      file.fd = ::open(("/proc/self/fd/" + std::to_string(fd)).c_str(), O_RDWR | O_CLOEXEC);
      file.synced_size = info.st_size;
    }
    // In whole sectors, as a disk writes.
    const off_t begin = at / kSector * kSector;
    const off_t end = (at + size + kSector - 1) / kSector * kSector;
    File::Before before{begin, std::string(static_cast<std::size_t>(end - begin), '\0')};
    [[maybe_unused]] const ssize_t got =
        ::pread(file.fd, before.bytes.data(), before.bytes.size(), begin);
    file.before.push_back(std::move(before));
  }

  bool fail_or_cut_off() {
    if (error_ == 0) cut_off();
    failed_ = true;
    errno = error_;
    return false;
  }

  [[noreturn]] void cut_off() {
    in_ = false;
    std::mt19937 random(cut_.seed);
    if (cut_.unsynced != Cut::Unsynced::kStays)
      for (auto& [inode, file] : files_) lose(file, random);
    ::kill(::getpid(), SIGKILL);
    for (;;) ::pause();
  }

  void lose(File& file, std::mt19937& random) const {
    std::set<off_t> kept;
    off_t size = file.synced_size;
    for (auto before = file.before.rbegin(); before != file.before.rend(); ++before) {
      for (off_t at = 0; at < static_cast<off_t>(before->bytes.size()); at += kSector) {
        const off_t sector = before->at + at;
        if (kept.contains(sector)) continue;  // a later write of it persisted
        if (cut_.unsynced == Cut::Unsynced::kTorn && (random() & 1u) != 0) {
          kept.insert(sector);
          size = std::max(size, sector + kSector);
        } else {
          real_pwrite(file.fd, before->bytes.data() + at, kSector, sector);
        }
      }
    }
    struct stat info {};
    ::fstat(file.fd, &info);
    if (!file.before.empty()) real_truncate(file.fd, std::min<off_t>(info.st_size, size));
  }

  std::mutex mutex_;
  bool in_ = false;
  Cut cut_;
  std::string directory_;
  long left_ = 0;
  int error_ = 0;  ///< 0: power is cut
  bool failed_ = false;
  std::map<ino_t, File> files_;
};

Disk& disk() {
  static Disk* const the_disk = new Disk;  // outlives writers at exit
  return *the_disk;
}

[[gnu::constructor]] void insert_by_environment() {
  const char* directory = std::getenv("LOSING_DISK_DIR");
  if (directory == nullptr) return;
  const auto number = [](const char* name) {
    const char* text = std::getenv(name);
    return text == nullptr ? 0L : std::atol(text);
  };
  const long seed = number("LOSING_DISK_SEED");
  disk().insert({directory, number("LOSING_DISK_AT"),
                 seed == 0 ? Cut::Unsynced::kLost : Cut::Unsynced::kTorn,
                 static_cast<unsigned>(seed)});
}

}  // namespace

bool is_cut_in(const Cut& cut, const std::function<void()>& act) {
  const pid_t child = ::fork();
  if (child == 0) {
    disk().insert(cut);
    try {
      act();
      ::_exit(0);
    } catch (const std::exception& error) {
      const std::string words = std::string(error.what()) + "\n";
      [[maybe_unused]] const ssize_t written = ::write(STDERR_FILENO, words.data(), words.size());
      ::_exit(1);
    }
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  if (WIFEXITED(status) && WEXITSTATUS(status) != 0) throw std::runtime_error("the child failed");
  return WIFSIGNALED(status);
}

FailingDisk::FailingDisk(const std::filesystem::path& directory, long at, int error) {
  disk().insert_failing(directory, at, error);
}
FailingDisk::~FailingDisk() { disk().remove(); }
bool FailingDisk::has_failed() const { return disk().has_failed(); }

}  // namespace cellcal::daemon::testing

using cellcal::daemon::testing::disk;
using cellcal::daemon::testing::real;

extern "C" {

ssize_t pwrite64(int fd, const void* from, std::size_t size, off_t at) {
  if (!disk().changes(fd, at, static_cast<off_t>(size))) return -1;
  return cellcal::daemon::testing::real_pwrite(fd, from, size, at);
}
ssize_t pwrite(int fd, const void* from, std::size_t size, off_t at) {
  if (!disk().changes(fd, at, static_cast<off_t>(size))) return -1;
  return cellcal::daemon::testing::real_pwrite(fd, from, size, at);
}
ssize_t write(int fd, const void* from, std::size_t size) {
  static auto* const call = real<ssize_t(int, const void*, std::size_t)>("write");
  if (!disk().changes(fd, ::lseek(fd, 0, SEEK_CUR), static_cast<off_t>(size))) return -1;
  return call(fd, from, size);
}
int ftruncate64(int fd, off_t size) noexcept {
  struct stat info {};
  ::fstat(fd, &info);
  if (!disk().changes(fd, size, std::max<off_t>(0, info.st_size - size))) return -1;
  return cellcal::daemon::testing::real_truncate(fd, size);
}
// Calls whose effect is decided here.
int fsync(int fd) {
  disk().is_synced(fd);
  return 0;
}
int fdatasync(int fd) {
  disk().is_synced(fd);
  return 0;
}
int rename(const char* from, const char* to) noexcept {
  static auto* const call = real<int(const char*, const char*)>("rename");
  if (!disk().name_changes(to)) return -1;
  return call(from, to);
}
int unlink(const char* path) noexcept {
  static auto* const call = real<int(const char*)>("unlink");
  if (!disk().name_changes(path)) return -1;
  return call(path);
}

}  // extern "C"
