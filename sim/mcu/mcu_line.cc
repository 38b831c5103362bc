#include "sim/mcu/mcu_line.h"

#include <algorithm>

namespace cellcal::sim {

void McuLine::write(std::span<const std::uint8_t> bytes, TimePoint t) {
  if (mcu_.datagrams()) return mcu_.receive(bytes, t, kThisComputer);
  mcu_.receive(bytes, t);
}

TimePoint McuLine::next() const { return mcu_.next_event(); }

void McuLine::advance(TimePoint t) { mcu_.advance(t); }

std::size_t McuLine::read(std::span<std::uint8_t> into, TimePoint& t) {
  const auto output = mcu_.next_output();
  if (!output) return 0;
  const auto bytes = output->frame.bytes();
  const std::size_t size = std::min(bytes.size(), into.size());
  std::copy_n(bytes.begin(), size, into.begin());
  t = output->t;
  return size;
}

}  // namespace cellcal::sim
