#pragma once
// Kinds of USB serial adapters as required for libusb: endpoints and requests.
//
// Sources: USB CDC 1.2 and PSTN 1.2 (class requests of CDC-ACM); FTDI AN232B-05 (divisors) and the
// request numbers of Linux's ftdi_sio.

#include <libusb.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>

namespace cellcal::drivers {

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

/// FTDI's own protocol for its vendor number, CDC-ACM for all others.
std::unique_ptr<UsbProtocol> usb_protocol(std::uint16_t vendor);

}  // namespace cellcal::drivers
