// A USB adapter through libusb, bypassing the kernel's terminal. usbfs completes a transfer in the
// interrupt of the host controller: no kernel worker of normal priority is between a byte and its
// reader (see "When the computer delivers late" in ../README.md).

#include <fcntl.h>
#include <fmt/format.h>
#include <libusb.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <optional>
#include <span>
#include <thread>
#include <utility>
#include <vector>

#include "drivers/contact/port/port.h"
#include "drivers/contact/port/port_keeper.h"

namespace cellcal::drivers {

namespace {

// Kinds of USB serial adapters as required for libusb: endpoints and requests.
//
// Sources: USB CDC 1.2 and PSTN 1.2 (class requests of CDC-ACM); FTDI AN232B-05 (divisors) and the
// request numbers of Linux's ftdi_sio.

struct UsbEndpoints {
  int control = 0;  ///< interface for class requests
  int data = 0;     ///< interface of the bulk endpoints; may be the same
  std::uint8_t in = 0, out = 0;
  std::size_t packet = 0;  ///< maximum size of an IN packet
};

inline constexpr std::size_t kMostUsbPacket = 512;

class UsbProtocol {
 public:
  virtual ~UsbProtocol() = default;
  /// Empty: not an adapter of this kind.
  virtual std::optional<UsbEndpoints> endpoints(const libusb_config_descriptor& config) const = 0;
  /// 8 data bits, no parity, one stop bit, DTR and RTS on. Returns libusb's error, or 0.
  virtual int configure(libusb_device_handle* device, const UsbEndpoints& ends, int baud) const = 0;
  /// Bytes before the data of each IN packet.
  virtual std::size_t header() const = 0;
};

constexpr std::uint16_t kFtdiVendor = 0x0403;
constexpr unsigned kTimeoutMs = 500;

/// The bulk endpoints of one interface. Empty if one is missing.
std::optional<UsbEndpoints> bulk_endpoints(const libusb_interface_descriptor& interface) {
  UsbEndpoints found{interface.bInterfaceNumber, interface.bInterfaceNumber, 0, 0, 0};
  for (const libusb_endpoint_descriptor& end :
       std::span(interface.endpoint, interface.bNumEndpoints)) {
    if ((end.bmAttributes & LIBUSB_TRANSFER_TYPE_MASK) != LIBUSB_TRANSFER_TYPE_BULK) continue;
    if ((end.bEndpointAddress & LIBUSB_ENDPOINT_IN) == 0) {
      found.out = end.bEndpointAddress;
    } else {
      found.in = end.bEndpointAddress;
      found.packet = end.wMaxPacketSize;
    }
  }
  const bool sound = found.out != 0 && 2 < found.packet && found.packet <= kMostUsbPacket;
  return sound ? std::optional(found) : std::nullopt;
}

class CdcAcm : public UsbProtocol {
 public:
  std::optional<UsbEndpoints> endpoints(const libusb_config_descriptor& config) const override {
    constexpr std::uint8_t kAbstractControl = 2;
    std::optional<int> control;
    std::optional<UsbEndpoints> data;
    for (const libusb_interface& one : std::span(config.interface, config.bNumInterfaces)) {
      if (one.num_altsetting < 1) continue;
      const libusb_interface_descriptor& interface = one.altsetting[0];
      if (interface.bInterfaceClass == LIBUSB_CLASS_COMM &&
          interface.bInterfaceSubClass == kAbstractControl) {
        control = interface.bInterfaceNumber;
      }
      if (interface.bInterfaceClass == LIBUSB_CLASS_DATA && !data) data = bulk_endpoints(interface);
    }
    if (!control || !data) return std::nullopt;
    data->control = *control;
    return data;
  }

  int configure(libusb_device_handle* device, const UsbEndpoints& ends, int baud) const override {
    constexpr std::uint8_t kSetLineCoding = 0x20, kSetControlLineState = 0x22, kDtrRts = 3;
    const auto rate = static_cast<std::uint32_t>(baud);
    std::array<std::uint8_t, 7> coding{static_cast<std::uint8_t>(rate),
                                       static_cast<std::uint8_t>(rate >> 8),
                                       static_cast<std::uint8_t>(rate >> 16),
                                       static_cast<std::uint8_t>(rate >> 24),
                                       0,  // one stop bit
                                       0,  // no parity
                                       8};
    const int set = request(device, ends, kSetLineCoding, 0, coding);
    return set < 0 ? set : request(device, ends, kSetControlLineState, kDtrRts, {});
  }

