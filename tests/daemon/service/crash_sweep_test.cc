// A small session whose process is killed, or whose power is cut, at each of its transitions; then it
// is resumed to its end.

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cerrno>
#include <set>

#include "daemon/service/journal_recorder.h"
#include "tests/daemon/journal/disks/losing_disk.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

constexpr std::size_t kTouches = 3;

using Watch = std::function<void(const State&, const World&)>;

/// The fakes' session, with a journal. `watch` is called after each step.
State run_with(Journal& journal, std::int64_t id, bool resumed, const Watch& watch = {}) {
  FakeBackend backend;
  JournalRecorder recorder(journal, id, backend);
  InlineWorker worker;
  State start;
  start.policy.confirm_every = 1;
  std::vector<calib::Touch> touches;
  if (resumed) {
    touches = journal.touches(id);
    start.resumed = true;
    start.expected_hash = journal.session(id)->plan_hash;
    start.done = touches.size();
    for (const calib::Touch& touch : touches) start.met.push_back(touch.target);
  }
  Runner runner({backend, recorder, worker, worker, line_tasks(kTouches),
                 [&](const State& state, const std::vector<calib::Touch>&) {
                   if (watch) watch(state, backend.world);
                 }},
                start, touches);
  return runner.run();
}

std::int64_t begin(Journal& journal) { return journal.begin({"/c", "c", "/r", "r", "{}"}, "t0"); }

int steps_of_a_whole_session() {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  int steps = 0;
  run_with(journal, begin(journal), false, [&](const State&, const World&) { ++steps; });
  return steps;
}

/// What a session of that many touches has in its journal, once it is done.
void expect_whole(const std::filesystem::path& path, const std::vector<calib::Touch>& before,
                  const std::string& where) {
  Journal journal(path);
  const std::vector<calib::Touch> touches = journal.touches(1);
  ASSERT_EQ(touches.size(), kTouches) << where;
  std::set<std::string> targets;
  for (const calib::Touch& touch : touches) targets.insert(touch.target);
  EXPECT_EQ(targets.size(), kTouches) << where << ": one was doubled";
  for (std::size_t i = 0; i < before.size(); ++i)
    EXPECT_EQ(touches[i], before[i]) << where << ": one was changed";
  EXPECT_EQ(journal.sessions()[0].state, RecordState::kDone) << where;
}

void resume_to_the_end(const std::filesystem::path& path, const std::string& where) {
  std::vector<calib::Touch> before;
  {
    Journal journal(path);
    if (journal.sessions().empty()) begin(journal);  // killed before it was there
    before = journal.touches(1);
    if (journal.sessions()[0].state == RecordState::kDone) return;
    journal.resume(1, "t1");
    const State end = run_with(journal, 1, true);
    ASSERT_EQ(end.phase, Phase::kDone) << where << (end.failure ? end.failure->detail : "");
  }
  expect_whole(path, before, where);
}

TEST(a_session, that_is_killed_at_each_of_its_transitions_is_resumed_to_its_end) {
  const int steps = steps_of_a_whole_session();
  ASSERT_GT(steps, 60);
  for (int nth = 1; nth <= steps; ++nth) {
    const TemporaryDirectory dir;
    // The cut is at the transition, not at a write.
    constexpr long kNoWrite = 1L << 40;
    ASSERT_TRUE(is_cut_in({dir.path(), kNoWrite}, [&] {
      Journal journal(dir / "j.db");
      int step = 0;
      run_with(journal, begin(journal), false, [&](const State&, const World&) {
        if (++step == nth) ::kill(::getpid(), SIGKILL);
      });
    })) << nth;
    resume_to_the_end(dir / "j.db", "killed at transition " + std::to_string(nth));
    if (HasFatalFailure()) return;
  }
  std::printf("killed at each of %d transitions: no touch lost or doubled, all resumed\n", steps);
}

TEST(a_session, whose_power_is_cut_at_many_of_its_writes_is_resumed_to_its_end) {
  int cuts = 0;
  constexpr long kStride = 7;
  for (long at = 0;; at += kStride) {
    const TemporaryDirectory dir;
    const auto unsynced = cuts % 2 == 0 ? Cut::Unsynced::kLost : Cut::Unsynced::kTorn;
    if (!is_cut_in({dir.path(), at, unsynced, static_cast<unsigned>(at) + 1}, [&] {
          Journal journal(dir / "j.db");
          run_with(journal, begin(journal), false);
        }))
      break;
    ++cuts;
    resume_to_the_end(dir / "j.db", "cut at write " + std::to_string(at));
    if (HasFatalFailure()) return;
  }
  std::printf("cut at %d writes: no touch lost or doubled, all resumed\n", cuts);
  EXPECT_GT(cuts, 30);
}

/// Fails at each write from the nth on; the session has to end by name with the arm at rest.
void fail_from(long at, int error, int& failed, bool& went_through) {
  const TemporaryDirectory dir;
  const std::string where = "failed from write " + std::to_string(at);
  {
    Journal journal(dir / "j.db");
    const std::int64_t id = begin(journal);
    const FailingDisk disk(dir.path(), at, error);
    bool moving = true;
    const State end = run_with(journal, id, false, [&](const State& state, const World& world) {
      if (is_final(state.phase)) moving = world.moving;
    });
    went_through = !disk.has_failed();
    if (end.phase == Phase::kFailed) {
      ++failed;
      ASSERT_EQ(end.failure->kind, FailureKind::kJournal) << where;
      EXPECT_FALSE(moving) << where;
      const std::string& words = end.failure->detail;
      const bool advised = error == ENOSPC ? words.find("full") != words.npos ||
                                                 words.find("Make room") != words.npos
                                           : words.find("heck") != words.npos;
      EXPECT_TRUE(advised) << where << words;
    }
  }
  resume_to_the_end(dir / "j.db", where);
}

TEST(a_session, whose_disk_is_full_or_turns_read_only_holds_still_by_name_and_is_resumed) {
  for (const int error : {ENOSPC, EROFS}) {
    int failed = 0;
    bool went_through = false;
    constexpr long kStride = 5;
    for (long at = 0; !went_through; at += kStride) {
      fail_from(at, error, failed, went_through);
      if (HasFatalFailure()) return;
    }
    std::printf("%s from %d writes on: each ended by name, and was resumed\n",
                error == ENOSPC ? "disk full" : "disk read-only", failed);
    EXPECT_GT(failed, 15);
  }
}

TEST(a_session, has_every_change_of_phase_and_every_contact_in_its_rows) {
  const TemporaryDirectory dir;
  std::vector<Phase> phases{Phase::kIdle};
  {
    Journal journal(dir / "j.db");
    run_with(journal, begin(journal), false, [&](const State& state, const World&) {
      if (state.phase != phases.back()) phases.push_back(state.phase);
    });
  }
  Journal journal(dir / "j.db");
  const std::string rows = journal.rows(1);
  std::size_t changes = 0, contacts = 0;
  const auto count = [&](const std::string& what) {
    std::size_t n = 0;
    for (std::size_t at = 0; (at = rows.find(what, at)) != std::string::npos; ++at) ++n;
    return n;
  };
  changes = count("\"table\":\"change\"");
  contacts = count("\"kind\":\"contact\"");
  EXPECT_EQ(changes, phases.size() - 1);
  EXPECT_EQ(contacts, static_cast<std::size_t>(journal.reading_count(1)));
  EXPECT_EQ(contacts, 3 * kTouches);
}

}  // namespace
}  // namespace cellcal::daemon::testing
