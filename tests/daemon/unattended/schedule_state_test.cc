#include <gtest/gtest.h>

#include <regex>

#include "calib/model/enum_table.h"
#include "daemon/unattended/schedule.h"

namespace cellcal::daemon {
namespace {

ScheduleState filled() {
  ScheduleState state;
  state.evaluated_until = 1'800'000'000;
  state.known = {{"nightly", 1'700'000'000}};
  state.close("nightly", "2026-11-22", false);
  state.close("nightly", "2026-11-23", true);
  state.hold = Hold{7, Why::kPastUnknown};
  state.clock = {"first", 1'799'999'000, 12.5};
  state.clock_doubt = ClockDoubt{Why::kClockStepped, -90.0};
  state.released = "7/3/failed/no-contact: x";
  state.add({1'800'000'000, "nightly", "2026-11-22", Verb::kRefused, Why::kCannotBegin, 8,
             "\xff \"odd\"\n", 1.5});
  return state;
}

std::string refusal(const std::string& text) {
  try {
    schedule_state_from(text);
    return "";
  } catch (const std::exception& error) {
    return error.what();
  }
}

TEST(TheSchedulesState, IsReadBackWholeAndNewWhereThereIsNone) {
  EXPECT_EQ(schedule_state_from("").evaluated_until, 0);
  const ScheduleState read = schedule_state_from(to_text(filled()));
  EXPECT_EQ(read.evaluated_until, 1'800'000'000);
  EXPECT_EQ(read.known.at("nightly"), 1'700'000'000);
  EXPECT_TRUE(read.is_closed("nightly", "2026-11-22"));
  EXPECT_FALSE(read.is_closed("other", "2026-11-22"));
  ASSERT_TRUE(read.hold);
  EXPECT_EQ(read.hold->session, 7);
  EXPECT_EQ(read.hold->why, Why::kPastUnknown);
  EXPECT_EQ(read.released, "7/3/failed/no-contact: x");
  EXPECT_EQ(read.clock.boot, "first");
  EXPECT_EQ(read.clock.since_boot_s, 12.5);
  ASSERT_TRUE(read.clock_doubt);
  EXPECT_EQ(read.clock_doubt->why, Why::kClockStepped);
  EXPECT_EQ(read.clock_doubt->set_by_s, -90.0);
  ASSERT_EQ(read.decisions.size(), 1u);
  EXPECT_EQ(read.decisions[0].verb, Verb::kRefused);
  EXPECT_EQ(read.decisions[0].figure_s, 1.5);
  EXPECT_EQ(words(read.decisions[0]).find('\n'), std::string::npos);
}

TEST(TheSchedulesState, ThatIsDamagedIsRefusedWhereverItIsCut) {
  const std::string whole = to_text(filled());
  for (std::size_t cut = 1; cut < whole.size(); cut += 7)
    EXPECT_NE(refusal(whole.substr(0, cut)), "") << cut;
  for (const char* wrong : {"[]", "{}", R"({"format": "cellcal.schedule/2"})", "null"})
    EXPECT_NE(refusal(wrong), "") << wrong;
}

TEST(TheSchedulesState, KeepsEvidenceAsAPhraseAndReadsTheTextOfEarlierVersions) {
  ScheduleState state;
  const calib::Phrase evidence("say.schedule.by", {{"who", "A. Name"}});
  state.add({1, "nightly", "2026-11-22", Verb::kReleased, Why::kNothing, 0, evidence, 0.0});
  state.add({2, "nightly", "2026-11-22", Verb::kEnded, Why::kHarmful, 7, "no-contact: x", 0.0});
  const std::string text = to_text(state);
  const ScheduleState read = schedule_state_from(text);
  EXPECT_EQ(read.decisions, state.decisions);
  EXPECT_NE(text.find(R"("detail":"no-contact: x")"), std::string::npos) << text;
  std::string wrong = text;
  wrong.replace(wrong.find(R"("no-contact: x")"), 15, "[[3]]");
  EXPECT_EQ(refusal(wrong), "the schedule's row is malformed");
}

TEST(EveryDecision, HasWordsInGerman) {
  const calib::Language german = *calib::Language::of("de");
  for (const Verb verb : all_values<Verb>())
    for (const Why why : all_values<Why>())
      for (const std::int64_t session : {0, 12}) {
        const Decision one{1, "nightly", "2026-11-22", verb, why, session, "say.join.colon", 90.0};
        const std::string words = daemon::words(one, german);
        EXPECT_NE(words, daemon::words(one));
        EXPECT_EQ(words.find("say."), std::string::npos) << words;
        static const std::regex kEnglish("\\b(the|of|and|is|are|not|was|has|by|for)\\b");
        EXPECT_FALSE(std::regex_search(words, kEnglish)) << words;
      }
  const Decision step{1, "", "", Verb::kHeld, Why::kClockStepped, 0, {}, -90.0};
  EXPECT_EQ(words(step).find("on hold, no automatic start: this computer's clock was set by -90 s. "
                             "Check date and time"),
            0u);
  EXPECT_EQ(words({1, "", "", Verb::kHeld, Why::kAbortedBefore, 0, {}, 0.0}, german)
                .find("gesperrt, kein automatischer Start: 'abort' wurde gegeben. Zelle und Arm"),
            0u);
}

TEST(AMissedNight, CanComeAgainAndABegunOneCannot) {
  ScheduleState state = filled();
  state.reopen_missed("nightly", "2026-11-22");
  state.reopen_missed("nightly", "2026-11-23");
  EXPECT_TRUE(state.is_closed("nightly", "2026-11-22"));
  EXPECT_FALSE(state.is_closed("nightly", "2026-11-23"));
}

TEST(NamesOfDecisions, LeadBackToWhatTheyName) {
  for (int i = 0; i <= static_cast<int>(Verb::kReleased); ++i)
    EXPECT_EQ(verb_of(to_string(static_cast<Verb>(i))), static_cast<Verb>(i));
  for (int i = 0; i <= static_cast<int>(Why::kWindowOver); ++i)
    EXPECT_EQ(why_of(to_string(static_cast<Why>(i))), static_cast<Why>(i));
}

}  // namespace
}  // namespace cellcal::daemon
