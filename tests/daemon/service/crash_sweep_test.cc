// A small session with its process killed, or its power cut, at each of its transitions; then it is
// resumed to its end.

#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <set>
#include <thread>

#include "calib/files/input_file.h"
#include "daemon/archive/archive.h"
#include "daemon/backends/backends.h"
#include "daemon/service/journal_recorder.h"
#include "daemon/service/service.h"
#include "daemon/tasks/planned_round.h"
#include "tests/daemon/journal/disks/losing_disk.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

constexpr std::size_t kTouches = 3;

using Watch = std::function<void(const State&, const World&)>;

/// The session of the fakes, with a journal. `watch` is called after each step.
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

/// Checks the journal of a completed session with this many touches.
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
    ASSERT_EQ(end.phase, Phase::kDone) << where << (end.failure ? words(end.failure->detail) : "");
  }
  expect_whole(path, before, where);
}

TEST(ASession, ThatIsKilledAtEachOfItsTransitionsIsResumedToItsEnd) {
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

TEST(ASession, WhosePowerIsCutAtManyOfItsWritesIsResumedToItsEnd) {
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

/// True if the message states a remedy for this error.
bool advises(const std::string& words, int error) {
  return error == ENOSPC ? words.find("full") != words.npos || words.find("ake room") != words.npos
                         : words.find("heck") != words.npos;
}

/// Fails at each write from the nth on; the session must report the failure, with the arm at rest.
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
      const std::string words = calib::words(end.failure->detail);
      EXPECT_TRUE(advises(words, error)) << where << words;
    }
  }
  resume_to_the_end(dir / "j.db", where);
}

