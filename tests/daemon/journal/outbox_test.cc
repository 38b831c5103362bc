// The journal's outbox of reports.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include "daemon/journal/store/sqlite.h"
#include "images.h"
#include "plain_reporter.h"
#include "temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

constexpr std::size_t kAll = 100000;
constexpr const char* kDropped = R"({"first":%ld,"last":%ld,"count":%ld})";
constexpr std::array kTip{1.0, 0.0, 0.5};

std::int64_t begin(Journal& journal) { return journal.begin({"c", "c", "r", "r", "{}"}, "t0"); }

struct OutboxTest : ::testing::Test {
  std::unique_ptr<Journal> open(std::int64_t most = 1 << 20, std::size_t size = 1) {
    auto journal = std::make_unique<Journal>(dir / "j.db");
    journal->report_to(std::make_shared<const PlainReporter>(most, size));
    return journal;
  }
  TemporaryDirectory dir;
};

TEST_F(OutboxTest, HasEveryFactInItsOrderAndNumbersThatCountUpByOne) {
  const auto journal = open();
  const std::int64_t id = begin(*journal);
  RecordChange change;
  change.change = {Phase::kPlanning, Phase::kTransit};
  journal->note(id, change);
  journal->record(id, RecordTouch{0, touch_at(0.1)});
  journal->store_calibration(id, "one");
  journal->record(id, RecordEnd{Ending::kDone, ""}, "t1");
  journal->activate({id, "t2", "anna", "why"});
  journal->report(0, {"health", Worth::kTelemetry, "well"});
  EXPECT_EQ(words_of(journal->waiting(0, kAll)),
            "1 session running\n2 phase transit\n3 touch 0.\n4 calibration \n5 session done\n"
            "6 activation anna\n7 health well\n");
  EXPECT_EQ(journal->waiting(0, kAll)[4].time, "t1");
  EXPECT_EQ(words_of(journal->waiting(5, 1)), "6 activation anna\n");
  EXPECT_EQ(journal->outbox().newest, 7);
}

TEST_F(OutboxTest, StaysEmptyWhileNobodyIsTold) {
  Journal journal(dir / "j.db");
  journal.record(fill(journal, 2), RecordEnd{Ending::kDone, ""}, "t1");
  journal.report(0, {"health", Worth::kTelemetry, "well"});
  EXPECT_EQ(journal.outbox().rows, 0);
  EXPECT_EQ(journal.outbox().newest, 0);
}

TEST_F(OutboxTest, KeepsWhatIsNotAcknowledgedAndUsesNoNumberTwice) {
  std::string source;
  {
    const auto journal = open();
    fill(*journal, 2);
    const auto rows = journal->waiting(0, kAll);
    journal->acknowledge({rows[0].row, rows[1].row, rows[2].row});
    EXPECT_EQ(journal->outbox().bytes, 0);
    source = rows[0].source;
  }
  const auto journal = open();
  const auto rows = journal->waiting(0, kAll);
  EXPECT_EQ(words_of(rows), "4 session interrupted\n") << "the daemon went away in its midst";
  EXPECT_EQ(rows[0].source, source);
}

TEST_F(OutboxTest, TellsOnceOfASessionThatWasFoundInterrupted) {
  fill(*open(), 1);
  open();
  EXPECT_EQ(words_of(open()->waiting(2, kAll)), "3 session interrupted\n");
  open()->resume(1, "t5");
  EXPECT_EQ(words_of(open()->waiting(3, kAll)), "4 session running\n5 session interrupted\n");
}

TEST_F(OutboxTest, TellsNothingOfSessionsOfOtherJournals) {
  const TemporaryDirectory elsewhere;
  std::string rows;
  {
    Journal other(elsewhere / "j.db");
    rows = other.rows(fill(other, 2));
  }
  const auto journal = open();
  journal->import(rows, "x");
  journal->report_to(std::make_shared<const PlainReporter>());
  EXPECT_EQ(journal->outbox().newest, 0);
}

