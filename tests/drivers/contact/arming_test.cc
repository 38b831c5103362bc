// Armed searches: refusals with their reasons, trips, noise, and the end of an arming.

#include <algorithm>

#include "rig.h"
#include "tests/drivers/said.h"

namespace cellcal::drivers {
namespace {

constexpr microseconds kLater{3210};

TEST(ContactArming, ATouchGivesTripThenContactWithTheTimeOfTheFirstEdge) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(7).armed);
  EXPECT_TRUE(rig.snapshot().armed);
  EXPECT_EQ(rig.snapshot().arm_id, 7);

  rig.run(milliseconds{200});
  const TimePoint touch = rig.now() + kLater;
  rig.mcu.edge(touch, true);
  for (int i = 0; i < 3; ++i) {  // bounces
    rig.mcu.edge(touch + microseconds{30 + 40 * i}, false);
    rig.mcu.edge(touch + microseconds{50 + 40 * i}, true);
  }
  rig.run(milliseconds{20});
  ASSERT_EQ(rig.events.size(), 2u);
  EXPECT_EQ(rig.events[0].kind, ContactEventKind::kTrip);
  EXPECT_EQ(rig.events[1].kind, ContactEventKind::kContact);
  for (const ContactEvent& e : rig.events) {
    EXPECT_EQ(e.arm_id, 7);
    EXPECT_NEAR(micro(e.first_edge - touch), 0.0, 2.0);
    EXPECT_GT(e.time_sigma_s, 0.0);
    EXPECT_LT(e.time_sigma_s, 20e-6);
  }
  EXPECT_EQ(rig.events[1].bounces, 3);
  EXPECT_TRUE(rig.snapshot().in_contact);
  EXPECT_FALSE(rig.snapshot().armed) << "one shot";
  EXPECT_NEAR(rig.contact.status().quality.contact_voltage_v, 0.044, 1e-3);
  EXPECT_EQ(rig.contact.status().quality.bounces, 3u);

  const TimePoint leave = rig.now() + kLater;
  rig.mcu.edge(leave, false);
  rig.run(milliseconds{20});
  ASSERT_EQ(rig.events.size(), 3u);
  EXPECT_EQ(rig.events[2].kind, ContactEventKind::kRelease);
  EXPECT_NEAR(micro(rig.events[2].first_edge - leave), 0.0, 2.0);
  EXPECT_FALSE(rig.snapshot().in_contact);
}

TEST(ContactArming, TheTripIsThereInTheNextCycle) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  rig.mcu.edge(rig.now() + microseconds{100}, true);
  rig.run(milliseconds{1});
  ASSERT_FALSE(rig.events.empty());
  EXPECT_EQ(rig.events[0].kind, ContactEventKind::kTrip);
}

TEST(ContactArming, ASpikeIsRevoked) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(2).armed);
  const TimePoint spike = rig.now() + kLater;
  rig.mcu.edge(spike, true);
  rig.mcu.edge(spike + microseconds{60}, false);
  rig.run(milliseconds{30});
  ASSERT_EQ(rig.events.size(), 2u);
  EXPECT_EQ(rig.events[0].kind, ContactEventKind::kTrip);
  EXPECT_EQ(rig.events[1].kind, ContactEventKind::kRevoked);
  EXPECT_FALSE(rig.snapshot().in_contact);
  EXPECT_TRUE(rig.arm(3).armed) << "noise does not stop the next try";
}

TEST(ContactArming, ContactOutsideAnArmingIsReportedAsSuch) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  rig.mcu.edge(rig.now() + kLater, true);
  rig.run(milliseconds{20});
  ASSERT_EQ(rig.events.size(), 1u);
  EXPECT_EQ(rig.events[0].kind, ContactEventKind::kContact);
  EXPECT_EQ(rig.events[0].arm_id, 0);
}

TEST(ContactArming, EventsAreRepeatedUntilAcknowledgedAndDeliveredOnce) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  int acks = 0;
  rig.line.to_sensor = [&](std::vector<std::uint8_t> wire) {
    const bool lose = type_of(wire) == CTP_ACK && acks++ < 4;
    return lose ? std::vector<std::uint8_t>{} : wire;
  };
  rig.mcu.edge(rig.now() + kLater, true);
  rig.run(milliseconds{100});
  EXPECT_EQ(acks, 5) << "every repetition is acknowledged, and the last one ends it";
  EXPECT_EQ(rig.mcu.repeats(), 4u);
  EXPECT_EQ(rig.of_kind(ContactEventKind::kContact).size(), 1u);
}

