// The board on Ethernet in virtual time: frames in datagrams that are lost, duplicated, reordered,
// or sent by another computer.

#include "rig.h"

namespace cellcal::drivers {
namespace {

using Wire = std::vector<std::uint8_t>;

constexpr host_address kStranger{0x0200007F, 777};

struct Ethernet : Rig {
  Ethernet() : Rig(sim::on_ethernet({}), over_ethernet()) {}

  void from_stranger(const ctp::WireBytes& wire) { mcu.receive(wire.bytes(), now(), kStranger); }
  bool touched_once() const { return of_kind(ContactEventKind::kContact).size() == 1; }
};

TEST(ContactOverEthernet, GetsReadyIsArmedAndReportsATouch) {
  Ethernet rig;
  ASSERT_TRUE(rig.get_ready()) << rig.contact.status().words;
  ASSERT_TRUE(rig.arm(1).armed);
  const TimePoint touch = rig.now() + milliseconds{3};
  rig.mcu.edge(touch, true);
  rig.run(milliseconds{10});
  ASSERT_TRUE(rig.touched_once());
  const ContactEvent contact = rig.of_kind(ContactEventKind::kContact).front();
  EXPECT_LT(std::abs(micro(contact.first_edge - touch)), 5.0);
  EXPECT_EQ(rig.of_kind(ContactEventKind::kTrip).size(), 1u);
  EXPECT_EQ(rig.contact.status().quality.gaps, 0u);
  EXPECT_FALSE(rig.contact.status().identity.board.known) << "it has no fuses of an ATmega";
}

TEST(ContactOverEthernet, WhatComesTwiceCountsOnce) {
  Ethernet rig;
  const auto twice = [](Wire wire) {
    const Wire copy = wire;
    wire.insert(wire.end(), copy.begin(), copy.end());
    return wire;
  };
  rig.line.to_sensor = twice;
  rig.line.to_host = twice;
  ASSERT_TRUE(rig.get_ready()) << rig.contact.status().words;
  ASSERT_TRUE(rig.arm(1).armed);
  rig.mcu.edge(rig.now(), true);
  rig.run(milliseconds{10});
  EXPECT_TRUE(rig.touched_once());
  EXPECT_EQ(rig.of_kind(ContactEventKind::kTrip).size(), 1u);
  EXPECT_EQ(rig.contact.status().quality.gaps, 0u);
  EXPECT_GT(rig.contact.status().quality.overtaken, 0u);
  EXPECT_GT(rig.mcu.core().reader.overtaken, 0u);
}

TEST(ContactOverEthernet, AStateThatWasOvertakenIsNotBelieved) {
  Ethernet rig;
  ASSERT_TRUE(rig.get_ready());
  Wire open;
  rig.line.to_host = [&open](Wire wire) {
    if (type_of(wire) == CTP_STATUS) open = wire;
    return wire;
  };
  rig.run(milliseconds{150});
  ASSERT_FALSE(open.empty());
  rig.line.to_host = [&open](Wire wire) {
    wire.insert(wire.end(), open.begin(), open.end());
    return wire;
  };
  rig.mcu.edge(rig.now(), true);
  ASSERT_TRUE(rig.run_until([&] { return rig.touched_once(); }));
  for (int i = 0; i < 150; ++i) {
    rig.run(milliseconds{1});
    EXPECT_TRUE(rig.snapshot().in_contact) << i;
  }
}

TEST(ContactOverEthernet, AnOldArmingIsNotArmedAgain) {
  Ethernet rig;
  ASSERT_TRUE(rig.get_ready());
  Wire old;
  rig.line.to_sensor = [&old](Wire wire) {
    if (type_of(wire) == CTP_ARM && old.empty()) old = wire;
    return wire;
  };
  for (const std::uint16_t id : {1, 2}) {
    ASSERT_TRUE(rig.arm(id).armed);
    rig.contact.disarm();
    rig.run(milliseconds{30});
  }
  ASSERT_FALSE(old.empty());
  rig.mcu.receive(old, rig.now(), sim::kThisComputer);
  for (int i = 0; i < 10; ++i) {
    rig.run(milliseconds{1});
    EXPECT_FALSE(rig.mcu.armed());
  }
}

TEST(ContactOverEthernet, ALostTripStopsByTheContactBehindIt) {
  Ethernet rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  rig.line.to_host = [](Wire wire) { return type_of(wire) == CTP_TRIP ? Wire{} : wire; };
  rig.mcu.edge(rig.now(), true);
  ASSERT_TRUE(rig.run_until([&] { return rig.touched_once(); }, milliseconds{3}));
  EXPECT_FALSE(rig.snapshot().armed);
}

TEST(ContactOverEthernet, ALostContactIsRepeatedUntilItIsHeard) {
  Ethernet rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  int lose = 3;
  rig.line.to_host = [&lose](Wire wire) {
    return type_of(wire) == CTP_CONTACT && lose-- > 0 ? Wire{} : wire;
  };
  rig.mcu.edge(rig.now(), true);
  rig.run(milliseconds{30});
  EXPECT_TRUE(rig.touched_once());
  EXPECT_EQ(rig.mcu.repeats(), 3u);
}

TEST(ContactOverEthernet, SilenceEndsAnArmingAsOnASerialLine) {
  Ethernet rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  rig.line.to_host = [](const Wire&) { return Wire{}; };
  rig.run(milliseconds{40});
  EXPECT_FALSE(rig.snapshot().armed);
  EXPECT_EQ(rig.snapshot().last_end, ArmEnd::kSilence);
}

TEST(ContactOverEthernet, ARestartIsNoticedAlsoWhereItsAnnouncementIsLost) {
  Ethernet rig;
  ASSERT_TRUE(rig.get_ready());
  rig.run(std::chrono::seconds{20});  // sequence numbers are far from where they begin again
  rig.mcu.reset(rig.now());
  rig.run(milliseconds{700});
  EXPECT_EQ(rig.contact.status().fault, ContactFault::kLostState) << rig.contact.status().words;
  EXPECT_FALSE(rig.snapshot().alive);
  rig.contact.self_test();
  EXPECT_TRUE(rig.run_until([&] { return rig.contact.status().link == ContactLink::kReady; }));
}

TEST(HostOfTheBoard, IsOneAtATime) {
  Ethernet rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  const std::uint16_t before = rig.mcu.link().foreign;
  rig.from_stranger(ctp::build(ctp::Hello{1, 1, 9}, 0));
  rig.from_stranger(ctp::build(ctp::Disarm{1}, 1));
  rig.run(milliseconds{50});
  EXPECT_TRUE(rig.snapshot().armed) << "a stranger's HELLO would have disarmed";
  EXPECT_EQ(rig.mcu.link().foreign, before + 2);
  EXPECT_EQ(rig.mcu.link().host.address, sim::kThisComputer.address);
}

TEST(HostOfTheBoard, IsAnotherOnceTheFirstIsSilentAndTheOtherGreets) {
  Ethernet rig;
  ASSERT_TRUE(rig.get_ready());
  rig.line.to_sensor = [](const Wire&) { return Wire{}; };
  rig.run(milliseconds{900});
  rig.from_stranger(ctp::build(ctp::Hello{1, 1, 9}, 0));
  rig.run(milliseconds{10});
  EXPECT_EQ(rig.mcu.link().host.address, sim::kThisComputer.address) << "not silent long enough";
  rig.run(milliseconds{200});
  rig.from_stranger(ctp::build(ctp::Ping{9}, 0));
  rig.run(milliseconds{10});
  EXPECT_FALSE(rig.mcu.link().there) << "a PING is no greeting";
  rig.from_stranger(ctp::build(ctp::Hello{1, 1, 9}, 0));
  rig.run(milliseconds{10});
  EXPECT_EQ(rig.mcu.link().host.address, kStranger.address);
}

TEST(HostOfTheBoard, GarbageDoesNotKeepItsPlace) {
  Ethernet rig;
  ASSERT_TRUE(rig.get_ready());
  rig.line.to_sensor = [](const Wire&) { return Wire(17, 0x55); };
  rig.run(std::chrono::seconds{2});
  EXPECT_FALSE(rig.mcu.link().there);
}

TEST(HostOfTheBoard, EmptyAndOversizedDatagramsAreCountedAndACutFrameEndsWithItsOwn) {
  Ethernet rig;
  ASSERT_TRUE(rig.get_ready());
  rig.mcu.receive(Wire{}, rig.now(), sim::kThisComputer);
  rig.mcu.receive(Wire(1500, 1), rig.now(), sim::kThisComputer);
  const std::uint16_t damaged = rig.mcu.core().reader.damaged;
  const ctp::WireBytes arm = ctp::build(ctp::KeepAlive{}, 200);
  rig.mcu.receive(arm.bytes().first(4), rig.now(), sim::kThisComputer);
  rig.run(milliseconds{1});
  EXPECT_EQ(rig.mcu.link().unfit, 2u);
  EXPECT_EQ(rig.mcu.core().reader.damaged, damaged + 1);
  EXPECT_TRUE(rig.arm(1).armed);
}

}  // namespace
}  // namespace cellcal::drivers
