// The power is cut, or the process killed, at each write while raw rows are dropped.

#include <gtest/gtest.h>

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

struct retention_whose_power_is_cut : ::testing::TestWithParam<Cut::Unsynced> {};

TEST_P(retention_whose_power_is_cut, at_any_write_leaves_each_sessions_raw_rows_whole_or_gone) {
  const TemporaryDirectory made;
  make(made / "j.db");
  int cuts = 0, gone = 0;
  for (long at = 0;; ++at) {
    const TemporaryDirectory dir;
    copy_journal(made / "j.db", dir / "j.db");
    if (!is_cut_in({dir.path(), at, GetParam(), static_cast<unsigned>(at) + 1}, [&] {
          Journal(dir / "j.db").retain({"2026-03-01T00:00:00.000Z", {}}, "t", false);
        }))
      break;
    ++cuts;
    ASSERT_EQ(refusal(dir / "j.db"), "") << "cut at write " << at;
    Journal journal(dir / "j.db");
    for (const std::int64_t id : {1, 2, 3}) {
      ASSERT_EQ(journal.touches(id).size(), kTouchesEach) << at;
      const bool dropped = !journal.session(id)->dropped.empty();
      gone += dropped ? 1 : 0;
      ASSERT_EQ(journal.readings(id).size(), dropped ? 0u : 2 * kTouchesEach) << at;
      ASSERT_EQ(journal.events(id).size(), dropped ? 0u : kTouchesEach) << at;
    }
    // And it can be gone on with to its end.
    journal.retain({"2026-03-01T00:00:00.000Z", {}}, "t", false);
    ASSERT_FALSE(journal.session(2)->dropped.empty()) << at;
  }
  EXPECT_GT(cuts, 5);
  EXPECT_GT(gone, 0) << "a cut between the two sessions was never met";
}

INSTANTIATE_TEST_SUITE_P(journal, retention_whose_power_is_cut,
                         ::testing::Values(Cut::Unsynced::kStays, Cut::Unsynced::kLost,
                                           Cut::Unsynced::kTorn));

}  // namespace
}  // namespace cellcal::daemon::testing
