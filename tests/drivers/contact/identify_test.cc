// From the open port to 'ready', and every refusal.

#include "rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

TEST(ContactIdentify, BecomesReadyOnlyAfterIdentConfigClockAndSelfTest) {
  Rig rig;
  EXPECT_EQ(rig.contact.status().link, ContactLink::kDown);
  ASSERT_TRUE(rig.get_ready()) << rig.contact.status().words;
  const ContactStatus s = rig.contact.status();
  EXPECT_EQ(s.loop_ok, true);
  EXPECT_TRUE(s.self_test_ok);
  EXPECT_EQ(s.in_contact, false);
  EXPECT_TRUE(s.words.empty());
  EXPECT_TRUE(rig.snapshot().alive);
  EXPECT_GT(s.quality.round_trip->min_s, 0.0);
  EXPECT_LT(s.quality.clock_sigma_s, 20e-6);
  EXPECT_TRUE(rig.events.empty()) << "the self-test's own edge must not be reported";
}

TEST(ContactIdentify, WorksAtEveryAllowedBaudRate) {
  for (const int baud : {1'000'000, 250'000, 115'200}) {
    sim::McuOptions mcu;
    mcu.baud = baud;
    ContactOptions options;
    options.baud = baud;
    Rig rig(mcu, options);
    EXPECT_TRUE(rig.get_ready()) << baud << ": " << rig.contact.status().words;
    EXPECT_EQ(rig.contact.status().quality.crc_errors, 0u);
  }
}

TEST(ContactIdentify, SaysThatNothingIsHeardWhenTheSensorIsMute) {
  Rig rig;
  rig.mcu.set_faults({.silent = true}, rig.now());
  rig.contact.open();
  rig.run(std::chrono::seconds{4});
  const ContactStatus s = rig.contact.status();
  EXPECT_EQ(s.link, ContactLink::kDown);
  EXPECT_NE(said(s.words).find("nothing received"), std::string::npos) << s.words;
  EXPECT_NE(said(s.words).find("firmware"), std::string::npos) << s.words;
  EXPECT_FALSE(rig.snapshot().alive);
}

TEST(ContactIdentify, RefusesAnUnknownVersionAndSaysWhatToFlash) {
  sim::McuOptions mcu;
  mcu.version = 2;
  mcu.firmware = {2, 3, 1};
  Rig rig(mcu);
  rig.contact.open();
  rig.run(std::chrono::seconds{1});
  const ContactStatus s = rig.contact.status();
  EXPECT_EQ(s.link, ContactLink::kFault);
  EXPECT_NE(said(s.words).find("CTP/2 in the contact sensor (firmware 2.3.1)"), std::string::npos)
      << s.words;
  EXPECT_NE(said(s.words).find("Flash firmware 1.x"), std::string::npos) << s.words;
  EXPECT_FALSE(rig.arm(1).armed);
}

TEST(ContactIdentify, RefusesAConfigurationThatTheSensorDoesNotTake) {
  ContactOptions options;
  options.wire.contact_mv = options.wire.open_mv;
  Rig rig({}, options);
  rig.contact.open();
  rig.run(std::chrono::seconds{1});
  EXPECT_EQ(rig.contact.status().link, ContactLink::kFault);
  EXPECT_NE(said(rig.contact.status().words).find("open_mv"), std::string::npos);
}

TEST(ContactIdentify, TellsABrokenWireFromATouch) {
  Rig broken;
  broken.mcu.set_faults({.circuit = {.sense_wire = sim::TouchCircuit::kOpen}}, broken.now());
  broken.contact.open();
  broken.run(std::chrono::seconds{2});
  EXPECT_EQ(broken.contact.status().link, ContactLink::kFault);
  EXPECT_EQ(broken.contact.status().in_contact, true) << "a break reads as contact";
  EXPECT_NE(said(broken.contact.status().words).find("broken or unplugged"), std::string::npos)
      << broken.contact.status().words;

  Rig touching;
  touching.mcu.edge(touching.now(), true);
  touching.contact.open();
  touching.run(std::chrono::seconds{2});
  EXPECT_EQ(touching.contact.status().link, ContactLink::kIdentifying);
  EXPECT_EQ(touching.contact.status().loop_ok, true);
  EXPECT_NE(said(touching.contact.status().words).find("Jog it free"), std::string::npos)
      << touching.contact.status().words;
  touching.mcu.edge(touching.now(), false);
  EXPECT_TRUE(
      touching.run_until([&] { return touching.contact.status().link == ContactLink::kReady; }));
}

TEST(ContactIdentify, RecoversByItselfWhenTheWireIsRepaired) {
  Rig rig;
  rig.mcu.set_faults({.circuit = {.sense_wire = sim::TouchCircuit::kOpen}}, rig.now());
  rig.contact.open();
  rig.run(std::chrono::seconds{2});
  ASSERT_EQ(rig.contact.status().link, ContactLink::kFault);
  rig.mcu.set_faults({}, rig.now());
  EXPECT_TRUE(rig.run_until([&] { return rig.contact.status().link == ContactLink::kReady; }))
      << rig.contact.status().words;
}

TEST(ContactIdentify, FindsAnInputThatIsStuckOpen) {
  Rig rig;
  rig.mcu.set_faults({.circuit = {.capture_joint_open = true}}, rig.now());
  rig.contact.open();
  rig.run(std::chrono::seconds{2});
  EXPECT_EQ(rig.contact.status().link, ContactLink::kFault);
  EXPECT_NE(said(rig.contact.status().words).find("does not detect its own test edge"),
            std::string::npos)
      << rig.contact.status().words;
  EXPECT_FALSE(rig.contact.status().self_test_ok);
}

