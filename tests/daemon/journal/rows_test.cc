// Rows are read as written, field by field; checksums detect others.

#include <gtest/gtest.h>

#include <algorithm>
#include <iterator>

#include "daemon/journal/store/sqlite.h"
#include "daemon/result/contact_delay.h"
#include "images.h"
#include "temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

SessionInputs inputs() { return {"/c/cell.toml", "cell", "/r/robot.toml", "robot", "{\"n\":3}"}; }

struct TheRows : ::testing::Test {
  std::filesystem::path with(const char* suffix) const {
    std::filesystem::path file = path;
    return file += suffix;
  }
  TemporaryDirectory dir;
  std::filesystem::path path = dir / "j.db";
};

TEST_F(TheRows, OfSessionsAreListedWithAllButTheirTexts) {
  Journal journal(path);
  const std::int64_t id = journal.begin(inputs(), "t0");
  journal.store_calibration(id, "{}");
  const SessionRecord listed = journal.sessions().at(0);
  EXPECT_EQ(listed.inputs.cell_name, "/c/cell.toml");
  EXPECT_EQ(listed.inputs.robot_name, "/r/robot.toml");
  EXPECT_EQ(listed.inputs.options, "{\"n\":3}");
  EXPECT_EQ(listed.state, RecordState::kRunning);
  EXPECT_EQ(listed.inputs.cell_text + listed.inputs.robot_text + listed.calibration, "");
  const auto whole = journal.session(id);
  EXPECT_EQ(whole->inputs.cell_name, "/c/cell.toml");
  EXPECT_EQ(whole->inputs.robot_name, "/r/robot.toml");
  EXPECT_EQ(whole->inputs.options, "{\"n\":3}");
  EXPECT_EQ(whole->inputs.cell_text, "cell");
  EXPECT_EQ(whole->inputs.robot_text, "robot");
  EXPECT_EQ(whole->calibration, "{}");
}

TEST_F(TheRows, OfTouchesComeBackWithTheirSetAndTheWholePlaceOfTheTracker) {
  Journal journal(path);
  const std::int64_t id = journal.begin(inputs(), "t0");
  calib::Touch touch = touch_at(0.5);
  const double tracker_m[] = {1.5, -2.5, 3.5};
  std::copy(std::begin(tracker_m), std::end(tracker_m), std::begin(touch.tracker_m));
  for (const auto set : {calib::TouchSet::kFit, calib::TouchSet::kCheck}) {
    touch.set = set;
    const std::size_t index = journal.touches(id).size();
    journal.record(id, RecordTouch{index, touch});
    EXPECT_EQ(journal.touches(id).at(index), touch);
  }
}

TEST_F(TheRows, HoldYesAndNoAsOneAndNought) {
  {
    Journal journal(path);
    const std::int64_t id = journal.begin(inputs(), "t0");
    calib::Touch touch = touch_at(0.5);
    touch.set = calib::TouchSet::kCheck;
    journal.record(id, RecordTouch{0, touch});
    RecordReading reading;
    reading.reading.slow = true;
    journal.record(id, reading);
  }
  Database database(path);
  EXPECT_EQ(database.integer("SELECT held_out FROM touch"), 1);
  EXPECT_EQ(database.integer("SELECT slow FROM reading"), 1);
}

TEST_F(TheRows, OfATouchWithReadingsOfOneSpeedAloneGiveNoContactAtBoth) {
  Journal journal(path);
  const std::int64_t id = journal.begin(inputs(), "t0");
  const auto read = [&](std::size_t touch, bool slow, double along_m) {
    RecordReading record;
    record.touch = touch;
    record.reading.slow = slow;
    record.reading.along_m = along_m;
    journal.record(id, record);
  };
  read(0, false, 0.5);  // only the fast one
  read(1, true, 0.6);   // only slow ones, first of all
  read(2, false, 0.013);
  read(2, true, 0.012);
  read(3, true, 0.7);  // and after a complete one
  for (std::size_t i = 0; i < 4; ++i) journal.record(id, RecordTouch{i, touch_at(0.1)});
  const auto contacts = fast_and_slow(journal.readings(id), journal.touches(id).size());
  ASSERT_EQ(contacts.size(), 1u);
  EXPECT_DOUBLE_EQ(contacts[0].fast_m, 0.013);
  EXPECT_DOUBLE_EQ(contacts[0].slow_m, 0.012);
  EXPECT_TRUE(journal.readings(id + 1).empty());
  EXPECT_TRUE(journal.readings(id + 1).empty());
}

