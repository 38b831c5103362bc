#include "drivers/contact/wire/ctp_codec.h"

#include <asm/termbits.h>
#include <sys/ioctl.h>

namespace cellcal::drivers::ctp {

namespace {

constexpr std::uint8_t kFromSensorBit = 0x80;

bool belongs(std::uint8_t type, Direction direction) {
  const bool from_sensor = (type & kFromSensorBit) != 0;
  return ctp_payload_size(type) >= -1 && from_sensor == (direction == Direction::kFromSensor);
}

}  // namespace

std::uint16_t config_crc(const Config& config) {
  std::array<std::uint8_t, Config::kSize> raw{};
  to_bytes(config, raw.data());
  return ctp_crc16(raw.data(), raw.size());
}

std::size_t cobs_encode(std::span<const std::uint8_t> in, std::uint8_t* out) {
  std::size_t code_at = 0, size = 1;
  std::uint8_t code = 1;
  for (const std::uint8_t byte : in) {
    if (byte == 0) {
      out[code_at] = code;
      code_at = size++;
      code = 1;
    } else {
      out[size++] = byte;
      ++code;
    }
  }
  out[code_at] = code;
  return size;
}

std::optional<std::size_t> cobs_decode(std::span<const std::uint8_t> in, std::uint8_t* out) {
  std::size_t size = 0;
  std::size_t i = 0;
  while (i < in.size()) {
    const std::size_t code = in[i++];
    if (code == 0 || i + code - 1 > in.size()) return std::nullopt;
    for (std::size_t k = 1; k < code; ++k, ++i) {
      if (in[i] == 0) return std::nullopt;
      out[size++] = in[i];
    }
    if (code != 0xFF && i < in.size()) out[size++] = 0;
  }
  return size;
}

WireBytes build_frame(std::uint8_t type, std::uint8_t seq, std::span<const std::uint8_t> payload) {
  WireBytes wire;
  if (payload.size() > CTP_MAX_PAYLOAD) return wire;
  std::array<std::uint8_t, CTP_MAX_FRAME> raw{};
  raw[0] = type;
  raw[1] = seq;
  std::copy(payload.begin(), payload.end(), raw.begin() + CTP_HEADER);
  const std::size_t body = CTP_HEADER + payload.size();
  ctp_put_u16(raw.data() + body, ctp_crc16(raw.data(), body));
  wire.size = cobs_encode({raw.data(), body + CTP_CRC}, wire.data.data());
  wire.data[wire.size++] = 0;
  return wire;
}

const Frame* FrameReader::feed(std::uint8_t byte) {
  if (byte == 0) {
    const bool had_bytes = size_ > 0 && !skipping_;
    const Frame* frame = had_bytes ? finish() : nullptr;
    size_ = 0;
    skipping_ = false;
    return frame;
  }
  if (skipping_) return nullptr;
  // The delimiter is not stored, so the longest frame leaves one byte free.
  if (size_ + 1 >= buffer_.size()) {
    ++counters_.oversize;
    skipping_ = true;
    return nullptr;
  }
  buffer_[size_++] = byte;
  return nullptr;
}

bool FrameReader::in_order(std::uint8_t type, std::uint8_t seq) {
  const bool begins = order_ == Order::kAnyhow && (type == CTP_HELLO || type == CTP_IDENT);
  if (last_seq_ && !begins) {
    const auto ahead = static_cast<std::uint8_t>(seq - *last_seq_);
    constexpr std::uint8_t kLongestOvertaken = 64;
    const auto behind = static_cast<std::uint8_t>(*last_seq_ - seq);
    if (order_ == Order::kAnyhow && behind < kLongestOvertaken) {
      ++counters_.overtaken;
      return false;
    }
    counters_.gaps += static_cast<std::uint8_t>(ahead - 1);
  }
  last_seq_ = seq;
  return true;
}

const Frame* FrameReader::finish() {
  std::array<std::uint8_t, CTP_MAX_WIRE> raw{};
  const auto size = cobs_decode({buffer_.data(), size_}, raw.data());
  if (!size || *size < CTP_HEADER + CTP_CRC) {
    ++counters_.malformed;
    return nullptr;
  }
  const std::size_t body = *size - CTP_CRC;
  if (ctp_crc16(raw.data(), body) != ctp_get_u16(raw.data() + body)) {
    ++counters_.crc_errors;
    return nullptr;
  }
  // The CRC is valid, so that the sequence number counts in any case.
  const std::uint8_t type = raw[0], seq = raw[1];
  if (!in_order(type, seq)) return nullptr;
  if (!belongs(type, direction_)) {
    ++counters_.unknown_types;
    return nullptr;
  }
  const std::size_t payload = body - CTP_HEADER;
  const int expected = ctp_payload_size(type);
  if (expected >= 0 && payload != static_cast<std::size_t>(expected)) {
    ++counters_.malformed;
    return nullptr;
  }
  ++counters_.frames;
  frame_ = Frame{};
  frame_.type = type;
  frame_.seq = seq;
  frame_.size = static_cast<std::uint8_t>(payload);
  std::copy_n(raw.begin() + CTP_HEADER, payload, frame_.payload.begin());
  return &frame_;
}

void FrameReader::resync() {
  size_ = 0;
  skipping_ = false;
  last_seq_.reset();
}

}  // namespace cellcal::drivers::ctp

namespace cellcal::drivers {

bool set_line_rate(int fd, int baud) {
  termios2 tio{};
  if (::ioctl(fd, TCGETS2, &tio) != 0) return false;
  tio.c_cflag = (tio.c_cflag & ~static_cast<tcflag_t>(CBAUD)) | BOTHER;
  tio.c_cflag &= ~static_cast<tcflag_t>(CIBAUD);
  tio.c_ispeed = tio.c_ospeed = static_cast<speed_t>(baud);
  return ::ioctl(fd, TCSETS2, &tio) == 0;
}

int line_rate(int fd) {
  termios2 tio{};
  return ::ioctl(fd, TCGETS2, &tio) == 0 ? static_cast<int>(tio.c_ospeed) : 0;
}

}  // namespace cellcal::drivers
