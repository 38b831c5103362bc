#include "daemon/journal/journal.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>

#include "daemon/journal/prepare.h"
#include "daemon/journal/store/sqlite.h"
#include "daemon/result/contact_delay.h"
#include "temporary_directory.h"

namespace cellcal::daemon {
namespace {

using testing::TemporaryDirectory;

SessionInputs inputs() {
  return {"/c/cell.toml", "cell text", "/c/robot.toml", "robot text", "{}"};
}

calib::Touch touch() {
  calib::Touch touch;
  touch.joint_rad = {0.1, -1.0 / 3.0, 5e-324};
  touch.target = "S\"1';--";
  touch.set = calib::TouchSet::kCheck;
  touch.sigma_m = 1e-5;
  touch.radius_m = 0.25;
  touch.tracker_m[1] = -0.7;
  touch.time = "2026-01-01T00:00:00.000Z";
  touch.settled_joint_rad = {0.2, -0.3, 1e300};
  touch.readings = 3;
  touch.spread_m = 1.0 / 7.0;
  touch.speed_m_s = 0.002;
  return touch;
}

std::string reason(const std::filesystem::path& path) {
  try {
    Journal journal(path);
  } catch (const JournalError& error) {
    return error.what();
  }
  return "opened";
}

TEST(AJournal, GivesATouchBackBitForBit) {
  const TemporaryDirectory dir;
  std::int64_t id = 0;
  {
    Journal journal(dir / "j.db");
    id = journal.begin(inputs(), "t0");
    journal.record(id, RecordTouch{0, touch()});
  }
  Journal again(dir / "j.db");
  ASSERT_EQ(again.touches(id).size(), 1u);
  EXPECT_EQ(again.touches(id)[0], touch());
}

TEST(AJournal, GivesTheContactsOfEachTouchAtBothSpeeds) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  const std::int64_t id = journal.begin(inputs(), "t0");
  const auto read = [&](std::size_t touch, bool slow, double along_m) {
    RecordReading record;
    record.touch = touch;
    record.reading.slow = slow;
    record.reading.along_m = along_m;
    journal.record(id, record);
  };
  read(0, false, 0.0125);
  read(0, true, 0.0120);
  read(0, true, 0.0122);
  journal.record(id, RecordTouch{0, touch()});
  read(1, false, 0.5);  // given up, and repeated
  read(1, true, 0.6);
  read(1, false, 0.013);
  read(1, true, 0.012);
  journal.record(id, RecordTouch{1, touch()});
  read(2, false, 0.7);  // never recorded
  read(2, true, 0.7);
  const auto contacts = fast_and_slow(journal.readings(id), journal.touches(id).size());
  ASSERT_EQ(contacts.size(), 2u);
  EXPECT_DOUBLE_EQ(contacts[0].fast_m, 0.0125);
  EXPECT_DOUBLE_EQ(contacts[0].slow_m, 0.0121);
  EXPECT_DOUBLE_EQ(contacts[1].fast_m, 0.013);
  EXPECT_DOUBLE_EQ(contacts[1].slow_m, 0.012);
}

TEST(AJournal, RefusesTheSameTouchTwice) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  const std::int64_t id = journal.begin(inputs(), "t0");
  journal.record(id, RecordTouch{0, touch()});
  EXPECT_THROW(journal.record(id, RecordTouch{0, touch()}), JournalError);
  EXPECT_EQ(journal.touches(id).size(), 1u);
}

TEST(AJournal, RefusesATouchOfNoSessionAndANumberThatIsNone) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  EXPECT_THROW(journal.record(77, RecordTouch{0, touch()}), JournalError);
  const std::int64_t id = journal.begin(inputs(), "t0");
  calib::Touch bad = touch();
  bad.spread_m = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(journal.record(id, RecordTouch{0, bad}), JournalError);
}

TEST(AJournal, KeepsInputsPlanEndAndCalibrationOfASession) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  const std::int64_t id = journal.begin(inputs(), "t0");
  journal.record(id, RecordPlan{"abc", 32});
  journal.store_calibration(id, "{\"format\":1}");
  journal.record(id, RecordEnd{Ending::kFailed, "no-contact: S2"}, "t9");
  const auto record = journal.session(id);
  ASSERT_TRUE(record);
  EXPECT_EQ(record->started, "t0");
  EXPECT_EQ(record->ended, "t9");
  EXPECT_EQ(record->state, RecordState::kFailed);
  EXPECT_EQ(record->inputs.cell_text, "cell text");
  EXPECT_EQ(record->inputs.robot_text, "robot text");
  EXPECT_EQ(record->plan_hash, "abc");
  EXPECT_EQ(record->planned, 32);
  EXPECT_EQ(record->failure, "no-contact: S2");
  EXPECT_EQ(record->calibration, "{\"format\":1}");
  EXPECT_FALSE(journal.session(id + 1));
}

TEST(AJournal, ListsSessionsNewestFirstWithTheirTouchesCounted) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  const std::int64_t first = journal.begin(inputs(), "t0");
  journal.record(first, RecordTouch{0, touch()});
  const std::int64_t second = journal.begin(inputs(), "t1");
  const auto sessions = journal.sessions();
  ASSERT_EQ(sessions.size(), 2u);
  EXPECT_EQ(sessions[0].id, second);
  EXPECT_EQ(sessions[1].touches, 1);
}

TEST(AJournal, KnowsWhetherACalibrationThatIsDoneWasPublished) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  const auto listed = [&](const std::optional<SessionResult>& result, Ending ending) {
    const std::int64_t id = journal.begin(inputs(), "t0");
    RecordEnd end{ending, ""};
    if (result) end.result = std::make_shared<const SessionResult>(*result);
    journal.record(id, end, "t1");
    return journal.was_published(id);
  };
  calib::Calibration calibration;
  EXPECT_EQ(listed(SessionResult{calibration}, Ending::kDone), false);
  calibration.verdict.judged = true;
  EXPECT_EQ(listed(SessionResult{calibration}, Ending::kDone), true);
  EXPECT_EQ(listed(SessionResult{calibration}, Ending::kAborted), std::nullopt);
  EXPECT_EQ(listed(SessionResult{calib::TcpCheck{}}, Ending::kDone), std::nullopt);
  EXPECT_EQ(listed(std::nullopt, Ending::kDone), std::nullopt);
  EXPECT_EQ(journal.was_published(99), std::nullopt);
}

TEST(AJournal, ResumesOnlyTheNewestSessionAndOnlyIfItIsNotDone) {
  const TemporaryDirectory dir;
  {
    Journal journal(dir / "j.db");
    EXPECT_FALSE(journal.newest_resumable());
    const std::int64_t id = journal.begin(inputs(), "t0");
    EXPECT_FALSE(journal.newest_resumable()) << "it runs";
    journal.record(id, RecordEnd{Ending::kAborted, ""}, "t1");
    EXPECT_EQ(journal.newest_resumable()->id, id);
    const std::int64_t next = journal.begin(inputs(), "t2");
    journal.record(next, RecordEnd{Ending::kDone, ""}, "t3");
    EXPECT_FALSE(journal.newest_resumable()) << "an older session's cell may have been moved";
  }
}

TEST(AJournal, MarksASessionThatACrashLeftRunningAsInterrupted) {
  const TemporaryDirectory dir;
  { Journal(dir / "j.db").begin(inputs(), "t0"); }
  Journal journal(dir / "j.db");
  EXPECT_EQ(journal.sessions()[0].state, RecordState::kInterrupted);
  EXPECT_TRUE(journal.newest_resumable());
}

TEST(AJournal, WritesNotesWithTheNextRowAndShowsThemBefore) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  const std::int64_t id = journal.begin(inputs(), "t0");
  journal.note(id, "t1", "transit -> arming");
  EXPECT_EQ(journal.events(id), std::vector<std::string>{"t1 transit -> arming"});
  journal.record(id, RecordReading{});
  EXPECT_EQ(journal.events(id), std::vector<std::string>{"t1 transit -> arming"});
  EXPECT_EQ(journal.readings(id).size(), 1u);
}

TEST(AJournal, RefusesAFileThatIsNotADatabase) {
  const TemporaryDirectory dir;
  std::ofstream(dir / "j.db") << std::string(5000, 'x');
  EXPECT_NE(reason(dir / "j.db").find("Move it aside"), std::string::npos) << reason(dir / "j.db");
  EXPECT_NE(reason(dir / "j.db").find("j.db"), std::string::npos);
}

TEST(AJournal, KeepsTheChangesOfPhaseOfASessionInTheirOrder) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  const std::int64_t id = journal.begin(inputs(), "t0");
  RecordChange change{.change = {Phase::kTransit, Phase::kArmingFast}, .clock_s = 1.5};
  journal.note(id, change);
  journal.record(id, RecordTouch{0, touch()});
  change = {.change = {Phase::kArmingFast, Phase::kFastSearch}, .clock_s = 1.75};
  journal.note(id, change);
  const std::vector<TimedChange> changes = journal.changes(id);
  ASSERT_EQ(changes.size(), 2u);
  EXPECT_EQ(changes[0].change, (PhaseChange{Phase::kTransit, Phase::kArmingFast}));
  EXPECT_EQ(changes[1].change, (PhaseChange{Phase::kArmingFast, Phase::kFastSearch}));
  EXPECT_EQ(changes[1].clock_s, 1.75);
  EXPECT_TRUE(journal.changes(id + 1).empty());
}

TEST(AJournal, RefusesTheDatabaseOfAnotherProgram) {
  const TemporaryDirectory dir;
  { Database(dir / "j.db").execute("CREATE TABLE cookies (a)"); }
  EXPECT_NE(reason(dir / "j.db").find("another program"), std::string::npos);
}

TEST(AJournal, RefusesOneOfAnotherSchemaVersionAndLeavesItUnchanged) {
  const TemporaryDirectory dir;
  { Journal journal(dir / "j.db"); }
  for (const int version : {99, 10, 1, 0, -1}) {
    Database(dir / "j.db").execute(("PRAGMA user_version = " + std::to_string(version)).c_str());
    const std::string why = reason(dir / "j.db");
    EXPECT_NE(why.find("j.db"), std::string::npos) << why;
    EXPECT_NE(why.find("schema version " + std::to_string(version) + ", supported is 13. Install"),
              std::string::npos)
        << why;
    EXPECT_EQ(Database(dir / "j.db").integer("PRAGMA user_version"), version);
  }
}

TEST(AJournal, OfAnEarlierVersionIsConvertedAndKeepsItsChecksums) {
  for (const char* earlier :
       {"ALTER TABLE touch DROP COLUMN positioner_rad; ALTER TABLE touch DROP COLUMN load; "
        "PRAGMA user_version = 11",
        "ALTER TABLE touch DROP COLUMN positioner_rad; PRAGMA user_version = 12"}) {
    const TemporaryDirectory dir;
    {
      Journal journal(dir / "j.db");
      const std::int64_t id = journal.begin(inputs(), "t0");
      for (std::size_t i = 0; i < 3; ++i) journal.record(id, RecordTouch{i, touch()});
    }
    const std::vector<calib::Touch> touches(3, touch());
    Database(dir / "j.db").execute(earlier);
    {
      Journal journal(dir / "j.db");
      EXPECT_EQ(journal.touches(1), touches);
      calib::Touch loaded = touch();
      loaded.load = "part";
      loaded.positioner_rad = {0.25, -1.5};
      journal.record(1, RecordTouch{3, loaded});
    }
    EXPECT_EQ(Database(dir / "j.db").integer("PRAGMA user_version"), 13);
    EXPECT_EQ(Journal(dir / "j.db").touches(1).back().load, "part");
    EXPECT_EQ(Journal(dir / "j.db").touches(1).back().positioner_rad, (std::vector{0.25, -1.5}));
  }
}

TEST(AJournal, RefusesADamagedOne) {
  const TemporaryDirectory dir;
  {
    Journal journal(dir / "j.db");
    const std::int64_t id = journal.begin(inputs(), "t0");
    for (std::size_t i = 0; i < 200; ++i) journal.record(id, RecordTouch{i, touch()});
  }
  std::fstream file(dir / "j.db", std::ios::in | std::ios::out | std::ios::binary);
  for (int page = 3; page < 12; ++page) {
    file.seekp(page * 4096);
    file << std::string(2000, '\xff');
  }
  file.close();
  EXPECT_NE(reason(dir / "j.db").find("Move it aside"), std::string::npos) << reason(dir / "j.db");
}

TEST(AJournal, RefusesASecondDaemon) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  EXPECT_NE(reason(dir / "j.db").find("second cellcald"), std::string::npos)
      << reason(dir / "j.db");
}

TEST(AJournal, InADirectoryThatDoesNotExistSaysSo) {
  EXPECT_NE(reason("/nonexistent/dir/j.db").find("/nonexistent/dir/j.db"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon
