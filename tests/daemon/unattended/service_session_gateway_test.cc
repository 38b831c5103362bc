// The schedule with the daemon's own sessions, in virtual time.

#include "daemon/unattended/service_session_gateway.h"

#include <gtest/gtest.h>

#include <thread>

#include "daemon/backends/backends.h"
#include "daemon/config/config.h"
#include "daemon/unattended/notice.h"
#include "daemon/unattended/schedule.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon {
namespace {

/// The daemon's sessions; for the first backends the sensor's port of the cell is missing.
struct UnattendedSession : ::testing::Test {
  ScheduledSession session() const {
    ScheduledSession session;
    session.name = "nightly";
    session.cell = CELLCAL_DEMO_CELL;
    session.window.from_min = 0;
    session.window.to_min = 23 * 60 + 59;
    session.touches = 8;
    session.check = 0;
    return session;
  }
  std::unique_ptr<Backend> backend(const calib::Cell& cell) {
    if (++made <= broken) {
      testing::Script script;
      script.open_contact_error = "/dev/ttyUSB0: no such device";
      auto fake = std::make_unique<testing::FakeBackend>(script);
      fake->is_emulated = true;  // as the one that it is resumed on
      return fake;
    }
    return make_mock_backend(
        parse_config("format = \"cellcal.daemon/1\"\nbackend = \"mock\"\n", "d"), cell);
  }
  /// Within the window, as of the state in this journal.
  std::unique_ptr<Schedule> schedule_of(SessionGateway& cell, Journal& rows) {
    return std::make_unique<Schedule>(Schedule::Parts{
        cell,
        {[&rows] { return rows.schedule(); },
         [&rows](const std::string& state) { rows.store_schedule(state); }},
        [this] {
          ScheduleConfig config;
          config.unattended = true;
          config.program_start = ProgramStart::kCell;
          config.responsible = "A. Miller";
          config.resumes = 1;
          config.resume_wait_s = 60.0;
          config.sessions = {session()};
          return config;
        },
        {[this] { return utc; }, [this] { return steady; }, "boot", [] { return true; }},
        {}});
  }
  void wait() {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(120);
    while (!is_final(service.status().phase) && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }

  UtcSeconds utc = 1'800'000'000 - 1'800'000'000 % 86400 + 43200;
  Schedule::Steady steady{std::chrono::hours(1)};
  int made = 0, broken = 0;
  testing::TemporaryDirectory dir;
  Journal journal{dir / "journal.db"};
  SessionService service{
      {journal,
       dir.path(),
       [this](const calib::Cell& cell, double, const std::string&) { return backend(cell); },
       {}}};
  ServiceSessionGateway gateway{service, journal};
};

TEST_F(UnattendedSession, BeginsFailsHarmlesslyIsResumedAndDoneWithItsEvidenceInTheJournal) {
  broken = 1;
  const auto schedule = schedule_of(gateway, journal);
  schedule->release("A. Miller");  // the journal is new
  const auto pass = [&](int seconds) {
    utc += seconds;
    steady += std::chrono::seconds(seconds);
    schedule->update();
  };
  pass(5);
  ASSERT_EQ(service.status().session, 1);
  wait();
  ASSERT_TRUE(service.status().failure);
  EXPECT_EQ(service.status().failure->kind, FailureKind::kDevice);
  pass(5);
  EXPECT_EQ(made, 1) << "not before its time";
  pass(60);
  wait();
  EXPECT_EQ(service.status().phase, Phase::kDone)
      << describe(service.status().failure.value_or(Failure{}));
  pass(5);
  EXPECT_EQ(schedule->picture().entries[0].last->why, Why::kDone);
  EXPECT_EQ(journal.sessions().size(), 1u);
  int said = 0;
  for (const std::string& event : journal.events(1))
    said += event.find("responsible for the clear cell: A. Miller") != std::string::npos ? 1 : 0;
  EXPECT_EQ(said, 2) << "when it began, and when it was resumed";
  EXPECT_LT(gateway.foreseen_s(session()), 3600.0) << "by the one that was done";
}

TEST_F(UnattendedSession, IsNotBegunInANewJournalNorInARestoredCopyUntilReleasedThroughRestarts) {
  broken = 9;
  auto schedule = schedule_of(gateway, journal);
  schedule->update();
  EXPECT_EQ(schedule->picture().held, Why::kPastUnknown) << "new";
  schedule->release("A. Miller");
  schedule = schedule_of(gateway, journal);
  EXPECT_EQ(schedule->picture().held, Why::kNothing) << "known since";
  schedule->update();
  wait();
  EXPECT_EQ(service.status().session, 1);
  schedule->release("A. Miller");
  journal.backup(dir / "restored.db");
  EXPECT_FALSE(service.abort()) << "after the copy";
  schedule->update();
  EXPECT_EQ(schedule->picture().held, Why::kAbortedBefore) << "also after an end that was released";
  for (int start = 0; start < 2;
       ++start) {  // the daemon ends before the schedule has stored anything
    Journal restored(dir / "restored.db");
    SessionService after{{restored, dir.path(), {}, {}}};
    ServiceSessionGateway cell(after, restored);
    EXPECT_EQ(schedule_of(cell, restored)->picture().held, Why::kPastUnknown) << start;
  }
  Journal restored(dir / "restored.db");
  SessionService after{{restored, dir.path(), {}, {}}};
  ServiceSessionGateway cell(after, restored);
  schedule_of(cell, restored)->update();
  EXPECT_EQ(restored.sessions().size(), 1u);
  EXPECT_EQ(schedule_of(cell, restored)->picture().held, Why::kPastUnknown) << "as stored";
  schedule_of(cell, restored)->release("A. Miller");
  EXPECT_EQ(schedule_of(cell, restored)->picture().held, Why::kNothing);
}

TEST_F(UnattendedSession, ChangesTheStatusWhereItIsHeldOrReleased) {
  const auto schedule = schedule_of(gateway, journal);
  const Status held = service.status();
  ASSERT_TRUE(held.schedule) << "before anything can be asked";
  EXPECT_FALSE(held.schedule->held.empty());
  schedule->update();
  EXPECT_EQ(service.status().seq, held.seq) << "unchanged";
  schedule->release("A. Miller");
  ASSERT_EQ(service.since(held.seq).size(), 1U);
  EXPECT_TRUE(service.since(held.seq)[0].schedule->open);
  schedule->update();
  ASSERT_EQ(service.status().session, 1);
  wait();
  ASSERT_TRUE(service.status().schedule) << "of a session";
}

TEST_F(UnattendedSession, AbortedByTheDaemonItselfNamesItsCauseAlsoAfterARestart) {
  for (const FailureKind why : {FailureKind::kWindowOver, FailureKind::kDaemonStopped}) {
    gateway.begin(session(), "by", gateway.standing().aborts);
    if (why == FailureKind::kWindowOver) gateway.stop();
    if (why == FailureKind::kDaemonStopped) service.shutdown();
    wait();
    const Status status = service.status();
    ASSERT_EQ(status.phase, Phase::kAborted);
    ASSERT_TRUE(status.failure);
    EXPECT_EQ(status.failure->kind, why);
    const SessionRecord record = *journal.newest_own();
    EXPECT_EQ(record.state, RecordState::kAborted);
    EXPECT_EQ(failure_from_journal(record.failure).kind, why) << record.failure;
    EXPECT_NE(record.failure_words(*calib::Language::of("de")), record.failure);
    EXPECT_EQ(news_of(status, journal).failure->kind, why);
    SessionService after{{journal, dir.path(), {}, {}}};
    ASSERT_TRUE(after.status().interrupted);
    EXPECT_EQ(after.status().interrupted->failure, why);
    EXPECT_EQ(ServiceSessionGateway(after, journal).standing().failure.kind, why);
  }
}

TEST_F(UnattendedSession, IsNotBegunWhereSomebodyHasAbortedMeanwhile) {
  const std::uint64_t seen = gateway.standing().aborts;
  EXPECT_FALSE(service.abort()) << "nothing runs";
  EXPECT_THROW(gateway.begin(session(), "by", seen), NotNow);
  EXPECT_EQ(gateway.standing().aborts, seen + 1);
  EXPECT_TRUE(journal.sessions().empty());
}

TEST_F(UnattendedSession, BeginsWithTheLoadOfItsEntry) {
  ScheduledSession full = session();
  full.load = "full";
  try {
    gateway.begin(full, "by", gateway.standing().aborts);
    ADD_FAILURE() << "the cell has no [[load]]";
  } catch (const RequestError& error) {
    EXPECT_NE(std::string(error.what()).find("load full: the cell has no such [[load]]"),
              std::string::npos)
        << error.what();
  }
}

TEST_F(UnattendedSession, IsForeseenByItsOwnClockNotByOneThatWasSetMeanwhile) {
  const auto done = [this](double lasted_s, const char* ended) {
    const std::int64_t id =
        journal.begin({CELLCAL_DEMO_CELL, "c", "r", "r", "{}"}, "2026-01-01T00:00:00.000Z");
    for (std::size_t i = 0; i < 8; ++i) journal.record(id, RecordTouch{i, {}});
    if (lasted_s > 0.0) {
      journal.note(id, RecordChange{{Phase::kIdle, Phase::kConnecting}, EventKind::kRun, "t", 5.0});
      journal.note(
          id,
          RecordChange{{Phase::kConnecting, Phase::kDone}, EventKind::kRun, "t", 5.0 + lasted_s});
    }
    journal.record(id, RecordEnd{Ending::kDone, ""}, ended);
  };
  const auto foreseen_s = [this] {
    return ServiceSessionGateway(service, journal).foreseen_s(session());
  };
  done(0.0, "2025-06-01T00:00:00.000Z");
  done(0.0, "2026-07-01T00:00:00.000Z");
  EXPECT_EQ(foreseen_s(), 3600.0) << "not known: no phases, and dates of a clock that was set";
  done(600.0, "2026-07-19T00:00:00.000Z");
  EXPECT_NEAR(foreseen_s(), 1.25 * 600.0, 1e-6);
  done(0.0, "2026-01-01T00:20:00.000Z");
  EXPECT_NEAR(foreseen_s(), 1.25 * 1200.0, 1e-6) << "the longer of two, by the wall clock";
}

TEST_F(UnattendedSession, StandsBehindTheEndThatTheJournalHasWhenTheDaemonBegins) {
  const std::int64_t id = journal.begin({"c", "c", "r", "r", "{}"}, "2026-01-01T00:00:00.000Z");
  journal.record(id, RecordEnd{Ending::kFailed, "no-contact: no contact up to 8 mm"},
                 "2026-01-01T00:10:00.000Z");
  SessionService after{{journal, dir.path(), {}, {}}};
  const Standing standing = ServiceSessionGateway(after, journal).standing();
  EXPECT_EQ(standing.session, id);
  EXPECT_EQ(standing.state, Standing::State::kFailed);
  EXPECT_EQ(standing.failure.kind, FailureKind::kNoContact);
  EXPECT_EQ(standing.failure.detail, "no contact up to 8 mm");
}

}  // namespace
}  // namespace cellcal::daemon