  std::size_t header() const override { return 0; }

 private:
  static int request(libusb_device_handle* device, const UsbEndpoints& ends, std::uint8_t number,
                     std::uint16_t value, std::span<std::uint8_t> data) {
    constexpr std::uint8_t kClassOfInterface =
        std::uint8_t{LIBUSB_REQUEST_TYPE_CLASS} | std::uint8_t{LIBUSB_RECIPIENT_INTERFACE};
    const int done = libusb_control_transfer(device, kClassOfInterface, number, value,
                                             static_cast<std::uint16_t>(ends.control), data.data(),
                                             static_cast<std::uint16_t>(data.size()), kTimeoutMs);
    return done < 0 ? done : 0;
  }
};

/// FT232R and FT-X: one interface, rates from 3 MHz, a status of two bytes before each packet.
class Ftdi : public UsbProtocol {
 public:
  std::optional<UsbEndpoints> endpoints(const libusb_config_descriptor& config) const override {
    if (config.bNumInterfaces != 1 || config.interface[0].num_altsetting < 1) return std::nullopt;
    return bulk_endpoints(config.interface[0].altsetting[0]);
  }

  int configure(libusb_device_handle* device, const UsbEndpoints&, int baud) const override {
    enum : std::uint8_t {
      kReset = 0,
      kModemLines = 1,
      kFlow = 2,
      kRate = 3,
      kFormat = 4,
      kTimer = 9
    };
    constexpr std::uint16_t kDtrRtsOn = 0x0303, k8N1 = 8, kOneMs = 1;
    const std::array<std::pair<std::uint8_t, std::uint16_t>, 6> steps{{{kReset, 0},
                                                                       {kTimer, kOneMs},
                                                                       {kFormat, k8N1},
                                                                       {kFlow, 0},
                                                                       {kRate, divisor(baud)},
                                                                       {kModemLines, kDtrRtsOn}}};
    for (const auto& [number, value] : steps) {
      const int done = libusb_control_transfer(device, LIBUSB_REQUEST_TYPE_VENDOR, number, value, 0,
                                               nullptr, 0, kTimeoutMs);
      if (done < 0) return done;
    }
    return 0;
  }

  std::size_t header() const override { return 2; }

 private:
  /// Integer divisors of 3 MHz: exact for 1 000 000 and 250 000 baud, 0.2 % off for 115 200.
  static std::uint16_t divisor(int baud) {
    return static_cast<std::uint16_t>((3'000'000 + baud / 2) / baud);
  }
};

/// FTDI's own protocol for its vendor number, CDC-ACM for all others.
std::unique_ptr<UsbProtocol> usb_protocol(std::uint16_t vendor) {
  if (vendor == kFtdiVendor) return std::make_unique<Ftdi>();
  return std::make_unique<CdcAcm>();
}

constexpr unsigned kWriteTimeoutMs = 100;
constexpr std::size_t kReads = 4;

[[noreturn]] void fail(const std::string& path, std::string_view what, int error) {
  if (error == LIBUSB_ERROR_NO_DEVICE) throw DriverError(cannot_open(path, ENODEV));
  if (error == LIBUSB_ERROR_BUSY) throw DriverError(cannot_open(path, EBUSY));
  throw DriverError(fmt::format("{}: {} failed: {}. Unplug and plug the adapter", path, what,
                                libusb_strerror(error)));
}

/// An open, claimed and configured device. Closing returns it to the kernel's driver.
class UsbDevice {
 public:
  UsbDevice(const std::string& path, int baud) : path_(path) {
    try {
      open();
      claim(baud);
    } catch (...) {
      shut();
      throw;
    }
  }
  ~UsbDevice() { shut(); }

  libusb_context* context() const { return context_; }
  libusb_device_handle* handle() const { return handle_; }
  const UsbEndpoints& ends() const { return ends_; }
  std::size_t header() const { return protocol_->header(); }

