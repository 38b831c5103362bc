#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <thread>
#include <utility>
#include <vector>

#include "calib/model/long_work.h"
#include "daemon/runner/runner.h"
#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon {
namespace {

TEST(AWorkerThread, DoesItsJobsInOrder) {
  std::vector<int> done;
  std::promise<void> last;
  ThreadWorker worker;
  for (int i = 0; i < 100; ++i) worker.post([&done, i] { done.push_back(i); });
  worker.post([&last] { last.set_value(); });
  last.get_future().wait();
  ASSERT_EQ(done.size(), 100u);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(done[static_cast<std::size_t>(i)], i);
}

TEST(AWorkerThread, FinishesTheJobInHandWhenItEnds) {
  std::promise<void> begun;
  bool finished = false;
  {
    ThreadWorker worker;
    worker.post([&] {
      begun.set_value();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      finished = true;
    });
    begun.get_future().wait();
  }
  EXPECT_TRUE(finished);
}

TEST(ASessionWithAWorkerThread, EndsAsOneWithAnInlineWorkerDoes) {
  testing::Session session;
  ThreadWorker worker;
  // The virtual clock runs far ahead of the thread, which requires long timeouts.
  State patient;
  patient.timeouts.planning = patient.timeouts.identifying = patient.timeouts.reporting =
      std::chrono::hours(100000);
  Runner runner({session.backend, session.recorder, worker, session.worker, session.tasks, {}},
                patient, {});
  EXPECT_EQ(runner.run().phase, Phase::kDone);
  EXPECT_EQ(session.recorder.touches.size(), 3u);
}

/// A disk that answers on request.
struct StalledRecorder final : testing::FakeRecorder {
  using FakeRecorder::record;
  void record(const RecordTouch&) override {
    stalled.set_value();
    answers.get_future().wait();
    on_disk = true;
  }

  std::promise<void> stalled, answers;
  std::atomic<bool> on_disk{false};
};

TEST(AnAbortOfASessionWhoseTouchWaitsForTheDisk, DoesNotWaitForIt) {
  testing::Session session({}, 1);
  StalledRecorder recorder;
  ThreadWorker disk(ThreadWorker::Priority::kNormal);
  // The virtual clock runs far ahead of the thread, which requires long timeouts.
  State patient;
  patient.timeouts.recording = std::chrono::hours(100000);
  bool aborted_before_the_disk_answered = false;
  Runner* running = nullptr;
  Runner runner({session.backend, recorder, session.worker, disk, session.tasks,
                 [&](const State& state, const std::vector<calib::Touch>&) {
                   if (state.phase == Phase::kRecording) {
                     recorder.stalled.get_future().wait();
                     running->request_abort();
                   }
                   if (!is_final(state.phase) || aborted_before_the_disk_answered) return;
                   aborted_before_the_disk_answered = !recorder.on_disk;
                   EXPECT_FALSE(session.backend.world.robot_open);
                   recorder.answers.set_value();
                 }},
                patient, {});
  running = &runner;
  EXPECT_EQ(runner.run().phase, Phase::kAborted);
  EXPECT_TRUE(aborted_before_the_disk_answered);
  EXPECT_TRUE(recorder.on_disk) << "the session waits for its end's record, the arm at rest";
}

/// A robot whose driver hangs at the first poll of a move.
class HangingBackend final : public Backend {
 public:
  drivers::Robot& robot() override {
    if (hangs) {
      if (!std::exchange(reported, true)) hanging.set_value();
      go_on.get_future().wait();
      hangs = false;
    }
    return fake.robot();
  }
  drivers::ContactSensor& contact() override { return fake.contact(); }
  drivers::Clock& clock() override { return fake.clock(); }
  std::string utc_now() override { return fake.utc_now(); }
  bool devices_alive() override { return devices; }