TEST(ContactIdentify, SaysThatTheSensorDoesNotHearWhereNoCommandReachesIt) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  rig.line.to_sensor = [](std::vector<std::uint8_t>) { return std::vector<std::uint8_t>{}; };
  rig.contact.self_test();
  rig.run(std::chrono::seconds{2});
  EXPECT_EQ(rig.contact.status().link, ContactLink::kFault);
  EXPECT_NE(said(rig.contact.status().words).find("receives no command"), std::string::npos)
      << rig.contact.status().words;
  rig.line.to_sensor = nullptr;
  EXPECT_TRUE(rig.run_until([&] { return rig.contact.status().self_test_ok; }));
}

TEST(ContactIdentify, DoesNotTakeALostSelfTestRequestForAPassedOne) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  rig.line.to_sensor = [](std::vector<std::uint8_t> wire) {
    return type_of(wire) == CTP_SELFTEST ? std::vector<std::uint8_t>{} : wire;
  };
  rig.contact.self_test();
  rig.run(std::chrono::seconds{1});
  EXPECT_FALSE(rig.contact.status().self_test_ok);
  rig.line.to_sensor = nullptr;
  EXPECT_TRUE(rig.run_until([&] { return rig.contact.status().self_test_ok; }));
}

TEST(ContactIdentify, IsReadyThoughEveryFifthFrameIsDamaged) {
  Rig rig;
  int n = 0;
  const auto flip = [&n](std::vector<std::uint8_t> wire) {
    if (++n % 5 == 0 && wire.size() > 3) wire[2] ^= 0x10;
    return wire;
  };
  rig.line.to_host = rig.line.to_sensor = flip;
  rig.contact.open();
  EXPECT_TRUE(rig.run_until([&] { return rig.contact.status().link == ContactLink::kReady; },
                            std::chrono::seconds{20}))
      << rig.contact.status().words;
  EXPECT_GT(rig.contact.status().quality.crc_errors, 0u);
  EXPECT_GT(rig.contact.status().quality.gaps, 0u);
}

TEST(ContactIdentify, BegunInContactItGuardsARetreatAndNothingElse) {
  Rig rig;
  rig.mcu.edge(rig.now(), true);
  rig.contact.open();
  ASSERT_TRUE(rig.run_until([&] { return rig.contact.status().can_guard_retreat; }))
      << rig.contact.status().words;
  EXPECT_EQ(rig.contact.status().link, ContactLink::kIdentifying);
  EXPECT_TRUE(rig.snapshot().alive);
  EXPECT_TRUE(rig.snapshot().in_contact);
  EXPECT_FALSE(rig.arm(1).armed);
  rig.mcu.edge(rig.now(), false);
  const TimePoint left = rig.now();
  while (rig.now() < left + std::chrono::seconds{3}) {
    rig.run(milliseconds{10});
    ASSERT_TRUE(rig.snapshot().alive) << "on the way out the guard must not fall silent";
  }
  EXPECT_FALSE(rig.snapshot().in_contact);
  EXPECT_EQ(rig.contact.status().link, ContactLink::kReady) << "the self-test runs by itself";
}

TEST(ContactIdentify, RestartWhileInUseIsAFaultUntilItIsAcknowledged) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  rig.mcu.reset(rig.now(), CTP_RESET_BROWN_OUT);
  rig.run(milliseconds{5});
  EXPECT_EQ(rig.contact.status().link, ContactLink::kFault);
  EXPECT_NE(said(rig.contact.status().words).find("restarted"), std::string::npos);
  EXPECT_FALSE(rig.snapshot().alive);
  rig.run(std::chrono::seconds{5});
  EXPECT_EQ(rig.contact.status().link, ContactLink::kFault) << "must not heal by itself";
  EXPECT_FALSE(rig.arm(1).armed);
  rig.contact.self_test();
  EXPECT_TRUE(rig.run_until([&] { return rig.contact.status().link == ContactLink::kReady; }));
}

TEST(ContactIdentify, RestartIsNoticedEvenIfItsAnnouncementIsLost) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  int idents = 0;
  rig.line.to_host = [&](std::vector<std::uint8_t> wire) {
    const bool first = type_of(wire) == CTP_IDENT && idents++ == 0;
    return first ? std::vector<std::uint8_t>{} : wire;
  };
  rig.mcu.reset(rig.now());
  rig.run(milliseconds{150});  // by the first heartbeat without our configuration
  EXPECT_EQ(rig.contact.status().link, ContactLink::kFault);
  EXPECT_NE(said(rig.contact.status().words).find("restarted"), std::string::npos);
}

TEST(ContactIdentify, ClosingAndOpeningIdentifiesFromTheStart) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  rig.contact.close();
  EXPECT_EQ(rig.contact.status().link, ContactLink::kDown);
  EXPECT_FALSE(rig.snapshot().armed);
  rig.run(milliseconds{500});
  rig.mcu.reset(rig.now());  // powered from the port: another boot is no fault here
  rig.run(milliseconds{10});
  EXPECT_TRUE(rig.get_ready()) << rig.contact.status().words;
  EXPECT_TRUE(rig.arm(1).armed) << "a new conversation may use the id again";
}

}  // namespace
}  // namespace cellcal::drivers