TEST_F(OutboxTest, TellsOfACalibrationWithTheEndOfASessionThatIsDoneAndOnlyThen) {
  const auto journal = open();
  const std::int64_t id = begin(*journal);
  journal->store_calibration(id, "one");
  journal->record(id, RecordEnd{Ending::kAborted, ""}, "t1");
  EXPECT_EQ(words_of(journal->waiting(1, kAll)), "2 session aborted\n");
  EXPECT_THROW(journal->store_calibration(id, "of a report that was not called off"), JournalError);
  EXPECT_EQ(journal->session(id)->calibration, "one");
  journal->resume(id, "t2");
  journal->store_calibration(id, "two");
  EXPECT_EQ(words_of(journal->waiting(2, kAll)), "3 session running\n");
  journal->record(id, RecordEnd{Ending::kDone, ""}, "t3");
  EXPECT_EQ(words_of(journal->waiting(3, kAll)), "4 calibration \n5 session done\n");
  EXPECT_EQ(journal->waiting(3, kAll)[0].time, "t3");
  journal->record(id, RecordEnd{Ending::kAborted, "too late"}, "t4");
  EXPECT_EQ(journal->session(id)->state, RecordState::kDone);
  EXPECT_EQ(journal->outbox().newest, 5);
}

TEST_F(OutboxTest, BeyondItsBoundDropsTheOldestTelemetrySaysWhichAndNeverAResult) {
  const auto journal = open(6000, 300);
  const std::int64_t id = begin(*journal);
  for (std::size_t i = 0; i < 60; ++i) {
    journal->record(id, RecordTouch{i, touch_at(0.1)});
    if (i % 20 == 0) journal->activate({id, "t", "anna", ""});
    ASSERT_LE(journal->outbox().bytes, 6000);
  }
  std::int64_t results = 0, telemetry = 0, first_kept = 0;
  const auto rows = journal->waiting(0, kAll);
  for (const WaitingReport& row : rows) {
    results += row.report.kind == "session" || row.report.kind == "activation" ? 1 : 0;
    if (row.report.kind != "touch") continue;
    if (telemetry++ == 0) first_kept = row.number;
  }
  EXPECT_EQ(results, 4);
  EXPECT_GE(telemetry, 3);
  EXPECT_EQ(telemetry + journal->outbox().dropped, 60);
  EXPECT_EQ(rows[1].number, 3) << "the second fact, the oldest telemetry, is gone";
  EXPECT_EQ(rows[1].report.kind, "activation");
  std::int64_t reported = 0, last = 0;
  for (const WaitingReport& row : rows) {
    if (row.report.kind != "dropped") continue;
    std::int64_t first = 0, count = 0;
    ASSERT_EQ(std::sscanf(row.report.body.c_str(), kDropped, &first, &last, &count), 3);
    reported += count;
  }
  EXPECT_EQ(reported, journal->outbox().dropped);
  EXPECT_LT(last, first_kept);
}

TEST_F(OutboxTest, ThatResultsAloneFillTakesNoTelemetryAndAllResults) {
  const auto journal = open(1000);
  const std::int64_t id = begin(*journal);
  for (int i = 0; i < 20; ++i) journal->activate({id, "t", "anna", ""});
  journal->record(id, RecordTouch{0, touch_at(0.1)});
  EXPECT_EQ(journal->outbox().rows, 21);
  EXPECT_EQ(journal->outbox().not_begun, 1);
  EXPECT_EQ(journal->outbox().newest, 21) << "no number is used for it";
}

/// No file of this process may grow beyond `bytes` during its lifetime.
class FileSizeLimit {
 public:
  explicit FileSizeLimit(rlim_t bytes) {
    ::signal(SIGXFSZ, SIG_IGN);
    ::getrlimit(RLIMIT_FSIZE, &before_);
    const rlimit limited{bytes, before_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limited);
  }
  ~FileSizeLimit() { ::setrlimit(RLIMIT_FSIZE, &before_); }
  FileSizeLimit(const FileSizeLimit&) = delete;
  FileSizeLimit& operator=(const FileSizeLimit&) = delete;

 private:
  rlimit before_{};
};

