#pragma once
// The emulated sensor as a line for drivers::ContactInline.

#include "drivers/contact/wire/byte_line.h"
#include "sim/mcu/microcontroller.h"

namespace cellcal::sim {

/// Address of the host for a board on Ethernet.
inline constexpr host_address kThisComputer{0x0100007F, 49'000};

/// The microcontroller must outlive this object.
class McuLine : public drivers::ByteLine {
 public:
  explicit McuLine(Microcontroller& mcu) : mcu_(mcu) {}

  void write(std::span<const std::uint8_t> bytes, TimePoint t) override;
  TimePoint next() const override;
  void advance(TimePoint t) override;
  std::size_t read(std::span<std::uint8_t> into, TimePoint& t) override;

 private:
  Microcontroller& mcu_;
};

}  // namespace cellcal::sim
