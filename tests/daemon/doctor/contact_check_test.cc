#include "daemon/doctor/wires.h"
#include "tests/daemon/doctor/outcome_of.h"

namespace cellcal::daemon::testing {
namespace {

ContactSeen sound_contact() {
  ContactSeen seen;
  drivers::ContactStatus& s = seen.newest;
  s.link = drivers::ContactLink::kReady;
  s.loop_ok = s.self_test_ok = true;
  s.in_contact = false;
  s.sense_voltage_v = 4.8;
  s.clock_limit_s = 500e-6;
  s.identity = {1, {1, 2, 3}, 7, 42, 0x1234, {true, false, false}};
  s.quality.clock_sigma_s = 20e-6;
  s.quality.frames = 200;
  s.quality.round_trip = {0.0, 0.0005, 0.0};
  seen.wanted_config_crc = 0x1234;
  seen.observed_s = 10.0;
  return seen;
}

Findings judged(const ContactSeen& seen, bool* good = nullptr) {
  Findings findings;
  const bool result = judge_contact(seen, findings);
  if (good != nullptr) *good = result;
  judge_contact_line(seen, findings);
  expect_advice(findings);
  return findings;
}

TEST(AContactSensor, ThatIsSoundIsAllOk) {
  bool good = false;
  const Findings findings = judged(sound_contact(), &good);
  EXPECT_TRUE(good);
  EXPECT_EQ(findings.count(Outcome::kOk), findings.all().size());
  EXPECT_NE(finding_of(findings, "contact sensor").found.find("firmware 1.2.3"), std::string::npos);
}

TEST(AContactSensor, ThatDoesNotAnswerLeavesTheRestUnlookedAt) {
  ContactSeen seen = sound_contact();
  seen.newest = {};
  seen.newest.words = "nothing heard";
  bool good = true;
  const Findings findings = judged(seen, &good);
  EXPECT_FALSE(good);
  EXPECT_EQ(outcome_of(findings, "contact sensor"), Outcome::kFailed);
  EXPECT_EQ(outcome_of(findings, "contact clock"), Outcome::kSkipped);
  EXPECT_EQ(outcome_of(findings, "contact line"), Outcome::kFailed);
}

TEST(AContactSensor, ThatIsInContactOrBrokenFailsByItsCircuit) {
  ContactSeen closed = sound_contact();
  closed.newest.in_contact = true;
  closed.newest.self_test_ok = false;
  bool good = true;
  const Findings touching = judged(closed, &good);
  EXPECT_FALSE(good);
  EXPECT_NE(finding_of(touching, "contact circuit").found.find("touches"), std::string::npos);
  EXPECT_EQ(outcome_of(touching, "contact self-test"), Outcome::kSkipped);
  ContactSeen broken = sound_contact();
  broken.newest.loop_ok = broken.newest.self_test_ok = false;
  broken.newest.link = drivers::ContactLink::kFault;
  broken.newest.fault = drivers::ContactFault::kLoopBroken;
  broken.newest.words = "a wire is broken";
  EXPECT_EQ(finding_of(judged(broken), "contact circuit").found, "a wire is broken");
}

TEST(AContactSensor, WhoseBoardWillFailSomeDayIsAWarningByName) {
  ContactSeen nano = sound_contact(), factory = sound_contact(), older = sound_contact();
  nano.newest.identity.board.old_loader = true;
  factory.newest.identity.board.weak_brown_out = true;
  older.newest.identity.board.known = false;
  EXPECT_EQ(outcome_of(judged(nano), "contact board"), Outcome::kWarning);
  EXPECT_NE(finding_of(judged(nano), "contact board").found.find("boot loader"), std::string::npos);
  EXPECT_EQ(outcome_of(judged(factory), "contact board"), Outcome::kWarning);
  EXPECT_EQ(outcome_of(judged(older), "contact board"), Outcome::kSkipped);
}

TEST(AContactSensor, WhoseVoltageLiesBetweenTheBandsFailsByItsCircuit) {
  ContactSeen wet = sound_contact();
  wet.newest.sense_voltage_v = 2.5;
  const Findings findings = judged(wet);
  EXPECT_EQ(outcome_of(findings, "contact circuit"), Outcome::kFailed);
  EXPECT_NE(finding_of(findings, "contact circuit").found.find("2.50 V"), std::string::npos);
}

TEST(AContactSensor, IsNotKnownToBeAtTheGunUntilATouchWasSeen) {
  ContactSeen seen = sound_contact();
  Findings before, after;
  judge_contact_touch(seen, before);
  seen.touched = true;
  judge_contact_touch(seen, after);
  EXPECT_EQ(outcome_of(before, "contact touch"), Outcome::kWarning);
  EXPECT_EQ(outcome_of(after, "contact touch"), Outcome::kOk);
}

TEST(AContactSensor, ThatMissesItsOwnEdgeFailsByItsSelfTest) {
  ContactSeen seen = sound_contact();
  seen.newest.self_test_ok = false;
  seen.newest.link = drivers::ContactLink::kFault;
  EXPECT_EQ(outcome_of(judged(seen), "contact self-test"), Outcome::kFailed);
}

TEST(AContactSensor, WithAnotherConfigurationFails) {
  ContactSeen seen = sound_contact();
  seen.wanted_config_crc = 0x4321;
  EXPECT_EQ(outcome_of(judged(seen), "contact configuration"), Outcome::kFailed);
}

TEST(AContactSensor, IsJudgedByHowWellItsClockIsKnown) {
  ContactSeen seen = sound_contact();
  seen.newest.quality.clock_sigma_s = 200e-6;
  EXPECT_EQ(outcome_of(judged(seen), "contact clock"), Outcome::kWarning);
  seen.newest.quality.clock_sigma_s = 600e-6;
  EXPECT_EQ(outcome_of(judged(seen), "contact clock"), Outcome::kFailed);
  seen.newest.quality.clock_sigma_s.reset();
  EXPECT_EQ(outcome_of(judged(seen), "contact clock"), Outcome::kFailed);
}

TEST(AContactSensor, OfAnotherBaudRateIsToldFromABrokenWire) {
  ContactSeen seen = sound_contact();
  seen.newest = {};
  seen.newest.fault = drivers::ContactFault::kBaud;
  seen.newest.link = drivers::ContactLink::kFault;
  seen.newest.words = "not one frame at 1000000 baud";
  seen.baud = 1'000'000;
  EXPECT_EQ(finding_of(judged(seen), "contact sensor").found, "not one frame at 1000000 baud");
  EXPECT_EQ(outcome_of(judged(seen), "contact circuit"), Outcome::kSkipped);
  seen.answers_at = 115'200;
  const Findings findings = judged(seen);
  EXPECT_EQ(finding_of(findings, "contact sensor").found,
            "115200 baud at the sensor, 1000000 baud in the configuration");
  EXPECT_EQ(finding_of(findings, "contact sensor").advice, "set baud = 115200 under [contact]");
}

TEST(AContactSensor, WhoseClockDoesNotComeHasNoOpenWire) {
  ContactSeen seen = sound_contact();
  seen.newest.loop_ok.reset();  // not tested
  seen.newest.self_test_ok = false;
  seen.newest.quality.clock_sigma_s = 800e-6;
  seen.newest.link = drivers::ContactLink::kIdentifying;
  const Findings findings = judged(seen);
  EXPECT_EQ(outcome_of(findings, "contact circuit"), Outcome::kSkipped);
  EXPECT_EQ(outcome_of(findings, "contact self-test"), Outcome::kSkipped);
  EXPECT_EQ(outcome_of(findings, "contact clock"), Outcome::kFailed);
}

TEST(AContactSensorsDelivery, IsJudgedByTheLatestHeartbeat) {
  const auto outcome = [](double worst_s, std::uint32_t times = 0, bool repeats = true) {
    ContactSeen seen = sound_contact();
    seen.newest.delivery.late = times;
    seen.repeats = repeats;
    seen.newest.quality.late_p50_s = 0.0002;
    seen.newest.quality.late_worst_s = worst_s;
    Findings findings;
    judge_contact_delivery(seen, findings);
    expect_advice(findings);
    return finding_of(findings, "contact delivery");
  };
  EXPECT_EQ(outcome(0.0).outcome, Outcome::kSkipped) << "not measured is not ok";
  EXPECT_EQ(outcome(0.001).outcome, Outcome::kOk);
  EXPECT_EQ(outcome(0.012).outcome, Outcome::kWarning);
  const auto late = outcome(0.040, 3);
  EXPECT_EQ(late.outcome, Outcome::kWarning) << "the touch is repeated, and the session goes on";
  EXPECT_NE(
      late.found.find("0.20 ms late on this computer (median), 40.0 ms at worst (limit 25 ms, "
                      "exceeded 3 times in 10 s); this computer was busy"),
      std::string::npos)
      << late.found;
  EXPECT_EQ(outcome(0.040, 1, false).outcome, Outcome::kFailed) << "it ends the session";
  EXPECT_EQ(outcome(0.040, 4).outcome, Outcome::kFailed) << "no touch comes to its end";
}

TEST(AContactLine, IsJudgedByItsDamagedFramesAndItsRoundTrip) {
  ContactSeen seen = sound_contact();
  seen.newest.quality.crc_errors = 1;
  EXPECT_EQ(outcome_of(judged(seen), "contact line"), Outcome::kWarning);
  seen.newest.quality.gaps = 20;
  EXPECT_EQ(outcome_of(judged(seen), "contact line"), Outcome::kFailed);
  seen = sound_contact();
  seen.newest.quality.round_trip->p50_s = 0.016;
  EXPECT_EQ(outcome_of(judged(seen), "contact line"), Outcome::kWarning);
}

}  // namespace
}  // namespace cellcal::daemon::testing