TEST_F(OutboxTest, OnAFullDiskGivesTelemetryUpBeforeATouchIsLost) {
  const auto journal = open(1 << 22, 3000);
  const std::int64_t id = begin(*journal);
  std::size_t made = 0, at_drop = 0;
  const FileSizeLimit limit(512 * 1024);
  try {
    for (; made < 5000; ++made) {
      journal->record(id, RecordTouch{made, touch_at(0.1)});
      if (at_drop == 0 && journal->outbox().dropped > 0) at_drop = made;
    }
    FAIL() << "the limit was never met";
  } catch (const JournalError& full) {
    ASSERT_GT(at_drop, 0u) << full.what();
  }
  EXPECT_GT(made, 2 * at_drop) << "what was given up made room for touches";
  EXPECT_EQ(journal->touches(id).size(), made);
  EXPECT_EQ(journal->waiting(0, 1)[0].report.kind, "session");
}

TEST_F(OutboxTest, OfACopyGoesOnUnderAnotherNameAndSendsWhatWaitsUnderTheOldOne) {
  const TemporaryDirectory copy;
  const auto living = open();
  const std::int64_t id = fill(*living, 1);
  living->activate({id, "t", "anna", ""});
  living->backup(copy / "j.db");
  living->activate({id, "t", "ben", ""});
  Journal restored(copy / "j.db");
  restored.report_to(std::make_shared<const PlainReporter>());
  restored.activate({id, "t", "cleo", ""});
  const auto rows = restored.waiting(0, kAll), before = living->waiting(0, kAll);
  EXPECT_EQ(words_of(rows),
            "1 session running\n2 dropped {\"first\":2,\"last\":2,\"count\":1}\n3 activation anna\n"
            "1 session interrupted\n2 activation cleo\n")
      << "under the old name no number that the living journal may use, too";
  EXPECT_EQ(rows[0].source, before[0].source);
  EXPECT_EQ(rows[2].source, before[0].source);
  EXPECT_NE(rows[3].source, before[0].source);
  EXPECT_EQ(rows[4].source, restored.outbox().source);
}

TEST_F(OutboxTest, KeepsATouchBackUntilItIsAssessedOrTheNextIsMadeOrTheSessionEnds) {
  const auto journal = open();
  const std::int64_t id = begin(*journal);
  journal->record(id, RecordTouch{0, touch_at(0.1), kTip});
  journal->report(0, {"health", Worth::kTelemetry, "well"});
  EXPECT_EQ(words_of(journal->waiting(0, kAll)), "1 session running\n") << "in order";
  journal->note(id, AssessedTouch{0, 1e-4});
  journal->record(id, RecordTouch{1, touch_at(0.2), kTip});
  EXPECT_EQ(words_of(journal->waiting(1, kAll)), "2 touch 0.assessed\n3 health well\n");
  journal->record(id, RecordTouch{2, touch_at(0.3), kTip});
  journal->note(id, AssessedTouch{1, 1e-4});  // too late: it may have been sent
  EXPECT_EQ(words_of(journal->waiting(3, kAll)), "4 touch 1.\n");
  journal->record(id, RecordEnd{Ending::kDone, ""}, "t1");
  EXPECT_EQ(words_of(journal->waiting(4, kAll)), "5 touch 2.\n6 session done\n");
  std::int64_t bytes = 0;
  for (const WaitingReport& row : journal->waiting(0, kAll))
    bytes += static_cast<std::int64_t>(row.report.body.size()) + 100;
  EXPECT_EQ(journal->outbox().bytes, bytes);
}

TEST_F(OutboxTest, TellsOfAnEndThatAFullDiskDidNotTakeWithItsAlarmOnceThereIsRoom) {
  const auto journal = open();
  const std::int64_t id = begin(*journal);
  journal->record(id, RecordTouch{0, touch_at(0.1), kTip});
  {
    const FileSizeLimit limit(1024);
    const RecordEnd end{Ending::kFailed, "", Failure{FailureKind::kJournal, "full"}};
    EXPECT_THROW(journal->record(id, end, "t1", {{"alarm", Worth::kResult, "failed"}}),
                 JournalError);
  }
  journal->report(0, {"health", Worth::kTelemetry, "well"});
  EXPECT_EQ(words_of(journal->waiting(1, kAll)),
            "2 touch 0.\n3 session failed journal\n4 alarm failed\n5 health well\n");
  EXPECT_EQ(journal->waiting(2, 1)[0].time, "t1");
  EXPECT_EQ(journal->session(id)->state, RecordState::kFailed);
}

