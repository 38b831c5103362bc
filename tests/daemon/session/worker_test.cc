#include "daemon/session/worker.h"

#include <gtest/gtest.h>

#include <future>
#include <vector>

#include "fakes.h"

namespace cellcal::daemon {
namespace {

TEST(a_worker_thread, does_its_jobs_in_order) {
  std::vector<int> done;
  std::promise<void> last;
  ThreadWorker worker;
  for (int i = 0; i < 100; ++i) worker.post([&done, i] { done.push_back(i); });
  worker.post([&last] { last.set_value(); });
  last.get_future().wait();
  ASSERT_EQ(done.size(), 100u);
  for (int i = 0; i < 100; ++i) EXPECT_EQ(done[static_cast<std::size_t>(i)], i);
}

TEST(a_worker_thread, finishes_the_job_in_hand_when_it_ends) {
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

TEST(a_session_with_a_worker_thread, ends_as_one_with_an_inline_worker_does) {
  testing::Session session;
  ThreadWorker worker;
  // The virtual clock runs far ahead of the thread: patience has to be long.
  State patient;
  patient.patience.planning = patient.patience.identifying = patient.patience.reporting =
      std::chrono::hours(100000);
  Runner runner({session.backend, session.recorder, worker, session.worker, session.tasks, {}},
                patient, {});
  EXPECT_EQ(runner.run().phase, Phase::kDone);
  EXPECT_EQ(session.recorder.touches.size(), 3u);
}

TEST(an_abort_of_a_planning_session, does_not_wait_for_the_plan) {
  testing::Session session;
  std::promise<void> release;
  session.tasks.plan = [&]() -> Tasks::Planned {
    release.get_future().wait();
    return {};
  };
  ThreadWorker worker;
  State patient;
  patient.patience.planning = std::chrono::hours(100000);
  Runner runner({session.backend, session.recorder, worker, session.worker, session.tasks, {}},
                patient, {});
  runner.request_abort();
  EXPECT_EQ(runner.run().phase, Phase::kAborted);
  release.set_value();
}

}  // namespace
}  // namespace cellcal::daemon
