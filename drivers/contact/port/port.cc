#include "drivers/contact/port/port.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <grp.h>
#include <libserialport.h>
#include <linux/serial.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <utility>

#include "drivers/contact/port/adapter.h"
#include "drivers/contact/wire/ctp_codec.h"

namespace cellcal::drivers {

namespace {

constexpr std::string_view kPseudoTerminals = "/dev/pts/", kUsbNodes = "/dev/bus/usb/";
constexpr int kMinBaud = 9600, kMaxBaud = 4'000'000;

std::string ports_here() {
  sp_port** ports = nullptr;
  if (sp_list_ports(&ports) != SP_OK) return "not known";
  std::string list;
  for (sp_port** p = ports; *p != nullptr; ++p) {
    const char* what = sp_get_port_description(*p);
    list += fmt::format("{}{}", list.empty() ? "" : ", ", sp_get_port_name(*p));
    if (what != nullptr && *what != '\0') list += fmt::format(" ({})", what);
  }
  sp_free_port_list(ports);
  return list.empty() ? "none" : list;
}

std::string group_of(const std::string& device) {
  struct stat info {};
  if (::stat(device.c_str(), &info) != 0) return {};
  group entry{};
  group* found = nullptr;
  std::array<char, 4096> buffer{};
  if (::getgrgid_r(info.st_gid, &entry, buffer.data(), buffer.size(), &found) != 0 ||
      found == nullptr) {
    return fmt::format("{}", info.st_gid);
  }
  return found->gr_name;
}

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

/// Disables buffering. FTDI adapters otherwise buffer for 16 ms; USB CDC has neither timer nor
/// flag. The result is verified from the adapter's reported value. Returns the warning, if any.
std::string lower_latency(int fd, const std::string& path) {
  serial_struct serial{};
  int why = 0;
  if (::ioctl(fd, TIOCGSERIAL, &serial) == 0) {
    serial.flags |= ASYNC_LOW_LATENCY;
    if (::ioctl(fd, TIOCSSERIAL, &serial) != 0) why = errno;
  } else {
    why = errno;
  }
  if (const std::optional<int> ms = latency_ms_of(path)) {
    if (*ms <= kBestLatencyMs) return {};
    return fmt::format(
        "{}: the adapter delays bytes by up to {} ms, and low-latency mode {}. Install the "
        "udev rule 70-cellcal.rules, or as root: echo {} > /sys/class/tty/{}/device/latency_timer",
        path, *ms,
        why == 0 ? std::string("changed nothing")
                 : fmt::format("could not be set ({})", std::strerror(why)),
        kBestLatencyMs, std::filesystem::path(path).filename().string());
  }
  const bool has_no_such_flag = why == 0 || why == ENOTTY || why == EINVAL || why == EOPNOTSUPP;
  if (has_no_such_flag) return {};
  return fmt::format("{}: low-latency mode could not be set ({})", path, std::strerror(why));
}

/// Terminal settings of an open descriptor: exclusive, close-on-exec, non-blocking, raw, with a read()
/// that waits for a byte instead of reporting the end of the file. Throws DriverError.
void make_exclusive_and_raw(int fd, const std::string& path) {
  const auto fail = [&path](const char* what) {
    throw DriverError(fmt::format("{}: {} failed: {}", path, what, std::strerror(errno)));
  };
  if (::ioctl(fd, TIOCEXCL) != 0) fail("TIOCEXCL");
  if (::fcntl(fd, F_SETFD, FD_CLOEXEC) != 0) fail("close-on-exec");
  const int flags = ::fcntl(fd, F_GETFL);
  if (flags < 0 || ::fcntl(fd, F_SETFL, flags | O_NONBLOCK) != 0) fail("non-blocking mode");
  termios tio{};
  if (::tcgetattr(fd, &tio) != 0) fail("tcgetattr");
  ::cfmakeraw(&tio);
  tio.c_cflag |= CLOCAL | CREAD;
  // Closing must not drop DTR, which resets many boards: the sensor keeps its clock and boot id.
  tio.c_cflag &= ~static_cast<tcflag_t>(HUPCL);
  // libserialport leaves VMIN at 0, and Asio takes an empty read for the end of the file.
  tio.c_cc[VMIN] = 1;
  tio.c_cc[VTIME] = 0;
  if (::tcsetattr(fd, TCSANOW, &tio) != 0) fail("tcsetattr");
  if (::tcflush(fd, TCIOFLUSH) != 0) fail("tcflush");
}

/// Discards unsent data and releases exclusive access; to be called just before close().
void let_go(int fd) {
  // Both fail on an unplugged device, with nothing to discard or release.
  [[maybe_unused]] const int flushed = ::tcflush(fd, TCIOFLUSH);
  [[maybe_unused]] const int shared = ::ioctl(fd, TIOCNXCL);
}

class RealPort : public Port {
 public:
  RealPort(const std::string& path, int baud) : Port(path) {
    if (sp_get_port_by_name(path.c_str(), &port_) != SP_OK) {
      throw DriverError(cannot_open(path, errno == 0 ? ENODEV : errno));
    }
    try {
      configure(baud);
    } catch (...) {
      shut();
      throw;
    }
  }
  ~RealPort() override { shut(); }

