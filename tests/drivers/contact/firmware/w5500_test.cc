// The Ethernet chip's driver with a model of the W5500.

#include <gtest/gtest.h>

#include <numeric>

#include "drivers/contact/firmware/core/host_link.h"
extern "C" {
#include "drivers/contact/firmware/core/sensor_parts.h"
}
#include "drivers/contact/wire/ctp_codec.h"
#include "w5500_model.h"

namespace cellcal::test {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr w5500_peer kHost{{192, 168, 0, 5}, 49152};
constexpr w5500_peer kOther{{192, 168, 0, 6}, 7};

Bytes counting(std::size_t size) {
  Bytes bytes(size);
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{1});
  return bytes;
}

bool equal(const w5500_peer& a, const w5500_peer& b) {
  return std::equal(a.address, a.address + 4, b.address) && a.port == b.port;
}

struct Board {
  Board() {
    chip.bus = model.bus();
    chip.own = {{192, 168, 0, 20}, {255, 255, 255, 0}, {2, 'c', 'e', 'l', 0, 1}, 4300};
  }
  Bytes receive(std::uint16_t room = 256) {
    Bytes into(room);
    into.resize(std::min(room, w5500_receive(&chip, &from, into.data(), room)));
    return into;
  }
  void send(const w5500_peer& to, const Bytes& bytes) {
    ASSERT_TRUE(w5500_free(&chip));
    w5500_load(&chip, &to, bytes.data(), static_cast<std::uint8_t>(bytes.size()));
    w5500_go(&chip);
  }

  W5500Model model;
  w5500 chip{};
  w5500_peer from{};
};

TEST(EthernetChip, IsSetUpAsOneUdpSocketAtItsOwnAddress) {
  Board b;
  ASSERT_TRUE(w5500_start(&b.chip));
  EXPECT_EQ(Bytes(b.model.common() + 0x0F, b.model.common() + 0x13), (Bytes{192, 168, 0, 20}));
  EXPECT_EQ(Bytes(b.model.common() + 0x05, b.model.common() + 0x09), (Bytes{255, 255, 255, 0}));
  EXPECT_EQ(Bytes(b.model.common() + 0x09, b.model.common() + 0x0F),
            (Bytes{2, 'c', 'e', 'l', 0, 1}));
  EXPECT_EQ(b.model.socket()[0x04] << 8 | b.model.socket()[0x05], 4300);
  EXPECT_TRUE(w5500_alive(&b.chip));
  EXPECT_FALSE(b.model.calls());
}

TEST(EthernetChip, ThatDoesNotAnswerIsNotTakenForOne) {
  Board b;
  b.model.be_another_chip();
  EXPECT_FALSE(w5500_start(&b.chip));
}

TEST(EthernetChip, ThatHasLostItsSettingsIsNoticed) {
  Board b;
  ASSERT_TRUE(w5500_start(&b.chip));
  b.model.forget();
  EXPECT_FALSE(w5500_alive(&b.chip));
  ASSERT_TRUE(w5500_start(&b.chip));
  EXPECT_TRUE(w5500_alive(&b.chip));
}

TEST(EthernetChip, GivesDatagramsWholeAndInOrderAlsoAcrossTheEndOfItsBuffer) {
  for (const int begin : {0, 2000, 2040, 2047, 65530}) {
    Board b;
    ASSERT_TRUE(w5500_start(&b.chip));
    b.model.begin_at(static_cast<std::uint16_t>(begin));
    ASSERT_TRUE(b.model.arrive(kHost, counting(20)));
    ASSERT_TRUE(b.model.arrive(kOther, counting(60)));
    EXPECT_TRUE(b.model.calls());
    EXPECT_EQ(b.receive(), counting(20)) << begin;
    EXPECT_TRUE(equal(b.from, kHost));
    EXPECT_EQ(b.receive(), counting(60)) << begin;
    EXPECT_TRUE(equal(b.from, kOther));
    EXPECT_TRUE(b.receive().empty());
    EXPECT_FALSE(b.model.calls());
  }
}

TEST(EthernetChip, ThrowsAwayWhatIsTooLongAndGoesOnBehindIt) {
  Board b;
  ASSERT_TRUE(w5500_start(&b.chip));
  ASSERT_TRUE(b.model.arrive(kHost, counting(1400)));
  ASSERT_TRUE(b.model.arrive(kHost, counting(9)));
  std::uint8_t into[256];
  EXPECT_EQ(w5500_receive(&b.chip, &b.from, into, sizeof into), 1400);
  EXPECT_EQ(b.receive(), counting(9));
}

TEST(EthernetChip, FindsItsPlaceAgainWhereASizeCannotBe) {
  Board b;
  ASSERT_TRUE(w5500_start(&b.chip));
  for (const std::uint16_t wrong : {13, 1000, 65535}) {
    ASSERT_TRUE(b.model.arrive(kHost, counting(12)));
    b.model.spoil_size(wrong);
    EXPECT_TRUE(b.receive().empty());
    ASSERT_TRUE(b.model.arrive(kHost, counting(12)));
    EXPECT_EQ(b.receive(), counting(12)) << wrong;
  }
}

