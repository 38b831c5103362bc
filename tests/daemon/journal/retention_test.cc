// Raw rows of old sessions are dropped, and everything else remains proven.

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/journal/journal.h"
#include "daemon/journal/store/sqlite.h"
#include "images.h"
#include "temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

struct Retention : ::testing::Test {
  /// A session that ended on this day.
  std::int64_t session(Journal& journal, const std::string& day, std::size_t touches = 3) {
    const std::int64_t id = fill(journal, touches);
    RecordContact contact;
    journal.note(id, contact);
    journal.note(id, RecordChange{});
    journal.store_calibration(id, "{\"of\": " + std::to_string(id) + "}");
    journal.record(id, RecordEnd{Ending::kDone, ""}, day + "T12:00:00.000Z");
    return id;
  }
  static std::vector<std::int64_t> numbers(const std::vector<DroppedRows>& dropped) {
    std::vector<std::int64_t> all;
    for (const DroppedRows& one : dropped) all.push_back(one.session);
    return all;
  }
  TemporaryDirectory dir;
  const RetentionLimits before_march{"2026-03-01T00:00:00.000Z", {}};
};

TEST_F(Retention, DropsRawRowsOfOldSessionsAndKeepsTouchesAndResultsThroughARestart) {
  std::string rows;
  {
    Journal journal(dir / "j.db");
    for (const char* day : {"2026-01-01", "2026-02-01", "2026-03-01", "2026-04-01"})
      session(journal, day);
    const auto gone = journal.retain(before_march, "2026-05-01T00:00:00.000Z", false);
    EXPECT_EQ(numbers(gone), (std::vector<std::int64_t>{1, 2}));
    EXPECT_EQ(gone[0].rows, 3 + 6 + 1 + 1) << "events, readings, a contact, a change";
  }
  Journal journal(dir / "j.db");
  EXPECT_TRUE(journal.remarks().empty());
  for (const std::int64_t id : {1, 2}) {
    EXPECT_EQ(journal.touches(id).size(), 3u);
    EXPECT_EQ(journal.session(id)->calibration, "{\"of\": " + std::to_string(id) + "}");
    EXPECT_EQ(journal.session(id)->dropped, "2026-05-01T00:00:00.000Z");
    EXPECT_TRUE(journal.events(id).empty());
    EXPECT_TRUE(journal.readings(id).empty());
  }
  EXPECT_EQ(journal.readings(3).size(), 6u);
  EXPECT_EQ(journal.session(3)->dropped, "");
  EXPECT_TRUE(journal.retain(before_march, "t", false).empty()) << "once";
}

TEST_F(Retention, TakesNoSessionForOlderThanTheOneBeforeIt) {
  Journal journal(dir / "j.db");
  for (const char* day : {"2026-01-01", "2026-04-01", "1970-01-01", "2026-04-02"})
    session(journal, day);
  EXPECT_EQ(numbers(journal.retain(before_march, "t", false)), std::vector<std::int64_t>{1})
      << "the clock was behind in the third";
}

TEST_F(Retention, SaysBeforehandWhatItWouldDropAndDropsNothing) {
  Journal journal(dir / "j.db");
  for (const char* day : {"2026-01-01", "2026-02-01", "2026-03-01"}) session(journal, day);
  const auto foreseen = journal.retain(before_march, "t", true);
  EXPECT_EQ(journal.readings(1).size(), 6u);
  EXPECT_EQ(journal.session(1)->dropped, "");
  EXPECT_EQ(numbers(journal.retain(before_march, "t", false)), numbers(foreseen));
}

TEST_F(Retention, KeepsTheNewestSessionTheRunningOneAndEverythingWhereNoLimitIsSet) {
  Journal journal(dir / "j.db");
  session(journal, "2026-01-01");
  EXPECT_TRUE(journal.retain(before_march, "t", false).empty()) << "the newest";
  fill(journal, 2);  // running
  EXPECT_TRUE(journal.retain({}, "t", false).empty());
  EXPECT_EQ(numbers(journal.retain(before_march, "t", false)), std::vector<std::int64_t>{1});
}

