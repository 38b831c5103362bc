#include "daemon/unattended/notice.h"

#include <gtest/gtest.h>

#include "tests/daemon/archive/checked_journal.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon {
namespace {

struct NewsOfASession : ::testing::Test {
  Status ended(Phase phase) {
    Status status;
    status.session = journal.begin({"/c.toml", "c", "r", "r", "{}"}, "t0");
    status.phase = phase;
    return status;
  }
  testing::TemporaryDirectory dir;
  Journal journal{dir / "journal.db"};
};

TEST_F(NewsOfASession, SayHowItEndedAndWhetherTheArmHasChanged) {
  EXPECT_EQ(news_of(OutcomeKind::kWithheld), News::kWithheld);
  EXPECT_EQ(news_of(OutcomeKind::kPublished), News::kDone);
  EXPECT_EQ(news_of(OutcomeKind::kNothingChanged), News::kDone) << "no result is withheld";
  EXPECT_EQ(news_of(OutcomeKind::kDoesNotHold), News::kDrifted);
  EXPECT_EQ(news_of(OutcomeKind::kUndecided), News::kUndecided);
  const Notice done = news_of(ended(Phase::kDone), journal);
  EXPECT_EQ(done.news, News::kDone);
  EXPECT_EQ(done.cell, "/c.toml");
  EXPECT_EQ(news_of(ended(Phase::kAborted), journal).news, News::kAborted);
  Status failed = ended(Phase::kFailed);
  failed.failure = Failure{FailureKind::kNoContact, "x"};
  EXPECT_EQ(news_of(failed, journal).news, News::kFailed);
  EXPECT_EQ(news_of(failed, journal).failure->kind, FailureKind::kNoContact);
}

TEST_F(NewsOfASession, AreOfACheckThatTheCalibrationHoldsOrWhatChanged) {
  Status status = ended(Phase::kDone);
  status.kind = "check";
  status.outcome = SessionOutcome{OutcomeKind::kHolds};
  EXPECT_EQ(news_of(status, journal).news, News::kDone);
  EXPECT_EQ(news_of(status, journal).outcome, "holds");
  status.outcome = SessionOutcome{
      .kind = OutcomeKind::kDoesNotHold,
      .tcp_shift = TcpShift{{0.31e-3, 0.0, 0.0}, 0.05e-3},
      .change = calib::Explanation{
          .kind = calib::ChangeKind::kTool, .name = "probe", .shift_m = {0.31e-3, 0.0, 0.0}}};
  const Notice failed = news_of(status, journal);
  EXPECT_EQ(failed.news, News::kDrifted);
  ASSERT_EQ(failed.findings.size(), 2U);
  EXPECT_EQ(calib::words(failed.findings[0]),
            "calibration does not hold: TCP shift 0.31 ± 0.05 mm (k=2)");
  EXPECT_TRUE(calib::words(failed.findings[1]).starts_with("probe shifted by 0.31"));
}

TEST_F(NewsOfASession, AreKnownBeforeItsEndIsOnDiskWithWhyItFailed) {
  const RecordEnd failed{Ending::kFailed, "no-contact: x", Failure{FailureKind::kNoContact, "x"}};
  const std::int64_t session = ended(Phase::kFailed).session;
  const Notice notice = notice_of_end(session, failed, "t9", journal);
  EXPECT_EQ(notice.news, News::kFailed);
  EXPECT_EQ(notice.failure->kind, FailureKind::kNoContact);
  EXPECT_EQ(notice.ended, "t9");
  EXPECT_FALSE(notice.cell.empty());
  EXPECT_EQ(notice_of_end(session, RecordEnd{Ending::kDone, ""}, "t9", journal).news, News::kDone);
}

TEST(NewsOfACheck, ThatHoldsAreOfDriftWhereTheControlChartAlarms) {
  testing::CheckedJournal checked;
  Status status;
  status.kind = "check";
  status.phase = Phase::kDone;
  const auto news = [&](double shift_m) {
    status.session = checked.check({.shift_m = {shift_m, 0, 0}});
    status.outcome = SessionOutcome{OutcomeKind::kHolds};
    return news_of(status, checked.journal);
  };
  for (int k = 0; k < 12; ++k) EXPECT_EQ(news(0.0).news, News::kDone);
  news(0.3e-3);
  const Notice drifted = news(0.3e-3);
  EXPECT_EQ(drifted.news, News::kDrifted);
  EXPECT_GT(drifted.findings.size(), 2U) << "since when, and what to do";
}

TEST(NewsOfACheck, ThatDoesNotHoldAndOfTheNextThatDoesAreDriftAndItsEnd) {
  testing::CheckedJournal checked;
  Status status;
  status.kind = "check";
  status.phase = Phase::kDone;
  const auto news = [&](const calib::TcpCheck& check) {
    status.session = checked.check({.result = check});
    status.outcome = outcome_of(SessionResult{check});
    return news_of(status, checked.journal);
  };
  using Checked = testing::CheckedJournal;
  EXPECT_EQ(news(Checked::that_holds()).news, News::kDone);
  // A displaced sphere: it does not enter the statistics.
  const Notice moved = news(Checked::that_does_not_hold(calib::ChangeKind::kSphere));
  EXPECT_EQ(moved.news, News::kDrifted);
  EXPECT_EQ(moved.advice, calib::DriftAdvice::kRecalibrate);
  const std::string said = compose(moved, {}, "host").body;
  EXPECT_NE(said.find("Check the likely cause"), std::string::npos) << said;
  EXPECT_EQ(said.find("--accept-change"), std::string::npos) << "of a calibration";
  EXPECT_FALSE(moved.by_chart) << "the check itself says so, with its end";
  const Notice back = news(Checked::that_holds());
  EXPECT_EQ(back.news, News::kRecovered);
  EXPECT_TRUE(back.by_chart) << "told behind its end";
  EXPECT_EQ(news(Checked::that_holds()).news, News::kDone);
}

TEST(NewsOfACheck, OfACalibrationThatIsNotInUseAreNoDrift) {
  testing::CheckedJournal checked;
  const std::int64_t before = checked.calibrated, used = checked.calibrate();
  const auto checked_against = [&](std::int64_t calibration) {
    checked.calibrated = calibration;
    const auto result = testing::CheckedJournal::that_does_not_hold(calib::ChangeKind::kTool);
    const std::int64_t session = checked.check({.result = result});
    RecordEnd end{Ending::kDone, ""};
    end.result = std::make_shared<const SessionResult>(SessionResult{result});
    Status status;
    status.session = session;
    status.kind = "check";
    status.phase = Phase::kDone;
    status.outcome = outcome_of(*end.result);
    const News news = news_of(status, checked.journal).news;
    EXPECT_EQ(notice_of_end(session, end, "t9", checked.journal).news, news);
    return news;
  };
  EXPECT_EQ(checked_against(before), News::kDone);
  EXPECT_EQ(checked_against(used), News::kDrifted);
}

TEST_F(NewsOfASession, AreOfOneThatWasInterruptedByAKilledDaemon) {
  Decision decision;
  decision.verb = Verb::kHeld;
  decision.why = Why::kInterruptedBefore;
  decision.session = journal.begin({"/c.toml", "c", "r", "r", "{}"}, "t0");
  const auto notice = news_of(decision, journal);
  ASSERT_TRUE(notice);
  EXPECT_EQ(notice->news, News::kInterrupted);
  EXPECT_EQ(notice->cell, "/c.toml");
  const Message message = compose(*notice, calib::Language(), "c");
  EXPECT_TRUE(message.subject.starts_with("Session 1: interrupted")) << message.subject;
  EXPECT_NE(message.body.find("--resume"), std::string::npos) << message.body;
}

TEST_F(NewsOfASession, AreToldWhereAWindowPassedWithoutOne) {
  Decision decision;
  decision.entry = "nightly";
  decision.day = "2026-11-22";
  decision.verb = Verb::kMissed;
  decision.why = Why::kFailedBefore;
  const auto notice = news_of(decision, journal);
  ASSERT_TRUE(notice);
  EXPECT_EQ(notice->news, News::kNotBegun);
  EXPECT_NE(words(notice->why).find("--release"), std::string::npos) << words(notice->why);
  const Message german = compose(*notice, *calib::Language::of("de"), "h");
  EXPECT_EQ(german.subject, "Zeitplan 'nightly': im Zeitfenster vom 2026-11-22 nicht begonnen");
  EXPECT_NE(german.body.find("\nBeleg: "), std::string::npos) << german.body;
  decision.verb = Verb::kWaiting;
  EXPECT_FALSE(news_of(decision, journal));
  decision.verb = Verb::kBegun;
  EXPECT_FALSE(news_of(decision, journal));
}

}  // namespace
}  // namespace cellcal::daemon
