// Rows of a session exported from one journal and imported into another.

#include <gtest/gtest.h>

#include "daemon/journal/chain.h"
#include "daemon/journal/rows.h"
#include "images.h"
#include "temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

struct TheRowsOfASession : ::testing::Test {
  TheRowsOfASession() {
    Journal journal(dir / "a.db");
    fill(journal, 1);
    id = fill(journal, 3);
    RecordContact contact;
    contact.contact.sense_v = HUGE_VAL;  // not a JSON number
    journal.note(id, contact);
    journal.note(id, "t", std::string("not UTF-8: \xff\0 and a nought", 27));
    journal.record(id, RecordEnd{Ending::kFailed, "why"}, "t9");
    lines = journal.rows(id);
    events = journal.events(id);
    name = journal.name();
  }

  std::string refusal_of(const std::string& altered) {
    Journal other(dir / "b.db");
    try {
      other.import(altered, "rows.jsonl");
    } catch (const JournalError& error) {
      if (!other.sessions().empty()) throw;
      return error.what();
    }
    return "";
  }
  std::string replaced(const std::string& what, const std::string& by) const {
    const auto at = lines.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    return std::string(lines).replace(at, what.size(), by);
  }

  TemporaryDirectory dir;
  std::int64_t id = 0;
  std::string lines, name;
  std::vector<std::string> events;
};

TEST_F(TheRowsOfASession, ComeIntoAnotherJournalBitForBitAndAreMarked) {
  Journal other(dir / "b.db");
  fill(other, 2);
  const auto [there, is_new] = other.import(lines, "rows.jsonl");
  EXPECT_TRUE(is_new);
  EXPECT_EQ(there, 2);
  Journal first(dir / "a.db");
  EXPECT_EQ(other.touches(there), first.touches(id));
  EXPECT_EQ(other.events(there), events);
  EXPECT_EQ(other.readings(there).size(), 6u);
  const SessionRecord record = *other.session(there);
  EXPECT_EQ(record.state, RecordState::kFailed);
  EXPECT_EQ(record.failure, "why");
  ASSERT_TRUE(record.origin);
  EXPECT_EQ(record.origin->journal, name);
  EXPECT_EQ(record.origin->session, id);
  EXPECT_FALSE(record.resumable());
}

TEST_F(TheRowsOfASession, OfAVersionWithoutTheNewestColumnsComeIn) {
  std::string earlier = lines;
  for (const std::string column : {",\"positioner_rad\":null", ",\"load\":null"}) {
    const std::string before = earlier;
    for (auto at = earlier.find(column); at != std::string::npos; at = earlier.find(column))
      earlier.erase(at, column.size());
    ASSERT_NE(earlier, before);
  }
  Journal other(dir / "b.db");
  const auto there = other.import(earlier, "rows.jsonl").first;
  EXPECT_EQ(other.touches(there), Journal(dir / "a.db").touches(id));
}

TEST_F(TheRowsOfASession, ComeInOnce) {
  Journal other(dir / "b.db");
  EXPECT_TRUE(other.import(lines, "x").second);
  const auto again = other.import(lines, "y");
  EXPECT_EQ(again.first, 1);
  EXPECT_FALSE(again.second);
  EXPECT_EQ(other.sessions().size(), 1u);
  Journal own(dir / "a.db");
  EXPECT_EQ(own.import(lines, "z"), (std::pair{id, false})) << "its own";
}

TEST_F(TheRowsOfASession, ThatWereImportedHideNoSessionThatCanBeResumed) {
  Journal other(dir / "b.db");
  const std::int64_t own = fill(other, 1);
  other.record(own, RecordEnd{Ending::kAborted, ""}, "t9");
  other.import(lines, "x");
  ASSERT_TRUE(other.newest_resumable());
  EXPECT_EQ(other.newest_resumable()->id, own);
}

TEST_F(TheRowsOfASession, ThatStillRanAreThoseOfOneThatWasInterrupted) {
  Journal running(dir / "c.db");
  const std::int64_t there = fill(running, 1);
  const std::string its = running.rows(there);
  Journal other(dir / "b.db");
  EXPECT_EQ(other.session(other.import(its, "x").first)->state, RecordState::kInterrupted);
}

