#include "daemon/fleet/store/store.h"

#include <gtest/gtest.h>

#include <thread>

#include "tests/daemon/fleet/facts.h"

namespace cellcal::daemon::fleet {
namespace {

using testing::ask;
using testing::Database;

const plant::CellName kWeld{"graz", "weld-3"}, kPaint{"graz", "paint-1"};

TEST(Store, CollectorsThatStartAtOnceMigrateOnce) {
  const std::string database = Database::shared().create();
  std::vector<std::thread> all;
  std::atomic<int> opened{0};
  for (int i = 0; i < 4; ++i)
    all.emplace_back([&] {
      const Store store({database});
      ++opened;
    });
  for (std::thread& one : all) one.join();
  EXPECT_EQ(opened, 4);
  EXPECT_EQ(ask(database, "SELECT version FROM fleet.versions ORDER BY 1"), "1\n2");
}

TEST(Store, VersionOneIsBroughtUpWithItsRows) {
  const std::string database = Database::shared().create();
  migrate(database, 1);
  ask(database, "INSERT INTO fleet.cells (plant, cell) VALUES ('graz', 'old')");
  const Store store({database});
  EXPECT_EQ(ask(database, "SELECT max(version) FROM fleet.versions"),
            std::to_string(newest_version()));
  EXPECT_EQ(ask(database, "SELECT cell FROM fleet.cell_states"), "old");
}

TEST(Store, ANewerDatabaseIsRefused) {
  const std::string database = Database::shared().create();
  { const Store store({database}); }
  ask(database, "INSERT INTO fleet.versions (version) VALUES (999)");
  EXPECT_THROW(Store({database}), StoreTooNew);
}

TEST(Store, WhatComesTwiceIsThereOnce) {
  const std::string database = Database::shared().create();
  Store store({database});
  Batch batch;
  std::int64_t number = 0;
  for (const plant::FactBody& body : testing::one_of_each())
    batch.facts.push_back(testing::fact(kWeld, ++number, body));
  batch.facts.push_back(batch.facts.front());
  const Written first = store.write(batch), second = store.write(batch);
  EXPECT_EQ(first.facts, 11u);
  EXPECT_EQ(first.twice, 1u);
  EXPECT_EQ(second.facts, 0u);
  EXPECT_EQ(second.twice, 12u);
  EXPECT_EQ(testing::count_of_each(database), "1|1|1|1|1|1|1|1|1|1|1");
}

TEST(Store, AnotherCellsJournalOfTheSameNameIsItsOwn) {
  const std::string database = Database::shared().create();
  Store store({database});
  Batch batch;
  batch.facts = {testing::alarm(kPaint, 1), testing::alarm(kWeld, 1)};
  EXPECT_EQ(store.write(batch).facts, 2u);
}

TEST(Store, MissingNumbersAreGapsUntilTheyCome) {
  const std::string database = Database::shared().create();
  Store store({database});
  const auto gaps = [&] { return ask(database, "SELECT first, last FROM fleet.gaps ORDER BY 1"); };
  Batch batch;
  for (const int number : {2, 7, 3, 10}) batch.facts.push_back(testing::alarm(kWeld, number));
  store.write(batch);
  EXPECT_EQ(gaps(), "1|1\n4|6\n8|9");
  batch.facts = {testing::alarm(kWeld, 5), testing::fact(kWeld, 11, plant::DroppedFact{8, 9, 2})};
  store.write(batch);
  EXPECT_EQ(gaps(), "1|1\n4|4\n6|6");
}

TEST(Store, AGapIsSettledWhenNewerNumbersAreThereForAWhile) {
  const std::string database = Database::shared().create();
  Store store({database});
  Batch batch;
  batch.facts = {testing::alarm(kWeld, 1), testing::alarm(kWeld, 3)};
  store.write(batch);
  const auto later = [&] {
    ask(database, "UPDATE fleet.journals SET marked = marked - interval '1 hour'");
    store.maintain();
    return ask(database, "SELECT settled FROM fleet.gaps");
  };
  EXPECT_EQ(later(), "f");  // may still come
  EXPECT_EQ(later(), "t");
  EXPECT_EQ(ask(database, "SELECT detail FROM fleet.attention WHERE what = 'gap'"), "1");
}

TEST(Store, PresenceAdvancesByNumberNotByArrival) {
  const std::string database = Database::shared().create();
  Store store({database});
  const auto say = [&](std::int64_t number, bool online, const char* time) {
    Batch batch;
    batch.presences = {{kWeld, online, false, "j1", number, "1.9.0", time, false}};
    store.write(batch);
    return ask(database, "SELECT online, number FROM fleet.presence");
  };
  EXPECT_EQ(say(5, true, "2026-11-22T20:00:00Z"), "t|5");
  EXPECT_EQ(say(5, false, "2026-11-22T20:00:00Z"), "f|5");  // its will
  EXPECT_EQ(say(5, true, "2026-11-22T20:00:00Z"), "f|5");   // its birth, late
  EXPECT_EQ(say(9, true, "2026-11-22T19:00:00Z"), "t|9");   // the clock was set back
  EXPECT_EQ(say(5, false, "2026-11-22T20:00:00Z"), "t|9");  // the will once more
}

TEST(Store, DocumentsComeBackByteForByte) {
  const std::string database = Database::shared().create();
  Store store({database});
  Batch batch;
  batch.facts = {testing::fact(kWeld, 1, testing::one_of_each()[1])};
  store.write(batch);
  EXPECT_EQ(ask(database, "SELECT convert_from(document, 'UTF8') FROM fleet.calibrations"),
            testing::a_calibration());
  EXPECT_EQ(
      ask(database, "SELECT sha256 = encode(sha256(document), 'hex') FROM fleet.calibrations"),
      "t");
  EXPECT_EQ(ask(database, "SELECT DISTINCT joint FROM fleet.joint_corrections ORDER BY 1"),
            "A1\nA2\nA3");
}

TEST(Store, ADocumentThatNobodyCanReadIsStoredAllTheSame) {
  const std::string database = Database::shared().create();
  Store store({database});
  plant::CalibrationFact odd{"KR 5", "", true, false, {},
                             {},     {}, {},   {},    std::string("no JSON \0\xff", 10)};
  Batch batch;
  batch.facts = {testing::fact(kWeld, 1, odd)};
  EXPECT_EQ(store.write(batch).facts, 1u);
  EXPECT_EQ(ask(database, "SELECT octet_length(document) FROM fleet.calibrations"), "10");
}

TEST(Store, WhatTheDatabaseRefusesIsQuarantinedAndTheRestIsWritten) {
  const std::string database = Database::shared().create();
  Store store({database});
  Batch batch;
  plant::Fact bad = testing::alarm(kWeld, 1);
  bad.time = "no time";  // judge() lets none through
  batch.facts = {bad, testing::alarm(kWeld, 2), testing::alarm(kPaint, 1)};
  const Written written = store.write(batch);
  EXPECT_EQ(written.facts, 2u);
  EXPECT_EQ(written.refused, 1u);
  EXPECT_EQ(ask(database, "SELECT cell, why FROM fleet.quarantine"), "weld-3|database");
}

TEST(Store, QuarantineIsBoundedAndCountsAll) {
  const std::string database = Database::shared().create();
  Store store({database});
  Batch batch;
  for (int i = 0; i < 150; ++i)
    batch.refused.push_back({kWeld, "cellcal/graz/weld-3/fact/x\xff", std::string(100'000, 'x'),
                             Refusal::kMessage, "bad"});
  batch.refused.push_back({kPaint, "t", "p", Refusal::kSize, "large"});
  store.write(batch);
  EXPECT_EQ(
      ask(database,
          "SELECT cell, count(*), max(octet_length(payload)), max(bytes) FROM fleet.quarantine GROUP BY 1 "
          "ORDER BY 1"),
      "paint-1|1|1|1\nweld-3|100|65536|100000");
  EXPECT_EQ(ask(database, "SELECT count FROM fleet.refusals ORDER BY 1"), "1\n150");
}

TEST(Store, ACellWithTooManyJournalsOrScatteredNumbersIsRefused) {
  const std::string database = Database::shared().create();
  Store store({database});
  Batch batch;
  for (int i = 0; i < 101; ++i) {
    batch.facts = {testing::alarm(kWeld, 1)};
    batch.facts[0].journal = "j" + std::to_string(i);
    store.write(batch);
  }
  EXPECT_EQ(ask(database, "SELECT count(*) FROM fleet.journals"), "100");
  batch.facts.clear();
  for (int i = 0; i < 5000; ++i) batch.facts.push_back(testing::alarm(kPaint, 10 + 2 * i));
  store.write(batch);
  batch.facts = {testing::alarm(kPaint, 1), testing::alarm(kPaint, 11)};
  EXPECT_EQ(store.write(batch).refused, 1u);
  EXPECT_EQ(ask(database, "SELECT cell, why, count FROM fleet.refusals ORDER BY 1"),
            "paint-1|bound|1\nweld-3|bound|1");
}

TEST(Store, MadeUpCellsDoNotFillTheDatabase) {
  const std::string database = Database::shared().create();
  Store store({database});
  Batch batch;
  batch.facts = {testing::alarm(kWeld, 1)};
  store.write(batch);
  ask(database,
      "INSERT INTO fleet.cells (plant, cell) SELECT 'made-up', i::text FROM generate_series(1, 19999) i");
  batch.facts = {testing::alarm(kWeld, 2), testing::alarm(kPaint, 1)};
  batch.presences = {{kPaint, true, false, "j1", 1, "1.9.0", "2026-11-22T20:00:00Z", false}};
  const Written written = store.write(batch);
  EXPECT_EQ(written.facts, 1u);
  EXPECT_EQ(written.refused, 2u);
  EXPECT_EQ(ask(database, "SELECT cell, why, count FROM fleet.refusals"), "paint-1|bound|2");
}

TEST(Store, RetentionDropsTelemetryAlone) {
  const std::string database = Database::shared().create();
  Store store({database, 2});
  Batch batch;
  std::int64_t number = 0;
  for (const plant::FactBody& body : testing::one_of_each())
    batch.facts.push_back(testing::fact(kWeld, ++number, body));
  store.write(batch);
  for (const char* table : {"phases", "touches", "health"}) {
    const std::string of = table;
    ask(database, "CREATE TABLE fleet." + of + "_2020_01 PARTITION OF fleet." + of +
                      " FOR VALUES FROM ('2020-01-01') TO ('2020-02-01');"
                      "CREATE TABLE fleet.old AS SELECT * FROM fleet." +
                      of +
                      "; UPDATE fleet.old SET received = '2020-01-07';"
                      "INSERT INTO fleet." +
                      of + " SELECT * FROM fleet.old; DROP TABLE fleet.old");
  }
  for (const char* table : {"alarms", "calibrations"})
    ask(database,
        "UPDATE fleet." + std::string(table) + " SET received = '2020-01-07', at = '2020-01-07'");
  EXPECT_EQ(testing::count_of_each(database), "1|1|1|1|1|1|1|2|2|2|1");
  store.maintain();
  EXPECT_EQ(testing::count_of_each(database), "1|1|1|1|1|1|1|1|1|1|1");
  EXPECT_EQ(ask(database, "SELECT count(*) FROM pg_tables WHERE tablename ~ '^health_'"),
            "3");  // this month and two ahead
}

TEST(Store, WithoutAServerItSaysSo) {
  EXPECT_THROW(Store({"host=/nowhere/at/all dbname=cellcal"}), StoreAway);
}

}  // namespace
}  // namespace cellcal::daemon::fleet