TEST_F(TheRows, OfNotesThatWaitAreWrittenWhenTheJournalIsClosed) {
  std::int64_t id = 0;
  {
    Journal journal(path);
    id = journal.begin(inputs(), "t0");
    journal.note(id, "t1", "the last word");
  }
  EXPECT_EQ(Journal(path).events(id), std::vector<std::string>{"t1 the last word"});
}

TEST_F(TheRows, BehindOneThatWasRefusedGoOnWhereTheFileStands) {
  std::int64_t id = 0;
  {
    Journal journal(path);
    id = fill(journal, 1);
  }
  {
    Journal journal(path);
    EXPECT_THROW(journal.record(id, RecordTouch{0, touch_at(0.1)}), JournalError)
        << "there already";
    journal.record(id, RecordTouch{1, touch_at(0.2)});
  }
  EXPECT_EQ(refusal(path), "");
  EXPECT_EQ(Journal(path).touches(id).size(), 2u);
}

// ---- rows that differ from those written ------------------------------------------------------------

TEST_F(TheRows, OfSessionsThatWereChangedOrTakenOutAreListedAsDamaged) {
  {
    Journal journal(path);
    for (int i = 0; i < 4; ++i) fill(journal, 1);
  }
  Database(path).execute(
      "PRAGMA foreign_keys = OFF; UPDATE session SET state='done' WHERE id=3;"
      "DELETE FROM session WHERE id=1; DELETE FROM session WHERE id=4;");
  Journal journal(path);
  const auto sessions = journal.sessions();
  ASSERT_EQ(sessions.size(), 4u);
  const RecordState states[] = {RecordState::kDamaged, RecordState::kDamaged,
                                RecordState::kInterrupted, RecordState::kDamaged};
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_EQ(sessions[i].id, static_cast<std::int64_t>(4 - i));
    EXPECT_EQ(sessions[i].state, states[i]) << i;
  }
}

TEST_F(TheRows, ThatAreNotAsTheyWereWrittenAreNamedByTheirNumber) {
  {
    Journal journal(path);
    fill(journal, 2);
    fill(journal, 2);
  }
  Database(path).execute("UPDATE touch SET target='S9' WHERE rowid=4");
  const std::string words = refusal(path);
  EXPECT_NE(words.find("session 2: row 4 of 'touch' was changed after it was written"),
            std::string::npos)
      << words;
}

TEST_F(TheRows, ThatTheEndLacksAreCounted) {
  {
    Journal journal(path);
    const std::int64_t id = fill(journal, 1);
    copy_journal(path, dir / "older.db");
    for (std::size_t i = 1; i < 4; ++i) journal.record(id, RecordTouch{i, touch_at(0.1)});
    std::filesystem::copy_file(with(".head"), dir / "older.db.head",
                               std::filesystem::copy_options::overwrite_existing);
  }
  const std::string words = refusal(dir / "older.db");
  EXPECT_NE(words.find(": 3 rows are missing at its end"), std::string::npos) << words;
}

TEST_F(TheRows, OfAJournalWhoseChecksumsWereChangedAreRefusedWhole) {
  for (const char* sql : {"UPDATE chain SET sum='0' WHERE number=4",
                          "UPDATE chain SET number=number+100 WHERE number=7"}) {
    const TemporaryDirectory other;
    { fill(*std::make_unique<Journal>(other / "j.db"), 1); }
    Database(other / "j.db").execute(sql);
    EXPECT_NE(refusal(other / "j.db").find("of its checksums is changed or missing"),
              std::string::npos)
        << sql << ": " << refusal(other / "j.db");
  }
}

TEST_F(TheRows, OfTwoJournalsWithTheSameWordsHaveHeadsThatFitOneAlone) {
  const auto other = dir / "other.db";
  for (const auto& each : {path, other}) fill(*std::make_unique<Journal>(each), 1);
  std::filesystem::copy_file(dir / "other.db.head", with(".head"),
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_NE(refusal(path).find("belongs to another journal"), std::string::npos) << refusal(path);
}

TEST_F(TheRows, WithoutAHeadGetOneThatFits) {
  { fill(*std::make_unique<Journal>(path), 1); }
  std::filesystem::remove(with(".head"));
  EXPECT_EQ(Journal(path).remarks().size(), 1u);
  EXPECT_TRUE(Journal(path).remarks().empty());
  Database(path).execute("DELETE FROM chain WHERE number=(SELECT max(number) FROM chain)");
  EXPECT_NE(refusal(path).find(": 1 rows are missing"), std::string::npos) << refusal(path);
}

}  // namespace
}  // namespace cellcal::daemon::testing