TEST_F(TheRowsOfASession, CanBeExportedAgainFromWhereTheyWereImported) {
  Journal second(dir / "b.db"), third(dir / "c.db");
  const std::string again = second.rows(second.import(lines, "x").first);
  third.import(again, "y");
  EXPECT_EQ(third.touches(1), second.touches(1));
  EXPECT_EQ(third.session(1)->origin->journal, second.name());
}

TEST_F(TheRowsOfASession, ThatWereAlteredAreRefusedWithTheirLine) {
  EXPECT_NE(refusal_of(replaced("\"target\":\"S1\"", "\"target\":\"S2\""))
                .find("its columns are not as they were written: damaged or altered"),
            std::string::npos);
  EXPECT_NE(refusal_of(replaced("\"table\":\"reading\"", "\"table\":\"touch\""))
                .find("its checksum is not that of its content"),
            std::string::npos);
  const auto line = [&](int number) {
    std::size_t begin = 0;
    for (int i = 1; i < number; ++i) begin = lines.find('\n', begin) + 1;
    return lines.substr(begin, lines.find('\n', begin) + 1 - begin);
  };
  EXPECT_NE(refusal_of(replaced(line(6), "")).find("rows.jsonl:"), std::string::npos);
  EXPECT_NE(refusal_of(replaced(line(6), line(7) + line(6))).find("rows.jsonl:7: it"),
            std::string::npos);
  EXPECT_NE(refusal_of(replaced(line(6), line(6) + line(6))).find("out of order"),
            std::string::npos);
}

/// Without one entry; from there on sums and counts are recomputed as by chain.h.
std::string without(const std::string& lines, const std::string& table, std::size_t nth) {
  SessionRows rows = parse_lines(lines, "x");
  std::size_t met = 0;
  std::erase_if(rows.entries,
                [&](const RowEntry& entry) { return entry.table == table && met++ == nth; });
  for (std::size_t i = 1; i < rows.entries.size(); ++i) {
    RowEntry& entry = rows.entries[i];
    const RowEntry& before = rows.entries[i - 1];
    if (entry.before == before.sum) continue;
    entry.number = before.number + 1;
    entry.before = before.sum;
    entry.sum =
        sum_of(entry.before, entry.number, rows.session, entry.table, entry.row, entry.digest);
  }
  return to_lines(rows);
}

TEST_F(TheRowsOfASession, OfWhichOneWasLeftOutAreRefusedThoughAllOthersAreWhole) {
  // A note: no other row refers to it, and its neighbours' sums are valid.
  const std::size_t at = lines.find("\"table\":\"event\"");
  const std::size_t begin = lines.rfind('\n', at) + 1, end = lines.find('\n', at) + 1;
  std::string fewer = std::string(lines).erase(begin, end - begin);
  const std::size_t count = parse_lines(lines, "x").entries.size();
  const std::string counted = "\"entries\":" + std::to_string(count);
  fewer.replace(fewer.find(counted), counted.size(), "\"entries\":" + std::to_string(count - 1));
  EXPECT_NE(refusal_of(fewer).find("rows.jsonl:1: the entries are not those that it counts"),
            std::string::npos)
      << refusal_of(fewer);
}

TEST_F(TheRowsOfASession, OfWhichATouchWasLeftOutAreRefusedWhateverTheirSums) {
  for (const std::size_t nth : {0, 1})
    EXPECT_NE(refusal_of(without(lines, "touch", nth))
                  .find("touch " + std::to_string(nth) + " is missing"),
              std::string::npos);
  // The last one leaves no gap: the export states the number.
  Journal other(dir / "b.db");
  EXPECT_THROW(other.import(without(lines, "touch", 2), "rows.jsonl", 3), JournalError);
  EXPECT_TRUE(other.import(lines, "rows.jsonl", 3).second);
}

TEST_F(TheRowsOfASession, MadeAnewAreRefusedByTheJournalThatRecordedIt) {
  Journal own(dir / "a.db");
  for (const char* table : {"event", "reading"}) {
    std::string forged = without(lines, table, 0);
    const auto refused = [&] {
      try {
        own.import(forged, "rows.jsonl");
      } catch (const JournalError& error) {
        return std::string(error.what());
      }
      return std::string();
    };
    EXPECT_NE(refused().find("was recorded by this journal"), std::string::npos) << refused();
    forged.replace(forged.find(name), name.size(), std::string(name.size(), '0'));
    EXPECT_NE(refused().find("was recorded by this journal"), std::string::npos) << "renamed";
  }
  EXPECT_EQ(own.sessions().size(), 2u);
}