TEST_F(OutboxTest, KeepsNoGoodEndThatAFullDiskDidNotTakeSinceTheSessionFailsThen) {
  const auto journal = open();
  const std::int64_t id = begin(*journal);
  journal->store_calibration(id, "one");
  {
    const FileSizeLimit limit(1024);
    EXPECT_THROW(journal->record(id, RecordEnd{Ending::kDone, ""}, "t1"), JournalError);
    EXPECT_THROW(journal->record(id, RecordEnd{Ending::kFailed, "journal: full"}, "t1"),
                 JournalError);
  }
  journal->report(0, {"health", Worth::kTelemetry, "well"});
  EXPECT_EQ(words_of(journal->waiting(1, kAll)), "2 session failed\n3 health well\n");
}

TEST_F(OutboxTest, GivesTelemetryUpOnAFullDiskThoughNobodyIsToldAnyMore) {
  const auto journal = open(1 << 22, 3000);
  const std::int64_t id = begin(*journal);
  const auto reporter = std::make_shared<const PlainReporter>(1 << 22, 3000);
  journal->report_to(reporter);
  std::size_t made = 0;
  for (; made < 50; ++made) journal->record(id, RecordTouch{made, touch_at(0.1)});
  journal->report_no_more_to(*reporter);
  const FileSizeLimit limit(512 * 1024);
  try {
    for (; made < 5000; ++made) journal->record(id, RecordTouch{made, touch_at(0.1)});
    FAIL() << "the limit was never met";
  } catch (const JournalError&) {
    EXPECT_EQ(journal->touches(id).size(), made);
    EXPECT_GT(journal->outbox().dropped, 0u);
  }
}

TEST_F(OutboxTest, HasATouchThatNobodyCouldAssessAnyMoreAsItWasMade) {
  const std::int64_t id = begin(*open());
  open()->record(id, RecordTouch{0, touch_at(0.1), kTip});
  EXPECT_EQ(words_of(open()->waiting(1, kAll)), "2 session interrupted\n3 touch 0.\n");
}

TEST_F(OutboxTest, TellsWithASessionsEndWhyItFailedAndWhatGoesWithIt) {
  const auto journal = open();
  const std::int64_t id = begin(*journal);
  const RecordEnd end{Ending::kFailed, "no-contact: x", Failure{FailureKind::kNoContact, "x"}};
  journal->record(id, end, "t1", {{"alarm", Worth::kResult, "failed"}});
  EXPECT_EQ(words_of(journal->waiting(1, kAll)), "2 session failed no-contact\n3 alarm failed\n");
  EXPECT_EQ(journal->waiting(2, kAll)[0].time, "t1");
}

TEST_F(OutboxTest, TellsAnotherResultInThePlaceOfOneThatNobodyTakes) {
  const auto journal = open();
  const std::int64_t id = begin(*journal);
  journal->activate({id, "t", "ben", ""});
  journal->activate({id, "t", "anna", ""});
  journal->replace(journal->waiting(1, 1)[0].row, {"dropped", Worth::kResult, "2"});
  EXPECT_EQ(words_of(journal->waiting(0, kAll)),
            "1 session running\n2 dropped 2\n3 activation anna\n");
  const std::int64_t bytes = journal->outbox().bytes;
  journal->replace(99, {"dropped", Worth::kResult, "99"});
  EXPECT_EQ(journal->outbox().bytes, bytes);
}