TEST(ContactArming, ALostContactFrameIsMadeUpForByItsRepetition) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  int contacts = 0;
  rig.line.to_host = [&](std::vector<std::uint8_t> wire) {
    if (type_of(wire) == CTP_CONTACT && contacts++ == 0) wire[5] ^= 1;
    return wire;
  };
  const TimePoint touch = rig.now() + kLater;
  rig.mcu.edge(touch, true);
  rig.run(milliseconds{30});
  const auto confirmed = rig.of_kind(ContactEventKind::kContact);
  ASSERT_EQ(confirmed.size(), 1u);
  EXPECT_NEAR(micro(confirmed[0].first_edge - touch), 0.0, 2.0);
}

TEST(ContactArming, ALostTripStillEndsTheArmingByTheContact) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(9).armed);
  rig.line.to_host = [](std::vector<std::uint8_t> wire) {
    return type_of(wire) == CTP_TRIP ? std::vector<std::uint8_t>{} : wire;
  };
  rig.mcu.edge(rig.now() + microseconds{500}, true);
  rig.run(milliseconds{3});
  ASSERT_EQ(rig.events.size(), 1u);
  EXPECT_EQ(rig.events[0].kind, ContactEventKind::kContact);
  EXPECT_EQ(rig.events[0].arm_id, 9);
  EXPECT_FALSE(rig.snapshot().armed);
}

struct Refusal {
  const char* name;
  std::function<void(Rig&)> spoil;
  const char* words;
};

void PrintTo(const Refusal& r, std::ostream* out) { *out << r.name; }

class ContactRefusal : public testing::TestWithParam<Refusal> {};

TEST_P(ContactRefusal, SaysWhyInWords) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  GetParam().spoil(rig);
  const ArmResult result = rig.arm(5);
  EXPECT_FALSE(result.armed);
  EXPECT_EQ(result.arm_id, 5);
  EXPECT_NE(said(result.why_not).find(GetParam().words), std::string::npos) << result.why_not;
  EXPECT_FALSE(rig.mcu.armed());
  EXPECT_FALSE(rig.snapshot().armed);
}

INSTANTIATE_TEST_SUITE_P(
    Each, ContactRefusal,
    testing::Values(Refusal{"InContact",
                            [](Rig& rig) {
                              rig.mcu.edge(rig.now(), true);
                              rig.run(milliseconds{20});
                            },
                            "already in contact"},
                    Refusal{"InContactSinceThisMoment",  // not yet known to the host
                            [](Rig& rig) { rig.mcu.edge(rig.now() + microseconds{20}, true); },
                            "already in contact"},
                    Refusal{"LoopBroken",
                            [](Rig& rig) {
                              rig.mcu.set_faults(
                                  {.circuit = {.sense_wire = sim::TouchCircuit::kOpen}}, rig.now());
                              rig.run(std::chrono::seconds{3});
                            },
                            "broken or unplugged"},
                    Refusal{"VoltageUndefined",
                            [](Rig& rig) {
                              rig.mcu.set_faults({.circuit = {.gun_to_earth = 850.0}}, rig.now());
                              rig.run(milliseconds{150});
                            },
                            "neither open nor contact"},
                    Refusal{"VoltageUndefinedSinceThisMoment",
                            [](Rig& rig) {
                              rig.mcu.set_faults({.circuit = {.gun_to_earth = 850.0}}, rig.now());
                            },
                            "neither open nor contact"},
                    Refusal{"ClockNotSynchronised",
                            [](Rig& rig) {
                              rig.line.to_host = [](std::vector<std::uint8_t> wire) {
                                return type_of(wire) == CTP_PONG ? std::vector<std::uint8_t>{}
                                                                 : wire;
                              };
                              rig.run(std::chrono::seconds{5});
                            },
                            "no answer to pings for 5."},
                    Refusal{"Silent",
                            [](Rig& rig) {
                              rig.mcu.set_faults({.silent = true}, rig.now());
                              rig.run(milliseconds{500});
                            },
                            "no valid frame"},
                    Refusal{"Closed", [](Rig& rig) { rig.contact.close(); }, "port is not open"}),
    [](const auto& instance) { return std::string(instance.param.name); });

TEST(ContactArming, RefusesWhenTheSelfTestIsTooOld) {
  ContactOptions options;
  options.self_test_max_age = std::chrono::seconds{2};
  options.self_test_renew = std::chrono::hours{1};
  Rig rig({}, options);
  ASSERT_TRUE(rig.get_ready());
  rig.run(std::chrono::seconds{3});
  EXPECT_FALSE(rig.contact.status().self_test_ok);
  const ArmResult result = rig.arm(1);
  EXPECT_FALSE(result.armed);
  EXPECT_EQ(result.refusal, ArmRefusal::kSelfTestOld) << result.why_not;
  rig.contact.self_test();
  EXPECT_TRUE(rig.arm(2).armed) << "an arming waits for the self-test that is running";
}

