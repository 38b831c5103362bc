#include "daemon/notify/session_news.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/daemon/drift/checked_journal.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon {
namespace {

struct news_of_a_session : ::testing::Test {
  Status ended(Phase phase) {
    Status status;
    status.session = journal.begin({"/c.toml", "c", "r", "r", "{}"}, "t0");
    status.phase = phase;
    return status;
  }
  testing::TemporaryDirectory dir;
  Journal journal{dir / "journal.db"};
};

TEST_F(news_of_a_session, say_how_it_ended_and_whether_the_arm_has_changed) {
  calib::Verdict verdict;
  EXPECT_EQ(news_of(verdict), News::kWithheld);
  verdict.publish = true;
  EXPECT_EQ(news_of(verdict), News::kDone);
  calib::Finding changed;
  changed.kind = calib::FindingKind::kChanged;
  verdict.findings = {changed};
  EXPECT_EQ(news_of(verdict), News::kDrifted);
  const Notice done = news_of(ended(Phase::kDone), journal);
  EXPECT_EQ(done.news, News::kDone);
  EXPECT_EQ(done.cell, "/c.toml");
  EXPECT_EQ(news_of(ended(Phase::kAborted), journal).news, News::kAborted);
  Status failed = ended(Phase::kFailed);
  failed.failure = Failure{FailureKind::kNoContact, "x"};
  EXPECT_EQ(news_of(failed, journal).news, News::kFailed);
  EXPECT_EQ(news_of(failed, journal).failure->kind, FailureKind::kNoContact);
}

TEST_F(news_of_a_session, are_of_a_check_that_the_calibration_holds_or_what_changed) {
  Status status = ended(Phase::kDone);
  status.kind = "check";
  status.results_dir = dir.path().string();
  std::ofstream(dir / "check.json") << R"({"holds": true, "words": ["0.02 mm"]})";
  EXPECT_EQ(news_of(status, journal).news, News::kDone);
  std::ofstream(dir / "check.json") << R"({"holds": false, "words": ["tool: 0.31 mm"]})";
  EXPECT_EQ(news_of(status, journal).news, News::kDrifted);
  EXPECT_EQ(news_of(status, journal).findings, std::vector<std::string>{"tool: 0.31 mm"});
  std::ofstream(dir / "check.json") << "{";  // is told, with what is wrong
  EXPECT_EQ(news_of(status, journal).findings.size(), 1U);
}

TEST_F(news_of_a_session, are_known_before_its_end_is_on_disk_with_why_it_failed) {
  const RecordEnd failed{Ending::kFailed, "no-contact: x", Failure{FailureKind::kNoContact, "x"}};
  const std::int64_t session = ended(Phase::kFailed).session;
  const Notice notice = news_of_end(session, failed, "t9", dir.path(), journal);
  EXPECT_EQ(notice.news, News::kFailed);
  EXPECT_EQ(notice.failure->kind, FailureKind::kNoContact);
  EXPECT_EQ(notice.ended, "t9");
  EXPECT_FALSE(notice.cell.empty());
  EXPECT_EQ(news_of_end(session, RecordEnd{Ending::kDone, ""}, "t9", dir.path(), journal).news,
            News::kDone);
}

TEST(news_of_a_check, that_holds_are_of_drift_where_the_control_chart_alarms) {
  testing::CheckedJournal checked;
  Status status;
  status.kind = "check";
  status.phase = Phase::kDone;
  const auto news = [&](double shift_m) {
    status.session = checked.check({.shift_m = {shift_m, 0, 0}});
    status.results_dir = checked.results_dir(status.session).string();
    std::ofstream(checked.results_dir(status.session) / "check.json")
        << R"({"holds": true, "words": ["w"]})";
    return news_of(status, checked.journal);
  };
  for (int k = 0; k < 12; ++k) EXPECT_EQ(news(0.0).news, News::kDone);
  news(0.3e-3);
  const Notice drifted = news(0.3e-3);
  EXPECT_EQ(drifted.news, News::kDrifted);
  EXPECT_GT(drifted.findings.size(), 2U) << "since when, and what to do";
}

TEST(news_of_the_schedule, are_told_where_a_window_passed_without_its_session) {
  Decision decision;
  decision.entry = "nightly";
  decision.night = "2026-11-22";
  decision.verb = Verb::kMissed;
  decision.why = Why::kFailedBefore;
  const auto notice = news_of(decision);
  ASSERT_TRUE(notice);
  EXPECT_EQ(notice->news, News::kNotBegun);
  EXPECT_NE(notice->why.find("--release"), std::string::npos) << notice->why;
  decision.verb = Verb::kWaiting;
  EXPECT_FALSE(news_of(decision));
  decision.verb = Verb::kBegun;
  EXPECT_FALSE(news_of(decision));
}

}  // namespace
}  // namespace cellcal::daemon