TEST_F(OutboxTest, UnderAnotherNameBeginsAnewAndKeepsWhatWaitsForTheNameThatItWasWrittenUnder) {
  const auto journal = std::make_unique<Journal>(dir / "j.db");
  const auto speak_as = [&](const char* name) {
    journal->report_to(std::make_shared<const PlainReporter>(1 << 20, 1, name));
  };
  speak_as("graz/weld-3");
  const std::int64_t id = begin(*journal);
  const std::string source = journal->outbox().source;
  journal->record(id, RecordTouch{0, touch_at(0.1), kTip});
  speak_as("graz/weld-3");
  EXPECT_EQ(journal->outbox().source, source);
  speak_as("graz/weld-4");
  EXPECT_NE(journal->outbox().source, source);
  journal->activate({id, "t", "anna", ""});
  EXPECT_EQ(words_of(journal->waiting(0, kAll)), "1 session running\n2 activation anna\n");
  EXPECT_EQ(journal->outbox().elsewhere, 2);
  EXPECT_EQ(journal->outbox().elsewhere_address, "graz/weld-3");
  speak_as("graz/weld-3");
  EXPECT_EQ(words_of(journal->waiting(0, kAll)),
            "1 session running\n3 dropped {\"first\":2,\"last\":2,\"count\":1}\n"
            "1 session running\n");
  EXPECT_EQ(journal->waiting(0, kAll)[0].source, source);
  EXPECT_EQ(journal->outbox().elsewhere, 2);
  EXPECT_EQ(journal->outbox().newest, 1)
      << "a third source: numbers of the first are told already, up to where it ended";
}

struct ReporterOfUse : PlainReporter {
  ReporterOfUse(const char* name, std::int64_t session)
      : PlainReporter(1 << 20, 1, name), used(session) {}
  std::int64_t in_use(Journal& journal) const override { return journal.session(used) ? used : 0; }
  std::int64_t used;
};

TEST_F(OutboxTest, UnderANewNameBeginsWithWhatIsInUseAndTheNewestSessionInTheirOrder) {
  Journal journal(dir / "j.db");
  const auto speak_as = [&](const char* name, std::int64_t used) {
    journal.report_to(std::make_shared<const ReporterOfUse>(name, used));
    return words_of(journal.waiting(0, kAll));
  };
  EXPECT_EQ(speak_as("graz/weld-2", 1), "");
  journal.report_to(nullptr);
  for (const char* end : {"t1", "t2"}) {
    const std::int64_t id = begin(journal);
    journal.store_calibration(id, "one");
    journal.record(id, RecordEnd{Ending::kDone, ""}, end);
  }
  EXPECT_EQ(speak_as("graz/weld-3", 2), "1 calibration \n2 session done\n");
  journal.activate({1, "t3", "anna", "why"});
  EXPECT_EQ(speak_as("graz/weld-4", 1),
            "1 calibration \n2 calibration \n3 session done\n4 activation anna\n");
  EXPECT_EQ(journal.waiting(0, 1)[0].session, 1);
  EXPECT_EQ(journal.waiting(0, 1)[0].time, "t1");
  journal.record(begin(journal), RecordEnd{Ending::kAborted, ""}, "t4");
  EXPECT_EQ(speak_as("graz/weld-5", 1), "1 calibration \n2 activation anna\n3 session aborted\n");
}

TEST_F(OutboxTest, OfACopyUsesNoNumberOfTheJournalThatGoesOnThoughItHasThatOnesHead) {
  std::string source;
  const TemporaryDirectory copy;
  {
    const auto living = open();
    fill(*living, 1);
    living->backup(copy / "j.db");
    living->report(0, {"health", Worth::kResult, "told, and no row of the chain"});
    source = living->outbox().source;
    EXPECT_EQ(living->outbox().newest, 3);
  }
  for (const char* log : {"j.db-wal", "j.db-shm"}) std::filesystem::remove(dir / log);
  std::filesystem::copy_file(copy / "j.db", dir / "j.db",
                             std::filesystem::copy_options::overwrite_existing);
  Journal restored(dir / "j.db");
  EXPECT_TRUE(restored.remarks().empty()) << "its head is the right one";
  EXPECT_NE(restored.outbox().source, source);
  EXPECT_EQ(restored.outbox().newest, 0);
}

TEST_F(OutboxTest, IsToldNothingByWhatAReporterCannotSayAndTheTouchStands) {
  struct Broken : PlainReporter {
    std::vector<Report> touch(const RecordTouch&) const override { throw std::runtime_error("x"); }
  };
  Journal journal(dir / "j.db");
  journal.report_to(std::make_shared<const Broken>());
  EXPECT_EQ(journal.touches(fill(journal, 2)).size(), 2u);
  EXPECT_EQ(journal.outbox().not_begun, 2);
}

}  // namespace
}  // namespace cellcal::daemon::testing
