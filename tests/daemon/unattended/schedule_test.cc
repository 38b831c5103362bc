#include "daemon/unattended/schedule.h"

#include "tests/daemon/unattended/a_schedule.h"

namespace cellcal::daemon {
namespace {

TEST_F(ASchedule, BeginsNothingWhereNothingStartsTheControllersProgram) {
  config.program_start = ProgramStart::kNone;
  live(10 * kHour);
  EXPECT_TRUE(cell.begun.empty());
  EXPECT_EQ(count(Verb::kWaiting, Why::kNoProgramStart), 1);
  EXPECT_NE(words(reported.back()).find("Unattended at night"), std::string::npos)
      << words(reported.back());
  config.program_start = ProgramStart::kCell;
  pass(600);
  EXPECT_EQ(cell.begun.size(), 1u) << "set up within the window";
}

TEST_F(ASchedule, ResumesBehindTheControllersOwnTestHoweverFewResumesThereAre) {
  config.resumes = 0;
  live(10 * kHour);
  ASSERT_EQ(cell.begun.size(), 1u);
  for (int again = 1; again <= 3; ++again) {
    cell.end(EndState::kFailed, {FailureKind::kControllerTest, "brake test requested"});
    live(600, 30);
    EXPECT_EQ(cell.resumed, again);
  }
  cell.end(EndState::kFailed, {FailureKind::kComputerBusy, "late"});
  live(600, 30);
  EXPECT_EQ(cell.resumed, 3) << "any other failure counts";
}

TEST_F(ASchedule, DoesNotResumeWhereTheProgramsStartWasTakenOutMeanwhile) {
  live(10 * kHour);
  cell.end(EndState::kFailed, {FailureKind::kControllerTest, "brake test requested"});
  pass(30);
  config.program_start = ProgramStart::kNone;
  live(600, 30);
  EXPECT_EQ(cell.resumed, 0);
  EXPECT_EQ(count(Verb::kEnded, Why::kNoProgramStart), 1);
}

TEST_F(ASchedule, BeginsOnceInEachWindowAndNamesWhoIsResponsible) {
  live(10 * kHour - 600);
  EXPECT_TRUE(cell.begun.empty());
  pass(600);
  ASSERT_EQ(cell.begun.size(), 1u);
  EXPECT_NE(cell.said.find("A. Miller"), std::string::npos) << cell.said;
  cell.end(EndState::kDone);
  live(kDay - 600);
  EXPECT_EQ(cell.begun.size(), 1u);
  pass(600);
  EXPECT_EQ(cell.begun.size(), 2u);
  EXPECT_EQ(count(Verb::kEnded, Why::kDone), 1);
}

TEST_F(ASchedule, MovesNothingUnlessSomebodyAnswersForTheCell) {
  config.unattended = false;
  live(kDay);
  EXPECT_TRUE(cell.begun.empty());
  EXPECT_EQ(count(Verb::kWaiting, Why::kUnattendedOff), 1) << "told once";
  EXPECT_EQ(count(Verb::kMissed, Why::kUnattendedOff), 1);
}

TEST_F(ASchedule, BeginsNoneThatWouldRunPastTheWindowsEnd) {
  cell.takes_s = 7.5 * kHour;
  live(kDay);
  EXPECT_TRUE(cell.begun.empty());
  EXPECT_EQ(count(Verb::kRefused, Why::kNoTimeLeft), 1);
  config.sessions[0].minutes = 60.0;
  live(kDay);
  EXPECT_EQ(cell.begun.size(), 1u) << "its own minutes come first";
}

TEST_F(ASchedule, StopsASessionThatStillRunsAtTheWindowsEndAndBeginsTheNextNight) {
  live(18 * kHour);
  EXPECT_EQ(cell.begun.size(), 1u);
  EXPECT_EQ(cell.stopped, 1);
  EXPECT_EQ(count(Verb::kStopped, Why::kWindowOver), 1);
  live(kDay);
  EXPECT_EQ(cell.begun.size(), 2u);
}

TEST_F(ASchedule, WaitsWhileAPersonRunsASession) {
  cell.now.busy = true;
  live(12 * kHour);
  EXPECT_TRUE(cell.begun.empty());
  EXPECT_EQ(count(Verb::kWaiting, Why::kBusy), 1);
  cell.person_runs(EndState::kDone);
  pass(5);
  EXPECT_EQ(cell.begun.size(), 1u);
}

TEST_F(ASchedule, BeginsNothingBehindAHarmfulFailureUntilSomebodyHasLooked) {
  cell.now.session = 4;
  cell.end(EndState::kFailed, {FailureKind::kUnexpectedContact, "x"});
  live(kDay);
  EXPECT_TRUE(cell.begun.empty());
  EXPECT_EQ(count(Verb::kMissed, Why::kFailedBefore), 1);
  EXPECT_EQ(schedule->picture().held, Why::kFailedBefore);
  EXPECT_NE(words(schedule->picture().held_words).find("session 4"), std::string::npos);
  restart();
  live(kDay);
  EXPECT_TRUE(cell.begun.empty()) << "a restart releases nothing";
  schedule->release("a person");
  EXPECT_EQ(schedule->picture().held, Why::kNothing);
  live(kDay);
  EXPECT_EQ(cell.begun.size(), 1u);
}

TEST_F(ASchedule, IsReleasedByASessionThatAPersonBroughtToItsEnd) {
  cell.now.session = 4;
  cell.end(EndState::kFailed, {FailureKind::kNoContact, "x"});
  live(kDay);
  cell.person_runs(EndState::kDone);
  live(kDay);
  EXPECT_EQ(cell.begun.size(), 1u);
}

TEST_F(ASchedule, IsHeldAgainWhereWhatWasReleasedFailsAgain) {
  cell.now.session = 4;
  cell.end(EndState::kFailed, {FailureKind::kNoContact, "x"});
  schedule->release("a person");
  cell.now.busy = true;
  pass(5);
  --cell.ends;  // the same end, in every word
  cell.end(EndState::kFailed, {FailureKind::kNoContact, "x"});
  pass(5);
  EXPECT_EQ(schedule->picture().held, Why::kFailedBefore);
}

TEST_F(ASchedule, BeginsNothingBehindAnAbortNorBehindAnInterruptedSession) {
  cell.person_runs(EndState::kAborted);
  live(kDay);
  cell.person_runs(EndState::kInterrupted);
  live(kDay);
  EXPECT_TRUE(cell.begun.empty());
  EXPECT_EQ(count(Verb::kMissed, Why::kAbortedBefore), 1);
  EXPECT_EQ(count(Verb::kMissed, Why::kInterruptedBefore), 1);
}

TEST_F(ASchedule, IsHeldByAnAbortThatHadNothingToStopAlsoBehindARestart) {
  cell.person_runs(EndState::kDone);
  pass(5);
  ++cell.now.aborts;
  pass(5);
  cell.now.aborts = 0;
  restart();
  live(kDay);
  EXPECT_TRUE(cell.begun.empty());
  cell.person_runs(EndState::kDone);
  live(kDay);
  EXPECT_EQ(cell.begun.size(), 1u);
}

TEST_F(ASchedule, BeginsBehindAFailureInWhichNothingWasMet) {
  cell.person_runs(EndState::kFailed);
  cell.now.failure = {FailureKind::kRobotSilent, "x", drivers::Interruption::kPacketsStopped};
  pass(5);
  // The journal does not record the cause; the schedule has kept it.
  cell.now.failure.by = drivers::Interruption::kNone;
  restart();
  live(kDay);
  EXPECT_EQ(cell.begun.size(), 1u);
}

TEST_F(ASchedule, DoesNotBeginTwiceWhereTheClockIsSetBack) {
  live(11 * kHour);
  ASSERT_EQ(cell.begun.size(), 1u);
  cell.end(EndState::kDone);
  utc -= 3 * kHour;
  live(4 * kHour);
  EXPECT_EQ(cell.begun.size(), 1u);
  EXPECT_EQ(count(Verb::kHeld, Why::kClockStepped), 1);
  utc -= 3 * kHour;
  restart();
  live(4 * kHour);
  EXPECT_EQ(cell.begun.size(), 1u) << "nor behind a restart";
}

TEST_F(ASchedule, TellsOfEachWindowThatAClockWasSetOver) {
  pass(5);
  utc += 3 * kDay;
  live(kHour);
  EXPECT_TRUE(cell.begun.empty());
  EXPECT_EQ(count(Verb::kMissed, Why::kClockSet), 3);
  live(10 * kHour);
  EXPECT_EQ(cell.begun.size(), 1u);
}

TEST_F(ASchedule, BeginsInAWindowThatAClockSetWrongHadMadeMissed) {
  pass(5);
  utc += kDay;
  pass(5);
  EXPECT_EQ(count(Verb::kMissed, Why::kClockSet), 1);
  utc -= kDay;
  live(11 * kHour);
  EXPECT_EQ(cell.begun.size(), 1u);
}

TEST_F(ASchedule, BeginsWhatItFirstSawWhileTheClockWasMonthsAhead) {
  utc += 90 * kDay;
  restart();
  pass(5);
  utc -= 90 * kDay;
  live(11 * kHour);
  EXPECT_EQ(cell.begun.size(), 1u);
}

TEST_F(ASchedule, TellsOfTheWindowsOfAWeekWhereTheClockWasYearsBehind) {
  utc -= 1000 * kDay;
  restart();
  pass(5);
  utc += 1000 * kDay;
  live(kHour);
  EXPECT_GE(count(Verb::kMissed, Why::kClockSet), 7);
  EXPECT_LE(count(Verb::kMissed, Why::kClockSet), 9);
}

TEST_F(ASchedule, BeginsNothingBecauseTheClockWasSetIntoAWindow) {
  live(2 * kHour);
  synchronised = false;  // as reported by the kernel after a clock was set manually
  utc += 8 * kHour + 600;
  pass(5);
  EXPECT_TRUE(cell.begun.empty());
  EXPECT_EQ(count(Verb::kWaiting, Why::kClockStepped), 1);
  EXPECT_NE(words(schedule->picture().held_words).find("+294"), std::string::npos)
      << words(schedule->picture().held_words);
  live(kHour);
  EXPECT_TRUE(cell.begun.empty());
  restart();
  pass(5);
  EXPECT_TRUE(cell.begun.empty()) << "nor behind a restart";
  boot = "second";
  restart();
  pass(5);
  EXPECT_TRUE(cell.begun.empty()) << "nor behind another start of the computer";
  EXPECT_EQ(schedule->release("A. Miller").verb, Verb::kReleased);
  pass(5);
  EXPECT_EQ(cell.begun.size(), 1u);
}

TEST_F(ASchedule, BelievesAClockThatWasSetOnceItHasBeenSynchronisedForTenMinutes) {
  live(9 * kHour + 1800);
  utc += kHour;
  pass(5);
  synchronised = false;
  pass(5);
  synchronised = true;
  live(590, 5);
  EXPECT_TRUE(cell.begun.empty());
  utc -= 90;  // another step meanwhile restarts the ten minutes
  pass(5);
  live(595, 5);
  EXPECT_TRUE(cell.begun.empty());
  live(10, 5);
  EXPECT_EQ(cell.begun.size(), 1u);
  EXPECT_EQ(count(Verb::kReleased, Why::kClockAgrees), 1);
}

TEST_F(ASchedule, HoldsBehindAStartOfTheComputerWithoutATimeSource) {
  synchronised = false;
  live(kHour);
  boot = "second";
  restart();
  live(10 * kHour);
  EXPECT_TRUE(cell.begun.empty());
  EXPECT_EQ(schedule->picture().held, Why::kClockNotSynchronised);
  schedule->release("A. Miller");
  restart();
  pass(5);
  EXPECT_EQ(cell.begun.size(), 1u) << "a release holds until the computer is started again";
}

TEST_F(ASchedule, IsReleasedUntilItsNextStartWhereTheKernelProvidesNoIdOfTheBoot) {
  synchronised = false;
  boot = "";
  restart();
  pass(5);
  EXPECT_EQ(schedule->picture().held, Why::kClockNotSynchronised);
  schedule->release("A. Miller");
  pass(5);
  EXPECT_EQ(schedule->picture().held, Why::kNothing);
  utc += 3 * kHour;
  EXPECT_FALSE(schedule->trusts_clock()) << "a step is seen";
  schedule->release("A. Miller");
  restart();
  EXPECT_FALSE(schedule->trusts_clock());
}

TEST_F(ASchedule, NoticesAClockThatWasSetWhileTheDaemonWasNotRunning) {
  pass(5);
  utc += 10 * kHour + 600;
  restart();
  pass(5);
  EXPECT_TRUE(cell.begun.empty());
  EXPECT_EQ(count(Verb::kHeld, Why::kClockStepped), 1);
}

TEST_F(ASchedule, DoesNotTakeAClockThatDriftsOrIsSlewedForOneThatWasSet) {
  for (int hour = 0; hour < 9; ++hour) {
    utc += 1;  // 280 ppm
    live(kHour);
  }
  EXPECT_EQ(count(Verb::kHeld, Why::kClockStepped), 0);
}

TEST_F(ASchedule, StopsASessionAtItsWindowsEndThoughTheClockWasSetBack) {
  live(10 * kHour);
  ASSERT_EQ(cell.begun.size(), 1u);
  utc -= 3 * kHour;
  live(7 * kHour - 600);
  EXPECT_EQ(cell.stopped, 0);
  live(1200);
  EXPECT_EQ(cell.stopped, 1);
}

TEST_F(ASchedule, TellsOfWindowsInWhichTheDaemonWasNotRunning) {
  pass(5);
  utc += 2 * kDay;
  reported.clear();
  boot = "second";
  restart();
  pass(5);
  EXPECT_EQ(count(Verb::kMissed, Why::kDaemonNotRunning), 2);
  EXPECT_EQ(count(Verb::kHeld, Why::kClockStepped), 0);
  reported.clear();
  restart();
  pass(5);
  EXPECT_TRUE(reported.empty()) << "each once";
}

TEST_F(ASchedule, TellsThatAWindowDoesNotExistWhereClocksAreSetForwardOverIt) {
  config.sessions[0].window.from_min = 130;
  config.sessions[0].window.to_min = 170;
  begin_at(2026y / 3 / 28);
  live(kDay);
  EXPECT_TRUE(cell.begun.empty());
  EXPECT_EQ(count(Verb::kMissed, Why::kNoSuchTime), 1);
  live(kDay);
  EXPECT_EQ(cell.begun.size(), 1u);
}

TEST_F(ASchedule, BeginsOnceInANightWhoseHourComesTwice) {
  config.sessions[0].window.from_min = 130;
  config.sessions[0].window.to_min = 170;
  begin_at(2026y / 10 / 24);
  for (UtcSeconds at = 0; at < 20 * kHour; at += 300) {
    pass(300);
    if (cell.now.busy) cell.end(EndState::kDone);
  }
  EXPECT_EQ(cell.begun.size(), 1u);
}

TEST_F(ASchedule, DoesNotCountWindowsBeforeItWasThere) {
  live(4 * kDay, 3600);
  cell.end(EndState::kDone);
  live(kHour);
  reported.clear();
  ScheduledSession other = config.sessions[0];
  other.name = "other";
  config.sessions.push_back(other);
  live(kHour);
  EXPECT_TRUE(reported.empty());
}

TEST_F(ASchedule, BeginsNothingThatItCouldNotRecordBefore) {
  disk_full = true;
  live(11 * kHour);
  EXPECT_TRUE(cell.begun.empty());
  EXPECT_EQ(count(Verb::kWaiting, Why::kNotOnDisk), 1);
  disk_full = false;
  pass(5);
  EXPECT_EQ(cell.begun.size(), 1u) << "as soon as the disk takes it";
}

TEST_F(ASchedule, WhoseRowIsDamagedBeginsNothingAndSaysSo) {
  stored = "{";
  restart();
  live(11 * kHour);
  EXPECT_TRUE(cell.begun.empty());
  EXPECT_EQ(count(Verb::kWaiting, Why::kNotOnDisk), 1);
}

TEST_F(ASchedule, ReportsAnInterruptedSessionOnceAlsoWhereNothingIsUnattended) {
  const auto start = [this] {
    restart();
    pass(5);
    return count(Verb::kHeld, Why::kInterruptedBefore);
  };
  config.unattended = false;
  cell.person_runs(EndState::kInterrupted);
  EXPECT_EQ(start(), 1);
  EXPECT_EQ(start(), 1);
  cell.now.busy = true;  // resumed
  pass(5);
  --cell.ends;  // the same end, in every word
  cell.end(EndState::kInterrupted);
  EXPECT_EQ(start(), 2);
}

TEST_F(ASchedule, TrustsNoClockThatWasSetNorOneThatIsNotSynchronisedSinceTheStart) {
  EXPECT_TRUE(schedule->trusts_clock());
  utc += 400 * kDay;
  EXPECT_FALSE(schedule->trusts_clock()) << "at once, not from the next pass on";
  utc -= 400 * kDay;
  EXPECT_FALSE(schedule->trusts_clock()) << "set once more";
  schedule->release("A. Miller");
  EXPECT_TRUE(schedule->trusts_clock());
  boot = "second";
  synchronised = false;
  restart();
  EXPECT_FALSE(schedule->trusts_clock());
}

TEST_F(ASchedule, RefusesASessionWhoseFileIsWrongOnceANightWithItsWords) {
  cell.wrong = "c.toml:3: no such robot";
  live(kDay);
  EXPECT_EQ(count(Verb::kRefused, Why::kCannotBegin), 1);
  EXPECT_NE(words(reported.back()).find("c.toml:3"), std::string::npos) << words(reported.back());
}

Failure late() { return {FailureKind::kComputerBusy, "late", drivers::Interruption::kLateReplies}; }

TEST_F(ASchedule, ResumesNothingUnlessItWasToldTo) {
  live(10 * kHour);
  cell.end(EndState::kFailed, late());
  live(kHour);
  EXPECT_EQ(cell.resumed, 0);
  EXPECT_EQ(count(Verb::kEnded, Why::kHarmless), 1);
}

TEST_F(ASchedule, ResumesAfterHarmlessFailuresSoOftenAndBehindAWait) {
  config.resumes = 2;
  config.resume_wait_s = 120.0;
  live(10 * kHour);
  cell.end(EndState::kFailed, late());
  pass(60);
  pass(60);
  EXPECT_EQ(cell.resumed, 0);
  pass(60);
  EXPECT_EQ(cell.resumed, 1);
  pass(60);
  cell.end(EndState::kFailed,
           {FailureKind::kContactSilent, "no heartbeat", drivers::Interruption::kPacketsStopped});
  live(600, 60);
  EXPECT_EQ(cell.resumed, 2);
  cell.end(EndState::kFailed, late());
  live(kHour);
  EXPECT_EQ(cell.resumed, 2);
  EXPECT_EQ(count(Verb::kEnded, Why::kResumesUsed), 1);
  EXPECT_EQ(cell.begun.size(), 1u);
}

TEST_F(ASchedule, ResumesNothingAfterAHarmfulFailureOrAnAbort) {
  config.resumes = 5;
  live(10 * kHour);
  cell.end(EndState::kFailed, {FailureKind::kNotFollowing, "x"});
  live(kHour);
  EXPECT_EQ(cell.resumed, 0);
  schedule->release("a person");
  live(kDay - kHour);
  ASSERT_TRUE(cell.now.busy);
  ++cell.now.aborts;
  cell.end(EndState::kAborted);
  live(kHour);
  EXPECT_EQ(cell.resumed, 0);
}

TEST_F(ASchedule, ResumesNothingThatSomebodyAbortsWhileItWaits) {
  config.resumes = 1;
  config.resume_wait_s = 120.0;
  live(10 * kHour);
  cell.end(EndState::kFailed, late());
  pass(60);
  ++cell.now.aborts;
  live(kHour, 60);
  EXPECT_EQ(cell.resumed, 0);
  EXPECT_EQ(count(Verb::kEnded, Why::kAbortedBefore), 1);
}

TEST_F(ASchedule, ResumesOnlyWhereWhatIsLeftEndsBeforeTheWindow) {
  config.resumes = 1;
  cell.takes_s = 2.0 * kHour;
  live(16 * kHour);
  ASSERT_TRUE(cell.now.busy);
  cell.end(EndState::kFailed, late());
  cell.now.left_share = 0.75;  // 1.5 h in total; one hour is left
  live(1800, 60);
  EXPECT_EQ(cell.resumed, 0);
  EXPECT_EQ(count(Verb::kEnded, Why::kNoTimeLeft), 1);
}

TEST_F(ASchedule, ResumesNothingOfAPersonNorWhatARestartHasLeft) {
  config.resumes = 3;
  live(11 * kHour);
  ASSERT_EQ(cell.begun.size(), 1u);
  cell.end(EndState::kFailed, late());
  restart();
  live(kHour);
  EXPECT_EQ(cell.resumed, 0) << "after a restart nothing goes on by itself";
  cell.person_runs(EndState::kFailed);
  cell.now.failure = late();
  live(kHour);
  EXPECT_EQ(cell.resumed, 0);
}

TEST_F(ASchedule, BeginsOnRequestOnlyWhatSaysSoAndByTheSameRules) {
  config.sessions[0].on_request = true;
  EXPECT_EQ(schedule->begin("nightly").why, Why::kOutsideWindow);
  EXPECT_EQ(schedule->begin("other").why, Why::kCannotBegin);
  live(11 * kHour);
  EXPECT_TRUE(cell.begun.empty()) << "not by itself";
  EXPECT_EQ(schedule->begin("nightly").verb, Verb::kBegun);
  EXPECT_EQ(schedule->begin("nightly").why, Why::kBusy);
  cell.end(EndState::kDone);
  EXPECT_EQ(schedule->begin("nightly").verb, Verb::kBegun) << "as often as it is asked for";
  cell.end(EndState::kDone);
  config.unattended = false;
  EXPECT_EQ(schedule->begin("nightly").why, Why::kUnattendedOff);
}

TEST_F(ASchedule, ShowsTheNextTimesAndTheLastDecision) {
  pass(5);
  SchedulePicture picture = schedule->picture();
  ASSERT_EQ(picture.entries.size(), 1u);
  EXPECT_EQ(local_time(picture.entries[0].next.begins), "2026-11-22 22:00");
  EXPECT_FALSE(picture.entries[0].last);
  live(11 * kHour);
  picture = schedule->picture();
  EXPECT_TRUE(picture.entries[0].now.exists());
  ASSERT_TRUE(picture.entries[0].last);
  EXPECT_EQ(words(*picture.entries[0].last), "session 1 begun");
}

TEST_F(ASchedule, ShowsAWindowAsOpenOnlyWhileASessionMayBeginInIt) {
  const auto opens = [this] { return schedule->picture().entries[0].now.exists(); };
  config.resumes = 1;
  live(11 * kHour);
  cell.end(EndState::kFailed, {FailureKind::kComputerBusy, "late"});
  pass(5);
  EXPECT_TRUE(opens()) << "about to be resumed";
  live(600, 60);
  ASSERT_EQ(cell.resumed, 1);
  cell.end(EndState::kDone);
  pass(5);
  EXPECT_FALSE(opens()) << "once in each window";
  EXPECT_EQ(local_time(schedule->picture().entries[0].next.begins), "2026-11-23 22:00");
  restart();
  EXPECT_FALSE(opens());
  live(kDay);
  cell.end(EndState::kFailed, {FailureKind::kNoContact, "no contact"});
  pass(5);
  EXPECT_FALSE(opens());
  live(kDay);
  EXPECT_EQ(cell.begun.size(), 2u) << "held";
  EXPECT_TRUE(opens()) << "begins where it is released within its window";
}

TEST_F(ASchedule, ShowsAWindowAsOpenThatAClockSetAheadHadMadeMissed) {
  live(8 * kHour);
  utc += kDay;
  schedule->update();
  ASSERT_GE(count(Verb::kMissed, Why::kClockSet), 1);
  utc -= kDay - 3 * kHour;
  restart();
  EXPECT_TRUE(schedule->picture().entries[0].now.exists());
}

TEST_F(ASchedule, StatesInTheStatusWhetherASessionMayBeginAndWhyNot) {
  const auto next = [this] { return local_time(cell.shown.next_utc_s.value_or(0)); };
  pass(5);
  EXPECT_FALSE(cell.shown.open);
  EXPECT_EQ(next(), "2026-11-22 22:00");
  live(11 * kHour);
  cell.end(EndState::kFailed, {FailureKind::kNoContact, "no contact"});
  pass(5);
  EXPECT_NE(calib::words(cell.shown.held).find("schedule --release"), std::string::npos);
  EXPECT_FALSE(cell.shown.open || cell.shown.next_utc_s) << "until a person has released it";
  restart();
  EXPECT_FALSE(cell.shown.held.empty());
  live(kDay);
  schedule->release("A. Miller");
  EXPECT_EQ(cell.shown.held, "");
  EXPECT_TRUE(cell.shown.open) << "at once";
  config.unattended = false;
  pass(5);
  EXPECT_FALSE(cell.shown.open || cell.shown.next_utc_s);
}

TEST_F(ASchedule, StatesAWindowAsOpenBehindAHoldThatEndsByItself) {
  live(11 * kHour);
  cell.end(EndState::kDone);
  live(kDay - 2 * kHour);
  utc += kHour;
  schedule->update();
  EXPECT_EQ(schedule->picture().held, Why::kClockStepped);
  EXPECT_FALSE(cell.shown.held.empty());
  EXPECT_TRUE(cell.shown.open);
}

TEST_F(ASchedule, StatesThatASessionOnRequestIsAboutToBeResumed) {
  config.resumes = 1;
  config.sessions[0].on_request = true;
  live(11 * kHour);
  EXPECT_FALSE(cell.shown.open || cell.shown.next_utc_s) << "nothing begins by itself";
  schedule->begin("nightly");
  cell.end(EndState::kFailed, {FailureKind::kComputerBusy, "late"});
  pass(5);
  EXPECT_TRUE(cell.shown.open);
}

}  // namespace
}  // namespace cellcal::daemon
