#include "sim/mcu/mcu_line.h"

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

namespace {

constexpr int kFrameBits = 10, kDataBits = 8;

/// Level of the line over one sender's bits; idle (high) before and after.
class Wire {
 public:
  explicit Wire(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}
  double bits() const { return static_cast<double>(bytes_.size()) * kFrameBits; }
  bool high(double bit) const {
    if (bit < 0.0 || bit >= bits()) return true;
    const auto at = static_cast<std::size_t>(bit);
    const std::size_t place = at % kFrameBits;
    if (place == 0) return false;
    return place > kDataBits || (bytes_[at / kFrameBits] >> (place - 1) & 1) != 0;
  }

 private:
  std::span<const std::uint8_t> bytes_;
};

}  // namespace

std::vector<std::uint8_t> received_as(std::span<const std::uint8_t> bytes, int sent_baud,
                                      int receiver_baud) {
  const Wire wire(bytes);
  const double own =
      static_cast<double>(sent_baud) / receiver_baud;  // listener's bit in units of the sender's
  std::vector<std::uint8_t> heard;
  double t = 0.0;
  while (t < wire.bits()) {
    // A start bit is a falling edge: the line was high, and is low from the sender's next bit on.
    if (wire.high(t)) {
      t = std::floor(t) + 1.0;
      continue;
    }
    std::uint8_t byte = 0;
    for (int i = 0; i < kDataBits; ++i) {
      if (wire.high(t + (1.5 + i) * own)) byte = static_cast<std::uint8_t>(byte | 1 << i);
    }
    const double stop = t + (1.5 + kDataBits) * own;
    heard.push_back(wire.high(stop) ? byte : std::uint8_t{0});
    t = stop;
    while (!wire.high(t)) t = std::floor(t) + 1.0;  // a break lasts until the line is high again
  }
  return heard;
}

}  // namespace cellcal::sim
