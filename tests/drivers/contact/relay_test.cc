// The relay in place of plug X1: closed while the port is open, verified by its mirror contact.

#include "rig.h"

namespace cellcal::drivers {
namespace {

sim::McuOptions with_relay() {
  sim::McuOptions options;
  options.relay = true;
  return options;
}

ContactOptions asks_for_relay() {
  ContactOptions options;
  options.relay = true;
  return options;
}

struct Isolated : Rig {
  explicit Isolated(const sim::McuOptions& mcu_options = with_relay(),
                    const ContactOptions& options = asks_for_relay())
      : Rig(mcu_options, options) {}

  bool fails_with(ContactFault fault) {
    contact.open();
    return run_until([&] { return contact.status().fault == fault; }, std::chrono::seconds{5});
  }
};

TEST(IsolationRelay, IsClosedWhileThePortIsOpenAndOpenBeforeAndBehind) {
  Isolated rig;
  EXPECT_FALSE(rig.mcu.relay_closed());
  ASSERT_TRUE(rig.get_ready()) << rig.contact.status().words;
  EXPECT_TRUE(rig.mcu.relay_closed());
  EXPECT_EQ(rig.contact.status().relay, ContactRelay::kClosed);
  ASSERT_TRUE(rig.arm(1).armed);
  rig.mcu.edge(rig.now(), true);
  rig.run(milliseconds{10});
  EXPECT_EQ(rig.of_kind(ContactEventKind::kContact).size(), 1u);
  rig.mcu.edge(rig.now(), false);
  rig.run(milliseconds{10});
  rig.contact.close();
  rig.mcu.advance(rig.now() + milliseconds{50});
  EXPECT_FALSE(rig.mcu.relay_closed());
}

TEST(IsolationRelay, OpensByItselfWhereTheHostIsSilent) {
  Isolated rig;
  ASSERT_TRUE(rig.get_ready());
  rig.line.to_sensor = [](const std::vector<std::uint8_t>&) { return std::vector<std::uint8_t>{}; };
  rig.run(milliseconds{1500});
  EXPECT_TRUE(rig.mcu.relay_closed());
  rig.run(milliseconds{700});
  EXPECT_FALSE(rig.mcu.relay_closed());
}

TEST(IsolationRelay, ThatIsWeldedIsNamedAtTheNextSessionsBegin) {
  Isolated rig;
  ASSERT_TRUE(rig.get_ready());
  rig.contact.close();
  rig.mcu.set_faults({.relay_welded = true}, rig.now());
  rig.clock.sleep_until(rig.now() + milliseconds{500});
  ASSERT_TRUE(rig.fails_with(ContactFault::kRelayWelded)) << rig.contact.status().words;
  EXPECT_FALSE(rig.arm(1).armed);
}

TEST(IsolationRelay, ThatDoesNotCloseIsNamed) {
  Isolated rig;
  rig.mcu.set_faults({.relay_dead = true}, rig.now());
  ASSERT_TRUE(rig.fails_with(ContactFault::kRelayStaysOpen)) << rig.contact.status().words;
  EXPECT_FALSE(rig.arm(1).armed);
}

TEST(IsolationRelay, ThatOpensInMidSearchStopsTheArm) {
  Isolated rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  rig.mcu.set_faults({.relay_dead = true}, rig.now());
  rig.run(milliseconds{20});
  EXPECT_FALSE(rig.of_kind(ContactEventKind::kTrip).empty());
  rig.run(milliseconds{300});
  EXPECT_EQ(rig.contact.status().fault, ContactFault::kRelayStaysOpen);
}

TEST(IsolationRelay, ThatIsNotFittedIsNamedWhereItIsConfigured) {
  Isolated rig{sim::McuOptions{}};
  ASSERT_TRUE(rig.fails_with(ContactFault::kNoRelay)) << rig.contact.status().words;
  EXPECT_FALSE(rig.arm(1).armed);
}

TEST(IsolationRelay, IsLeftOpenWhereNobodyAsksForIt) {
  Isolated rig{with_relay(), {}};
  EXPECT_FALSE(rig.get_ready());
  EXPECT_FALSE(rig.mcu.relay_closed());
  EXPECT_EQ(rig.contact.status().relay, ContactRelay::kOpen);
}

TEST(IsolationRelay, WorksOverEthernetAsWell) {
  ContactOptions options = over_ethernet();
  options.relay = true;
  Isolated rig{sim::on_ethernet(with_relay()), options};
  ASSERT_TRUE(rig.get_ready()) << rig.contact.status().words;
  EXPECT_TRUE(rig.mcu.relay_closed());
}

}  // namespace
}  // namespace cellcal::drivers
