#include <nlohmann/json.hpp>

#include "daemon/doctor/doctor.h"
#include "daemon/doctor/wires.h"
#include "tests/daemon/doctor/outcome_of.h"

namespace cellcal::daemon::testing {
namespace {

using nlohmann::json;

json status() {
  return {{"robot", ""},
          {"contact", ""},
          {"links",
           {{"open", true},
            {"robot",
             {{"cycle_ms", 4.0},
              {"packets", 100},
              {"replies", 100},
              {"late", 0},
              {"reply_ms", {{"p50", 0.03}, {"p99", 0.1}, {"max", 0.2}}}}},
            {"contact", {{"frames", 50}, {"firmware", "1.0.0"}, {"boot_id", 7}}}}}};
}

Findings judged(const json& value) {
  Findings findings;
  judge_links_of(value.dump(), findings);
  return findings;
}

TEST(LinksOfASession, ThatAreSoundAreShown) {
  const Findings findings = judged(status());
  EXPECT_EQ(findings.count(Outcome::kOk), 2u);
  EXPECT_NE(finding_of(findings, "robot link").found.find("cycle 4.00 ms"), std::string::npos);
  EXPECT_NE(finding_of(findings, "contact link").found.find("boot id 7"), std::string::npos);
}

TEST(LinksOfASession, FailByTheirOwnWordsAndWarnOfLosses) {
  json value = status();
  value["robot"] = "packets stopped";
  value["links"]["contact"]["crc_errors"] = 1;
  const Findings findings = judged(value);
  EXPECT_EQ(finding_of(findings, "robot link").found, "packets stopped");
  EXPECT_EQ(outcome_of(findings, "robot link"), Outcome::kFailed);
  EXPECT_EQ(outcome_of(findings, "contact link"), Outcome::kWarning);
  value["robot"] = "17 of the replies late";
  value["arm"] = {{"motion", "moving"}, {"packet_age_s", 0.004}};
  EXPECT_EQ(outcome_of(judged(value), "robot link"), Outcome::kWarning) << "it delivers";
}

TEST(LinksOfASession, ThatHasOpenedNothingOrOfAnotherVersionAreSkipped) {
  json value = status();
  value["links"] = nullptr;
  EXPECT_EQ(judged(value).count(Outcome::kSkipped), 2u);
  EXPECT_EQ(judged(json{{"phase", "idle"}}).count(Outcome::kSkipped), 2u);
  EXPECT_EQ(judged(json("no object")).count(Outcome::kSkipped), 2u);
}

TEST(AnArmOfTheStatus, IsAtRestOnlyWithThePacketThatShowsItAndIsReadAsAnEnumerator) {
  const auto said = [](const json& arm) { return calib::words(arm_phrase(arm)); };
  EXPECT_EQ(said({{"motion", to_string(ArmMotion::kAtRest)}, {"packet_age_s", 0.13}}),
            "arm: at rest (packet 0.1 s old)");
  EXPECT_EQ(said({{"motion", "unknown"}, {"packet_age_s", nullptr}}),
            "arm: unknown, no packet from the controller");
  const std::string lost = said({{"motion", "unknown"}, {"packet_age_s", 12.2}});
  EXPECT_TRUE(lost.starts_with("arm: unknown since ")) << lost;
  EXPECT_NE(lost.find("newest packet 12 s old. Look at the robot"), std::string::npos) << lost;
  EXPECT_TRUE(arm_phrase(nullptr).empty());
  for (std::size_t i = 0; i < EnumNames<ArmMotion>::kSize; ++i)
    EXPECT_EQ(motion_of({{"motion", to_string(ArmMotion(i))}}), ArmMotion(i));
  EXPECT_EQ(motion_of({{"motion", "of another version"}}), ArmMotion::kUnknown);
}

TEST(ALinkOfTheStatus, IsSaidInTheReadersLanguageWithoutWhatIsNotThere) {
  EXPECT_TRUE(robot_link_phrase(nullptr).empty());
  EXPECT_TRUE(contact_link_phrase(3).empty());
  const std::string eki = calib::words(robot_link_phrase({{"cycle_ms", 20.0}, {"packets", 5}}));
  EXPECT_NE(eki.find("cycle 20.00 ms"), std::string::npos) << eki;
  EXPECT_EQ(eki.find("replies"), std::string::npos) << eki;
  EXPECT_EQ(eki.find("mode"), std::string::npos) << eki;
  const calib::Phrase in_t1 =
      robot_link_phrase({{"packets", 5}, {"mode", "T1"}, {"override_percent", 10}});
  EXPECT_NE(calib::words(in_t1).find("; mode T1; override 10 %"), std::string::npos);
  EXPECT_NE(calib::words(in_t1, *calib::Language::of("de")).find("; Betriebsart T1; Override 10 %"),
            std::string::npos);
  const std::string contact = calib::words(contact_link_phrase({{"frames", 50}, {"boot_id", 7}}));
  EXPECT_NE(contact.find("firmware unknown, boot id 7; 50 frames"), std::string::npos) << contact;
  for (const char* unknown : {"round trip", "clock", "late on this computer"})
    EXPECT_EQ(contact.find(unknown), std::string::npos) << contact;
  const std::string sound = calib::words(contact_link_phrase(
      {{"frames", 50}, {"round_trip_ms", {{"p50", 0.5}, {"p99", 0.7}}}, {"clock_sigma_us", 8.0}}));
  EXPECT_NE(sound.find("; round trip 0.50 ms, p99 0.70 ms; clock ± 8.0 us"), std::string::npos)
      << sound;
}

TEST(TheLineToThePlant, IsToldWithWhatWaitsSinceWhenAndWhatToDoAndNeverFails) {
  json line{{"connected", true}, {"since", "2026-11-22T20:00:00Z"},  {"words", ""},
            {"waiting", 3},      {"oldest", "2026-11-21T08:00:00Z"}, {"dropped", 0},
            {"not_begun", 0}};
  const auto judge = [&] {
    Findings findings;
    judge_plant(line.dump(), findings);
    return finding_of(findings, "plant");
  };
  EXPECT_EQ(judge().outcome, Outcome::kOk);
  EXPECT_EQ(judge().found,
            "3 messages queued, oldest 2026-11-21T08:00:00Z; connected since 2026-11-22T20:00:00Z");
  line["connected"] = false;
  line["words"] = "broker b:8883: not reached. Check the cable";
  line["dropped"] = 7;
  EXPECT_EQ(judge().outcome, Outcome::kWarning);
  EXPECT_NE(judge().found.find("not connected since"), std::string::npos);
  EXPECT_NE(judge().found.find("7 telemetry messages dropped"), std::string::npos);
  EXPECT_EQ(judge().advice, line["words"]);
  line = "another version";
  EXPECT_EQ(judge().outcome, Outcome::kSkipped);
}

TEST(TheSparkplugLine, IsToldOfWhereThereIsOne) {
  const auto judge = [](const json& node) {
    Findings findings;
    judge_plant(json{{"connected", true}, {"words", ""}, {"sparkplug", node}}.dump(), findings);
    return findings;
  };
  EXPECT_EQ(judge(nullptr).all().size(), 1u);
  json node{{"connected", true}, {"since", "2026-11-22T20:00:00Z"}, {"words", ""}};
  EXPECT_EQ(finding_of(judge(node), "sparkplug").outcome, Outcome::kOk);
  node["connected"] = false;
  EXPECT_EQ(finding_of(judge(node), "sparkplug").outcome, Outcome::kWarning);
  node["words"] = "broker b:8883: not reached. Check the cable";
  EXPECT_EQ(finding_of(judge(node), "sparkplug").advice, node["words"]);
}

TEST(RealTime, IsJudgedByTheDaemonThatRuns) {
  DaemonConfig config;
  ProcessRights rights;
  rights.who = "cellcald (process 7)";
  const auto outcome = [&] {
    Findings findings;
    judge_realtime(config, rights, {"a warning of this process"}, findings);
    return finding_of(findings, "real time");
  };
  EXPECT_NE(outcome().found.find("lacks SCHED_FIFO"), std::string::npos);
  EXPECT_NE(outcome().found.find("locked memory"), std::string::npos);
  rights.realtime = rights.locked_memory = true;
  EXPECT_EQ(outcome().outcome, Outcome::kOk);
  config.realtime = false;
  EXPECT_EQ(outcome().outcome, Outcome::kWarning);
}

}  // namespace
}  // namespace cellcal::daemon::testing
