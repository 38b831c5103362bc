#include "daemon/schedule/schedule_state.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon {
namespace {

ScheduleState filled() {
  ScheduleState state;
  state.looked = 1'800'000'000;
  state.known = {{"nightly", 1'700'000'000}};
  state.close("nightly", "2026-11-22", false);
  state.close("nightly", "2026-11-23", true);
  state.aborted = 7;
  state.released = "7/3/failed/no-contact: x";
  state.add({1'800'000'000, "nightly", "2026-11-22", Verb::kRefused, Why::kCannotBegin, 8,
             "\xff \"odd\"\n", 1.5});
  return state;
}

std::string refusal(const std::filesystem::path& file) {
  try {
    load_schedule_state(file);
    return "";
  } catch (const std::exception& error) {
    return error.what();
  }
}

TEST(the_schedules_file, holds_all_of_it_and_is_new_where_there_is_none) {
  const testing::TemporaryDirectory dir;
  EXPECT_EQ(load_schedule_state(dir / "s.json").looked, 0);
  save(filled(), dir / "s.json");
  const ScheduleState read = load_schedule_state(dir / "s.json");
  EXPECT_EQ(read.looked, 1'800'000'000);
  EXPECT_EQ(read.known.at("nightly"), 1'700'000'000);
  EXPECT_TRUE(read.is_closed("nightly", "2026-11-22"));
  EXPECT_FALSE(read.is_closed("other", "2026-11-22"));
  EXPECT_EQ(read.aborted, 7);
  EXPECT_EQ(read.released, "7/3/failed/no-contact: x");
  ASSERT_EQ(read.decisions.size(), 1u);
  EXPECT_EQ(read.decisions[0].verb, Verb::kRefused);
  EXPECT_EQ(read.decisions[0].figure_s, 1.5);
  EXPECT_EQ(words(read.decisions[0]).find('\n'), std::string::npos);
}

TEST(the_schedules_file, that_is_damaged_is_refused_by_name_wherever_it_is_cut) {
  const testing::TemporaryDirectory dir;
  save(filled(), dir / "s.json");
  std::ifstream in(dir / "s.json");
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  for (std::size_t cut = 0; cut + 2 < whole.size(); cut += 7) {
    std::ofstream(dir / "s.json") << whole.substr(0, cut);
    EXPECT_NE(refusal(dir / "s.json").find("s.json: damaged"), std::string::npos) << cut;
  }
  for (const char* wrong : {"[]", "{}", R"({"format": "cellcal.schedule/2"})", "null"}) {
    std::ofstream(dir / "s.json") << wrong;
    EXPECT_NE(refusal(dir / "s.json").find("damaged"), std::string::npos) << wrong;
  }
}

TEST(a_missed_night, can_come_again_and_a_begun_one_cannot) {
  ScheduleState state = filled();
  state.reopen_missed("nightly", "2026-11-22");
  state.reopen_missed("nightly", "2026-11-23");
  EXPECT_TRUE(state.is_closed("nightly", "2026-11-22"));
  EXPECT_FALSE(state.is_closed("nightly", "2026-11-23"));
}

TEST(names_of_decisions, lead_back_to_what_they_name) {
  for (int i = 0; i <= static_cast<int>(Verb::kClock); ++i)
    EXPECT_EQ(verb_of(to_string(static_cast<Verb>(i))), static_cast<Verb>(i));
  for (int i = 0; i <= static_cast<int>(Why::kWindowOver); ++i)
    EXPECT_EQ(why_of(to_string(static_cast<Why>(i))), static_cast<Why>(i));
}

}  // namespace
}  // namespace cellcal::daemon
