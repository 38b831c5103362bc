#include "drivers/contact/port/port_lock.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstring>

#include "drivers/error.h"

namespace cellcal::drivers {

namespace {

/// The first writable one is used. /tmp is for users outside the lock group.
constexpr std::array kFolders = {"/run/lock", "/tmp"};
constexpr mode_t kMode = 0666;  // other users must be able to lock the device later

std::string holder_of(int fd) {
  std::array<char, 32> text{};
  const ssize_t n = ::pread(fd, text.data(), text.size() - 1, 0);
  if (n <= 0) return "another process";
  std::string pid(text.data(), static_cast<std::size_t>(n));
  pid.erase(pid.find_last_not_of(" \n") + 1);
  pid.erase(0, pid.find_first_not_of(' '));
  return "process " + pid;
}

}  // namespace

std::string lock_name(const std::string& device) {
  constexpr std::string_view kDev = "/dev/";
  std::string name = device.rfind(kDev, 0) == 0 ? device.substr(kDev.size()) : device;
  for (char& c : name) {
    if (c == '/') c = '-';
  }
  return "LCK.." + name;
}

PortLock::PortLock(const std::string& device) {
  std::string tried;
  for (const char* folder : kFolders) {
    const std::string path = fmt::format("{}/{}", folder, lock_name(device));
    // Symlinks are not followed, since /tmp is world-writable.
    const int fd = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC | O_NOFOLLOW, kMode);
    if (fd < 0) {
      tried += fmt::format("{}{}: {}", tried.empty() ? "" : "; ", path, std::strerror(errno));
      continue;
    }
    if (::flock(fd, LOCK_EX | LOCK_NB) != 0) {
      const std::string holder = holder_of(fd);
      ::close(fd);
      throw DriverError(
          fmt::format("{}: in use by {} (lock file {}). Stop it first", device, holder, path));
    }
    fd_ = fd;
    // The lock is held; the umask may have restricted the mode. For a file of another user this
    // fails, but then its mode was sufficient.
    [[maybe_unused]] const int mode_set = ::fchmod(fd, kMode);
    const std::string pid = fmt::format("{:10}\n", ::getpid());
    // The pid is informative; the lock is the flock.
    [[maybe_unused]] const bool written =
        ::ftruncate(fd, 0) == 0 &&
        ::pwrite(fd, pid.data(), pid.size(), 0) == static_cast<ssize_t>(pid.size());
    return;
  }
  throw DriverError(fmt::format("{}: cannot create a lock file ({})", device, tried));
}

PortLock::~PortLock() {
  // The file is kept: removing it would allow two processes to lock two files of one name.
  if (fd_ >= 0) ::close(fd_);
}

}  // namespace cellcal::drivers
