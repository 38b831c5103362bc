#include "drivers/contact/port/port_backends.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <libserialport.h>
#include <linux/serial.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <optional>
#include <utility>

#include "drivers/contact/port/adapter.h"
#include "drivers/contact/port/port.h"
#include "drivers/contact/wire/line_rate.h"

namespace cellcal::drivers {

namespace {

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
        "udev rule in systemd/, or as root: echo {} > /sys/class/tty/{}/device/latency_timer",
        path, *ms,
        why == 0 ? std::string("changed nothing")
                 : fmt::format("could not be set ({})", std::strerror(why)),
        kBestLatencyMs, std::filesystem::path(path).filename().string());
  }
  const bool has_no_such_flag = why == 0 || why == ENOTTY || why == EINVAL || why == EOPNOTSUPP;
  if (has_no_such_flag) return {};
  return fmt::format("{}: low-latency mode could not be set ({})", path, std::strerror(why));
}

class RealPort : public Port {
 public:
  RealPort(const std::string& path, int baud) : path_(path), lock_(path) {
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

  int fd() const override { return fd_; }
  const std::string& path() const override { return path_; }
  const std::string& warning() const override { return warning_; }

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

  std::string path_, warning_;
  PortLock lock_;
  sp_port* port_ = nullptr;
  bool open_ = false;
  int fd_ = -1;
};

class PseudoTerminal : public Port {
 public:
  PseudoTerminal(const std::string& path, int baud) : path_(path), lock_(path) {
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

  int fd() const override { return fd_; }
  const std::string& path() const override { return path_; }
  const std::string& warning() const override { return warning_; }

 private:
  std::string path_, warning_;
  PortLock lock_;
  int fd_ = -1;
};

}  // namespace

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

void let_go(int fd) {
  // Both fail on an unplugged device, with nothing to discard or release.
  [[maybe_unused]] const int flushed = ::tcflush(fd, TCIOFLUSH);
  [[maybe_unused]] const int shared = ::ioctl(fd, TIOCNXCL);
}

std::unique_ptr<Port> open_real_port(const std::string& path, int baud) {
  return std::make_unique<RealPort>(path, baud);
}

std::unique_ptr<Port> open_pseudo_terminal(const std::string& path, int baud) {
  return std::make_unique<PseudoTerminal>(path, baud);
}

}  // namespace cellcal::drivers
