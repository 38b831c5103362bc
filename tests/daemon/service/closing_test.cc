// A session requested while the preceding one still closes its devices.

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <mutex>
#include <thread>

#include "daemon/service/service.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

/// Its link closes when the test permits.
class SlowToClose final : public Backend {
 public:
  explicit SlowToClose(std::shared_future<void> closed) : closed_(std::move(closed)) {}
  ~SlowToClose() override { closed_.wait(); }
  drivers::Robot& robot() override { return fake_.robot(); }
  drivers::ContactSensor& contact() override { return fake_.contact(); }
  drivers::Clock& clock() override { return fake_.clock(); }
  bool virtual_time() const override { return true; }
  std::string utc_now() override { return fake_.utc_now(); }

 private:
  std::shared_future<void> closed_;
  FakeBackend fake_;
};

void wait_until(const std::function<bool()>& true_) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!true_() && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
}

struct SlowService {
  SlowService() {
    request.kind = SessionKind::kQualify;
    request.cell = CELLCAL_DEMO_CELL;
  }
  TemporaryDirectory dir;
  Journal journal{dir / "j.db"};
  std::promise<void> closed;
  std::shared_future<void> gate = closed.get_future().share();
  std::function<void()> before_a_backend = [] {};
  SessionService service{{journal,
                          dir.path(),
                          [this](const calib::Cell&, double, const std::string&) {
                            before_a_backend();
                            return std::make_unique<SlowToClose>(gate);
                          },
                          {}}};
  RunRequest request;
};
struct AnAbort : ::testing::Test, SlowService {};
struct ARun : ::testing::Test, SlowService {};
struct WhatIsDoneAlone : ::testing::Test, SlowService {};

TEST_F(AnAbort, TakesBackARunThatStillWaitsForTheSessionBeforeToClose) {
  service.start(request);
  wait_until([&] { return is_final(service.status().phase); });

  std::promise<std::string> answer;
  std::thread asking([&] {
    try {
      service.start(request);
      answer.set_value("it was started");
    } catch (const BusyError& busy) {
      answer.set_value(busy.what());
    }
  });
  // Until a request waits there is nothing to abort.
  bool taken = false;
  wait_until([&] { return taken = service.abort(); });
  EXPECT_TRUE(taken);
  EXPECT_EQ(answer.get_future().get(), "aborted before it began: no session was started");
  asking.join();
  closed.set_value();
  service.shutdown();
  EXPECT_EQ(journal.sessions().size(), 1U);
}

/// It would otherwise take the abort of the running one.
TEST_F(ARun, ThatWaitsBesideAnotherOneEndsWhenThatHasTakenThePlace) {
  std::promise<void> prepared;
  const std::shared_future<void> ready = prepared.get_future().share();
  int backends = 0;
  before_a_backend = [&] {
    if (++backends > 1) ready.wait();
  };
  service.start(request);
  wait_until([&] { return is_final(service.status().phase); });

  std::mutex mutex;
  std::vector<std::string> answers;
  const auto ask = [&] {
    std::string answer = "it was started";
    try {
      service.start(request);
    } catch (const BusyError& busy) {
      answer = busy.what();
    }
    const std::lock_guard lock(mutex);
    answers.push_back(answer);
  };
  std::thread one(ask), other(ask);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));  // usually both wait
  closed.set_value();
  wait_until([&] {
    const std::lock_guard lock(mutex);
    return !answers.empty();
  });
  {
    const std::lock_guard lock(mutex);
    ASSERT_EQ(answers.size(), 1U);
    EXPECT_EQ(answers[0], "a session is being prepared. See 'cellcal status'");
  }
  EXPECT_TRUE(service.abort());
  prepared.set_value();
  one.join();
  other.join();
  service.shutdown();
  EXPECT_EQ(answers[1], "it was started");
  ASSERT_EQ(journal.sessions().size(), 2U);
  EXPECT_EQ(journal.sessions()[0].state, RecordState::kAborted);
}

TEST_F(WhatIsDoneAlone, WaitsForNoSessionAndLetsNoneBegin) {
  int done = 0;
  service.alone("an import", [&] {
    EXPECT_THROW(service.start(request), BusyError);
    EXPECT_THROW(service.alone("another", [] {}), BusyError);
    EXPECT_FALSE(service.abort()) << "nothing moves";
    ++done;
  });
  EXPECT_THROW(service.alone("an import", [] { throw JournalError("damaged"); }), JournalError);
  service.start(request);
  wait_until([&] { return is_final(service.status().phase); });  // and still holds its devices
  EXPECT_THROW(service.alone("an import", [&] { ++done; }), BusyError);
  closed.set_value();
  service.shutdown();
  EXPECT_EQ(done, 1);
  EXPECT_EQ(journal.sessions().size(), 1U);
}

TEST_F(WhatIsDoneAlone, ForSomeSecondsIsWaitedForByASessionInsteadOfRefusingIt) {
  std::promise<std::int64_t> started;
  std::thread asking;
  EXPECT_TRUE(service.try_exclusively("telling the controller", [&] {
    EXPECT_FALSE(service.try_exclusively("another", [] {}));
    asking = std::thread([&] { started.set_value(service.start(request)); });
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    EXPECT_TRUE(journal.sessions().empty()) << "it waits";
  }));
  EXPECT_EQ(started.get_future().get(), 1);
  asking.join();
  EXPECT_FALSE(service.try_exclusively("telling the controller", [] {})) << "a session has them";
  closed.set_value();
  service.shutdown();
}

TEST_F(WhatIsDoneAlone, ForSomeSecondsIsWaitedForByWhatIsDoneAlone) {
  bool over = false;
  std::thread asking;
  EXPECT_TRUE(service.try_exclusively("telling the controller", [&] {
    asking = std::thread([&] { service.alone("an import", [&] { EXPECT_TRUE(over); }); });
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    over = true;
  }));
  asking.join();
  EXPECT_TRUE(over);
}

TEST_F(WhatIsDoneAlone, ForSomeSecondsLeavesAnAbortToTheSessionThatWaits) {
  std::promise<std::string> answer;
  std::thread asking;
  EXPECT_TRUE(service.try_exclusively("telling the controller", [&] {
    asking = std::thread([&] {
      try {
        service.start(request);
        answer.set_value("it was started");
      } catch (const BusyError& busy) {
        answer.set_value(busy.what());
      }
    });
    wait_until([&] { return service.abort(); });
  }));
  EXPECT_EQ(answer.get_future().get(), "aborted before it began: no session was started");
  asking.join();
  closed.set_value();
  EXPECT_TRUE(journal.sessions().empty());
}

}  // namespace
}  // namespace cellcal::daemon::testing
