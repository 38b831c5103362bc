// A reader keeps no state between frames.

#include <gtest/gtest.h>

#include <algorithm>

#include "drivers/contact/wire/ctp_codec.h"

namespace cellcal::drivers::ctp {
namespace {

const Frame* last_frame_of(FrameReader& reader, std::span<const std::uint8_t> bytes) {
  const Frame* last = nullptr;
  for (const std::uint8_t byte : bytes) {
    if (const Frame* frame = reader.feed(byte)) last = frame;
  }
  return last;
}

TEST(CtpReaderMemory, AShortFrameHasNothingOfTheLongOneBeforeIt) {
  FrameReader reader(Direction::kFromSensor);
  ASSERT_NE(
      last_frame_of(reader, build(Event{0xFFFF, 0xFFFF, 0xFFFFFFFF, 0xFFFF, 0xFF, 0xFF, 0xFFFF}, 0,
                                  CTP_CONTACT)
                                .bytes()),
      nullptr);
  const Frame* nak = last_frame_of(reader, build(Nak{3, 6}, 1).bytes());
  ASSERT_NE(nak, nullptr);
  EXPECT_EQ(nak->size, CTP_NAK_SIZE);
  EXPECT_TRUE(std::all_of(nak->payload.begin() + CTP_NAK_SIZE, nak->payload.end(),
                          [](std::uint8_t byte) { return byte == 0; }));
}

TEST(CtpReaderMemory, ANewPeerIsReadFromItsFirstByte) {
  FrameReader reader(Direction::kFromSensor);
  const WireBytes wire = build(Trip{1, 2}, 9);
  last_frame_of(reader, wire.bytes().first(5));
  reader.resync();
  EXPECT_NE(last_frame_of(reader, wire.bytes()), nullptr);
  last_frame_of(reader, wire.bytes());
  reader.resync();
  EXPECT_NE(last_frame_of(reader, build(Trip{1, 2}, 77).bytes()), nullptr);
  EXPECT_EQ(reader.counters().gaps, 255u)
      << "only the frame that came twice counts, not the new peer's";
  EXPECT_EQ(reader.counters().frames, 3u);
  // Neither after a frame that is too long.
  for (int i = 0; i < 1000; ++i) reader.feed(1);
  reader.resync();
  EXPECT_NE(last_frame_of(reader, wire.bytes()), nullptr);
}

TEST(CtpDatagrams, AreOvertakenByAQuarterOfTheCountAtMost) {
  FrameReader reader(Direction::kFromSensor, Order::kAnyhow);
  const auto is_read = [&](std::uint8_t seq) {
    return last_frame_of(reader, build(Trip{1, 2}, seq).bytes()) != nullptr;
  };
  EXPECT_TRUE(is_read(0));
  EXPECT_FALSE(is_read(0)) << "twice";
  EXPECT_TRUE(is_read(151)) << "150 frames were lost with the cable";
  EXPECT_FALSE(is_read(100));
  EXPECT_TRUE(is_read(152));
  EXPECT_EQ(reader.counters().overtaken, 2u);
}

TEST(CtpReaderMemory, TheLongestFrameIsReadAndOneByteMoreIsNot) {
  const std::vector<std::uint8_t> text(CTP_MAX_PAYLOAD, 'x');
  FrameReader reader(Direction::kFromSensor);
  EXPECT_NE(last_frame_of(reader, build_frame(CTP_LOG, 0, text).bytes()), nullptr);
  for (int i = 0; i < int{CTP_MAX_WIRE} - 1; ++i) reader.feed(1);
  EXPECT_EQ(reader.counters().oversize, 0u);
  reader.feed(1);
  EXPECT_EQ(reader.counters().oversize, 1u);
}

}  // namespace
}  // namespace cellcal::drivers::ctp