TEST(ContactArming, RenewsTheSelfTestWhileNothingElseHappens) {
  ContactOptions options;
  options.self_test_max_age = std::chrono::seconds{4};
  options.self_test_renew = std::chrono::seconds{2};
  Rig rig({}, options);
  ASSERT_TRUE(rig.get_ready());
  for (int i = 0; i < 200; ++i) {
    rig.run(milliseconds{100});
    ASSERT_TRUE(rig.contact.status().self_test_ok);
    ASSERT_TRUE(rig.snapshot().alive);
  }
  EXPECT_TRUE(rig.events.empty());
}

TEST(ContactArming, RefusesSenselessArguments) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  EXPECT_FALSE(rig.arm(0).armed);
  EXPECT_FALSE(rig.arm(1, milliseconds{0}).armed);
  EXPECT_FALSE(rig.arm(1, milliseconds{65536}).armed);
  EXPECT_EQ(rig.arm(1, milliseconds{-5}).refusal, ArmRefusal::kBadArgument);
  EXPECT_TRUE(rig.arm(1).armed);
}

TEST(ContactArming, AnIdThatWasUsedUpIsRefusedByTheSensor) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(4).armed);
  rig.contact.disarm();
  rig.run(milliseconds{20});
  EXPECT_FALSE(rig.arm(4).armed);
  EXPECT_TRUE(rig.arm(5).armed);
}

TEST(ContactArming, ArmingAnewLetsTheOldOneGoFirst) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  const ArmResult second = rig.arm(2);
  EXPECT_TRUE(second.armed) << second.why_not;
  EXPECT_EQ(rig.snapshot().arm_id, 2);
}

TEST(ContactArming, SurvivesLostRequestsAndAnswers) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  int arms = 0, status = 0;
  rig.line.to_sensor = [&](std::vector<std::uint8_t> wire) {
    const bool lose = type_of(wire) == CTP_ARM && arms++ == 0;
    return lose ? std::vector<std::uint8_t>{} : wire;
  };
  rig.line.to_host = [&](std::vector<std::uint8_t> wire) {
    const bool lose = type_of(wire) == CTP_STATUS && status++ == 0;
    return lose ? std::vector<std::uint8_t>{} : wire;
  };
  const ArmResult result = rig.arm(1);
  EXPECT_TRUE(result.armed) << result.why_not;
  EXPECT_TRUE(rig.mcu.armed());
}

TEST(ContactArming, GivesUpAnArmingThatIsNeverAnsweredAndLeavesNothingArmed) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  bool blocked = true;
  rig.line.to_host = [&](std::vector<std::uint8_t> wire) {
    // Heartbeats with 'armed' are lost; everything else arrives.
    const bool lose = blocked && type_of(wire) == CTP_STATUS && rig.mcu.armed();
    return lose ? std::vector<std::uint8_t>{} : wire;
  };
  const ArmResult result = rig.arm(1);
  EXPECT_FALSE(result.armed);
  EXPECT_EQ(result.refusal, ArmRefusal::kNoAnswer) << result.why_not;
  rig.run(milliseconds{100});
  EXPECT_FALSE(rig.mcu.armed());
  blocked = false;
  EXPECT_TRUE(rig.arm(2).armed);
}

TEST(ContactArming, EndsByItsLifetimeOnBothSides) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1, milliseconds{500}).armed);
  rig.run(milliseconds{450});
  EXPECT_TRUE(rig.snapshot().armed);
  rig.run(milliseconds{80});
  EXPECT_FALSE(rig.mcu.armed());
  EXPECT_FALSE(rig.snapshot().armed);
  EXPECT_NE(said(rig.contact.status().words).find("lifetime"), std::string::npos);
}

TEST(ContactArming, EndsByItsLifetimeWhateverTheRateOfTheSensorsClock) {
  for (const double ppm : {-100.0, 10.0, 100.0}) {
    sim::McuOptions options;
    options.drift_ppm = ppm;
    Rig rig(options);
    ASSERT_TRUE(rig.get_ready());
    ASSERT_TRUE(rig.arm(1, milliseconds{4700}).armed);
    rig.run(milliseconds{5000});
    EXPECT_EQ(rig.snapshot().last_end, ArmEnd::kExpired) << ppm;
  }
}

TEST(ContactArming, TheSensorDisarmsWithoutKeepAlive) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  rig.line.to_sensor = [](std::vector<std::uint8_t> wire) {
    return type_of(wire) == CTP_KEEPALIVE ? std::vector<std::uint8_t>{} : wire;
  };
  rig.run(milliseconds{CTP_KEEPALIVE_LIMIT_MS + 30});
  EXPECT_FALSE(rig.mcu.armed());
  EXPECT_FALSE(rig.snapshot().armed);
  EXPECT_NE(said(rig.contact.status().words).find("keep-alive"), std::string::npos);
}

