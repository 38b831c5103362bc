// Every single fault of the touch circuit, before and during a search: it is identified by name
// before the arm relies on the sensor, or it stops the arm, or touches are still detected. Same
// rows as the table in drivers/contact/firmware/README.md.

#include "circuit_faults.h"
#include "rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

using test::CircuitFault;

class Fmea : public testing::TestWithParam<CircuitFault> {
 protected:
  static bool on_ethernet() { return GetParam().circuit.board == sim::kEthernetBoard; }
  static sim::McuOptions mcu() { return on_ethernet() ? sim::on_ethernet({}) : sim::McuOptions{}; }
  static ContactOptions options() { return on_ethernet() ? over_ethernet() : ContactOptions{}; }
  void spoil(Rig& rig) { rig.mcu.set_faults({.circuit = GetParam().circuit}, rig.now()); }
  void touch(Rig& rig) {
    rig.mcu.edge(rig.now(), true);
    rig.run(milliseconds{5});
  }
  static bool stopped(const Rig& rig) { return !rig.of_kind(ContactEventKind::kTrip).empty(); }
};

TEST_P(Fmea, IsFoundByNameBeforeASearchOrDoesNotHideATouch) {
  const CircuitFault& fault = GetParam();
  Rig rig(mcu(), options());
  ASSERT_TRUE(rig.get_ready());
  spoil(rig);
  rig.run(std::chrono::seconds{2});
  EXPECT_EQ(rig.contact.status().in_contact, fault.in_contact) << rig.contact.status().words;
  const ArmResult armed = rig.arm(1);
  EXPECT_EQ(armed.armed, !fault.refused()) << armed.why_not;
  const ContactStatus s = rig.contact.status();
  EXPECT_EQ(s.loop_flaw, fault.flaw) << s.words;
  EXPECT_EQ(s.fault == ContactFault::kSelfTestFailed, fault.self_test_fails) << s.words;
  if (fault.refused()) {
    EXPECT_FALSE(armed.why_not.empty());
    return;
  }
  touch(rig);
  EXPECT_EQ(stopped(rig), !fault.touch_is_lost);
}

TEST_P(Fmea, InMidSearchItStopsTheArmOrATouchStillDoes) {
  const CircuitFault& fault = GetParam();
  Rig rig(mcu(), options());
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  spoil(rig);
  rig.run(milliseconds{5});
  EXPECT_EQ(stopped(rig), fault.trips);
  if (!fault.trips) {
    EXPECT_TRUE(rig.snapshot().armed);
    touch(rig);
    EXPECT_EQ(stopped(rig), !fault.touch_is_lost);
  }
  rig.run(milliseconds{20});
  EXPECT_EQ(rig.contact.status().voltage_trip, fault.by_voltage);
  // A trip not confirmed by an edge is not used for measurement.
  EXPECT_EQ(rig.of_kind(ContactEventKind::kRevoked).empty(), !fault.by_voltage);
  EXPECT_EQ(rig.of_kind(ContactEventKind::kContact).empty(),
            fault.by_voltage || fault.touch_is_lost);
}

TEST_P(Fmea, MendedItWorksAgain) {
  Rig rig(mcu(), options());
  ASSERT_TRUE(rig.get_ready());
  spoil(rig);
  rig.run(std::chrono::seconds{2});
  rig.mcu.set_faults({}, rig.now());
  ASSERT_TRUE(rig.run_until([&] { return rig.contact.status().link == ContactLink::kReady; }));
  rig.run(std::chrono::seconds{1});
  EXPECT_TRUE(rig.arm(2).armed) << rig.contact.status().words;
  touch(rig);
  EXPECT_TRUE(stopped(rig));
}

INSTANTIATE_TEST_SUITE_P(Circuit, Fmea, testing::ValuesIn(test::circuit_faults()),
                         [](const auto& row) { return std::string(row.param.name); });

INSTANTIATE_TEST_SUITE_P(EthernetBoard, Fmea,
                         testing::ValuesIn(test::circuit_faults(sim::kEthernetBoard)),
                         [](const auto& row) { return std::string(row.param.name); });

/// Between gun and earth: hoses and long cables have nanofarads, a filter has more.
class GunCapacitor : public testing::TestWithParam<bool> {
 protected:
  GunCapacitor()
      : rig(GetParam() ? sim::on_ethernet({}) : sim::McuOptions{},
            GetParam() ? over_ethernet() : ContactOptions{}) {}
  void put(double farad) { rig.mcu.set_faults({.circuit = {.gun_farad = farad}}, rig.now()); }

  Rig rig;
};

