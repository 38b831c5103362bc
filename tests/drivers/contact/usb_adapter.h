#pragma once
// A USB serial adapter on an emulated usbfs (umockdev), for libusb as Debian ships it. Needs
// libumockdev-preload in LD_PRELOAD.

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace cellcal::drivers {

enum class UsbAdapterKind {
  kCdcAcm,
  kFtdi,
  kOther,  ///< vendor class, of neither protocol
};

struct UsbRequest {
  std::uint8_t type = 0, number = 0;
  std::uint16_t value = 0, index = 0;
  std::vector<std::uint8_t> data;
};

class UsbAdapter {
 public:
  /// `line`: the terminal at the adapter's serial side.
  UsbAdapter(UsbAdapterKind kind, const std::string& line);
  ~UsbAdapter();

  /// /dev/bus/usb/001/002
  std::string path() const;
  /// Control transfers other than standard requests, in order.
  std::vector<UsbRequest> requests() const;
  std::size_t claimed() const;     ///< interfaces held by the program
  std::size_t given_back() const;  ///< number of times the kernel's driver was reattached
  void plug(bool plugged);
  /// OUT packets are not accepted; a transfer waits until it is cancelled.
  void stall_output(bool stalled);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace cellcal::drivers