TEST(EthernetChip, SendsToThePeerAndAsksTheNetworkForItOnce) {
  Board b;
  ASSERT_TRUE(w5500_start(&b.chip));
  b.model.begin_at(2040);
  for (std::size_t size = 1; size <= 40; ++size) b.send(kHost, counting(size));
  ASSERT_EQ(b.model.sent.size(), 40u);
  EXPECT_EQ(b.model.sent.back().second, counting(40));
  EXPECT_TRUE(equal(b.model.sent.back().first, kHost));
  EXPECT_EQ(b.model.arps, 1);
  b.send(kOther, counting(3));
  EXPECT_EQ(b.model.arps, 2);
  ASSERT_TRUE(w5500_free(&b.chip));
  w5500_retry(&b.chip);
  b.send(kOther, counting(3));
  EXPECT_EQ(b.model.arps, 3);
}

TEST(EthernetChip, IsBusyUntilADatagramHasLeft) {
  Board b;
  ASSERT_TRUE(w5500_start(&b.chip));
  b.model.slow = true;
  b.send(kHost, counting(3));
  EXPECT_FALSE(w5500_free(&b.chip));
  b.model.finish();
  EXPECT_TRUE(w5500_free(&b.chip));
}

TEST(EthernetChip, AsksAgainForAPeerThatDidNotAnswer) {
  Board b;
  ASSERT_TRUE(w5500_start(&b.chip));
  b.model.nobody_answers = true;
  b.send(kHost, counting(3));
  b.model.nobody_answers = false;
  b.send(kHost, counting(4));
  EXPECT_EQ(b.model.arps, 2);
  ASSERT_EQ(b.model.sent.size(), 1u);
  EXPECT_EQ(b.model.sent[0].second, counting(4));
}

TEST(EthernetChip, WhatWasLoadedAndNotSentIsReplaced) {
  Board b;
  ASSERT_TRUE(w5500_start(&b.chip));
  w5500_load(&b.chip, &kHost, counting(30).data(), 30);
  EXPECT_TRUE(w5500_free(&b.chip));
  b.send(kHost, counting(5));
  ASSERT_EQ(b.model.sent.size(), 1u);
  EXPECT_EQ(b.model.sent[0].second, counting(5));
}

TEST(BoardTime, OfAStampLaterThanTheLoopsIsNoAge) {
  sensor_identity identity{};
  identity.version = CTP_VERSION;
  identity.baud = CTP_DEFAULT_BAUD;
  identity.has_relay = true;
  sensor s{};
  sensor_init(&s, &identity, 0);
  constexpr std::uint32_t kSwitching = CTP_RELAY_MS * 1000u * CTP_TICKS_PER_US,
                          kAsked = 10 * kSwitching;
  sensor_want_relay(&s, kAsked, true);
  s.relay_until = kAsked + 10 * kSwitching;
  sensor_run_relay(&s, kAsked - 1);
  EXPECT_FALSE(s.relay_fault) << "it has just been asked to switch";
  sensor_run_relay(&s, kAsked + kSwitching);
  EXPECT_TRUE(s.relay_fault);
}

/// As in the board's program: a HELLO received through the chip, the IDENT sent through it.
TEST(EthernetChip, CarriesAConversation) {
  namespace ctp = drivers::ctp;
  Board b;
  ASSERT_TRUE(w5500_start(&b.chip));
  sensor_identity identity{};
  identity.version = CTP_VERSION;
  identity.baud = 100'000'000;
  identity.datagrams = true;
  sensor s{};
  sensor_init(&s, &identity, 0);
  host_link link{};
  host_link_init(&link, &s);
  const auto hello = ctp::build(ctp::Hello{1, 1, 99}, 0);
  b.model.arrive(kHost, {hello.bytes().begin(), hello.bytes().end()});
  const Bytes heard = b.receive();
  const host_address from{ctp_get_u32(b.from.address), b.from.port};
  host_link_take(&link, &from, heard.data(), static_cast<std::uint16_t>(heard.size()), 10);
  ASSERT_TRUE(link.there);
  host_link_run(&link,
                9);  // by the time taken before the datagram was read, as in the board's loop
  ASSERT_TRUE(link.there);
  std::array<std::uint8_t, CTP_MAX_WIRE> wire{};
  std::uint32_t start = 0;
  const std::uint8_t size = sensor_next_frame(&s, 20, wire.data(), &start);
  w5500_peer to{};
  ctp_put_u32(to.address, link.host.address);
  to.port = link.host.port;
  b.send(to, {wire.begin(), wire.begin() + size});
  ASSERT_EQ(b.model.sent.size(), 1u);
  EXPECT_TRUE(equal(b.model.sent[0].first, kHost));
  ctp::FrameReader reader(ctp::Direction::kFromSensor);
  const ctp::Frame* frame = nullptr;
  for (const std::uint8_t byte : b.model.sent[0].second) frame = reader.feed(byte);
  ASSERT_NE(frame, nullptr);
  EXPECT_EQ(ctp::read<ctp::Ident>(*frame).nonce, 99u);
  constexpr std::uint32_t kSilence = HOST_SILENCE_MS * 1000u * CTP_TICKS_PER_US;
  host_link_run(&link, 10 + kSilence);
  EXPECT_TRUE(link.there);
  host_link_run(&link, 11 + kSilence);
  EXPECT_FALSE(link.there);
}

}  // namespace
}  // namespace cellcal::test