TEST_P(GunCapacitor, OfMicrofaradsIsRefusedAndASmallerOneIsNot) {
  ASSERT_TRUE(rig.get_ready());
  put(0.47e-6);
  rig.run(milliseconds{100});
  EXPECT_TRUE(rig.arm(1).armed) << rig.contact.status().words;
  rig.contact.disarm();
  // Not recharged at the end of the self-test: neither open nor in contact.
  put(2.2e-6);
  rig.run(milliseconds{100});
  EXPECT_EQ(rig.arm(2).refusal, ArmRefusal::kVoltageUndefined);
  // The test's pull does not lower the feed to the band of an intact loop.
  put(8.2e-6);
  rig.run(milliseconds{100});
  EXPECT_FALSE(rig.arm(3).armed);
  EXPECT_EQ(rig.contact.status().fault, ContactFault::kLoopBroken) << rig.contact.status().words;
}

TEST_P(GunCapacitor, DoesNotDelayATouchAndHoldsBackTheReleaseByItsTimeConstant) {
  ASSERT_TRUE(rig.get_ready());
  put(0.47e-6);
  ASSERT_TRUE(rig.arm(1).armed);
  const TimePoint touch = rig.now() + milliseconds{2};
  const TimePoint release = touch + milliseconds{30};
  rig.mcu.edge(touch, true);
  rig.mcu.edge(release, false);
  rig.run(milliseconds{60});
  ASSERT_EQ(rig.of_kind(ContactEventKind::kTrip).size(), 1u);
  EXPECT_LT(micro(rig.of_kind(ContactEventKind::kTrip)[0].first_edge - touch), 50.0);
  const auto released = rig.of_kind(ContactEventKind::kRelease);
  ASSERT_EQ(released.size(), 1u);
  // R1 charges it: 1 k times 0.47 uF, and the level that reads as open at 0.6 of the supply.
  const double late_us = micro(released[0].first_edge - release);
  EXPECT_GT(late_us, 350.0);
  EXPECT_LT(late_us, 600.0);
}

INSTANTIATE_TEST_SUITE_P(Board, GunCapacitor, testing::Bool(), [](const auto& on_ethernet) {
  return on_ethernet.param ? "Ethernet" : "Uno";
});

TEST(Earth, OfAFirmwareThatDoesNotWatchItIsNotBelieved) {
  sim::McuOptions old;
  old.firmware = {1, 0, 0};
  Rig rig(old);
  rig.mcu.set_faults({.circuit = {.earth_reads_v = 0.0}}, rig.now());  // the flag was never set
  EXPECT_FALSE(rig.get_ready());
  EXPECT_FALSE(rig.arm(1).armed);
  EXPECT_NE(rig.contact.status().loop_flaw, LoopFlaw::kNone);
}

TEST(BoardOfASensor, IsJudgedByItsFusesAndItsBootLoader) {
  struct Chip {
    ctp::Board board;
    bool old_loader, weak_brown_out;
  };
  for (const Chip& chip : {Chip{{0xFF, 0xD7, 0xFC, 0xFFFF}, false, false},   // as in the guide
                           Chip{{0xFF, 0xD6, 0xFC, 0x0404}, false, false},   // with optiboot 4.4
                           Chip{{0xFF, 0xDE, 0xFD, 0x0404}, false, true},    // Uno, factory
                           Chip{{0xFF, 0xDA, 0xFD, 0xFFFF}, true, true}}) {  // Nano, factory
    sim::McuOptions options;
    options.board = chip.board;
    Rig rig(options);
    ASSERT_TRUE(rig.get_ready());
    const BoardFlaws flaws = rig.contact.status().identity.board;
    EXPECT_TRUE(flaws.known);
    EXPECT_EQ(flaws.old_loader, chip.old_loader) << int{chip.board.fuses_high};
    EXPECT_EQ(flaws.weak_brown_out, chip.weak_brown_out) << int{chip.board.fuses_extended};
    EXPECT_EQ(rig.contact.status().quality.unknown_types, 0u);
  }
}

TEST(VoltageTrip, IsExplainedWithWhatToClean) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  rig.mcu.set_faults({.circuit = {.touch_ohm = 1000.0}}, rig.now());
  rig.mcu.edge(rig.now(), true);
  rig.run(milliseconds{20});
  EXPECT_NE(said(rig.contact.status().words).find("oxide"), std::string::npos)
      << rig.contact.status().words;
}

TEST(SelfTest, IsMadeBeforeEverySearch) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  int asked = 0;
  rig.line.to_sensor = [&asked](std::vector<std::uint8_t> wire) {
    asked += type_of(wire) == CTP_SELFTEST ? 1 : 0;
    return wire;
  };
  for (std::uint16_t id = 1; id <= 3; ++id) {
    ASSERT_TRUE(rig.arm(id).armed);
    EXPECT_EQ(asked, id);
    rig.contact.disarm();
    rig.run(milliseconds{20});
  }
}

}  // namespace
}  // namespace cellcal::drivers
