#include "daemon/config/schedule_config.h"

#include <gtest/gtest.h>

#include "daemon/config/config.h"
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

TEST(a_schedule_in_the_configuration, is_off_unless_somebody_is_named_who_answers_for_the_cell) {
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

TEST(a_schedule_in_the_configuration, is_read_with_days_times_and_what_to_do) {
  const ScheduledSession one =
      schedule_of(kNightly +
                  "days = [\"mon\", \"sat\"]\ntouches = 60\ncheck = 5\ngoal_mm = 0.2\n"
                  "minutes = 45\nbegin = \"on request\"\n")
          .sessions.at(0);
  EXPECT_EQ(one.window.from_min, 22 * 60);
  EXPECT_EQ(one.window.to_min, 5 * 60 + 30);
  const std::array<bool, 7> days{false, true, false, false, false, false, true};
  EXPECT_EQ(one.window.days, days);
  EXPECT_TRUE(one.on_request);
  EXPECT_EQ(one.touches, 60);
  EXPECT_EQ(one.minutes, 45.0);
  EXPECT_EQ(schedule_of(kNightly).sessions[0].kind, "calibrate");
}

TEST(a_schedule_in_the_configuration, that_is_wrong_is_refused_with_line_and_key) {
  const std::pair<std::string, const char*> kWrong[] = {
      {"days = []\n", "days"},
      {"days = [\"monday\"]\n", "monday"},
      {"kind = \"calibration\"\n", "kind"},
      {"begin = \"never\"\n", "begin"},
      {"kind = \"qualify\"\ntouches = 9\n", "touches"},
      {"minutes = 0\n", "minutes"},
      {"goal_mm = nan\n", "goal_mm"},
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