 private:
  void configure(int baud) {
    errno = 0;
    if (sp_open(port_, SP_MODE_READ_WRITE) != SP_OK) throw DriverError(cannot_open(path_, errno));
    open_ = true;
    check(sp_set_baudrate(port_, baud), fmt::format("baud rate {}", baud));
    check(sp_set_bits(port_, 8), "8 data bits");
    check(sp_set_parity(port_, SP_PARITY_NONE), "no parity");
    check(sp_set_stopbits(port_, 1), "1 stop bit");
    check(sp_set_flowcontrol(port_, SP_FLOWCONTROL_NONE), "no flow control");
    check(sp_get_port_handle(port_, &fd_), "its descriptor");
    make_exclusive_and_raw(fd_, path_);
    warning_ = lower_latency(fd_, path_);
  }

  void check(sp_return result, const std::string& what) {
    if (result == SP_OK) return;
    char* message = result == SP_ERR_FAIL ? sp_last_error_message() : nullptr;
    const std::string why = message != nullptr ? message : "not supported";
    if (message != nullptr) sp_free_error_message(message);
    throw DriverError(fmt::format("{}: {} cannot be set: {}", path_, what, why));
  }

  void shut() {
    if (open_) {
      if (fd_ >= 0) let_go(fd_);
      sp_close(port_);
    }
    sp_free_port(port_);
    open_ = false;
    port_ = nullptr;
  }

  sp_port* port_ = nullptr;
  bool open_ = false;
};

/// libserialport 0.1.1 cannot open pseudo-terminals (they are not in /sys and refuse TIOCMGET).
class PseudoTerminal : public Port {
 public:
  PseudoTerminal(const std::string& path, int baud) : Port(path) {
    fd_ = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC);
    if (fd_ < 0) throw DriverError(cannot_open(path, errno));
    try {
      make_exclusive_and_raw(fd_, path_);
      // A pseudo-terminal has no line, but an emulated sensor at its other end uses the rate.
      set_line_rate(fd_, baud);
    } catch (...) {
      ::close(fd_);
      throw;
    }
  }
  ~PseudoTerminal() override {
    let_go(fd_);
    ::close(fd_);
  }
};

}  // namespace

PortReading Port::read(std::span<std::uint8_t> into) {
  const ssize_t n = ::read(fd_, into.data(), into.size());
  PortReading reading;
  const int error = n < 0 ? errno : 0;
  reading.arrived = std::chrono::steady_clock::now();
  if (n > 0) {
    reading.size = static_cast<std::size_t>(n);
  } else if (error != EINTR && error != EAGAIN) {
    reading.lost = true;
    reading.error = error;
  }
  return reading;
}

bool Port::write(std::span<const std::uint8_t> frame) {
  ssize_t n = -1;
  do {
    n = ::write(fd_, frame.data(), frame.size());
  } while (n < 0 && errno == EINTR);
  return n == static_cast<ssize_t>(frame.size());
}

std::unique_ptr<Port> open_port(const PortOptions& options) {
  if (is_datagrams(options.device)) return open_udp_port(options.device);
  if (options.baud < kMinBaud || options.baud > kMaxBaud) {
    throw ConfigError(fmt::format("baud rate {} of {} is outside {} to {}", options.baud,
                                  options.device, kMinBaud, kMaxBaud));
  }
  // libserialport looks up devices by name and does not resolve symlinks, such as those of udev.
  std::error_code error;
  const std::filesystem::path real = std::filesystem::canonical(options.device, error);
  if (error) throw DriverError(cannot_open(options.device, error.value()));
  const std::string path = real.string();
  if (!std::filesystem::is_character_file(real)) throw DriverError(cannot_open(path, ENOTTY));
  if (path.rfind(kPseudoTerminals, 0) == 0 && !options.always_libserialport) {
    return std::make_unique<PseudoTerminal>(path, options.baud);
  }
  if (path.rfind(kUsbNodes, 0) == 0) return open_usb_port(path, options.baud, options.priority);
  return open_real_port(path, options.baud);
}

std::string cannot_open(const std::string& device, int error) {
  switch (error) {
    case ENOENT:
    case ENXIO:
    case ENODEV:
    case ENOTTY:
      if (std::error_code unknown; std::filesystem::exists(device, unknown))
        return fmt::format(
            "{}: not a serial port, or nothing connected to it. Name the sensor's port as device "
            "under [contact] (ports found: {})",
            device, ports_here());
      return fmt::format("{}: no such device. Plug the sensor in (ports found: {})", device,
                         ports_here());
    case EACCES:
    case EPERM:
      if (group_of(device) == "root")  // membership in root would grant this program everything
        return fmt::format(
            "{}: no permission: no group but root may open the device. Install the udev rule "
            "/usr/lib/udev/rules.d/70-cellcal.rules (group 'dialout'), unplug and plug the sensor",
            device);
      return fmt::format(
          "{}: no permission: the device belongs to group '{}'. Add this program's user to it "
          "(usermod -aG {} USER) and log in again",
          device, group_of(device), group_of(device));
    case EBUSY:
    case EAGAIN:
      return fmt::format("{}: in use by another program. Stop it first (fuser -v {})", device,
                         device);
    default: return fmt::format("{}: cannot be opened: {}", device, std::strerror(error));
  }
}

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

std::unique_ptr<Port> open_real_port(const std::string& path, int baud) {
  return std::make_unique<RealPort>(path, baud);
}

}  // namespace cellcal::drivers