TEST_F(TheRowsOfASession, MadeAnewAreRefusedWhereAnEarlierExportWasImported) {
  Journal other(dir / "b.db");
  other.import(lines, "rows.jsonl");
  {
    Journal own(dir / "a.db");
    own.resume(id, "t10");
    own.note(id, "t11", "it goes on");
    own.record(id, RecordTouch{3, touch_at(9.0)});
    lines = own.rows(id);
  }
  EXPECT_THROW(other.import(without(lines, "event", 0), "rows.jsonl"), JournalError);
  EXPECT_TRUE(other.import(lines, "rows.jsonl").second) << "the same session, which went on";
}

TEST_F(TheRowsOfASession, OfAJournalThatWasLostComeIntoItsCopy) {
  copy_journal(dir / "a.db", dir / "copy.db");
  std::string since;
  {
    Journal lost(dir / "a.db");
    lost.begin({"c", "c", "r", "r", "{}"}, "of the lost one");
    since = lost.rows(3);
  }
  Journal copy(dir / "copy.db");
  copy.begin({"c", "c", "r", "r", "{}"}, "of the copy");
  EXPECT_TRUE(copy.import(since, "x").second) << "another session of the same number";
}

TEST_F(TheRowsOfASession, ThatWereCutShortAnywhereAreRefused) {
  for (std::size_t size = 0; size + 1 < lines.size(); size += 1 + lines.size() / 150)
    EXPECT_NE(refusal_of(lines.substr(0, size)), "") << size;
}

TEST_F(TheRowsOfASession, InWhichAByteIsAnotherAreRefusedOrTheSame) {
  // The journal's name in the first line is checked by the manifest (daemon/archive/archive.h).
  for (std::size_t at = lines.find('\n'); at < lines.size(); at += 1 + lines.size() / 150) {
    std::string altered = lines;
    altered[at] = altered[at] == '7' ? '8' : '7';
    EXPECT_NE(refusal_of(altered), "") << at << ": " << lines.substr(at, 40);
  }
}

TEST_F(TheRowsOfASession, ThatAreNoneAreRefused) {
  for (const std::string& hostile :
       {std::string(), std::string("\n"), std::string("{}"), std::string("[]\n[]"),
        std::string("{\"format\":\"cellcal.rows/2\",\"journal\":\"x\",\"session\":1,"
                    "\"entries\":0}"),
        std::string(100000, '['), std::string("\0\0", 2),
        lines.substr(0, lines.find('\n') + 1) + "{\"entry\":1e400}"})
    EXPECT_NE(refusal_of(hostile), "") << hostile.substr(0, 50);
}

TEST_F(TheRowsOfASession, OfForgedSumsNameNoTableAndColumnThatIsNotThere) {
  // Recomputed sums do not reveal a forgery; but its names must not get into a statement.
  SessionRows rows = parse_lines(lines, "x");
  for (RowEntry& entry : rows.entries) entry.names.clear(), entry.columns.clear();
  SessionRows forged{rows.journal, rows.session, {}};
  const auto with = [&](const std::string& table, const std::string& column) {
    RowEntry entry;
    entry.number = entry.row = 1;
    entry.table = table;
    entry.names = {column};
    entry.columns = {std::string("running")};
    // The digest and sum of this row, as computed by chain.h.
    entry.digest = digest_of({entry.row, entry.columns[0]});
    entry.sum = sum_of("", 1, forged.session, entry.table, entry.row, entry.digest);
    forged.entries = {entry};
    return to_lines(forged);
  };
  EXPECT_NE(refusal_of(with("session", "state) VALUES (1); DROP TABLE touch; --"))
                .find("are not those of this version"),
            std::string::npos);
  EXPECT_NE(refusal_of(with("sqlite_schema", "sql")).find("session's own row is missing"),
            std::string::npos);
  EXPECT_NE(refusal_of(with("session", "state")), "") << "a session without its inputs";
}

}  // namespace
}  // namespace cellcal::daemon::testing
