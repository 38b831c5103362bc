#pragma once
// The sensor's line with faults in both directions, wrapping any other line.

#include "drivers/contact/wire/byte_line.h"
#include "sim/mcu/line.h"

namespace cellcal::sim {

/// Each frame sent by the device, and each write of the host, is one message of the lines.
class SerialLine final : public drivers::ByteLine {
 public:
  /// The device's own line must outlive this object.
  SerialLine(drivers::ByteLine& device, std::uint64_t seed, LineKind kind = LineKind::kFrames);

  Line& to_device() { return to_device_; }
  Line& to_host() { return to_host_; }

  void write(std::span<const std::uint8_t> bytes, drivers::TimePoint t) override;
  drivers::TimePoint next() const override;
  void advance(drivers::TimePoint t) override;
  std::size_t read(std::span<std::uint8_t> into, drivers::TimePoint& t) override;

 private:
  void listen();

  drivers::ByteLine& device_;
  LineKind kind_;
  Line to_device_, to_host_;
  drivers::TimePoint now_{};
};

}  // namespace cellcal::sim
