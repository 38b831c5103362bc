#include "sim/mcu/serial_line.h"

#include <algorithm>
#include <array>

#include "drivers/contact/wire/byte_line.h"
#include "drivers/contact/wire/ctp.h"

namespace cellcal::sim {

using drivers::TimePoint;

SerialLine::SerialLine(drivers::ByteLine& device, std::uint64_t seed, LineKind kind)
    : device_(device), kind_(kind), to_device_(kind, {}, seed), to_host_(kind, {}, seed + 1) {}

void SerialLine::write(std::span<const std::uint8_t> bytes, TimePoint t) {
  const std::string text(bytes.begin(), bytes.end());
  to_device_.send(text, t);
  // Messages without transit time are delivered immediately, as without this line.
  advance(std::max(now_, t));
}

TimePoint SerialLine::next() const {
  return std::min({device_.next(), to_device_.next(), to_host_.next()});
}

void SerialLine::listen() {
  std::array<std::uint8_t, CTP_MAX_WIRE> bytes{};
  TimePoint t{};
  while (const std::size_t size = device_.read(bytes, t)) {
    to_host_.send(std::string(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)), t);
  }
}

void SerialLine::advance(TimePoint t) {
  while (to_device_.next() <= t) {
    const TimePoint due = std::max(now_, to_device_.next());
    device_.advance(due);
    listen();
    now_ = due;
    const auto message = to_device_.take(due);
    const std::vector<std::uint8_t> bytes(message->bytes.begin(), message->bytes.end());
    device_.write(bytes, due);
  }
  device_.advance(t);
  listen();
  now_ = std::max(now_, t);
}

std::size_t SerialLine::read(std::span<std::uint8_t> into, TimePoint& t) {
  const auto message = to_host_.take(now_);
  if (!message) return 0;
  std::size_t size = std::min(message->bytes.size(), into.size());
  std::copy_n(message->bytes.begin(), size, into.begin());
  // As in the socket's reader: a truncated frame ends with its datagram.
  const bool cut = kind_ == LineKind::kDatagrams && size > 0 && into[size - 1] != 0;
  if (cut && size < into.size()) into[size++] = 0;
  t = message->t;
  // An empty datagram (truncated completely) must not be read as 'none pending'.
  return size > 0 ? size : read(into, t);
}

}  // namespace cellcal::sim
