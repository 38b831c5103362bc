#include "usb_adapter.h"

#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <termios.h>
#include <umockdev.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <deque>
#include <mutex>
#include <set>
#include <stdexcept>

#include "drivers/contact/wire/ctp_codec.h"

namespace cellcal::drivers {

namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr std::uint8_t kBulkIn = 0x81, kPacket = 64;

Bytes device_descriptor(UsbAdapterKind kind) {
  Bytes bytes{18, 1, 0x00, 0x02, 0, 0, 0, 64, 0x41, 0x23, 0x43, 0x00, 0x01, 0x00, 0, 0, 0, 1};
  if (kind == UsbAdapterKind::kFtdi)
    bytes[8] = 0x03, bytes[9] = 0x04, bytes[10] = 0x01, bytes[11] = 0x60;
  if (kind == UsbAdapterKind::kOther) bytes[8] = 0x86, bytes[9] = 0x1A;
  return bytes;
}

Bytes configuration(const std::vector<Bytes>& parts, std::uint8_t interfaces) {
  Bytes bytes{9, 2, 0, 0, interfaces, 1, 0, 0x80, 50};
  for (const Bytes& part : parts) bytes.insert(bytes.end(), part.begin(), part.end());
  bytes[2] = static_cast<std::uint8_t>(bytes.size());
  return bytes;
}

Bytes descriptors(UsbAdapterKind kind) {
  const Bytes in{7, 5, kBulkIn, 2, kPacket, 0, 0}, out{7, 5, 0x02, 2, kPacket, 0, 0};
  const Bytes event{7, 5, 0x83, 3, 8, 0, 255}, vendor{9, 4, 0, 0, 2, 0xFF, 0xFF, 0xFF, 0};
  const Bytes control{9, 4, 0, 0, 1, 2, 2, 1, 0}, data{9, 4, 1, 0, 2, 10, 0, 0, 0};
  Bytes bytes = device_descriptor(kind);
  const Bytes tail = kind == UsbAdapterKind::kCdcAcm
                         ? configuration({control, event, data, in, out}, 2)
                         : configuration({vendor, in, out}, 1);
  bytes.insert(bytes.end(), tail.begin(), tail.end());
  return bytes;
}

std::string hex(const Bytes& bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    constexpr const char* kDigits = "0123456789ABCDEF";
    text += kDigits[byte >> 4];
    text += kDigits[byte & 15];
  }
  return text;
}

constexpr const char* kNode = "/dev/bus/usb/001/002";

}  // namespace

class UsbAdapter::Impl {
 public:
  Impl(UsbAdapterKind kind, const std::string& line)
      : kind_(kind), line_(::open(line.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    if (line_ < 0) throw std::runtime_error("no line " + line);
    termios tio{};
    ::tcgetattr(line_, &tio);
    ::cfmakeraw(&tio);
    ::tcsetattr(line_, TCSANOW, &tio);
    const std::string tree =
        "P: /devices/pci0000:00/usb1/1-1\nN: bus/usb/001/002=" + hex(descriptors(kind)) +
        "\nE: SUBSYSTEM=usb\nE: DEVTYPE=usb_device\nE: DEVNAME=/dev/bus/usb/001/002\n"
        "E: MAJOR=189\nE: MINOR=1\nA: busnum=1\\n\nA: devnum=2\\n\nA: bConfigurationValue=1\\n\n"
        "A: idVendor=0403\\n\nA: idProduct=6001\\n\nA: speed=12\\n\n\n";
    GError* error = nullptr;
    if (!umockdev_testbed_add_from_string(testbed_, tree.c_str(), &error)) {
      throw std::runtime_error(error->message);
    }
    g_signal_connect(handler_, "handle-ioctl", G_CALLBACK(&Impl::on_ioctl), this);
    if (!umockdev_testbed_attach_ioctl(testbed_, kNode, handler_, &error)) {
      throw std::runtime_error(error->message);
    }
  }
  ~Impl() {
    umockdev_testbed_detach_ioctl(testbed_, kNode, nullptr);
    forget();
    g_object_unref(handler_);
    g_object_unref(testbed_);
    ::close(line_);
  }

  std::mutex mutex_;
  std::vector<UsbRequest> requests_;
  std::set<unsigned> claimed_;
  std::size_t given_back_ = 0;
  bool unplugged_ = false, stalled_ = false;

 private:
  struct Urb {
    UMockdevIoctlData* data;
    UMockdevIoctlData* buffer;
    gulong address;
    usbdevfs_urb& urb() const { return *reinterpret_cast<usbdevfs_urb*>(data->data); }
  };

  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, Impl* self) {
    const std::lock_guard lock(self->mutex_);
    const gulong request = umockdev_ioctl_client_get_request(client);
    // As in the kernel: transfers of a lost device end, and can still be reaped.
    const bool gone = self->unplugged_ && request != USBDEVFS_REAPURBNDELAY;
    const int error = gone ? ENODEV : self->answer(request, client);
    umockdev_ioctl_client_complete(client, error == 0 ? 0 : -1, error);
    return TRUE;
  }

