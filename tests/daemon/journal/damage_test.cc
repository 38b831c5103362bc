// Damage of every kind is detected: rows changed, missing, lost at the end, files replaced.

#include <gtest/gtest.h>

#include <random>

#include "daemon/journal/store/sqlite.h"
#include "images.h"
#include "temporary_directory.h"
#include "tests/daemon/journal/disks/away_disk.h"

namespace cellcal::daemon::testing {
namespace {

/// A journal of two sessions as left by a kill: much of it in the write-ahead log.
class AJournalThatAKillLeft : public ::testing::Test {
 protected:
  void SetUp() override {
    { fill(*std::make_unique<Journal>(original_), 3); }
    Journal living(original_);
    fill(living, 4);
    copy_journal(original_, image_);
    copy_journal(image_, copy_);
    whole_ = all_of(copy_);
    copy_journal(image_, copy_);
  }
  std::filesystem::path with(const char* suffix) const {
    std::filesystem::path path = copy_;
    return path += suffix;
  }

  TemporaryDirectory dir_;
  std::filesystem::path original_ = dir_ / "original.db", image_ = dir_ / "image.db",
                        copy_ = dir_ / "copy.db";
  std::string whole_;
};

TEST_F(AJournalThatAKillLeft, GivesTheSameRowsOrNoneWhenABitIsFlipped) {
  std::mt19937_64 random(18);
  int refused = 0;
  for (int flip = 0; flip < 60; ++flip) {
    const char* suffix = flip % 2 == 0 ? "" : "-wal";
    const std::uintmax_t bits = 8 * std::filesystem::file_size(with(suffix));
    const std::uintmax_t bit = random() % bits;
    flip_bit(with(suffix), bit);
    try {
      EXPECT_EQ(all_of(copy_), whole_) << "bit " << bit << " of copy.db" << suffix;
    } catch (const JournalError& error) {
      ++refused;
      EXPECT_NE(std::string(error.what()).find("copy.db"), std::string::npos) << error.what();
    }
    copy_journal(image_, copy_);
  }
  EXPECT_GT(refused, 15) << "most of what is flipped is in use";
}

TEST_F(AJournalThatAKillLeft, MissesItsRowsWhenTheLogIsCutAnywhere) {
  const std::uintmax_t size = std::filesystem::file_size(with("-wal"));
  int refused = 0;
  for (std::uintmax_t tenth = 0; tenth < 10; ++tenth) {
    std::filesystem::resize_file(with("-wal"), size * tenth / 10);
    const std::string words = refusal(copy_);
    EXPECT_TRUE(words.empty() || words.find("missing at its end") != std::string::npos) << words;
    if (words.empty()) {
      EXPECT_EQ(all_of(copy_), whole_) << tenth;
    }
    refused += words.empty() ? 0 : 1;
    copy_journal(image_, copy_);
  }
  EXPECT_GE(refused, 9);
}

TEST_F(AJournalThatAKillLeft, ThatIsRefusedIsLeftAsItIs) {
  const std::uintmax_t log = std::filesystem::file_size(with("-wal"));
  flip_bit(with("-wal"), 8 * 200);
  EXPECT_NE(refusal(copy_).find("missing at its end"), std::string::npos) << refusal(copy_);
  EXPECT_EQ(std::filesystem::file_size(with("-wal")), log);
  flip_bit(with("-wal"), 8 * 200);
  EXPECT_EQ(all_of(copy_), whole_) << "mended, it is whole again";
}

TEST_F(AJournalThatAKillLeft, MissesItsRowsWhenTheLogIsGone) {
  std::filesystem::remove(with("-wal"));
  const std::string words = refusal(copy_);
  EXPECT_NE(words.find("remove the .head file to continue"), std::string::npos) << words;
  std::filesystem::remove(with(".head"));
  Journal without(copy_);
  ASSERT_EQ(without.remarks().size(), 1u);
  EXPECT_NE(without.remarks()[0].find(".head file was missing"), std::string::npos);
}

TEST_F(AJournalThatAKillLeft, MayBeOneCommitAheadOfItsHead) {
  std::filesystem::path ahead = dir_ / "ahead.db";
  {
    Journal journal(copy_);
    std::filesystem::copy_file(with(".head"), dir_ / "head");
    journal.record(2, RecordTouch{4, touch_at(9.0)});
    copy_journal(copy_, ahead);
  }
  std::filesystem::copy_file(dir_ / "head", std::filesystem::path(ahead) += ".head",
                             std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(refusal(ahead), "");
  EXPECT_EQ(Journal(ahead).touches(2).size(), 5u);
}

TEST_F(AJournalThatAKillLeft, IsNotTakenForAnotherOrAnOlderOne) {
  std::filesystem::path other = dir_ / "other.db";
  { fill(*std::make_unique<Journal>(other), 20); }
  std::filesystem::copy_file(other, copy_, std::filesystem::copy_options::overwrite_existing);
  std::filesystem::remove(with("-wal"));
  EXPECT_NE(refusal(copy_).find("another journal"), std::string::npos) << refusal(copy_);

  std::filesystem::remove(copy_);
  EXPECT_NE(refusal(copy_).find("Restore the journal"), std::string::npos) << refusal(copy_);
}

/// With a row of each table with data of a session.
std::int64_t fill_all(Journal& journal) {
  const std::int64_t id = fill(journal, 3);
  journal.note(id, RecordChange{});
  journal.note(id, RecordContact{});
  journal.activate({id, "t", "who", "why"});
  return id;
}

struct Change {
  const char* name;
  const char* sql;
  std::int64_t session;  ///< session of the changed rows
};

class ARow : public ::testing::TestWithParam<Change> {};

TEST_P(ARow, ThatAnotherProgramChangedIsToldAndItsSessionRefused) {
  const TemporaryDirectory dir;
  const auto path = dir / "j.db";
  {
    Journal journal(path);
    fill_all(journal);
    fill_all(journal);
  }
  Database(path).execute(GetParam().sql);
  Journal journal(path);
  const std::int64_t bad = GetParam().session, good = 3 - bad;
  const auto refused = [&](const std::function<void()>& act) {
    try {
      act();
      return std::string();
    } catch (const DamagedError& error) {
      return std::string(error.what());
    }
  };
  const std::string session = "session " + std::to_string(bad) + ": row ";
  EXPECT_NE(refused([&] { journal.session(bad); }).find(session), std::string::npos);
  EXPECT_NE(refused([&] { journal.touches(bad); }).find(session), std::string::npos);
  EXPECT_NE(refused([&] { journal.readings(bad); }).find(session), std::string::npos);
  EXPECT_NE(refused([&] { journal.events(bad); }).find(session), std::string::npos);
  EXPECT_EQ(journal.touches(good).size(), 3u) << "the other session is as good as before";
  ASSERT_EQ(journal.sessions().size(), 2u);
  EXPECT_EQ(journal.sessions()[bad == 2 ? 0 : 1].state, RecordState::kDamaged);
  EXPECT_NE(journal.sessions()[bad == 2 ? 1 : 0].state, RecordState::kDamaged);
  if (bad == 2) {
    EXPECT_FALSE(journal.remarks().empty()) << "of the newest it is told at once";
    EXPECT_NE(refused([&] { journal.newest_resumable(); }).find(session), std::string::npos);
  }
}

TEST(APageOfSessions, IsThatPartOfAllOfThemWithThoseThatWereTakenOut) {
  const TemporaryDirectory dir;
  const auto path = dir / "j.db";
  {
    Journal journal(path);
    for (int i = 0; i < 7; ++i) fill(journal, 1);
  }
  // The newest, two consecutive ones, and the oldest.
  Database(path).execute("PRAGMA foreign_keys=OFF; DELETE FROM session WHERE id IN (1, 4, 5, 7)");
  Journal journal(path);
  const std::vector<SessionRecord> all = journal.sessions();
  ASSERT_EQ(all.size(), 7u);
  for (std::int64_t before = 0; before <= 9; ++before)
    for (std::size_t most = 0; most <= 8; ++most) {
      std::vector<std::pair<std::int64_t, RecordState>> expected, page;
      for (const SessionRecord& one : all)
        if (one.id < before && expected.size() < most) expected.emplace_back(one.id, one.state);
      for (const SessionRecord& one : journal.sessions(before, most))
        page.emplace_back(one.id, one.state);
      EXPECT_EQ(page, expected) << most << " before " << before;
    }
  EXPECT_EQ(journal.newest_own()->id, 7);
  EXPECT_THROW((void)journal.newest_resumable(), DamagedError) << "nobody knows how it ended";
}

const Change kChanges[] = {
    {"an_angle", "UPDATE touch SET joint_rad = zeroblob(16) WHERE session=2 AND number=1", 2},
    {"a_target", "UPDATE touch SET target='S2' WHERE session=1 AND number=0", 1},
    {"a_reading", "UPDATE reading SET along_m=0.5 WHERE session=2 AND rowid=8", 2},
    {"an_event", "UPDATE event SET words='nothing' WHERE session=2", 2},
    {"a_change_of_phase", "UPDATE change SET clock_s=9.0 WHERE session=2", 2},
    {"a_contact", "UPDATE contact SET ticks=9 WHERE session=1", 1},
    {"an_activation", "UPDATE activation SET who='another' WHERE session=2", 2},
    {"the_cell_file", "UPDATE session SET cell_text='other' WHERE id=2", 2},
    {"the_state", "UPDATE session SET state='done' WHERE id=1", 1},
    {"a_touch_taken_out", "DELETE FROM touch WHERE session=2 AND number=2", 2},
    {"a_touch_put_in",
     "INSERT INTO touch SELECT session, 7, joint_rad, target, held_out, sigma_m, radius_m, "
     "tracker_m, time, settled_rad, readings, spread_m, speed_m_s, tool, turn_sigma_rad, "
     "tracker_abc_rad, approach, temperature_c, load, positioner_rad FROM touch "
     "WHERE session=2 AND number=0",
     2},
    {"two_touches_exchanged",
     "UPDATE touch SET number=-number WHERE session=2 AND number IN (1, 2);"
     "UPDATE touch SET number=3+number WHERE session=2 AND number<0",
     2},
    {"a_session_taken_out", "DELETE FROM session WHERE id=2", 2},
};

INSTANTIATE_TEST_SUITE_P(Journal, ARow, ::testing::ValuesIn(kChanges),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(AJournal, IsRefusedWhenItsChecksumsThemselvesWereChanged) {
  for (const char* sql :
       {"UPDATE chain SET digest='0' WHERE number=9", "UPDATE chain SET sum='0' WHERE number=9",
        "UPDATE chain SET session=1 WHERE number=25", "DELETE FROM chain WHERE number=9"}) {
    const TemporaryDirectory dir;
    {
      Journal journal(dir / "j.db");
      fill(journal, 3);
      fill(journal, 3);
    }
    Database(dir / "j.db").execute(sql);
    EXPECT_NE(refusal(dir / "j.db").find("of its checksums"), std::string::npos) << sql;
  }
}

TEST(AHeadFile, ThatIsDamagedInItsNewestLineFallsBackToTheOneBefore) {
  const TemporaryDirectory dir;
  const auto head = dir / "j.db.head";
  {
    Journal journal(dir / "j.db");
    fill(journal, 2);
  }
  const auto size = std::filesystem::file_size(head);
  for (const std::uintmax_t byte : {size / 4, 3 * size / 4}) {
    flip_bit(head, 8 * byte);
    EXPECT_EQ(refusal(dir / "j.db"), "") << "one line is whole";
    flip_bit(head, 8 * byte);
  }
  flip_bit(head, 8 * (size / 4));
  flip_bit(head, 8 * (3 * size / 4));
  EXPECT_NE(refusal(dir / "j.db").find("j.db.head is damaged"), std::string::npos);
}

TEST(ASession, ThatCannotBeReadNowIsNotCalledDamaged) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  const std::int64_t id =  // more than SQLite keeps in its cache
      journal.begin({"c", std::string(std::size_t{4} << 20, 'c'), "r", "r", "{}"}, "t0");
  try {
    const AwayDisk away(dir.path());
    journal.session(id);
    FAIL() << "nothing was read";
  } catch (const DamagedError& damaged) {
    FAIL() << damaged.what();
  } catch (const JournalError&) {  // possibly temporary
  }
  EXPECT_EQ(journal.session(id)->inputs.cell_text.size(), std::size_t{4} << 20);
}

enum class Deed { kRemove, kReplace, kCut };

class ALivingJournal : public ::testing::TestWithParam<std::pair<const char*, Deed>> {};

TEST_P(ALivingJournal, WhoseFileIsNoLongerItsOwnTakesNoFurtherTouch) {
  const TemporaryDirectory dir;
  const auto path = dir / "j.db", victim = dir / (std::string("j.db") + GetParam().first);
  Journal journal(path);
  const std::int64_t id = fill(journal, 2);
  EXPECT_NO_THROW(journal.check());
  if (GetParam().second == Deed::kReplace) {
    std::filesystem::copy_file(victim, dir / "copy");
    std::filesystem::rename(dir / "copy", victim);
  } else if (GetParam().second == Deed::kRemove) {
    std::filesystem::remove(victim);
  } else {
    std::filesystem::resize_file(victim, std::filesystem::file_size(victim) / 2);
  }
  EXPECT_THROW(journal.check(), JournalError) << "before the next move";
  EXPECT_THROW(journal.record(id, RecordTouch{2, touch_at(3.0)}), JournalError);
  try {
    journal.check();
  } catch (const JournalError& error) {
    EXPECT_NE(std::string(error.what()).find("restart cellcald"), std::string::npos);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Journal, ALivingJournal,
    ::testing::Values(std::pair{"", Deed::kRemove}, std::pair{"-wal", Deed::kRemove},
                      std::pair{".lock", Deed::kRemove}, std::pair{".head", Deed::kRemove},
                      std::pair{"", Deed::kReplace}, std::pair{"-wal", Deed::kReplace},
                      std::pair{".lock", Deed::kReplace}, std::pair{"-wal", Deed::kCut}));

}  // namespace
}  // namespace cellcal::daemon::testing