TEST(ASession, WhoseDiskIsFullOrTurnsReadOnlyHoldsStillByNameAndIsResumed) {
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

TEST(ASession, HasEveryChangeOfPhaseAndEveryContactInItsRows) {
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
  EXPECT_EQ(contacts, journal.readings(1).size());
  EXPECT_EQ(contacts, 3 * kTouches);
}

/// A daemon's sessions on an emulated cell, in a shared directory with one published calibration.
class ACalibratedCell : public ::testing::TestWithParam<SessionKind> {
 public:
  static RunRequest request(SessionKind kind, int touches = 0) {
    RunRequest wanted;
    wanted.kind = kind;
    wanted.update = kind == SessionKind::kCalibrate && touches == 0;
    wanted.cell = CELLCAL_DEMO_CELL;
    if (touches > 0) wanted.fit_touches = touches;
    wanted.check_touches = touches > 0 ? 6 : 0;
    return wanted;
  }
  /// The final status; none: it did not begin, for this reason.
  struct End {
    std::optional<Status> status;
    std::string refused;
  };
  static End run(Journal& journal, const std::filesystem::path& dir, const RunRequest& wanted) {
    SessionSettings settings;
    SessionService service{
        {journal, dir,
         [](const calib::Cell& cell, double, const std::string&) {
           return make_mock_backend(
               parse_config("format = \"cellcal.daemon/1\"\nbackend = \"mock\"\n"
                            "[motion]\nspeed_percent = 100\nacceleration_deg_s2 = 900\n"
                            "jerk_deg_s3 = 12000\n",
                            "d"),
               cell);
         },
         settings}};
    try {
      service.start(wanted);
    } catch (const std::exception& refused) {
      return {{}, refused.what()};
    }
    while (!is_final(service.status().phase))
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return {service.status(), ""};
  }
  /// Writes between two failures: an update and its continuation take seconds. tests/disk_faults uses smaller steps.
  static long stride() {
    const char* every = std::getenv("CELLCAL_SWEEP_EVERY");
    return every == nullptr ? 421 : std::max(1L, std::strtol(every, nullptr, 10));
  }
  static void sweep(const RunRequest& wanted, int error);
  static const std::filesystem::path& calibrated() {
    static const TemporaryDirectory dir;
    static const bool made = [] {
      Journal journal(dir / "j.db");
      const End end = run(journal, dir.path(), request(SessionKind::kCalibrate, 40));
      return end.status && end.status->phase == Phase::kDone &&
             journal.was_published(1).value_or(false);
    }();
    EXPECT_TRUE(made);
    return dir.path();
  }
};

TEST_P(ACalibratedCell, WhoseDiskFailsInMidSessionHoldsStillByNameKeepsItsCalibrationAndGoesOn) {
  const RunRequest wanted = request(GetParam());
  for (const int error : {ENOSPC, EIO}) sweep(wanted, error);
}

void ACalibratedCell::sweep(const RunRequest& wanted, int error) {
  int failed = 0, refused = 0;
  // The two kinds of failure occur at different writes.
  for (long at = error == EIO ? stride() / 2 : 0;; at += stride()) {
    const TemporaryDirectory dir;
    const std::string where = "failed from write " + std::to_string(at);
    std::filesystem::remove(dir.path());
    std::filesystem::copy(calibrated(), dir.path(), std::filesystem::copy_options::recursive);
    const std::filesystem::path file = dir / "j.db";
    bool has_failed = false;
    {
      Journal journal(file);
      const FailingDisk disk(dir.path(), at, error);
      const End end = run(journal, dir.path(), wanted);
      has_failed = disk.has_failed();
      refused += end.refused.empty() ? 0 : 1;
      if (end.status) {
        EXPECT_NE(end.status->arm.motion, ArmMotion::kMoving) << where;
        failed += end.status->phase == Phase::kFailed ? 1 : 0;
        if (end.status->phase == Phase::kFailed) {
          ASSERT_TRUE(end.status->failure) << where;
          EXPECT_TRUE(end.status->failure->kind == FailureKind::kJournal ||
                      end.status->failure->kind == FailureKind::kReport)
              << where << to_string(end.status->failure->kind);
        }
      } else {
        EXPECT_TRUE(advises(end.refused, error)) << where << end.refused;
      }
    }
    Journal journal(file);
    for (const SessionRecord& one : journal.sessions())
      EXPECT_NE(one.state, RecordState::kDamaged) << where << " " << one.id;
    EXPECT_TRUE(journal.was_published(1).value_or(false)) << where;
    ASSERT_EQ(published_session(journal, CELLCAL_DEMO_CELL, 1).id, 1) << where;
    if (!has_failed) break;
    const End again = run(journal, dir.path(), wanted);
    ASSERT_TRUE(again.status) << where << again.refused;
    EXPECT_EQ(again.status->phase, Phase::kDone) << where;
    if (HasFatalFailure()) return;
  }
  std::printf(
      "%s: disk %s from %d writes on in mid-session, from %d before it began: each held still by name, and "
      "was done when the disk was back\n",
      GetParam() == SessionKind::kQualify ? "qualify" : "update",
      error == ENOSPC ? "full" : "broken (EIO)", failed, refused);
  EXPECT_GE(failed, 3);
}

/// With the file of its calibration, stored next to the journal. `rows_are_there`: an earlier import stopped there.
int fail_each_import(int error, long every, bool rows_are_there) {
  Journal recorded(ACalibratedCell::calibrated() / "j.db");
  const Archive archive = make_archive(recorded, 1, ACalibratedCell::calibrated() / "sessions/1");
  int failed = 0;
  for (long at = 0;; at += every) {
    const TemporaryDirectory dir;
    const std::string where = "failed from write " + std::to_string(at);
    Journal journal(dir / "j.db");
    const auto import = [&] {
      return import_archive(journal, archive, "x", [&](std::int64_t session) {
        return dir / ("sessions/" + std::to_string(session));
      });
    };
    if (rows_are_there) {
      import();
      std::filesystem::remove_all(dir / "sessions");
    }
    bool has_failed = false;
    {
      const FailingDisk disk(dir.path(), at, error);
      try {
        import();
      } catch (const std::exception& refused) {
        EXPECT_TRUE(advises(refused.what(), error)) << where << ": " << refused.what();
      }
      has_failed = disk.has_failed();
    }
    import();
    EXPECT_EQ(journal.sessions().size(), 1u) << where;
    EXPECT_EQ(journal.touches(1), recorded.touches(1)) << where;
    EXPECT_EQ(calib::read_file(dir / "sessions/1/calibration.json"), archive.at("calibration.json"))
        << where;
    if (!has_failed) return failed;
    ++failed;
  }
}

TEST(AnImport, WhoseDiskFailsAtAnyWriteIsRefusedByNameAndWholeWhenItIsBack) {
  constexpr long kShare = 10;  // an import takes less time than a session
  for (const int error : {ENOSPC, EIO}) {
    const int rows =
        fail_each_import(error, std::max(1L, ACalibratedCell::stride() / kShare), false);
    const int files = fail_each_import(error, 1, true);
    std::printf(
        "import of an export: disk %s from %d writes on, from each of %d of its calibration's file: whole when it "
        "was back\n",
        error == ENOSPC ? "full" : "broken (EIO)", rows, files);
    EXPECT_GT(rows, 5);
    EXPECT_GT(files, 1);
  }
}

INSTANTIATE_TEST_SUITE_P(Sessions, ACalibratedCell,
                         ::testing::Values(SessionKind::kCalibrate, SessionKind::kQualify),
                         [](const auto& one) {
                           return std::string(one.param == SessionKind::kQualify ? "qualify"
                                                                                 : "update");
                         });

}  // namespace
}  // namespace cellcal::daemon::testing
