// Fields of a log line in systemd's journal.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <thread>

#include "daemon/files/log.h"

namespace cellcal::daemon {
namespace {

bool has(const std::vector<std::string>& fields, const std::string& field) {
  return std::find(fields.begin(), fields.end(), field) != fields.end();
}

bool names(const std::vector<std::string>& fields, const std::string& name) {
  return std::any_of(fields.begin(), fields.end(),
                     [&](const std::string& field) { return field.starts_with(name + "="); });
}

TEST(ALineOfTheJournal, SaysWhichSessionTouchAndPhaseItBelongsTo) {
  LogContext context{7, 12, "slow search", "contact-lost", LogEvent::kTouch};
  const auto fields = journal_fields(spdlog::level::warn, "words", context);
  for (const char* field :
       {"PRIORITY=4", "MESSAGE=words", "SYSLOG_IDENTIFIER=cellcald", "CELLCAL_SESSION=7",
        "CELLCAL_TOUCH=12", "CELLCAL_PHASE=slow search", "CELLCAL_FAILURE=contact-lost",
        "MESSAGE_ID=c055b6ccc5774e2b952722b7bbe56434"})
    EXPECT_TRUE(has(fields, field)) << field;
}

TEST(ALineOfTheJournal, HasNoFieldThatNothingIsKnownOf) {
  const auto fields = journal_fields(spdlog::level::info, "words", {});
  EXPECT_EQ(fields.size(), 3u);
  for (const char* name : {"CELLCAL_SESSION", "CELLCAL_TOUCH", "CELLCAL_PHASE", "MESSAGE_ID"})
    EXPECT_FALSE(names(fields, name)) << name;
}

TEST(ALineOfTheJournal, CannotForgeAField) {
  const auto fields =
      journal_fields(spdlog::level::info, "a\nCELLCAL_SESSION=9", {.phase = "b\nX=1"});
  EXPECT_TRUE(has(fields, "MESSAGE=a CELLCAL_SESSION=9"));
  EXPECT_TRUE(has(fields, "CELLCAL_PHASE=b X=1"));
}

TEST(TheContextOfALine, IsTheDaemonsWhereTheThreadKnowsNoBetter) {
  set_log_context({3, 5, "transit", "", LogEvent::kNone});
  {
    const LogScope touch({.session = 3, .touch = 4, .event = LogEvent::kTouch});
    EXPECT_EQ(log_context().touch, 4);
    EXPECT_EQ(log_context().phase, "transit");
    EXPECT_EQ(log_context().event, LogEvent::kTouch);
    std::thread([] { EXPECT_EQ(log_context().touch, 5); }).join();
  }
  EXPECT_EQ(log_context().touch, 5);
  EXPECT_EQ(log_context().event, LogEvent::kNone);
  {
    const LogScope other({.session = 4});  // nothing of session 3 applies
    EXPECT_EQ(log_context().session, 4);
    EXPECT_FALSE(log_context().touch);
    EXPECT_TRUE(log_context().phase.empty());
  }
  set_log_context({});
}

TEST(StandardError, IsTheJournalOnlyWhereItIsTheStreamThatIsNamed) {
  ::setenv("JOURNAL_STREAM", "8:1", 1);
  EXPECT_FALSE(stderr_is_journal());
  ::setenv("JOURNAL_STREAM", "words", 1);
  EXPECT_FALSE(stderr_is_journal());
  ::unsetenv("JOURNAL_STREAM");
  EXPECT_FALSE(stderr_is_journal());
}

}  // namespace
}  // namespace cellcal::daemon