  /// Returns an errno, or 0.
  int answer(gulong request, UMockdevIoctlClient* client) {
    UMockdevIoctlData* arg = umockdev_ioctl_client_get_arg(client);
    switch (request) {
      case USBDEVFS_GET_CAPABILITIES: return put<std::uint32_t>(arg, 0);
      case USBDEVFS_CONNECTINFO: return put<usbdevfs_connectinfo>(arg, {2, 0});
      case USBDEVFS_CLAIMINTERFACE: claimed_.insert(get<unsigned>(arg)); return 0;
      case USBDEVFS_DISCONNECT_CLAIM:
        claimed_.insert(get<usbdevfs_disconnect_claim>(arg).interface);
        return 0;
      case USBDEVFS_RELEASEINTERFACE: claimed_.erase(get<unsigned>(arg)); return 0;
      case USBDEVFS_IOCTL:
        if (get<usbdevfs_ioctl>(arg).ioctl_code == static_cast<int>(USBDEVFS_CONNECT))
          ++given_back_;
        return 0;
      case USBDEVFS_SUBMITURB: return submit(arg);
      case USBDEVFS_REAPURBNDELAY: return reap(arg);
      case USBDEVFS_DISCARDURB: return discard(arg);
      default: return ENOTTY;
    }
  }

  template <class Value>
  static Value get(UMockdevIoctlData* arg) {
    UMockdevIoctlData* data = umockdev_ioctl_data_resolve(arg, 0, sizeof(Value), nullptr);
    Value value{};
    std::memcpy(&value, data->data, sizeof value);
    umockdev_ioctl_data_unref(data);
    return value;
  }

  template <class Value>
  static int put(UMockdevIoctlData* arg, const Value& value) {
    UMockdevIoctlData* data = umockdev_ioctl_data_resolve(arg, 0, sizeof(Value), nullptr);
    umockdev_ioctl_data_update(data, 0, reinterpret_cast<guint8*>(const_cast<Value*>(&value)),
                               sizeof value);
    umockdev_ioctl_data_unref(data);
    return 0;
  }

  int submit(UMockdevIoctlData* arg) {
    Urb one{};
    one.data = umockdev_ioctl_data_resolve(arg, 0, sizeof(usbdevfs_urb), nullptr);
    one.address = one.data->client_addr;
    one.buffer = umockdev_ioctl_data_resolve(one.data, offsetof(usbdevfs_urb, buffer),
                                             one.urb().buffer_length, nullptr);
    flying_.push_back(one);
    return 0;
  }

  /// The first transfer that is complete, or can be completed.
  int reap(UMockdevIoctlData* arg) {
    for (auto one = flying_.begin(); one != flying_.end(); ++one) {
      if (!finish(*one)) continue;
      UMockdevIoctlData* where = umockdev_ioctl_data_resolve(arg, 0, sizeof(void*), nullptr);
      umockdev_ioctl_data_set_ptr(where, 0, one->data);
      umockdev_ioctl_data_unref(where);
      release(*one);
      flying_.erase(one);
      return 0;
    }
    // A real device's descriptor becomes ready; the emulated one always is.
    ::usleep(200);
    return EAGAIN;
  }

