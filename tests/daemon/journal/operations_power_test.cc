// Power cut, process killed, or disk failure at each write of operations other than sessions: import, activation,
// retention.

#include <gtest/gtest.h>

#include <cerrno>

#include "daemon/journal/journal.h"
#include "images.h"
#include "temporary_directory.h"
#include "tests/daemon/journal/disks/losing_disk.h"

namespace cellcal::daemon::testing {
namespace {

constexpr std::size_t kTouchesEach = 3;

void make(const std::filesystem::path& path) {
  Journal journal(path);
  for (const char* day : {"2026-01-01", "2026-01-02", "2026-04-01"}) {
    const std::int64_t id = fill(journal, kTouchesEach);
    journal.record(id, RecordEnd{Ending::kDone, ""}, std::string(day) + "T12:00:00.000Z");
  }
}

const std::string& rows_of_another() {
  static const std::string rows = [] {
    const TemporaryDirectory dir;
    make(dir / "j.db");
    return Journal(dir / "j.db").rows(2);
  }();
  return rows;
}

struct Operation {
  const char* name;
  void (*act)(Journal&);
  /// Number of completed steps, out of `whole`; fails the test for a partial step.
  int (*done)(Journal&);
  int whole;
};

const Operation kOperations[] = {
    {"import", [](Journal& journal) { journal.import(rows_of_another(), "x"); },
     [](Journal& journal) {
       const auto sessions = journal.sessions();
       if (sessions.size() == 3) return 0;
       EXPECT_EQ(sessions.size(), 4u);
       EXPECT_EQ(journal.touches(4).size(), kTouchesEach);
       EXPECT_EQ(journal.readings(4).size(), 2 * kTouchesEach);
       EXPECT_TRUE(journal.session(4)->origin);
       return 1;
     },
     1},
    {"activate",
     [](Journal& journal) {
       if (journal.activations().empty()) journal.activate({1, "t", "anna", "why"});
     },
     [](Journal& journal) {
       const auto all = journal.activations();
       if (!all.empty()) {
         EXPECT_EQ(all[0].reason, "why");
       }
       return static_cast<int>(all.size());
     },
     1},
    {"retain",
     [](Journal& journal) {
       journal.retain({"2026-03-01T00:00:00.000Z", {}}, "t", false);
     },
     [](Journal& journal) {
       int gone = 0;
       for (const std::int64_t id : {1, 2, 3}) {
         const bool dropped = !journal.session(id)->dropped.empty();
         EXPECT_EQ(journal.readings(id).size(), dropped ? 0u : 2 * kTouchesEach);
         EXPECT_EQ(journal.events(id).size(), dropped ? 0u : kTouchesEach);
         EXPECT_EQ(journal.touches(id).size(), kTouchesEach);
         gone += dropped ? 1 : 0;
       }
       return gone;
     },
     2},
};

struct AnOperation : ::testing::TestWithParam<Operation> {
  AnOperation() { make(made / "j.db"); }
  /// All of it or nothing, and it can be completed.
  void expect_whole(const std::filesystem::path& path, const std::string& where) {
    ASSERT_EQ(refusal(path), "") << where;
    Journal journal(path);
    const int done = GetParam().done(journal);
    halfway += done > 0 && done < GetParam().whole ? 1 : 0;
    for (const SessionRecord& one : journal.sessions())
      ASSERT_EQ(one.state, RecordState::kDone) << where;
    GetParam().act(journal);
    ASSERT_EQ(GetParam().done(journal), GetParam().whole) << where;
    ASSERT_EQ(journal.sessions().size(), GetParam().name == std::string("import") ? 4u : 3u)
        << where;
  }
  TemporaryDirectory made;
  int halfway = 0;
};

TEST_P(AnOperation, WhosePowerIsCutAtAnyWriteIsWholeOrNotThere) {
  for (const Cut::Unsynced unsynced :
       {Cut::Unsynced::kStays, Cut::Unsynced::kLost, Cut::Unsynced::kTorn}) {
    int cuts = 0;
    for (long at = 0;; ++at) {
      const TemporaryDirectory dir;
      copy_journal(made / "j.db", dir / "j.db");
      if (!is_cut_in({dir.path(), at, unsynced, static_cast<unsigned>(at) + 1}, [&] {
            Journal journal(dir / "j.db");
            GetParam().act(journal);
          }))
        break;
      ++cuts;
      expect_whole(dir / "j.db", "cut at write " + std::to_string(at));
      if (HasFatalFailure()) return;
    }
    std::printf("%s cut at each of %d writes: all or nothing of each session\n", GetParam().name,
                cuts);
    EXPECT_GT(cuts, 5);
  }
  if (GetParam().whole > 1) {
    EXPECT_GT(halfway, 0) << "a cut between two of its sessions was never met";
  }
}

TEST_P(AnOperation, WhoseDiskFailsFromAnyWriteOnIsRefusedByNameAndDoneWhenItIsBack) {
  for (const int error : {ENOSPC, EROFS, EIO}) {
    int failed = 0;
    for (long at = 0;; ++at) {
      const TemporaryDirectory dir;
      copy_journal(made / "j.db", dir / "j.db");
      const std::string where = "failed from write " + std::to_string(at);
      bool has_failed = false;
      {
        Journal journal(dir / "j.db");
        {
          const FailingDisk disk(dir.path(), at, error);
          const std::string words = error_of([&] { GetParam().act(journal); });
          has_failed = disk.has_failed();
          if (!words.empty()) {
            EXPECT_TRUE(words.find("Make room") != words.npos || words.find("full") != words.npos ||
                        words.find("heck") != words.npos)
                << where << ": " << words;
          }
        }
        // The same daemon, after the disk has recovered.
        const int before = GetParam().done(journal);
        ASSERT_GE(before, 0);
        ASSERT_EQ(error_of([&] { GetParam().act(journal); }), "") << where;
        ASSERT_EQ(GetParam().done(journal), GetParam().whole) << where;
      }
      if (!has_failed) break;
      ++failed;
      expect_whole(dir / "j.db", where);
      if (HasFatalFailure()) return;
    }
    std::printf("%s: disk %s from each of %d writes on: all or nothing, done when it was back\n",
                GetParam().name,
                error == ENOSPC  ? "full"
                : error == EROFS ? "read-only"
                                 : "broken (EIO)",
                failed);
    EXPECT_GT(failed, 3);
  }
}

INSTANTIATE_TEST_SUITE_P(Journal, AnOperation, ::testing::ValuesIn(kOperations),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace cellcal::daemon::testing