TEST_F(Retention, DropsTheOldestUntilTheJournalUsesNoMore) {
  Journal journal(dir / "j.db");
  for (int i = 0; i < 6; ++i) session(journal, "2026-01-0" + std::to_string(i + 1), 40);
  const std::int64_t used = journal.bytes_in_use();
  RetentionLimits limits;
  limits.bytes = used;
  EXPECT_TRUE(journal.retain(limits, "t", true).empty());
  limits.bytes = used - 1;
  EXPECT_EQ(numbers(journal.retain(limits, "t", true)), std::vector<std::int64_t>{1});
  limits.bytes = 0;
  EXPECT_EQ(numbers(journal.retain(limits, "t", false)),
            (std::vector<std::int64_t>{1, 2, 3, 4, 5}));
  EXPECT_LT(journal.bytes_in_use(), used);
}

TEST_F(Retention, StopsBetweenTwoSessionsWhereItIsToldTo) {
  Journal journal(dir / "j.db");
  for (const char* day : {"2026-01-01", "2026-02-01", "2026-04-01"}) session(journal, day);
  int asked = 0;
  EXPECT_EQ(numbers(journal.retain(before_march, "t", false, [&] { return ++asked < 2; })),
            std::vector<std::int64_t>{1});
}

TEST_F(Retention, DoesNotHideARowThatWasChangedTakenOutOrPutIn) {
  {
    Journal journal(dir / "j.db");
    for (const char* day : {"2026-01-01", "2026-01-02", "2026-01-03", "2026-04-01"})
      session(journal, day);
    journal.retain({"2026-01-02T00:00:00.000Z", {}}, "t", false);
  }
  {
    Database database(dir / "j.db");
    database.execute("INSERT INTO event (session, time, words) VALUES (1, 't', 'forged')");
    database.execute("DELETE FROM reading WHERE session=2");
    database.execute("UPDATE touch SET target='S9' WHERE session=3");
  }
  Journal journal(dir / "j.db");
  for (const std::int64_t id : {1, 2, 3}) EXPECT_THROW(journal.touches(id), JournalError) << id;
  EXPECT_EQ(journal.touches(4).size(), 3u);
  EXPECT_TRUE(journal.retain(before_march, "t", false).empty()) << "evidence of damage is kept";
}

TEST_F(Retention, IsNoWayToTakeOutTheRowThatSaysSo) {
  {
    Journal journal(dir / "j.db");
    for (const char* day : {"2026-01-01", "2026-04-01"}) session(journal, day);
    journal.retain(before_march, "t", false);
  }
  Database(dir / "j.db").execute("DELETE FROM dropped");
  Journal journal(dir / "j.db");
  EXPECT_THROW(journal.session(1), JournalError);
}

TEST_F(Retention, LeavesSessionsThatCanBeExportedAndImported) {
  Journal journal(dir / "j.db");
  for (const char* day : {"2026-01-01", "2026-04-01"}) session(journal, day);
  journal.retain(before_march, "t", false);
  const std::string rows = journal.rows(1);
  Journal other(dir / "other.db");
  const auto [id, is_new] = other.import(rows, "rows");
  EXPECT_TRUE(is_new);
  EXPECT_EQ(other.touches(id), journal.touches(1));
  EXPECT_EQ(other.session(id)->dropped, "t");
  EXPECT_TRUE(other.readings(id).empty());
  EXPECT_FALSE(other.import(other.rows(id), "again").second) << "its own";
}

/// The export without the values of the first row of this table.
std::string without_a_row(const std::string& rows, const std::string& table) {
  std::string all, line;
  bool left_out = false;
  for (std::istringstream lines(rows); std::getline(lines, line);) {
    auto json = nlohmann::json::parse(line);
    if (!left_out && json.value("table", "") == table && !json["columns"].is_null()) {
      json["columns"] = nullptr;
      left_out = true;
    }
    all += json.dump() + "\n";
  }
  EXPECT_TRUE(left_out) << table;
  return all;
}

TEST_F(Retention, DoesNotLetOtherRowsBeLeftOutOfAnExport) {
  Journal journal(dir / "j.db");
  for (const char* day : {"2026-01-01", "2026-04-01"}) session(journal, day);
  journal.retain(before_march, "t", false);
  Journal other(dir / "other.db");
  EXPECT_THROW(other.import(without_a_row(journal.rows(1), "touch"), "rows"), JournalError);
  EXPECT_THROW(other.import(without_a_row(journal.rows(1), "dropped"), "rows"), JournalError);
  EXPECT_THROW(other.import(without_a_row(journal.rows(2), "reading"), "rows"), JournalError);
}

}  // namespace
}  // namespace cellcal::daemon::testing