TEST(ContactArming, SilenceOf25MillisecondsIsNotAliveWithoutAnyHandlerHavingRun) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  rig.run(milliseconds{100});
  for (int i = 0; i < 30; ++i) {
    rig.run(milliseconds{1});
    ASSERT_TRUE(rig.snapshot().alive);
  }
  // Time passes without the core running: snapshot() alone has to detect it.
  const TimePoint last = rig.now();
  EXPECT_FALSE(rig.contact.guard().snapshot(last + milliseconds{26}).alive);
}

TEST(ContactArming, ArmedStateDoesNotComeBackAfterSilence) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  rig.mcu.set_faults({.silent = true}, rig.now());
  rig.run(milliseconds{60});
  EXPECT_FALSE(rig.snapshot().alive && rig.snapshot().armed);
  EXPECT_FALSE(rig.snapshot().armed);
  rig.mcu.set_faults({}, rig.now());
  rig.run(milliseconds{100});
  EXPECT_FALSE(rig.snapshot().armed);
  EXPECT_FALSE(rig.mcu.armed());
}

TEST(ContactArming, IdleSilenceStartsTheIdentificationAgain) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  rig.mcu.set_faults({.silent = true}, rig.now());
  rig.run(milliseconds{250});
  EXPECT_TRUE(rig.snapshot().alive);
  rig.run(milliseconds{200});
  EXPECT_FALSE(rig.snapshot().alive);
  EXPECT_EQ(rig.contact.status().link, ContactLink::kFault);
  EXPECT_EQ(rig.contact.status().fault, ContactFault::kSilent);
  rig.mcu.set_faults({}, rig.now());
  EXPECT_TRUE(rig.run_until([&] { return rig.contact.status().link == ContactLink::kReady; }));
}

TEST(ContactArming, ARestartInMidSearchEndsTheArmingAtOnce) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  rig.run(milliseconds{50});
  rig.mcu.reset(rig.now(), CTP_RESET_WATCHDOG);
  rig.run(milliseconds{2});
  EXPECT_FALSE(rig.snapshot().alive);
  EXPECT_FALSE(rig.snapshot().armed);
  EXPECT_EQ(rig.contact.status().link, ContactLink::kFault);
}

TEST(ContactArming, AWireThatBreaksInMidSearchStopsLikeATouchAndIsThenFound) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  ASSERT_TRUE(rig.arm(1).armed);
  rig.mcu.set_faults({.circuit = {.sense_wire = sim::TouchCircuit::kOpen}}, rig.now());
  rig.run(milliseconds{5});
  EXPECT_EQ(rig.of_kind(ContactEventKind::kTrip).size(), 1u);
  EXPECT_EQ(rig.of_kind(ContactEventKind::kContact).size(), 1u);
  rig.contact.self_test();
  rig.run(milliseconds{100});
  EXPECT_EQ(rig.contact.status().link, ContactLink::kFault);
  EXPECT_NE(said(rig.contact.status().words).find("broken or unplugged"), std::string::npos)
      << rig.contact.status().words;
}

TEST(ContactArming, LastingContactIsExaminedForABreakUnasked) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  rig.mcu.set_faults({.circuit = {.sense_wire = sim::TouchCircuit::kOpen}}, rig.now());
  rig.run(std::chrono::seconds{3});
  EXPECT_EQ(rig.contact.status().link, ContactLink::kFault);
  EXPECT_EQ(rig.contact.status().loop_ok, false);
}

TEST(ContactArming, ATouchDuringTheSelfTestIsNotLost) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  rig.contact.self_test();
  rig.mcu.edge(rig.now() + microseconds{500}, true);
  rig.run(milliseconds{20});
  EXPECT_EQ(rig.of_kind(ContactEventKind::kContact).size(), 1u);
  EXPECT_TRUE(rig.snapshot().in_contact);
}

TEST(ContactArming, EventsThatNobodyTookMakeRoomForNewOnes) {
  Rig rig;
  ASSERT_TRUE(rig.get_ready());
  TimePoint t = rig.now();
  for (int i = 0; i < 50; ++i) {  // 100 events, more than the queue holds
    rig.mcu.edge(t += milliseconds{3}, true);
    rig.mcu.edge(t += milliseconds{3}, false);
  }
  for (TimePoint c = rig.now(); c < t + milliseconds{20}; c += milliseconds{1}) {
    rig.clock.sleep_until(c);
    rig.contact.run_until(c);
  }
  int taken = 0;
  std::optional<ContactEvent> last;
  while (const auto e = rig.contact.guard().pop_event()) {
    ++taken;
    last = e;
  }
  EXPECT_EQ(taken, 64);
  EXPECT_EQ(last->kind, ContactEventKind::kRelease);
}

}  // namespace
}  // namespace cellcal::drivers
