// The two small types over SQLite, and requirements on a journal's file system and pages.

#include "daemon/journal/store/sqlite.h"

#include <gtest/gtest.h>

#include <cstring>

#include "daemon/journal/prepare.h"
#include "images.h"
#include "temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

/// One column as in a digest: type, length, bytes.
template <class Value>
std::string column(char type, const Value& value) {
  std::string bytes(1, type);
  const std::uint64_t length = sizeof value;
  bytes.append(reinterpret_cast<const char*>(&length), sizeof length);
  return bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}
std::string column(char type, const std::string& value) {
  const std::uint64_t length = value.size();
  std::string bytes(1, type);
  return bytes.append(reinterpret_cast<const char*>(&length), sizeof length) + value;
}

struct ARowAsBytes : ::testing::Test {
  std::string of(const std::string& columns) {
    Statement row(database, ("SELECT " + columns).c_str());
    EXPECT_TRUE(row.step());
    return bytes_of(row.values());
  }
  TemporaryDirectory dir;
  Database database{dir / "j.db"};
};

TEST_F(ARowAsBytes, HasTypeLengthAndValueOfEveryColumnAsJournalsOnDiskHaveThem) {
  EXPECT_EQ(of("7, 2.5, 'ab', x'6162', 'c', '', NULL"),
            column('i', std::int64_t{7}) + column('f', 2.5) + column('t', std::string("ab")) +
                column('b', std::string("ab")) + column('t', std::string("c")) +
                column('t', std::string()) + column('n', std::string()));
}

TEST_F(ARowAsBytes, DiffersWhereTheRowDoes) {
  EXPECT_NE(of("'1'"), of("1"));
  EXPECT_NE(of("1.0"), of("1"));
  EXPECT_NE(of("x'61'"), of("'a'"));
  EXPECT_NE(of("'ab', 'c'"), of("'a', 'bc'"));
  EXPECT_NE(of("0.0"), of("-0.0"));
  EXPECT_NE(of("NULL"), of("x''"));
}

TEST(ADatabase, GivesNoughtAndNothingWhereThereIsNoRow) {
  const TemporaryDirectory dir;
  Database database(dir / "j.db");
  EXPECT_EQ(database.integer("SELECT 5 WHERE 0"), 0);
  EXPECT_EQ(database.text("SELECT 'a' WHERE 0"), "");
}

TEST(ADatabase, ThatCannotBeOpenedSaysWhichWhyAndWhatToDo) {
  EXPECT_EQ(error_of([] { Database database("/nonexistent/dir/j.db"); }),
            "journal /nonexistent/dir/j.db: unable to open database file; check that the directory "
            "exists and that the daemon may write there: the service writes to /var/lib/cellcal "
            "alone");
}

TEST(AJournal, WhereThereCanBeNoLogIsRefusedAndNothingIsMade) {
  const TemporaryDirectory dir;
  Database database(":memory:");  // without a log, like a network's file system
  HeadFile head(dir / "head", ":memory:");
  Chain chain(database, head);
  const std::string words = error_of([&] { prepare(database, head, chain); });
  EXPECT_EQ(words,
            "journal :memory:: no write-ahead log on this file system (memory). Put the state "
            "directory on a local disk");
  EXPECT_EQ(database.integer("SELECT count(*) FROM sqlite_schema"), 0);
}

TEST(AJournal, WhosePagesContradictItsTablesIsRefusedAndLeftAsItIs) {
  const TemporaryDirectory dir;
  const auto path = dir / "j.db";
  { fill(*std::make_unique<Journal>(path), 1); }
  Database(path).execute(
      "PRAGMA writable_schema = ON; UPDATE sqlite_schema SET sql = replace(sql, 'words TEXT', "
      "'words INTEGER') WHERE name = 'event'");
  const std::string words = error_of([&] { const Journal journal(path); });
  EXPECT_TRUE(words.starts_with("journal " + path.string() + ": damaged (")) << words;
  EXPECT_NE(words.find("event"), std::string::npos) << words;
  EXPECT_NE(words.find("). Move it aside with its -wal and .head files"), std::string::npos)
      << words;
}

}  // namespace
}  // namespace cellcal::daemon::testing