  bool finish(const Urb& one) {
    usbdevfs_urb& urb = one.urb();
    if (cancelled_.erase(one.address) != 0) {
      urb.status = -ENOENT;
      return true;
    }
    if (unplugged_) {
      urb.status = -ESHUTDOWN;
      return true;
    }
    if (urb.type == USBDEVFS_URB_TYPE_CONTROL) return control(one);
    return urb.endpoint == kBulkIn ? packet_in(one) : packet_out(one);
  }

  bool control(const Urb& one) {
    usbdevfs_urb& urb = one.urb();
    const std::uint8_t* b = one.buffer->data;
    const auto word = [b](int at) { return static_cast<std::uint16_t>(b[at] | b[at + 1] << 8); };
    requests_.push_back({b[0], b[1], word(2), word(4), Bytes(b + 8, b + urb.buffer_length)});
    set_rate(requests_.back());
    urb.status = 0;
    urb.actual_length = urb.buffer_length - 8;
    return true;
  }

  /// Rate of the serial line, as received by the sensor's end of the terminal.
  void set_rate(const UsbRequest& request) {
    if (kind_ == UsbAdapterKind::kFtdi && request.number == 3 && request.value != 0) {
      set_line_rate(line_, 3'000'000 / request.value);
    }
    if (kind_ == UsbAdapterKind::kCdcAcm && request.number == 0x20 && request.data.size() == 7) {
      set_line_rate(line_, request.data[0] | request.data[1] << 8 | request.data[2] << 16);
    }
  }

  bool packet_in(const Urb& one) {
    const std::size_t header = kind_ == UsbAdapterKind::kFtdi ? 2 : 0;
    std::array<std::uint8_t, kPacket> bytes{0x01, 0x60};
    const ssize_t n = ::read(line_, bytes.data() + header, bytes.size() - header);
    if (n <= 0) return false;
    one.urb().status = 0;
    one.urb().actual_length = static_cast<int>(n + static_cast<ssize_t>(header));
    std::memcpy(one.buffer->data, bytes.data(), static_cast<std::size_t>(one.urb().actual_length));
    return true;
  }

  bool packet_out(const Urb& one) {
    if (stalled_) return false;
    one.urb().actual_length = static_cast<int>(
        ::write(line_, one.buffer->data, static_cast<std::size_t>(one.urb().buffer_length)));
    one.urb().status = 0;
    return true;
  }

  int discard(UMockdevIoctlData* arg) {
    gulong address = 0;
    std::memcpy(&address, arg->data, sizeof address);
    for (const Urb& one : flying_) {
      if (one.address != address) continue;
      cancelled_.insert(address);
      return 0;
    }
    return EINVAL;
  }

  static void release(const Urb& one) {
    umockdev_ioctl_data_unref(one.buffer);
    umockdev_ioctl_data_unref(one.data);
  }

  void forget() {
    for (const Urb& one : flying_) release(one);
    flying_.clear();
  }

  const UsbAdapterKind kind_;
  const int line_;
  UMockdevTestbed* testbed_ = umockdev_testbed_new();
  UMockdevIoctlBase* handler_ = umockdev_ioctl_base_new();
  std::deque<Urb> flying_;
  std::set<gulong> cancelled_;
};

UsbAdapter::UsbAdapter(UsbAdapterKind kind, const std::string& line)
    : impl_(std::make_unique<Impl>(kind, line)) {}
UsbAdapter::~UsbAdapter() = default;

std::string UsbAdapter::path() const { return kNode; }

std::vector<UsbRequest> UsbAdapter::requests() const {
  const std::lock_guard lock(impl_->mutex_);
  return impl_->requests_;
}

std::size_t UsbAdapter::claimed() const {
  const std::lock_guard lock(impl_->mutex_);
  return impl_->claimed_.size();
}

std::size_t UsbAdapter::given_back() const {
  const std::lock_guard lock(impl_->mutex_);
  return impl_->given_back_;
}

void UsbAdapter::plug(bool plugged) {
  const std::lock_guard lock(impl_->mutex_);
  impl_->unplugged_ = !plugged;
}

void UsbAdapter::stall_output(bool stalled) {
  const std::lock_guard lock(impl_->mutex_);
  impl_->stalled_ = stalled;
}

}  // namespace cellcal::drivers