  testing::FakeBackend fake;
  bool hangs = false, reported = false;
  std::atomic<bool> devices{true};
  std::promise<void> hanging, go_on;
};

TEST(ARunner, WhoseLoopOrDevicesHangIsNotAlive) {
  HangingBackend backend;
  testing::Session session({}, 1);
  Runner* running = nullptr;
  Runner runner({backend, session.recorder, session.worker, session.worker, session.tasks,
                 [&](const State& state, const std::vector<calib::Touch>&) {
                   if (state.phase == Phase::kConnecting) backend.hangs = true;
                   if (state.phase == Phase::kTransit) running->request_abort();
                 }},
                {}, {});
  running = &runner;
  EXPECT_TRUE(runner.alive()) << "before it begins";
  std::thread loop([&] { runner.run(); });
  backend.hanging.get_future().wait();
  EXPECT_TRUE(runner.alive()) << "it has turned until now";
  EXPECT_FALSE(runner.alive()) << "and does no longer";
  backend.go_on.set_value();
  loop.join();
  EXPECT_TRUE(runner.alive());
  EXPECT_FALSE(runner.alive());
}

TEST(ARunner, WhoseDevicesHangIsNotAlive) {
  HangingBackend backend;
  testing::Session session({}, 1);
  Runner runner({backend, session.recorder, session.worker, session.worker, session.tasks, {}}, {},
                {});
  backend.devices = false;
  EXPECT_FALSE(runner.alive());
}

TEST(AnAbortOfAPlanningSession, DoesNotWaitForThePlan) {
  testing::Session session;
  std::promise<void> release;
  session.tasks.plan = [&]() -> Tasks::Planned {
    release.get_future().wait();
    return {};
  };
  ThreadWorker worker;
  State patient;
  patient.timeouts.planning = std::chrono::hours(100000);
  Runner runner({session.backend, session.recorder, worker, session.worker, session.tasks, {}},
                patient, {});
  runner.request_abort();
  EXPECT_EQ(runner.run().phase, Phase::kAborted);
  release.set_value();
}

/// Computes until cancelled.
[[noreturn]] void compute(std::promise<void>& begun) {
  begun.set_value();
  while (true) {
    calib::poll_cancelled();
    std::this_thread::yield();
  }
}

TEST(AnAbortOfAPlanningSession, CallsThePlanOffWhichIsNoFailure) {
  testing::Session session;
  std::promise<void> begun;
  session.tasks.plan = [&]() -> Tasks::Planned { compute(begun); };
  State patient;
  patient.timeouts.planning = std::chrono::hours(100000);
  {
    ThreadWorker worker;  // whose destructor waits for the current job
    Runner runner({session.backend, session.recorder, worker, session.worker, session.tasks, {}},
                  patient, {});
    std::thread person([&] {
      begun.get_future().wait();
      runner.request_abort();
    });
    const State end = runner.run();
    person.join();
    EXPECT_EQ(end.phase, Phase::kAborted);
    EXPECT_FALSE(end.failure);
  }
  ASSERT_EQ(session.recorder.ends.size(), 1u);
  EXPECT_EQ(session.recorder.ends[0].ending, Ending::kAborted);
}

TEST(AnAbortOfAnIdentifyingSession, CallsTheEstimateOffAndTheTouchesStay) {
  testing::Session session;
  std::promise<void> begun;
  session.tasks.identify = [&](const std::vector<calib::Touch>&) -> SessionResult {
    compute(begun);
  };
  State patient;
  patient.timeouts.identifying = std::chrono::hours(100000);
  {
    ThreadWorker worker;
    patient.timeouts.planning = patient.timeouts.identifying;
    Runner runner({session.backend, session.recorder, worker, session.worker, session.tasks, {}},
                  patient, {});
    std::thread person([&] {
      begun.get_future().wait();
      runner.request_abort();
    });
    EXPECT_EQ(runner.run().phase, Phase::kAborted);
    person.join();
  }
  EXPECT_EQ(session.recorder.touches.size(), 3u);
}

TEST(ASessionThatEnds, CallsOffWhatNobodyWaitsForAnyMore) {
  testing::Session session({}, 1);
  std::promise<void> begun;
  session.tasks.plan = [&]() -> Tasks::Planned { compute(begun); };
  ThreadWorker worker;
  State hasty;  // the clock runs far ahead of the thread
  Runner runner({session.backend, session.recorder, worker, session.worker, session.tasks, {}},
                hasty, {});
  EXPECT_EQ(runner.run().phase, Phase::kFailed);
}

TEST(ASession, SaysHowFarItsPlanIs) {
  testing::Session session({}, 1);
  std::promise<void> told;
  session.tasks.plan = [&, plan = session.tasks.plan] {
    calib::report_progress(0.5);
    told.get_future().wait();
    return plan();
  };
  ThreadWorker worker;
  State patient;
  patient.timeouts.planning = patient.timeouts.identifying = patient.timeouts.reporting =
      std::chrono::hours(100000);
  std::vector<double> shares;
  RunnerParts parts{session.backend, session.recorder, worker, session.worker, session.tasks, {}};
  parts.on_work = [&](const calib::WorkDone& done) {
    shares.push_back(done.share);
    told.set_value();
  };
  Runner runner(std::move(parts), patient, {});
  EXPECT_EQ(runner.run().phase, Phase::kDone);
  EXPECT_EQ(shares, std::vector<double>{0.5});
}

TEST(ASession, SaysHowFarItsPlanIsWhileItIsMadeOnTheSessionsOwnThread) {
  testing::Session session({}, 1);
  std::vector<double> shares;
  session.tasks.plan = [&, plan = session.tasks.plan] {
    for (const double share : {0.25, 0.5}) {
      calib::report_progress(share);
      EXPECT_EQ(shares.back(), share) << "before the plan is there";
    }
    return plan();
  };
  InlineWorker worker;
  RunnerParts parts{session.backend, session.recorder, worker, session.worker, session.tasks, {}};
  shares.push_back(0.0);
  parts.on_work = [&](const calib::WorkDone& done) { shares.push_back(done.share); };
  Runner runner(std::move(parts), State{}, {});
  EXPECT_EQ(runner.run().phase, Phase::kDone);
  EXPECT_EQ(shares, (std::vector<double>{0.0, 0.25, 0.5}));
}

}  // namespace
}  // namespace cellcal::daemon