 private:
  void open() {
    fd_ = ::open(path_.c_str(), O_RDWR | O_CLOEXEC);
    if (fd_ < 0) throw DriverError(cannot_open(path_, errno));
    // The device is identified by its node: requires neither enumeration nor netlink, which the
    // systemd unit forbids.
    libusb_set_option(nullptr, LIBUSB_OPTION_NO_DEVICE_DISCOVERY);
    if (const int error = libusb_init(&context_)) fail(path_, "libusb", error);
    const int error = libusb_wrap_sys_device(context_, fd_, &handle_);
    if (error != 0) fail(path_, "opening", error);
    libusb_set_auto_detach_kernel_driver(handle_, 1);
  }

  void claim(int baud) {
    libusb_device* device = libusb_get_device(handle_);
    libusb_device_descriptor about{};
    if (const int error = libusb_get_device_descriptor(device, &about)) {
      fail(path_, "reading its description", error);
    }
    protocol_ = usb_protocol(about.idVendor);
    find_endpoints(device);
    for (const int interface : interfaces()) {
      if (const int error = libusb_claim_interface(handle_, interface)) {
        fail(path_, "taking the interface from the kernel's driver", error);
      }
      claimed_.push_back(interface);
    }
    if (const int error = protocol_->configure(handle_, ends_, baud)) {
      fail(path_, fmt::format("setting {} baud", baud), error);
    }
  }

  void find_endpoints(libusb_device* device) {
    libusb_config_descriptor* config = nullptr;
    if (const int error = libusb_get_active_config_descriptor(device, &config)) {
      fail(path_, "reading its configuration", error);
    }
    const std::optional<UsbEndpoints> found = protocol_->endpoints(*config);
    libusb_free_config_descriptor(config);
    if (!found) {
      throw DriverError(fmt::format(
          "{}: the adapter is neither CDC-ACM nor an FTDI with one port. Name its serial device "
          "(/dev/ttyUSB0 or /dev/cellcal-contact) instead",
          path_));
    }
    ends_ = *found;
  }

  std::vector<int> interfaces() const {
    if (ends_.control == ends_.data) return {ends_.data};
    return {ends_.control, ends_.data};
  }

  void shut() {
    for (const int interface : claimed_) libusb_release_interface(handle_, interface);
    if (handle_ != nullptr) libusb_close(handle_);
    if (context_ != nullptr) libusb_exit(context_);
    if (fd_ >= 0) ::close(fd_);
  }

  const std::string path_;
  int fd_ = -1;
  libusb_context* context_ = nullptr;
  libusb_device_handle* handle_ = nullptr;
  std::unique_ptr<UsbProtocol> protocol_;
  UsbEndpoints ends_;
  std::vector<int> claimed_;
};

/// Transfers bytes between a device and a socket until either ends, on the calling thread.
class UsbBridge {
 public:
  explicit UsbBridge(UsbDevice& device) : device_(device) {
    for (Transfer& read : reads_) {
      read.start(*this);
      libusb_fill_bulk_transfer(read.usb, device_.handle(), device_.ends().in, read.bytes.data(),
                                static_cast<int>(device_.ends().packet), &UsbBridge::was_read,
                                &read, 0);
    }
    write_.start(*this);
  }
  ~UsbBridge() {
    for (Transfer& read : reads_) libusb_free_transfer(read.usb);
    libusb_free_transfer(write_.usb);
  }
  UsbBridge(const UsbBridge&) = delete;
  UsbBridge& operator=(const UsbBridge&) = delete;

  void run(int socket) {
    socket_ = socket;
    for (Transfer& read : reads_) submit(read);
    while (!over_) {
      wait();
      handle_events();
      if (!over_ && !write_.flying) send_waiting();
    }
    for (Transfer& read : reads_) cancel(read);
    cancel(write_);
    while (flying() != 0) {
      wait();
      handle_events();
    }
    // The port's reader then sees the end of the file: a lost port.
    ::shutdown(socket_, SHUT_RDWR);
  }

 private:
  struct Transfer {
    void start(UsbBridge& bridge) {
      owner = &bridge;
      usb = libusb_alloc_transfer(0);
      if (usb == nullptr) throw std::bad_alloc();
    }
    UsbBridge* owner = nullptr;
    libusb_transfer* usb = nullptr;
    bool flying = false;
    std::array<std::uint8_t, kMostUsbPacket> bytes{};
  };

