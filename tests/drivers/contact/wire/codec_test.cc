// The wire: check values, round trips, and bytes that are not frames.

#include <gtest/gtest.h>

#include <random>
#include <string_view>
#include <vector>

#include "drivers/contact/wire/ctp_codec.h"

namespace cellcal::drivers::ctp {
namespace {

std::vector<Frame> frames_of(FrameReader& reader, std::span<const std::uint8_t> bytes) {
  std::vector<Frame> frames;
  for (const std::uint8_t b : bytes) {
    if (const Frame* f = reader.feed(b)) frames.push_back(*f);
  }
  return frames;
}

std::vector<std::uint8_t> bytes_of(const WireBytes& wire) {
  return {wire.bytes().begin(), wire.bytes().end()};
}

TEST(CtpCodec, CrcHasTheCheckValueOfCcittFalse) {
  constexpr std::string_view kText = "123456789";
  EXPECT_EQ(ctp_crc16(reinterpret_cast<const std::uint8_t*>(kText.data()), kText.size()), 0x29B1);
  EXPECT_EQ(ctp_crc16(nullptr, 0), CTP_CONFIG_NONE);
}

TEST(CtpCodec, AFrameHasSixBytesOfOverheadAndOneZeroAtItsEnd) {
  for (std::size_t size = 0; size <= CTP_MAX_PAYLOAD; ++size) {
    const std::vector<std::uint8_t> payload(size, 0);
    const WireBytes wire = build_frame(CTP_LOG, 0, payload);
    EXPECT_EQ(wire.size, size + 6);
    EXPECT_EQ(wire.data[wire.size - 1], 0);
    EXPECT_EQ(std::count(wire.data.begin(), wire.data.begin() + static_cast<int>(wire.size), 0), 1);
  }
  EXPECT_EQ(build_frame(CTP_LOG, 0, std::vector<std::uint8_t>(CTP_MAX_PAYLOAD + 1)).size, 0u);
}

TEST(CtpCodec, AKnownFrameHasTheseBytes) {
  // TRIP, seq 1, arm_id 0x0102, t 0x00000A0B; CRC by an independent bitwise calculation.
  const std::vector<std::uint8_t> raw = {0x83, 0x01, 0x02, 0x01, 0x0B, 0x0A, 0x00, 0x00};
  std::uint16_t crc = 0xFFFF;
  for (const std::uint8_t b : raw) {
    crc = static_cast<std::uint16_t>(crc ^ (b << 8));
    for (int i = 0; i < 8; ++i) {
      crc = static_cast<std::uint16_t>((crc & 0x8000) != 0 ? (crc << 1) ^ 0x1021 : crc << 1);
    }
  }
  const auto wire = bytes_of(build(Trip{0x0102, 0x0A0B}, 1));
  const std::vector<std::uint8_t> head = {0x07, 0x83, 0x01, 0x02, 0x01, 0x0B, 0x0A, 0x01, 0x03};
  ASSERT_EQ(wire.size(), 12u);
  EXPECT_EQ(std::vector<std::uint8_t>(wire.begin(), wire.begin() + 9), head);
  EXPECT_EQ(wire[9], crc & 0xFF);
  EXPECT_EQ(wire[10], crc >> 8);
  EXPECT_EQ(wire[11], 0);
}

TEST(CtpCodec, CobsComesBackForAllLengthsAndContents) {
  std::mt19937 random(1);
  for (std::size_t size = 0; size <= 254; ++size) {
    std::vector<std::uint8_t> data(size);
    for (auto& b : data) b = random() % 3 == 0 ? 0 : static_cast<std::uint8_t>(random());
    std::vector<std::uint8_t> coded(size + 1), back(size + 1);
    const std::size_t n = cobs_encode(data, coded.data());
    ASSERT_EQ(n, size + 1);
    const auto m = cobs_decode({coded.data(), n}, back.data());
    ASSERT_TRUE(m);
    back.resize(*m);
    EXPECT_EQ(back, data);
  }
}

TEST(CtpCodec, ABlockOfTheGreatestLengthStandsForNoZero) {
  std::vector<std::uint8_t> coded(255, 1);
  coded[0] = 0xFF;
  coded.insert(coded.end(), {2, 7});
  std::vector<std::uint8_t> back(coded.size()), expected(254, 1);
  expected.push_back(7);
  const auto size = cobs_decode(coded, back.data());
  ASSERT_TRUE(size);
  back.resize(*size);
  EXPECT_EQ(back, expected);
}

template <class Payload>
void comes_back(const Payload& payload, Direction direction) {
  FrameReader reader(direction);
  const auto frames = frames_of(reader, build(payload, 9).bytes());
  ASSERT_EQ(frames.size(), 1u);
  EXPECT_EQ(frames[0].type, Payload::kType);
  EXPECT_EQ(frames[0].seq, 9);
  std::array<std::uint8_t, CTP_MAX_PAYLOAD> a{}, b{};
  to_bytes(payload, a.data());
  to_bytes(read<Payload>(frames[0]), b.data());
  EXPECT_EQ(a, b);
  EXPECT_EQ(frames[0].payload, a);
}

TEST(CtpCodec, EveryPayloadComesBack) {
  comes_back(Hello{1, 3, 0xDEADBEEF}, Direction::kFromHost);
  comes_back(Config{1, 7, 0x1234, 9, 0x2345, 0x3456}, Direction::kFromHost);
  comes_back(Arm{0xFFFE, 0x8001}, Direction::kFromHost);
  comes_back(Disarm{0x0100}, Direction::kFromHost);
  comes_back(Ack{0x00FF}, Direction::kFromHost);
  comes_back(Ping{0x01020304}, Direction::kFromHost);
  comes_back(SelfTest{}, Direction::kFromHost);
  comes_back(KeepAlive{}, Direction::kFromHost);
  comes_back(Ident{1, {2, 3, 4}, 5, 6, 16'000'000, 8, 9, 0xABCD}, Direction::kFromSensor);
  comes_back(Board{0x62, 0xD6, 0xFD, 0x0804}, Direction::kFromSensor);
  comes_back(Status{0xFFFFFFFF, 0x1F, 3, 4, 5000, 0x1234}, Direction::kFromSensor);
  comes_back(Trip{1, 2}, Direction::kFromSensor);
  comes_back(Pong{1, 2, 3}, Direction::kFromSensor);
  comes_back(Nak{3, 6}, Direction::kFromSensor);
}

TEST(CtpCodec, EventsShareOnePayload) {
  for (const std::uint8_t type : {CTP_CONTACT, CTP_REVOKED, CTP_RELEASE}) {
    FrameReader reader(Direction::kFromSensor);
    const auto frames = frames_of(reader, build(Event{1, 2, 3, 4, 5, 1, 7}, 0, type).bytes());
    ASSERT_EQ(frames.size(), 1u);
    EXPECT_EQ(frames[0].type, type);
    const auto event = read<Event>(frames[0]);
    EXPECT_EQ(event.event, 1);
    EXPECT_EQ(event.arm_id, 2);
    EXPECT_EQ(event.t_first, 3u);
    EXPECT_EQ(event.dt_confirm_us, 4);
    EXPECT_EQ(event.bounces, 5);
    EXPECT_EQ(event.level, 1);
    EXPECT_EQ(event.sense_mv, 7);
  }
}

TEST(CtpCodec, ABoardsFusesAndLoaderStandWhereTheProtocolHasThem) {
  std::array<std::uint8_t, CTP_BOARD_SIZE> bytes{};
  const Board board{0x62, 0xD6, 0xFD, 0x0804};
  to_bytes(board, bytes.data());
  EXPECT_EQ(bytes, (std::array<std::uint8_t, CTP_BOARD_SIZE>{0x62, 0xD6, 0xFD, 0x04, 0x08}));
  const auto read = from_bytes<Board>(bytes.data());
  EXPECT_EQ(read.fuses_low, 0x62);
  EXPECT_EQ(read.fuses_high, 0xD6);
  EXPECT_EQ(read.fuses_extended, 0xFD);
  EXPECT_EQ(read.loader, 0x0804);
}

TEST(CtpReader, EverySingleBitErrorIsRejectedAndTheNextFrameRead) {
  const auto good = bytes_of(build(Event{1, 2, 3, 4, 5, 1, 7}, 0, CTP_CONTACT));
  const auto next = bytes_of(build(Trip{1, 2}, 1));
  for (std::size_t at = 0; at < good.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      FrameReader reader(Direction::kFromSensor);
      auto bad = good;
      bad[at] = static_cast<std::uint8_t>(bad[at] ^ (1 << bit));
      EXPECT_TRUE(frames_of(reader, bad).empty()) << at << " bit " << bit;
      const std::uint8_t zero = 0;
      frames_of(reader, {&zero, 1});  // the flipped delimiter's replacement
      EXPECT_EQ(frames_of(reader, next).size(), 1u) << at << " bit " << bit;
      const WireCounters& c = reader.counters();
      EXPECT_EQ(c.frames, 1u);
      EXPECT_GE(c.crc_errors + c.malformed, 1u);
    }
  }
}

TEST(CtpReader, EveryTruncationIsRejectedAndTheNextFrameRead) {
  const auto good = bytes_of(build(Status{1, 2, 3, 4, 5, 6}, 0));
  const auto next = bytes_of(build(Trip{1, 2}, 1));
  for (std::size_t keep = 1; keep + 1 < good.size(); ++keep) {
    FrameReader reader(Direction::kFromSensor);
    frames_of(reader, {good.data(), keep});
    const std::uint8_t zero = 0;
    EXPECT_TRUE(frames_of(reader, {&zero, 1}).empty());
    EXPECT_EQ(frames_of(reader, next).size(), 1u) << keep;
  }
}

TEST(CtpReader, AnEndlessFrameCostsOneFrame) {
  FrameReader reader(Direction::kFromSensor);
  std::vector<std::uint8_t> noise(100'000, 0xFF);
  EXPECT_TRUE(frames_of(reader, noise).empty());
  EXPECT_EQ(reader.counters().oversize, 1u);
  const std::uint8_t zero = 0;
  frames_of(reader, {&zero, 1});
  EXPECT_EQ(frames_of(reader, build(Trip{1, 2}, 1).bytes()).size(), 1u);
}

TEST(CtpReader, CountsGapsAcrossTheWrapOfTheSequence) {
  FrameReader reader(Direction::kFromSensor);
  for (const int seq : {254, 255, 0, 1}) {
    frames_of(reader, build(Trip{}, static_cast<std::uint8_t>(seq)).bytes());
  }
  EXPECT_EQ(reader.counters().gaps, 0u);
  frames_of(reader, build(Trip{}, 4).bytes());
  EXPECT_EQ(reader.counters().gaps, 2u);
}

TEST(CtpReader, UnknownTypesAreIgnoredAndCounted) {
  FrameReader reader(Direction::kFromSensor);
  const std::vector<std::uint8_t> payload = {1, 2, 3};
  EXPECT_TRUE(frames_of(reader, build_frame(0xC3, 0, payload).bytes()).empty());
  EXPECT_TRUE(frames_of(reader, build(Arm{1, 2}, 1).bytes()).empty()) << "the host's, echoed";
  EXPECT_EQ(reader.counters().unknown_types, 2u);
  EXPECT_EQ(reader.counters().gaps, 0u);
}

TEST(CtpReader, AKnownTypeOfTheWrongSizeIsMalformed) {
  FrameReader reader(Direction::kFromSensor);
  for (std::size_t size = 0; size <= CTP_MAX_PAYLOAD; ++size) {
    if (size == CTP_STATUS_SIZE) continue;
    const std::vector<std::uint8_t> payload(size, 1);
    EXPECT_TRUE(frames_of(reader, build_frame(CTP_STATUS, 0, payload).bytes()).empty()) << size;
  }
  EXPECT_EQ(reader.counters().malformed, static_cast<std::uint64_t>(CTP_MAX_PAYLOAD));
}

TEST(CtpReader, LogTextMayHaveAnySize) {
  FrameReader reader(Direction::kFromSensor);
  for (std::size_t size = 0; size <= CTP_MAX_PAYLOAD; ++size) {
    const std::vector<std::uint8_t> text(size, 'x');
    const auto frames = frames_of(reader, build_frame(CTP_LOG, 0, text).bytes());
    ASSERT_EQ(frames.size(), 1u);
    EXPECT_EQ(frames[0].size, size);
  }
}

}  // namespace
}  // namespace cellcal::drivers::ctp
