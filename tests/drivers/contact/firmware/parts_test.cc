// The firmware's small parts: frames, and the boot id in EEPROM.

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <random>
#include <vector>

#include "drivers/contact/firmware/core/boot_record.h"
#include "drivers/contact/firmware/core/link.h"
#include "drivers/contact/wire/ctp_codec.h"

namespace cellcal::test {
namespace {

namespace ctp = drivers::ctp;

// Frames ------------------------------------------------------------------------------------------

TEST(FirmwareLink, BuildsWhatTheDriverBuilds) {
  std::mt19937 random(3);
  for (int i = 0; i < 2000; ++i) {
    std::array<std::uint8_t, CTP_MAX_PAYLOAD> payload{};
    for (auto& b : payload) b = static_cast<std::uint8_t>(random() % 3 == 0 ? 0 : random());
    const auto size = static_cast<std::uint8_t>(random() % (CTP_MAX_PAYLOAD + 1));
    const auto type = static_cast<std::uint8_t>(random()),
               seq = static_cast<std::uint8_t>(random());
    std::array<std::uint8_t, CTP_MAX_WIRE> wire{};
    const auto own = link_build(type, seq, payload.data(), size, wire.data());
    const ctp::WireBytes theirs = ctp::build_frame(type, seq, {payload.data(), size});
    ASSERT_TRUE(
        std::equal(wire.begin(), wire.begin() + own, theirs.bytes().begin(), theirs.bytes().end()));
  }
}

TEST(FirmwareLink, TakesAndCountsWhatTheDriversReaderTakesAndCounts) {
  std::mt19937 random(5);
  link_reader own;
  link_reader_init(&own);
  ctp::FrameReader theirs(ctp::Direction::kFromHost);
  std::uint64_t frames = 0;
  std::vector<std::uint8_t> line;
  for (int i = 0; i < 20'000; ++i) {
    const ctp::WireBytes good =
        ctp::build(ctp::Arm{static_cast<std::uint16_t>(i), 0}, static_cast<std::uint8_t>(i / 3));
    line.assign(good.bytes().begin(), good.bytes().end());
    switch (random() % 8) {
      case 0:  // a flipped bit
        line[random() % line.size()] ^= static_cast<std::uint8_t>(1u << (random() % 8));
        break;
      case 1:  // truncated
        line.resize(random() % line.size());
        break;
      case 2:  // noise, with or without zeros
        line.resize(random() % 120);
        for (auto& b : line) b = static_cast<std::uint8_t>(random() % 2 == 0 ? random() : 0xFF);
        break;
      case 3:  // oversized
        line.assign(200, 7);
        break;
      case 4: {  // an unknown type, or one of the other direction, or the wrong size for its type
        const std::array<std::uint8_t, 3> three{};
        const auto odd = ctp::build_frame(static_cast<std::uint8_t>(random()), 1, three);
        line.assign(odd.bytes().begin(), odd.bytes().end());
        break;
      }
      default: break;
    }
    for (const std::uint8_t byte : line) {
      const ctp::Frame* frame = theirs.feed(byte);
      ASSERT_EQ(link_feed(&own, byte), frame != nullptr);
      if (frame == nullptr) continue;
      ++frames;
      ASSERT_EQ(link_type(&own), frame->type);
      ASSERT_TRUE(std::equal(frame->payload.begin(), frame->payload.begin() + frame->size,
                             link_payload(&own)));
    }
  }
  const ctp::WireCounters& c = theirs.counters();
  EXPECT_GT(frames, 3'000u);
  EXPECT_EQ(own.frames, static_cast<std::uint16_t>(frames));
  EXPECT_EQ(own.damaged, static_cast<std::uint16_t>(c.crc_errors + c.malformed + c.oversize));
  EXPECT_EQ(own.unknown_types, static_cast<std::uint16_t>(c.unknown_types));
  EXPECT_EQ(own.gaps, static_cast<std::uint16_t>(c.gaps));
}

// The boot id -------------------------------------------------------------------------------------

struct Eeprom {
  std::array<std::uint8_t, BOOT_RECORDS * BOOT_RECORD_SIZE> bytes{};
  std::map<std::uint16_t, int> writes;
  int until_power_fails = -1;  ///< writes that still succeed; negative: all
  std::uint16_t worn_below = 0;

  Eeprom() { bytes.fill(0xFF); }
  boot_memory memory() { return {read, write, this}; }
  static std::uint8_t read(void* self, std::uint16_t at) {
    return static_cast<Eeprom*>(self)->bytes.at(at);
  }
  static void write(void* self, std::uint16_t at, std::uint8_t value) {
    auto& e = *static_cast<Eeprom*>(self);
    if (e.until_power_fails == 0) return;
    if (e.until_power_fails > 0) --e.until_power_fails;
    ++e.writes[at];
    if (at >= e.worn_below) e.bytes.at(at) = value;
  }
};

TEST(FirmwareBootRecord, CountsUpFromErasedMemoryAndSpreadsItsWrites) {
  Eeprom eeprom;
  const boot_memory memory = eeprom.memory();
  for (std::uint32_t i = 1; i <= 5 * BOOT_RECORDS; ++i) {
    std::uint32_t id = 0;
    ASSERT_TRUE(boot_record_next(&memory, &id));
    ASSERT_EQ(id, i);
  }
  for (const auto& [at, times] : eeprom.writes) EXPECT_EQ(times, 5) << at;
}

TEST(FirmwareBootRecord, APowerFailureInMidWriteNeverBringsAnAnnouncedIdBack) {
  for (int bytes = 0; bytes < BOOT_RECORD_SIZE; ++bytes) {
    Eeprom eeprom;
    const boot_memory memory = eeprom.memory();
    std::uint32_t announced = 0, cut_off = 0, next = 0;
    for (int i = 0; i < 70; ++i) ASSERT_TRUE(boot_record_next(&memory, &announced));
    eeprom.until_power_fails = bytes;
    boot_record_next(&memory, &cut_off);  // the power fails before it is reported
    eeprom.until_power_fails = -1;
    ASSERT_TRUE(boot_record_next(&memory, &next));
    EXPECT_GT(next, announced);
  }
}

TEST(FirmwareBootRecord, PassesWornCellsAndSaysWhenAllAreWorn) {
  Eeprom eeprom;
  const boot_memory memory = eeprom.memory();
  std::uint32_t id = 0;
  eeprom.worn_below = 2 * BOOT_RECORD_SIZE;
  ASSERT_TRUE(boot_record_next(&memory, &id));
  EXPECT_EQ(id, 1u);
  eeprom.worn_below = BOOT_RECORDS * BOOT_RECORD_SIZE;
  EXPECT_FALSE(boot_record_next(&memory, &id));
  EXPECT_EQ(id, 2u);
}

}  // namespace
}  // namespace cellcal::test