  std::size_t flying() const {
    std::size_t count = write_.flying ? 1 : 0;
    for (const Transfer& read : reads_) count += read.flying ? 1 : 0;
    return count;
  }

  void submit(Transfer& transfer) {
    transfer.flying = libusb_submit_transfer(transfer.usb) == 0;
    over_ = over_ || !transfer.flying;
  }

  static void cancel(Transfer& transfer) {
    if (transfer.flying) libusb_cancel_transfer(transfer.usb);
  }

  /// Waits until libusb or the port's writer needs service.
  void wait() {
    ends_.clear();
    const libusb_pollfd** usb = libusb_get_pollfds(device_.context());
    for (const libusb_pollfd** one = usb; one != nullptr && *one != nullptr; ++one) {
      ends_.push_back({(*one)->fd, (*one)->events, 0});
    }
    libusb_free_pollfds(usb);
    if (!over_ && !write_.flying) ends_.push_back({socket_, POLLIN, 0});
    ::poll(ends_.data(), ends_.size(), kLongestWaitMs);
  }

  void handle_events() {
    timeval none{};
    const int error = libusb_handle_events_timeout_completed(device_.context(), &none, nullptr);
    over_ = over_ || (error != 0 && error != LIBUSB_ERROR_INTERRUPTED);
  }

  void send_waiting() {
    const ssize_t n = ::recv(socket_, write_.bytes.data(), write_.bytes.size(), MSG_DONTWAIT);
    if (n < 0 && (errno == EAGAIN || errno == EINTR)) return;
    if (n <= 0) {
      over_ = true;
      return;
    }
    libusb_fill_bulk_transfer(write_.usb, device_.handle(), device_.ends().out, write_.bytes.data(),
                              static_cast<int>(n), &UsbBridge::was_written, &write_,
                              kWriteTimeoutMs);
    submit(write_);
  }

  static void was_read(libusb_transfer* usb) {
    Transfer& read = *static_cast<Transfer*>(usb->user_data);
    UsbBridge& bridge = *read.owner;
    read.flying = false;
    if (usb->status != LIBUSB_TRANSFER_COMPLETED) {
      bridge.over_ = true;
      return;
    }
    const auto size = static_cast<std::size_t>(usb->actual_length);
    const std::size_t header = bridge.device_.header();
    // A full socket loses bytes like an overrun line; the frames' CRC detects it.
    if (size > header) {
      [[maybe_unused]] const ssize_t sent = ::send(bridge.socket_, read.bytes.data() + header,
                                                   size - header, MSG_DONTWAIT | MSG_NOSIGNAL);
    }
    if (!bridge.over_) bridge.submit(read);
  }

  /// A frame not accepted by the device in time is lost, as on a bad line: the protocol repeats
  /// important data. A disconnected device is detected by the reads.
  static void was_written(libusb_transfer* usb) {
    static_cast<Transfer*>(usb->user_data)->flying = false;
  }

  static constexpr int kLongestWaitMs = 1000;

  UsbDevice& device_;
  int socket_ = -1;
  std::array<Transfer, kReads> reads_;
  Transfer write_;
  std::vector<pollfd> ends_;
  bool over_ = false;
};

class UsbPort : public Port {
 public:
  UsbPort(const std::string& path, int baud, int priority)
      : Port(path), device_(path, baud), bridge_(device_) {
    std::array<int, 2> ends{};
    if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0, ends.data()) != 0) {
      throw DriverError(fmt::format("{}: socketpair failed: {}", path, std::strerror(errno)));
    }
    fd_ = ends[0];
    far_ = ends[1];
    thread_ = std::thread([this, priority] {
      configure_port_thread("port-usb", priority);
      bridge_.run(far_);
    });
  }
  ~UsbPort() override {
    ::shutdown(fd_, SHUT_RDWR);
    thread_.join();
    ::close(fd_);
    ::close(far_);
  }

 private:
  UsbDevice device_;
  UsbBridge bridge_;
  int far_ = -1;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<Port> open_usb_port(const std::string& path, int baud, int priority) {
  return std::make_unique<UsbPort>(path, baud, priority);
}

}  // namespace cellcal::drivers
