#include <numbers>

#include "daemon/doctor/robot_check.h"
#include "tests/daemon/doctor/outcome_of.h"

namespace cellcal::daemon::testing {
namespace {

RsiSeen sound_rsi() {
  RsiSeen seen;
  seen.up = seen.answered = true;
  seen.observed_s = 10.0;
  seen.sender = "10.0.0.2";
  seen.listening = "UDP 10.0.0.5:49152";
  drivers::CoreState& s = seen.newest;
  s.link = drivers::RobotLink::kNotReferenced;
  s.packets = s.replies = 2500;
  s.cycle_s = 0.004;
  s.jitter_s = 0.0003;
  s.ipoc_step = 4;
  s.decimals = 5;
  s.sends_setpoint = s.sends_delay = true;
  s.mode = drivers::OperatingMode::kAut;
  s.override_percent = 100;
  seen.state.quality.replies = 2500;
  seen.state.quality.reply_p99_s = 0.0001;
  seen.state.quality.reply_p999_s = 0.0004;
  return seen;
}

Findings judged(const RsiSeen& seen) {
  Findings findings;
  judge_rsi(seen, {"ImFree", 3}, findings);
  expect_advice(findings);
  return findings;
}

TEST(AnRsiLink, ThatIsSoundIsAllOk) {
  const Findings findings = judged(sound_rsi());
  EXPECT_EQ(findings.count(Outcome::kOk), findings.all().size());
  EXPECT_EQ(findings.all().size(), 8u);
}

TEST(AnRsiLink, WhosePacketsArriveTwiceSaysHowManyDid) {
  RsiSeen seen = sound_rsi();
  seen.state.quality.duplicates = 7;
  const auto packets = finding_of(judged(seen), "rsi packets");
  EXPECT_EQ(packets.outcome, Outcome::kWarning);
  EXPECT_EQ(packets.found, "2500, 7 of them received twice (the same IPOC)");
}

testing::Said judged_model(const calib::ControllerModel& model, bool sends = true,
                           WireKind wire = WireKind::kRsi) {
  Findings findings;
  calib::Robot robot;
  robot.name = "KR 5";
  for (const char* name : {"A1", "A2"}) robot.joints.emplace_back().name = name;
  judge_model(model, robot, sends, wire, findings);
  expect_advice(findings);
  return finding_of(findings, "controller's model");
}

TEST(TheControllersModel, IsJudgedByItsDifferenceFromTheRobotFile) {
  using enum calib::ControllerModel::Outcome;
  const std::vector<double> at{0.0, -1.5707963267948966};
  EXPECT_EQ(judged_model({kAgrees, 3, 1e-6, at}).outcome, Outcome::kOk);
  EXPECT_EQ(judged_model({kAgrees, 3, 1e-6, at}).found,
            "0.00 mm from the robot file over 3 postures");
  const auto differs = judged_model({kDiffers, 9, 12.3e-3, at});
  EXPECT_EQ(differs.outcome, Outcome::kFailed);
  EXPECT_NE(differs.found.find("12.30 mm from the robot file at A1 0.0, A2 -90.0 deg"),
            std::string::npos)
      << differs.found;
  const auto frames = judged_model({kOtherFrames, 9, 0.0, at, 3.25e-3, 0.0});
  EXPECT_EQ(frames.outcome, Outcome::kWarning);
  EXPECT_NE(frames.found.find("$TOOL 3.2 mm"), std::string::npos) << frames.found;
  EXPECT_EQ(judged_model({kUndecided, 1, 12.3e-3, at}).outcome, Outcome::kWarning);
}

TEST(TheControllersModel, ThatIsNotSentSaysWhatToCopy) {
  EXPECT_NE(judged_model({}, false).advice.find("DEF_RIst"), std::string::npos);
  const auto eki = judged_model({}, false, WireKind::kEki);
  EXPECT_EQ(eki.outcome, Outcome::kWarning);
  for (const char* file : {"CellcalEki.xml", "cellcal_sub.sub", "cellcal_eki.dat"})
    EXPECT_NE(eki.advice.find(file), std::string::npos) << eki.advice;
  EXPECT_EQ(judged_model({}, true, WireKind::kEki).outcome, Outcome::kSkipped)
      << "its program does not run";
}

TEST(AnRsiLink, WithASecondStopPathIsOkOnceTheInputWasSeenToFollow) {
  const auto outcome = [](const RsiSeen& seen) {
    Findings findings;
    RsiExpected expected{"ImFree", 3};
    expected.input = 17;
    judge_rsi(seen, expected, findings);
    expect_advice(findings);
    return outcome_of(findings, "rsi contact input");
  };
  RsiSeen seen = sound_rsi();
  seen.newest.input_path = drivers::InputPath::kUnproven;
  EXPECT_EQ(outcome(seen), Outcome::kWarning) << "its wire was not tested";
  seen.input.changed = seen.input.contact_changed = true;
  EXPECT_EQ(outcome(seen), Outcome::kOk);
  seen.input.changed = false;
  EXPECT_EQ(outcome(seen), Outcome::kFailed) << "stuck";
  seen.input = {.on_while_open = true, .on = true};
  EXPECT_EQ(outcome(seen), Outcome::kFailed) << "cut";
  seen.newest.input_path = drivers::InputPath::kUntold;
  EXPECT_EQ(outcome(seen), Outcome::kFailed) << "an older set of files";
}

TEST(AnRsiLink, ShowsModeAndOverrideAndWarnsWhereAnOlderSetDoesNotTellThem) {
  RsiSeen seen = sound_rsi();
  seen.newest.mode = drivers::OperatingMode::kT1;
  seen.newest.override_percent = 10;
  EXPECT_EQ(finding_of(judged(seen), "rsi state").found,
            "mode T1, override 10 % (which does not slow RSI down)");
  EXPECT_EQ(outcome_of(judged(seen), "rsi state"), Outcome::kOk);
  seen.newest.override_percent = -1;
  EXPECT_EQ(finding_of(judged(seen), "rsi state").found, "mode T1, override unknown");
  EXPECT_EQ(outcome_of(judged(seen), "rsi state"), Outcome::kWarning);
  Findings mode_alone, neither;
  judge_rsi(seen, {"ImFree", 3, false, true, false}, mode_alone);
  EXPECT_EQ(outcome_of(mode_alone, "rsi state"), Outcome::kOk);
  judge_rsi(seen, {"ImFree", 3, false, false, false}, neither);
  EXPECT_EQ(outcome_of(neither, "rsi state"), Outcome::kSkipped);
}

TEST(AnRsiLink, ForCorrectionsInSpaceIsToldWhereTheControllerHasItsTool) {
  const auto of = [](double mm, double deg) {
    RsiSeen seen = sound_rsi();
    seen.newest.tcp_apart = {mm, deg};
    Findings findings;
    judge_rsi(seen, {"ImFree", 3, true}, findings);
    expect_advice(findings);
    return finding_of(findings, "rsi tool");
  };
  EXPECT_EQ(of(0.0, 0.0).outcome, Outcome::kWarning) << "not compared";
  EXPECT_EQ(of(0.003, 0.0001).outcome, Outcome::kOk);
  const auto wrong = of(417.2, 38.0);
  EXPECT_EQ(wrong.outcome, Outcome::kFailed);
  EXPECT_NE(wrong.found.find("417.20 mm"), std::string::npos) << wrong.found;
  EXPECT_NE(wrong.advice.find("$TOOL"), std::string::npos);
}

TEST(AnRsiLink, WithoutPacketsGetsTheChecklistAndNothingElse) {
  RsiSeen seen;
  seen.listening = "UDP 10.0.0.5:49152";
  const Findings findings = judged(seen);
  EXPECT_NE(finding_of(findings, "rsi packets").advice.find("listen before RSI_ON"),
            std::string::npos);
  EXPECT_EQ(findings.count(Outcome::kFailed), 1u);
  EXPECT_EQ(findings.count(Outcome::kSkipped), 7u);
}

TEST(AnRsiLink, OnWhichSomethingElseComesSaysWhat) {
  RsiSeen seen;
  seen.newest.bad_packets = 4;
  seen.newest.last_error = drivers::WireError::kNotXml;
  std::string_view("hello").copy(seen.newest.last_bad, 5);
  EXPECT_NE(finding_of(judged(seen), "rsi packets").found.find("\"hello\""), std::string::npos);
}

TEST(AnRsiLink, WhoseRepliesAreRefusedIsToldBySentypeNotBySilence) {
  RsiSeen seen = sound_rsi();
  seen.refused = true;
  EXPECT_NE(finding_of(judged(seen), "rsi replies").advice.find("\"ImFree\""), std::string::npos);
  // With a short Timeout the controller stops sending before the adapter is certain.
  seen = sound_rsi();
  seen.lost = true;
  seen.newest.packets = 11;
  seen.newest.replies = 10;
  seen.newest.late = 9;
  const Findings findings = judged(seen);
  EXPECT_EQ(outcome_of(findings, "rsi replies"), Outcome::kFailed);
  EXPECT_EQ(outcome_of(findings, "rsi packets"), Outcome::kOk);
}

TEST(AnRsiLink, ThatStoppedForAnotherReasonSaysSo) {
  RsiSeen seen = sound_rsi();
  seen.lost = true;
  EXPECT_NE(finding_of(judged(seen), "rsi packets").found.find("then none after IPOC"),
            std::string::npos);
}

TEST(AnRsiLink, IsJudgedByItsLateRepliesSinceItAnswers) {
  RsiSeen seen = sound_rsi();
  seen.newest.late = 7;
  seen.late_at_start = 7;
  EXPECT_EQ(outcome_of(judged(seen), "rsi replies"), Outcome::kOk);
  seen.late_at_start = 6;
  EXPECT_EQ(outcome_of(judged(seen), "rsi replies"), Outcome::kWarning);
  seen.late_at_start = 4;
  EXPECT_EQ(outcome_of(judged(seen), "rsi replies"), Outcome::kFailed);
}

TEST(AnRsiLink, ThatIsNotAnsweredSaysWhy) {
  RsiSeen seen = sound_rsi();
  seen.answered = false;
  seen.last_words = "not answering: which correction";
  EXPECT_EQ(finding_of(judged(seen), "rsi replies").found, seen.last_words);
}

TEST(AnRsiLink, IsJudgedByDecimalsAndElements) {
  RsiSeen seen = sound_rsi();
  seen.newest.decimals = 1;
  EXPECT_EQ(outcome_of(judged(seen), "rsi decimals"), Outcome::kFailed);
  seen.newest.decimals = 3;
  EXPECT_EQ(outcome_of(judged(seen), "rsi decimals"), Outcome::kWarning);
  seen.newest.decimals = 1;
  seen.newest.decimals_unproven = true;
  EXPECT_EQ(outcome_of(judged(seen), "rsi decimals"), Outcome::kWarning) << "a session takes it";
  seen.newest.sends_delay = false;
  EXPECT_EQ(finding_of(judged(seen), "rsi elements").found, "Delay is not sent");
  seen.newest.sends_setpoint = false;
  EXPECT_EQ(finding_of(judged(seen), "rsi elements").found, "ASPos and Delay is not sent");
  EXPECT_EQ(outcome_of(judged(seen), "rsi elements"), Outcome::kWarning) << "a session takes it";
  seen.newest.relative = true;
  EXPECT_EQ(outcome_of(judged(seen), "rsi elements"), Outcome::kFailed) << "a session refuses it";
}

TEST(AnRsiLink, IsJudgedByCycleSenderAndReplyTimes) {
  RsiSeen seen = sound_rsi();
  seen.newest.ipoc_step = 1;
  EXPECT_EQ(outcome_of(judged(seen), "rsi cycle"), Outcome::kWarning);
  seen = sound_rsi();
  seen.newest.jitter_s = 0.002;
  EXPECT_EQ(outcome_of(judged(seen), "rsi cycle"), Outcome::kWarning);
  seen.newest.cycle_s = 0.0;
  EXPECT_EQ(outcome_of(judged(seen), "rsi cycle"), Outcome::kFailed);
  seen = sound_rsi();
  seen.foreign = 3;
  EXPECT_EQ(outcome_of(judged(seen), "rsi sender"), Outcome::kFailed);
  seen.state.quality.reply_p999_s = 0.0015;
  EXPECT_EQ(outcome_of(judged(seen), "rsi reply times"), Outcome::kWarning);
  seen.state.quality.reply_p99_s = 0.003;
  EXPECT_EQ(outcome_of(judged(seen), "rsi reply times"), Outcome::kFailed);
}

TEST(JointAngles, AreComparedWithTheRobotFilesLimits) {
  calib::Robot robot;
  for (const char* name : {"A1", "A2"}) {
    calib::Joint joint;
    joint.name = name;
    joint.min_rad = -1.0;
    joint.max_rad = 1.0;
    robot.joints.push_back(joint);
  }
  const auto outcome = [&](drivers::AxisAngles at, const calib::Robot* known) {
    Findings findings;
    judge_angles("angles", at, known, findings);
    return outcome_of(findings, "angles");
  };
  EXPECT_EQ(outcome({0.0, 0.5}, &robot), Outcome::kOk);
  EXPECT_EQ(outcome({0.0, 1.0 - 0.01}, &robot), Outcome::kWarning);
  EXPECT_EQ(outcome({0.0, 1.1}, &robot), Outcome::kFailed);
  EXPECT_EQ(outcome({0.0}, &robot), Outcome::kFailed);
  EXPECT_EQ(outcome({0.0, 5.0}, nullptr), Outcome::kSkipped);
  calib::Joint track;
  track.name = "E1";
  track.guide.emplace();
  track.max_rad = 3.0;
  robot.joints.insert(robot.joints.begin(), track);
  EXPECT_EQ(outcome({1.5, 0.0, 0.5}, &robot), Outcome::kOk);
  EXPECT_EQ(outcome({2.995, 0.0, 0.5}, &robot), Outcome::kWarning) << "5 mm from its end";
  EXPECT_EQ(outcome({3.2, 0.0, 0.5}, &robot), Outcome::kFailed);
}

TEST(JointAngles, HaveALinearUnitsPositionInMillimetres) {
  calib::Robot robot;
  robot.joints.resize(2);
  robot.joints[0].guide.emplace();
  robot.joints[0].max_rad = 3.0;
  robot.joints[1].min_rad = -1.0;
  robot.joints[1].max_rad = 1.0;
  Findings findings;
  judge_angles("angles", {1.25, 0.0}, &robot, findings);
  const std::string found = calib::words(findings.all().front().found);
  EXPECT_NE(found.find("1250.000 mm, 0.000 deg"), std::string::npos) << found;
}

TEST(TheEndOfRsi, IsSeenOrWarnedOf) {
  Findings findings;
  judge_rsi_end(0.02, findings);
  judge_rsi_end(std::nullopt, findings);
  EXPECT_EQ(findings.all().front().outcome, Outcome::kOk);
  EXPECT_EQ(findings.all().back().outcome, Outcome::kWarning);
}

}  // namespace
}  // namespace cellcal::daemon::testing
