#include "drivers/contact/port/usb_protocol.h"

#include <array>
#include <span>
#include <utility>

namespace cellcal::drivers {

namespace {

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
    const int done =
        libusb_control_transfer(device, kClassOfInterface,
                                number, value, static_cast<std::uint16_t>(ends.control),
                                data.data(), static_cast<std::uint16_t>(data.size()), kTimeoutMs);
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

}  // namespace

std::unique_ptr<UsbProtocol> usb_protocol(std::uint16_t vendor) {
  if (vendor == kFtdiVendor) return std::make_unique<Ftdi>();
  return std::make_unique<CdcAcm>();
}

}  // namespace cellcal::drivers
