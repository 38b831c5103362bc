#include "daemon/fleet/store.h"

#include <gtest/gtest.h>

#include <chrono>
#include <pqxx/pqxx>
#include <thread>

#include "tests/daemon/fleet/facts.h"

namespace cellcal::daemon::fleet {
namespace {

using testing::ask;
using testing::Database;
using testing::kPaint;
using testing::kWeld;

TEST(Store, CollectorsThatStartAtOnceCreateTheTablesOnce) {
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
  EXPECT_EQ(ask(database, "SELECT version FROM fleet.versions"), "6");
}

TEST(Store, RefusesTablesOfAnotherVersion) {
  const std::string database = Database::shared().create();
  { const Store store({database}); }
  for (const char* version : {"999", "5"}) {
    ask(database, std::string("UPDATE fleet.versions SET version = ") + version);
    EXPECT_THROW(Store({database}), OtherVersion) << version;
  }
}

TEST(Store, WhatComesTwiceIsThereOnce) {
  const std::string database = Database::shared().emptied();
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

TEST(Store, ConfirmsTheNumbersOfTheBatchThoughThereAreMoreNewerRangesThanOneMessageNames) {
  const std::string database = Database::shared().emptied();
  Store store({database});
  const auto kMost = static_cast<std::int64_t>(plant::kMostStoredRanges);
  Batch scattered, old;
  for (std::int64_t i = 0; i < kMost; ++i)
    scattered.facts.push_back(testing::alarm(kWeld, 10 + 2 * i));
  EXPECT_EQ(store.write(scattered).stored.at(0).numbers.size(), plant::kMostStoredRanges);
  old.facts = {testing::alarm(kWeld, 1)};
  const auto numbers = store.write(old).stored.at(0).numbers;
  EXPECT_EQ(numbers.size(), plant::kMostStoredRanges);
  EXPECT_EQ(numbers.front(), (std::pair<std::int64_t, std::int64_t>{1, 1}));
  EXPECT_EQ(numbers.back().first, 10 + 2 * (kMost - 1)) << "and the newest";
}

TEST(Store, AnotherCellsJournalOfTheSameNameIsItsOwn) {
  const std::string database = Database::shared().emptied();
  Store store({database});
  Batch batch;
  batch.facts = {testing::alarm(kPaint, 1), testing::alarm(kWeld, 1)};
  EXPECT_EQ(store.write(batch).facts, 2u);
}

TEST(Store, MissingNumbersAreGapsUntilTheyCome) {
  const std::string database = Database::shared().emptied();
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
  const std::string database = Database::shared().emptied();
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
  const std::string database = Database::shared().emptied();
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
  EXPECT_EQ(say(5, false, "2026-11-22T20:00:00Z"), "t|9");  // the will again
}

TEST(Store, PresenceOfALaterConnectionReplacesTheEndOfTheOneBeforeUnderAClockThatIsBehind) {
  const std::string database = Database::shared().emptied();
  Store store({database});
  const auto say = [&](bool online, bool farewell, const char* time) {
    Batch batch;
    batch.presences = {{kWeld, online, farewell, "j1", 5, "1.9.0", time, false}};
    store.write(batch);
    return ask(database, "SELECT online, farewell FROM fleet.presence");
  };
  EXPECT_EQ(say(true, false, "2026-11-22T20:00:00Z"), "t|f");
  EXPECT_EQ(say(false, true, "2026-11-22T21:00:00Z"), "f|t");
  EXPECT_EQ(say(true, false, "2026-11-21T21:00:00Z"), "t|f") << "no fact since the farewell";
  EXPECT_EQ(say(false, false, "2026-11-21T21:00:00Z"), "f|f");
  EXPECT_EQ(say(true, false, "2026-11-20T21:00:00Z"), "t|f") << "no fact since the will";
  EXPECT_EQ(say(false, true, "2026-11-19T21:00:00Z"), "f|t") << "set back during the connection";
}

TEST(Store, DocumentsComeBackByteForByte) {
  const std::string database = Database::shared().emptied();
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
  const std::string database = Database::shared().emptied();
  Store store({database});
  plant::CalibrationFact odd{"KR 5", "", true, false, {},
                             {},     {}, {},   {},    std::string("no JSON \0\xff", 10)};
  Batch batch;
  batch.facts = {testing::fact(kWeld, 1, odd)};
  EXPECT_EQ(store.write(batch).facts, 1u);
  EXPECT_EQ(ask(database, "SELECT octet_length(document) FROM fleet.calibrations"), "10");
}

TEST(Store, WhatTheDatabaseRefusesIsQuarantinedAndTheRestIsWritten) {
  const std::string database = Database::shared().emptied();
  Store store({database});
  Batch batch;
  plant::Fact bad = testing::alarm(kWeld, 1);
  bad.time = "no time";  // not accepted by judge()
  batch.facts = {bad, testing::alarm(kWeld, 2), testing::alarm(kPaint, 1)};
  const Written written = store.write(batch);
  EXPECT_EQ(written.facts, 2u);
  EXPECT_EQ(written.refused, 1u);
  EXPECT_EQ(ask(database, "SELECT cell, why FROM fleet.quarantine"), "weld-3|database");
}

TEST(Store, QuarantineIsBoundedAndCountsAll) {
  const std::string database = Database::shared().emptied();
  Store store({database});
  Batch batch;
  for (int i = 0; i < 150; ++i)
    batch.refused.push_back({kWeld, "cellcal/graz/weld-3/fact/x\xff",
                             std::to_string(i) + std::string(70'000, 'x'), Refusal::kSize, "bad"});
  batch.refused.push_back({kPaint, "t", "p", Refusal::kSize, "large"});
  batch.too_many[kPaint] = 7'000'000;
  EXPECT_EQ(store.write(batch).refused, 7'000'151u);
  EXPECT_EQ(
      ask(database,
          "SELECT cell, count(*), max(octet_length(payload)), max(bytes) FROM fleet.quarantine GROUP BY 1 "
          "ORDER BY 1"),
      "paint-1|1|1|1\nweld-3|100|65536|70003");
  EXPECT_EQ(ask(database, "SELECT cell, why, count FROM fleet.refusals ORDER BY 1, 2"),
            "paint-1|size|1\npaint-1|rate|7000000\nweld-3|size|150");
}

TEST(Store, WhatAnotherVersionMayTakeIsKeptWholeAndABoundedNumberOfBytesOfIt) {
  const std::string database = Database::shared().emptied();
  Store store({database});
  ask(database,
      "INSERT INTO fleet.quarantine (plant, cell, topic, why, words, payload, bytes) SELECT 'graz', "
      "'weld-3', letter, 'message', '', convert_to(repeat(letter, 6 << 20), 'UTF8'), 6 << 20 "
      "FROM unnest(ARRAY['a', 'b', 'c']) AS letter");
  Batch batch;
  batch.refused.push_back(
      {kWeld, "d", std::string(100'000, 'd'), Refusal::kMessage, "unknown kind"});
  store.write(batch);
  EXPECT_EQ(ask(database,
                "SELECT topic, octet_length(payload) = bytes FROM fleet.quarantine ORDER BY id"),
            "b|t\nc|t\nd|t");
}

TEST(Store, AMessageThatNobodyTakesAndThatComesAgainAndAgainIsKeptOnce) {
  const std::string database = Database::shared().emptied();
  Store store({database});
  const Refused same{kWeld, "cellcal/graz/weld-3/fact/newer", "{}", Refusal::kMessage,
                     "unknown kind"};
  Batch batch;
  batch.refused = {same, same, {kWeld, same.topic, "[]", Refusal::kMessage, "no object"}};
  store.write(batch);
  store.write(batch);
  EXPECT_EQ(
      ask(database, "SELECT convert_from(payload, 'UTF8'), times FROM fleet.quarantine ORDER BY 1"),
      "[]|2\n{}|4");
  EXPECT_EQ(ask(database, "SELECT count FROM fleet.refusals"), "6");
}

TEST(Store, WordsThatAreTooLongAreCutBetweenTwoCharacters) {
  const std::string database = Database::shared().emptied();
  Store store({database});
  Batch batch;
  batch.refused.push_back(
      {kWeld, "t", "p", Refusal::kMessage, std::string(299, 'x') + "\xc3\xa4 and more"});
  store.write(batch);
  EXPECT_EQ(ask(database, "SELECT words = repeat('x', 299) FROM fleet.quarantine"), "t");
}

TEST(Store, ACellWithTooManyJournalsOrScatteredNumbersIsRefused) {
  const std::string database = Database::shared().emptied();
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

/// As if the clock of the database had been set.
void erase_months(const std::string& database) {
  ask(database,
      "DO $$ DECLARE name text; BEGIN FOR name IN SELECT tablename FROM pg_tables WHERE "
      "tablename ~ '^(phases|touches|health)_' LOOP EXECUTE 'DROP TABLE fleet.' || name; END LOOP; END $$");
}

/// Copies the rows to a month long ago.
void copy_into_2020(const std::string& database, const std::string& table) {
  ask(database, "CREATE TABLE fleet." + table + "_2020_01 PARTITION OF fleet." + table +
                    " FOR VALUES FROM ('2020-01-01') TO ('2020-02-01');"
                    "CREATE TABLE fleet.old AS SELECT * FROM fleet." +
                    table +
                    "; UPDATE fleet.old SET received = '2020-01-07';"
                    "INSERT INTO fleet." +
                    table + " SELECT * FROM fleet.old; DROP TABLE fleet.old");
}

Batch one_of_each_kind() {
  Batch batch;
  std::int64_t number = 0;
  for (const plant::FactBody& body : testing::one_of_each())
    batch.facts.push_back(testing::fact(kWeld, ++number, body));
  return batch;
}

TEST(Store, RetentionDropsTelemetryAlone) {
  const std::string database = Database::shared().emptied();
  Store store({database, 1});
  store.write(one_of_each_kind());
  for (const char* table : {"phases", "touches", "health"}) copy_into_2020(database, table);
  for (const char* table : {"alarms", "calibrations"})
    ask(database,
        "UPDATE fleet." + std::string(table) + " SET received = '2020-01-07', at = '2020-01-07'");
  EXPECT_EQ(testing::count_of_each(database), "1|1|1|1|1|1|1|2|2|2|1");
  EXPECT_TRUE(store.maintain().empty());
  EXPECT_EQ(testing::count_of_each(database), "1|1|1|1|1|1|1|1|1|1|1");
  EXPECT_EQ(ask(database, "SELECT count(*) FROM pg_tables WHERE tablename ~ '^health_'"),
            "3");  // this month and two ahead
}

TEST(Store, AClockThatStandsYearsAheadTakesOldMonthsOnlyWhereThereAreAsManyNewOnes) {
  const std::string database = Database::shared().emptied();
  Store store({database, 2});
  store.write(one_of_each_kind());
  copy_into_2020(database, "touches");  // last month, by a correct clock
  store.maintain();
  EXPECT_EQ(ask(database, "SELECT count(*) FROM fleet.touches"), "2");
  ask(database, "DROP TABLE fleet.touches_2020_01");
}

TEST(Store, ALongReaderHoldsUpNeitherTheNextMonthsNorWritersNorAStart) {
  const std::string database = Database::shared().emptied();
  erase_months(database);
  ask(database,
      "CREATE TABLE fleet.touches_2020_01 PARTITION OF fleet.touches FOR VALUES FROM "
      "('2020-01-01') TO ('2020-02-01')");
  pqxx::connection connection(database);
  pqxx::work reader(connection);
  reader.exec("SELECT count(*) FROM fleet.phases, fleet.touches, fleet.health");
  const auto begun = std::chrono::steady_clock::now();
  Store store({database});
  EXPECT_EQ(store.maintain(), std::vector<std::string>{"fleet.touches: dropping old months"});
  EXPECT_EQ(store.write(one_of_each_kind()).facts, 11u);
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(5));
  reader.commit();
  EXPECT_TRUE(store.maintain().empty());
  EXPECT_EQ(ask(database, "SELECT to_regclass('fleet.touches_2020_01') IS NULL"), "t");
}

TEST(Store, TelemetryIsStoredThoughTheDatabasesClockWasSetToAMonthThatHasNoTable) {
  const std::string database = Database::shared().emptied();
  Store store({database});
  store.maintain();
  erase_months(database);
  EXPECT_EQ(store.write(one_of_each_kind()).facts, 11u);
  EXPECT_EQ(testing::count_of_each(database), "1|1|1|1|1|1|1|1|1|1|1");
  EXPECT_EQ(ask(database, "SELECT count(*) FROM fleet.quarantine"), "0");
}

TEST(Store, AGapIsSettledThoughTheDatabasesClockWasSetBack) {
  const std::string database = Database::shared().emptied();
  Store store({database});
  Batch batch;
  batch.facts = {testing::alarm(kWeld, 1), testing::alarm(kWeld, 3)};
  store.write(batch);
  for (int i = 0; i < 2; ++i) {
    ask(database, "UPDATE fleet.journals SET marked = now() + interval '9 years'");
    store.maintain();
  }
  EXPECT_EQ(ask(database, "SELECT settled FROM fleet.gaps"), "t");
}

TEST(Store, WithoutAServerItSaysSo) {
  EXPECT_THROW(Store({"host=/nowhere/at/all dbname=cellcal"}), StoreUnavailable);
}

}  // namespace
}  // namespace cellcal::daemon::fleet
