// A session asked for while the one before still lets its devices go.

#include <gtest/gtest.h>

#include <chrono>
#include <future>
#include <thread>

#include "daemon/service/service.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

/// Its link takes as long to close as the test wants.
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

TEST(an_abort, takes_back_a_run_that_still_waits_for_the_session_before_to_close) {
  TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  std::promise<void> closed;
  const std::shared_future<void> gate = closed.get_future().share();
  SessionService service{{journal,
                          dir.path(),
                          [&](const calib::Cell&) { return std::make_unique<SlowToClose>(gate); },
                          {}}};
  RunRequest request;
  request.kind = SessionKind::kQualify;
  request.cell = CELLCAL_DEMO_CELL;
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
  // Until somebody waits there is nothing to abort.
  bool taken = false;
  wait_until([&] { return taken = service.abort(); });
  EXPECT_TRUE(taken);
  EXPECT_EQ(answer.get_future().get(), "aborted before it began: no session was started");
  asking.join();
  closed.set_value();
  service.shutdown();
  EXPECT_EQ(journal.sessions().size(), 1U);
}

TEST(what_is_done_alone, waits_for_no_session_and_lets_none_begin) {
  TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  std::promise<void> closed;
  const std::shared_future<void> gate = closed.get_future().share();
  SessionService service{{journal,
                          dir.path(),
                          [&](const calib::Cell&) { return std::make_unique<SlowToClose>(gate); },
                          {}}};
  RunRequest request;
  request.kind = SessionKind::kQualify;
  request.cell = CELLCAL_DEMO_CELL;
  int done = 0;
  service.alone("an import", [&] {
    EXPECT_THROW(service.start(request), BusyError);
    EXPECT_THROW(service.alone("another", [] {}), BusyError);
    EXPECT_FALSE(service.abort()) << "nothing moves";
    ++done;
  });
  EXPECT_THROW(service.alone("an import", [] { throw JournalError("damaged"); }), JournalError);
  service.start(request);
  wait_until([&] { return is_final(service.status().phase); });  // and holds its devices still
  EXPECT_THROW(service.alone("an import", [&] { ++done; }), BusyError);
  closed.set_value();
  service.shutdown();
  EXPECT_EQ(done, 1);
  EXPECT_EQ(journal.sessions().size(), 1U);
}

}  // namespace
}  // namespace cellcal::daemon::testing
