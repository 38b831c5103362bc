#include <gtest/gtest.h>

#include "daemon/config/config.h"
#include "daemon/config/unattended_config.h"
#include "tests/daemon/config/reason.h"

namespace cellcal::daemon {
namespace {

constexpr const char* kTop =
    "format = \"cellcal.daemon/1\"\nbackend = \"rsi\"\n[contact]\ndevice = \"/dev/x\"\n";
const std::string kNightly =
    "[[schedule.session]]\nname = \"nightly\"\ncell = \"/c.toml\"\nfrom = \"22:00\"\nto = \"05:30\"\n";

ScheduleConfig schedule_of(const std::string& text) {
  return parse_config(kTop + text, "d.toml").schedule;
}

std::string refusal_of_schedule(const std::string& text) { return testing::reason(kTop + text); }

TEST(AScheduleInTheConfiguration, IsOffUnlessSomebodyIsNamedWhoAnswersForTheCell) {
  EXPECT_FALSE(schedule_of("").unattended);
  EXPECT_FALSE(schedule_of(kNightly).unattended);
  EXPECT_EQ(schedule_of(kNightly).sessions.size(), 1u);
  EXPECT_NE(
      refusal_of_schedule("[schedule]\nunattended = true\n").find("d.toml:5: schedule.responsible"),
      std::string::npos)
      << refusal_of_schedule("[schedule]\nunattended = true\n");
  EXPECT_TRUE(
      schedule_of("[schedule]\nunattended = true\nresponsible = \"A. Miller, 4711\"\n").unattended);
}

/// As kTop, with EKI.
std::string over_eki(std::string text) {
  const std::string top = kTop;
  return std::string(top).replace(top.find("\"rsi\""), 5, "\"eki\"") + std::move(text);
}

TEST(AScheduleInTheConfiguration, SaysHowTheControllersProgramStarts) {
  EXPECT_EQ(schedule_of(kNightly).program_start, ProgramStart::kNone);
  EXPECT_EQ(schedule_of("[schedule]\nprogram_start = \"cell\"\n").program_start,
            ProgramStart::kCell);
  EXPECT_EQ(parse_config(over_eki("[schedule]\nprogram_start = \"left running\"\n"), "d.toml")
                .schedule.program_start,
            ProgramStart::kLeftRunning);
  const DaemonConfig run = parse_config(
      over_eki("[controller]\nrun_programs = true\n[schedule]\nprogram_start = \"run\"\n"),
      "d.toml");
  EXPECT_TRUE(run.eki.run_program);
  EXPECT_TRUE(run.controller.may_run);
  EXPECT_FALSE(
      parse_config(over_eki("[controller]\nrun_programs = true\n"), "d.toml").eki.run_program)
      << "permitted, and not asked for";
}

TEST(AScheduleInTheConfiguration, StartsNoProgramThatTheWireOrTheControllerDoesNotLetIt) {
  for (const char* start : {"left running", "run"}) {
    const std::string text = std::string("[schedule]\nprogram_start = \"") + start + "\"\n";
    EXPECT_NE(refusal_of_schedule(text).find(
                  "d.toml:6: schedule.program_start: must be \"cell\" over RSI"),
              std::string::npos)
        << refusal_of_schedule(text);
  }
  const std::string unpermitted =
      testing::reason(over_eki("[schedule]\nprogram_start = \"run\"\n"));
  EXPECT_NE(unpermitted.find("[controller] run_programs is not true"), std::string::npos)
      << unpermitted;
}

TEST(AScheduleInTheConfiguration, WithoutAStartOfTheProgramHasAnObstacleToName) {
  const std::string unattended = "[schedule]\nunattended = true\nresponsible = \"A. Miller\"\n";
  const auto obstacle = [](const std::string& text) {
    return unattended_obstacle(parse_config(kTop + text, "d.toml"));
  };
  EXPECT_NE(obstacle(unattended + kNightly).find("program_start is \"none\""), std::string::npos);
  EXPECT_EQ(obstacle(unattended + "program_start = \"cell\"\n" + kNightly), "");
  EXPECT_EQ(obstacle(unattended), "") << "nothing is to begin";
  EXPECT_EQ(obstacle(kNightly), "") << "nor without a person";
  EXPECT_EQ(
      unattended_obstacle(parse_config(
          "format = \"cellcal.daemon/1\"\nbackend = \"mock\"\n" + unattended + kNightly, "d.toml")),
      "")
      << "an emulated program is always there";
}

TEST(AScheduleInTheConfiguration, IsReadWithDaysTimesAndWhatToDo) {
  const ScheduledSession one =
      schedule_of(kNightly +
                  "days = [\"mon\", \"sat\"]\ntouches = 60\ncheck = 5\ngoal_mm = 0.2\n"
                  "minutes = 45\nbegin = \"on request\"\nload = \"full\"\n")
          .sessions.at(0);
  EXPECT_EQ(one.window.from_min, 22 * 60);
  EXPECT_EQ(one.window.to_min, 5 * 60 + 30);
  const std::array<bool, 7> days{false, true, false, false, false, false, true};
  EXPECT_EQ(one.window.days, days);
  EXPECT_TRUE(one.on_request);
  EXPECT_EQ(one.touches, 60);
  EXPECT_EQ(one.minutes, 45.0);
  EXPECT_EQ(one.load, "full");
  EXPECT_EQ(schedule_of(kNightly).sessions[0].kind, "calibrate");
}

TEST(AScheduleInTheConfiguration, ThatIsWrongIsRefusedWithLineAndKey) {
  const std::pair<std::string, const char*> kWrong[] = {
      {"days = []\n", "days"},
      {"days = [\"monday\"]\n", "monday"},
      {"kind = \"calibration\"\n", "kind"},
      {"begin = \"never\"\n", "begin"},
      {"kind = \"qualify\"\ntouches = 9\n", "touches"},
      {"minutes = 0\n", "minutes"},
      {"goal_mm = nan\n", "goal_mm"},
      {"load = \"\"\n", "load"},
      {"load = \"a\\nb\"\n", "load"},
      {"load = \"" + std::string(65, 'x') + "\"\n", "load"},
      {"load = 3\n", "load"},
      {"when = \"now\"\n", "when"},
      {kNightly, "name"}};
  for (const auto& [text, words] : kWrong) {
    const std::string message = refusal_of_schedule(kNightly + text);
    EXPECT_NE(message.find("d.toml:"), std::string::npos) << text << message;
    EXPECT_NE(message.find(words), std::string::npos) << text << message;
  }
  for (const char* time : {"24:00", "22:60", "9:00", "22.00", "", "22:000", "aa:bb", "-1:00"}) {
    const std::string text = "[[schedule.session]]\nname = \"n\"\ncell = \"/c\"\nfrom = \"" +
                             std::string(time) + "\"\nto = \"05:00\"\n";
    EXPECT_NE(refusal_of_schedule(text).find("from"), std::string::npos) << time;
  }
  EXPECT_NE(
      refusal_of_schedule(
          "[[schedule.session]]\nname = \"n\"\ncell = \"/c\"\nfrom = \"05:00\"\nto = \"05:00\"\n")
          .find("another time"),
      std::string::npos);
  for (const char* name :
       {"", "-x", "a b", "a\\u0007", "0123456789012345678901234567890123456789x"}) {
    const std::string text = "[[schedule.session]]\nname = \"" + std::string(name) +
                             "\"\ncell = \"/c\"\nfrom = \"05:00\"\nto = \"06:00\"\n";
    EXPECT_NE(refusal_of_schedule(text).find("name"), std::string::npos) << name;
  }
  EXPECT_NE(
      refusal_of_schedule(
          "[[schedule.session]]\nname = \"n\"\ncell = \"c\"\nfrom = \"05:00\"\nto = \"06:00\"\n")
          .find("cell"),
      std::string::npos);
  std::string many;
  for (int i = 0; i < 33; ++i)
    many += "[[schedule.session]]\nname = \"n" + std::to_string(i) +
            "\"\ncell = \"/c\"\nfrom = \"05:00\"\nto = \"06:00\"\n";
  EXPECT_NE(refusal_of_schedule(many).find("at most 32"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon
