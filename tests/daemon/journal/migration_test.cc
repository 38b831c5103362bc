// Journals of earlier schemas, as those versions made them.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "daemon/journal/database/schema.h"
#include "daemon/journal/store/sqlite.h"
#include "daemon/qualification/contact_delay.h"
#include "daemon/result/outcome_json.h"
#include "images.h"
#include "temporary_directory.h"
#include "tests/daemon/journal/disks/losing_disk.h"
#include "version_2.h"

namespace cellcal::daemon::testing {
namespace {

/// Two sessions with touches, readings and events; the second was left running by a kill.
void make_version_1(const std::filesystem::path& path) {
  Database database(path);
  database.execute("PRAGMA journal_mode = WAL");
  database.execute(kSchema1);
  database.execute(R"sql(
    PRAGMA application_id = 0x6363616c;
    PRAGMA user_version = 1;
    INSERT INTO session (started, ended, state, cell_name, cell_text, robot_name, robot_text,
                         options, plan_hash, planned)
      VALUES ('t0', 't1', 'done', '/c', 'cell', '/r', 'robot', '{}', 'h', 2),
             ('t2', '', 'running', '/c', 'cell', '/r', 'robot', '{}', 'h', 9);
    INSERT INTO touch VALUES
      (1, 0, x'000000000000f03f', 'S1', 0, 0, 0, x'', 't', x'', 2, 0.0, 0.002),
      (1, 1, x'000000000000f03f', 'S2', 1, 0, 0, x'', 't', x'', 2, 0.0, 0.002),
      (2, 0, x'000000000000f03f', 'S1', 0, 0, 0, x'', 't', x'', 2, 0.0, 0.002);
    INSERT INTO reading VALUES (2, 0, 0, 0, x'', x'', 0.0125, 0, 0, 0, 't'),
                               (2, 0, 1, 1, x'', x'', 0.0120, 0, 0, 0, 't');
    INSERT INTO event VALUES (2, 't', 'transit -> arming fast');
  )sql");
}

TEST(a_journal_of_version_1, is_taken_over_as_it_is_and_says_so) {
  const TemporaryDirectory dir;
  make_version_1(dir / "j.db");
  {
    Journal journal(dir / "j.db");
    ASSERT_EQ(journal.remarks().size(), 2u);
    EXPECT_NE(
        journal.remarks()[1].find("taken over from schema 1 to 10; as it was before it is kept "
                                  "as j.db.version-1"),
        std::string::npos)
        << journal.remarks()[1];
    EXPECT_NE(journal.remarks()[0].find("8 rows of an earlier version had no checksums"),
              std::string::npos)
        << journal.remarks()[0];
    ASSERT_EQ(journal.sessions().size(), 2u);
    EXPECT_EQ(journal.sessions()[1].state, RecordState::kDone);
    EXPECT_EQ(journal.touches(1).size(), 2u);
    EXPECT_EQ(fast_and_slow(journal.readings(2), journal.touches(2).size()).size(), 1u);
    EXPECT_EQ(journal.events(2).size(), 1u);
    const auto resumable = journal.newest_resumable();
    ASSERT_TRUE(resumable);
    EXPECT_EQ(resumable->state, RecordState::kInterrupted);
    journal.resume(2, "t3");
    journal.record(2, RecordTouch{1, touch_at(0.5)});
  }
  Journal again(dir / "j.db");
  EXPECT_TRUE(again.remarks().empty());
  EXPECT_EQ(again.touches(2).size(), 2u);
  EXPECT_EQ(again.touches(2)[0].joint_rad, std::vector<double>{1.0});
}

TEST(a_journal_of_version_1, has_its_rows_watched_from_then_on) {
  const TemporaryDirectory dir;
  make_version_1(dir / "j.db");
  { const Journal journal(dir / "j.db"); }
  Database(dir / "j.db").execute("UPDATE touch SET target='S3' WHERE session=1 AND number=0");
  Journal journal(dir / "j.db");
  EXPECT_THROW(journal.touches(1), JournalError);
  EXPECT_EQ(journal.touches(2).size(), 1u);
}

/// Every value of every table of versions 1 and 2, with its type.
std::string dump(const std::filesystem::path& path, const char* columns_of_touch) {
  Database database(path);
  std::string all;
  for (const std::string table :
       {"session", "touch", "reading", "event", "chain WHERE kind <> 'none'"}) {
    std::string columns = "*";
    if (table == "touch") columns = columns_of_touch;
    if (table == "session")
      columns =
          "id, started, ended, state, cell_name, cell_text, robot_name, robot_text, options, "
          "plan_hash, planned, failure, calibration";
    Statement rows(database, ("SELECT rowid, " + columns + " FROM " + table).c_str());
    while (rows.step()) all += bytes_of(rows.values());
  }
  return all;
}
constexpr const char* kTouch =
    "session, number, joint_rad, target, held_out, sigma_m, radius_m, tracker_m, time, "
    "settled_rad, readings, spread_m, speed_m_s";

TEST(a_journal_of_version_2, is_taken_over_bit_for_bit_with_its_checksums_as_they_are) {
  const TemporaryDirectory dir;
  make_version_2(dir / "j.db");
  const std::string before = dump(dir / "j.db", kTouch);
  {
    Journal journal(dir / "j.db");
    ASSERT_EQ(journal.remarks().size(), 1u);
    EXPECT_NE(journal.remarks()[0].find("from schema 2 to 10"), std::string::npos);
    ASSERT_EQ(journal.touches(1).size(), 2u);
    const calib::Touch touch = journal.touches(1)[1];
    EXPECT_EQ(touch.joint_rad, (std::vector<double>{0.1, HUGE_VAL}));
    EXPECT_EQ(touch.settled_joint_rad, std::vector<double>{-1.0 / 3.0});
    EXPECT_EQ(touch.set, calib::TouchSet::kCheck);
    EXPECT_EQ(touch.tracker_m[2], 3.0);
    EXPECT_EQ(touch.spread_m, 1.0 / 7.0);
    EXPECT_EQ(touch.tool, "");
    EXPECT_FALSE(touch.temperature_c);
    EXPECT_EQ(journal.session(1)->software, "");
    EXPECT_EQ(journal.newest_resumable()->id, 2);
  }
  EXPECT_EQ(dump(dir / "j.db", kTouch), before);
  EXPECT_EQ(dump(dir / "j.db.version-2", kTouch), before);
  EXPECT_EQ(refusal(dir / "j.db"), "");
}

TEST(a_journal_of_version_2, whose_rows_were_changed_has_the_same_session_damaged_afterwards) {
  const TemporaryDirectory dir;
  make_version_2(dir / "j.db");
  Database(dir / "j.db").execute("UPDATE touch SET target='S9' WHERE session=1");
  Journal journal(dir / "j.db");
  EXPECT_THROW(journal.touches(1), JournalError);
  EXPECT_EQ(journal.touches(2).size(), 1u);
}

TEST(a_journal_of_version_2, whose_checksums_were_changed_is_refused_and_not_taken_over) {
  const TemporaryDirectory dir;
  make_version_2(dir / "j.db");
  Database(dir / "j.db").execute("UPDATE chain SET digest='00' WHERE number=3");
  EXPECT_NE(refusal(dir / "j.db").find("entry 3 of its checksums"), std::string::npos);
  EXPECT_EQ(Database(dir / "j.db").integer("PRAGMA user_version"), 2);
  EXPECT_FALSE(std::filesystem::exists(dir / "j.db.version-2"));
}

TEST(a_journal_of_version_2, is_kept_until_a_session_of_this_version_is_done) {
  const TemporaryDirectory dir;
  make_version_2(dir / "j.db");
  {
    Journal journal(dir / "j.db");
    journal.resume(2, "t2");
    journal.record(2, RecordEnd{Ending::kDone, ""}, "t3");
  }
  std::int64_t id = 0;
  {
    Journal journal(dir / "j.db");  // that session began in the version before
    EXPECT_TRUE(std::filesystem::exists(dir / "j.db.version-2"));
    id = fill(journal, 1);
  }
  {
    Journal journal(dir / "j.db");
    EXPECT_TRUE(std::filesystem::exists(dir / "j.db.version-2"));
    journal.record(id, RecordEnd{Ending::kDone, ""}, "t3");
  }
  const Journal journal(dir / "j.db");
  ASSERT_EQ(journal.remarks().size(), 1u);
  EXPECT_NE(journal.remarks()[0].find("j.db.version-2, kept of the version before, was removed"),
            std::string::npos);
  EXPECT_FALSE(std::filesystem::exists(dir / "j.db.version-2"));
}

TEST(a_journal_of_version_2, whose_taking_over_is_cut_off_anywhere_is_one_or_the_other_whole) {
  const TemporaryDirectory dir;
  make_version_2(dir / "old.db");
  const std::string before = dump(dir / "old.db", kTouch);
  int cuts = 0, old_left = 0;
  for (long at = 0;; ++at) {
    const TemporaryDirectory here;
    copy_journal(dir / "old.db", here / "j.db");
    const auto unsynced = at % 2 == 0 ? Cut::Unsynced::kLost : Cut::Unsynced::kTorn;
    if (!is_cut_in({here.path(), at, unsynced, static_cast<unsigned>(at) + 1},
                   [&] { const Journal journal(here / "j.db"); }))
      break;
    ++cuts;
    const TemporaryDirectory look;
    copy_journal(here / "j.db", look / "j.db");
    ASSERT_EQ(dump(look / "j.db", kTouch), before) << "cut at write " << at;
    old_left += Database(look / "j.db").integer("PRAGMA user_version") == 2;
    ASSERT_EQ(refusal(here / "j.db"), "") << "cut at write " << at;
    Journal again(here / "j.db");
    EXPECT_EQ(again.touches(1).size(), 2u);
  }
  std::printf("cut at each of %d writes; version 2 was left %d times\n", cuts, old_left);
  EXPECT_GT(cuts, 20);
  EXPECT_GT(old_left, 10);
  EXPECT_LT(old_left, cuts) << "a cut behind the commit leaves the new version";
}

/// As that version left it: all tables but those that it did not have.
std::int64_t make_version_4(const std::filesystem::path& path) {
  std::int64_t id = 0;
  {
    Journal journal(path);
    id = fill(journal, 2);
    journal.record(id, RecordEnd{Ending::kDone, ""}, "t1");
  }
  Database(path).execute(
      "DROP TABLE activation; DROP TABLE outbox; DROP TABLE outbox_source; "
      "ALTER TABLE session DROP COLUMN outcome; DROP TABLE schedule; DROP TABLE search; DROP TABLE interruption; PRAGMA user_version = 4");
  return id;
}

TEST(a_journal_of_version_4, is_taken_over_and_takes_activations_from_then_on) {
  const TemporaryDirectory dir;
  const std::int64_t id = make_version_4(dir / "j.db");
  const std::string before = dump(dir / "j.db", kTouch);
  {
    Journal journal(dir / "j.db");
    ASSERT_EQ(journal.remarks().size(), 1u);
    EXPECT_NE(journal.remarks()[0].find("from schema 4 to 10"), std::string::npos);
    EXPECT_TRUE(journal.activations().empty());
  }
  EXPECT_EQ(dump(dir / "j.db", kTouch), before);
  EXPECT_EQ(dump(dir / "j.db.version-4", kTouch), before);
  {
    Journal journal(dir / "j.db");
    journal.activate({id, "2026-01-02T00:00:00.000Z", "anna", "the newer one was made cold"});
    EXPECT_EQ(journal.touches(id).size(), 2u);
  }
  Journal journal(dir / "j.db");
  ASSERT_EQ(journal.activations().size(), 1u);
  EXPECT_EQ(journal.activations()[0].who, "anna");
  EXPECT_EQ(journal.session(id)->state, RecordState::kDone);
}

TEST(a_journal_of_version_7, gives_each_check_the_outcome_that_its_own_file_states) {
  const TemporaryDirectory dir;
  std::vector<std::int64_t> ids;
  {
    Journal journal(dir / "j.db");
    for (int k = 0; k < 4; ++k) {
      ids.push_back(fill(journal, 1));
      journal.record(ids.back(), RecordEnd{Ending::kDone, ""}, "t3");
    }
  }
  Database(dir / "j.db")
      .execute(
          "ALTER TABLE session DROP COLUMN outcome; DROP TABLE schedule; DROP TABLE search; DROP TABLE interruption; PRAGMA user_version = 7");
  const auto file = [&](std::size_t k, const std::string& text) {
    const auto folder = dir.path() / "sessions" / std::to_string(ids[k]);
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "check.json") << text;
  };
  file(0, R"({"format": "cellcal.check/1", "holds": false, "touches": 8, "changed": "tool",
    "log_odds": 30.0, "log_odds_alarm": 9.0, "not_found": [],
    "unsteady": [{"touch": 2, "target": "S2"}, {"touch": 3, "target": "S2"}],
    "tcp_shift_mm": {"frame": "flange", "xyz": [0.3, 0.4, 0.0], "u_length": 0.06}})");
  file(1, R"({"format": "cellcal.check/1", "holds": true, "touches": 8, "changed": null,
    "log_odds": 1.0, "log_odds_alarm": 9.0, "not_found": [], "unsteady": [],
    "tcp_shift_mm": {"frame": "flange", "xyz": [0.0, 0.0, 0.0], "u_length": 0.06}})");
  file(2, R"({"format": "cellcal.check/1", "holds": true)");
  Database(dir / "j.db")
      .execute(("UPDATE touch SET target='S9' WHERE session=" + std::to_string(ids[3])).c_str());
  file(3, R"({"format": "cellcal.check/1", "holds": true, "touches": 8, "changed": null,
    "not_found": [], "unsteady": [], "tcp_shift_mm": null})");
  for (int time = 0; time < 2; ++time) {
    Journal journal(dir / "j.db");
    const auto knocked = outcome_from_json(journal.session(ids[0])->outcome);
    ASSERT_TRUE(knocked);
    EXPECT_EQ(knocked->kind, OutcomeKind::kDoesNotHold);
    EXPECT_EQ(knocked->unsteady, std::vector<std::string>{"S2"});
    ASSERT_TRUE(knocked->tcp_shift && knocked->change);
    EXPECT_NEAR(knocked->tcp_shift->shift_m.norm(), 5e-4, 1e-9);
    EXPECT_EQ(knocked->change->kind, calib::ChangeKind::kTool);
    EXPECT_EQ(outcome_from_json(journal.session(ids[1])->outcome)->kind, OutcomeKind::kHolds);
    EXPECT_EQ(journal.session(ids[2])->outcome, "");
    EXPECT_THROW(journal.touches(ids[3]), JournalError) << "damaged as before";
    EXPECT_EQ(journal.touches(ids[0]).size(), 1u);
  }
}

TEST(a_journal_of_version_7, has_sessions_without_an_outcome_and_keeps_those_of_new_ones) {
  const TemporaryDirectory dir;
  std::int64_t old = 0, checked = 0;
  {
    Journal journal(dir / "j.db");
    old = fill(journal, 2);
    journal.record(old, RecordEnd{Ending::kDone, ""}, "t1");
  }
  Database(dir / "j.db")
      .execute(
          "ALTER TABLE session DROP COLUMN outcome; DROP TABLE schedule; DROP TABLE search; DROP TABLE interruption; PRAGMA user_version = 7");
  {
    Journal journal(dir / "j.db");
    EXPECT_NE(journal.remarks()[0].find("from schema 7 to 10"), std::string::npos);
    EXPECT_EQ(journal.session(old)->state, RecordState::kDone);
    EXPECT_EQ(journal.session(old)->outcome, "");
    checked = fill(journal, 2);
    RecordEnd end{Ending::kDone, ""};
    end.result =
        std::make_shared<const SessionResult>(SessionResult{calib::TcpCheck{.holds = true}});
    journal.record(checked, end, "t2");
  }
  {
    Journal journal(dir / "j.db");
    const auto outcome = outcome_from_json(journal.session(checked)->outcome);
    ASSERT_TRUE(outcome);
    EXPECT_EQ(outcome->kind, OutcomeKind::kHolds);
    EXPECT_EQ(journal.sessions().front().outcome, journal.session(checked)->outcome);
  }
  Database(dir / "j.db").execute("UPDATE session SET outcome = '' WHERE outcome IS NOT NULL");
  Journal journal(dir / "j.db");
  EXPECT_EQ(journal.sessions().front().state, RecordState::kDamaged)
      << "it is part of the evidence";
}

TEST(a_journal_of_version_4, whose_taking_over_is_cut_off_anywhere_is_one_or_the_other_whole) {
  const TemporaryDirectory dir;
  make_version_4(dir / "old.db");
  const std::string before = dump(dir / "old.db", kTouch);
  int cuts = 0, old_left = 0;
  for (long at = 0;; at += 3) {
    const TemporaryDirectory here;
    copy_journal(dir / "old.db", here / "j.db");
    const auto unsynced = at % 2 == 0 ? Cut::Unsynced::kLost : Cut::Unsynced::kTorn;
    if (!is_cut_in({here.path(), at, unsynced, static_cast<unsigned>(at) + 1},
                   [&] { const Journal journal(here / "j.db"); }))
      break;
    ++cuts;
    const TemporaryDirectory look;
    copy_journal(here / "j.db", look / "j.db");
    ASSERT_EQ(dump(look / "j.db", kTouch), before) << "cut at write " << at;
    old_left += Database(look / "j.db").integer("PRAGMA user_version") == 4;
    ASSERT_EQ(refusal(here / "j.db"), "") << "cut at write " << at;
  }
  EXPECT_GT(cuts, 5);
  EXPECT_GT(old_left, 3);
  EXPECT_LT(old_left, cuts);
}

}  // namespace
}  // namespace cellcal::daemon::testing
