// A change that a session does not make, such as one of the schedule, published during or after it.

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "daemon/service/service.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

using namespace std::chrono_literals;

/// Virtual time, with an action at each of its steps.
class WatchedCell final : public FakeBackend {
 public:
  WatchedCell(Script script, std::function<void()> at_step)
      : FakeBackend(std::move(script)), clock_(world.clock, std::move(at_step)) {}
  drivers::Clock& clock() override { return clock_; }

 private:
  struct WatchedClock final : drivers::Clock {
    WatchedClock(drivers::Clock& inner, std::function<void()> act)
        : inner(inner), at_step(std::move(act)) {}
    drivers::TimePoint now() const override { return inner.now(); }
    void sleep_until(drivers::TimePoint t) override {
      inner.sleep_until(t);
      at_step();
    }
    drivers::Clock& inner;
    std::function<void()> at_step;
  };
  WatchedClock clock_;
};

struct AChangeOfTheSchedule : ::testing::Test {
  AChangeOfTheSchedule() {
    request.kind = SessionKind::kQualify;
    request.cell = CELLCAL_DEMO_CELL;
  }
  void run_to_its_end() {
    service.start(request);
    while (!is_final(service.status().phase)) std::this_thread::sleep_for(1ms);
    service.shutdown();
  }
  /// The status that it publishes.
  Status published() {
    seen.open = !seen.open;
    service.show(seen);
    return service.since(service.status().seq - 1).back();
  }
  TemporaryDirectory dir;
  Journal journal{dir / "j.db"};
  std::atomic<drivers::TimePoint> now{drivers::TimePoint(1h)};
  ScheduleSeen seen;
  Script script;
  std::function<void()> at_step = [] {};
  SessionService service{{journal,
                          dir.path(),
                          [this](const calib::Cell&, double, const std::string&) {
                            return std::make_unique<WatchedCell>(script, [this] { at_step(); });
                          },
                          {},
                          {},
                          [this] { return now.load(); }}};
  RunRequest request;
};

TEST_F(AChangeOfTheSchedule, PublishesArmAndLinksAsTheyAreSinceTheSessionsEnd) {
  run_to_its_end();
  ASSERT_EQ(service.since(0).back().arm.packet_age_s, 0.0);
  now = now.load() + 5s;
  const Status after = published();
  EXPECT_EQ(after.arm.packet_age_s, 5.0);
  ASSERT_TRUE(after.links);
  EXPECT_FALSE(after.links->open);
}

TEST_F(AChangeOfTheSchedule, PublishesTheWaitThatIsLeftByThen) {
  script.robot_never_ready = true;
  std::optional<double> before_s, at_s, later_s;
  at_step = [&] {
    const Status status = service.status();
    if (before_s || !status.waiting) return;
    before_s = status.waiting->left_s;
    now = now.load() + 2s;
    at_s = published().waiting->left_s;
    now = now.load() + 1s;
    later_s = service.status().waiting->left_s;
  };
  run_to_its_end();
  ASSERT_TRUE(before_s);
  EXPECT_NEAR(*at_s, *before_s - 2.0, 1e-9);
  EXPECT_NEAR(*later_s, *before_s - 3.0, 1e-9);
}

/// A listener that read the status first, and came last, would take the older one for the newest.
TEST_F(AChangeOfTheSchedule, IsHeardInTheOrderOfTheChangesWhicheverThreadMakesThem) {
  std::atomic<int> inside{0}, beside{0};
  std::atomic<std::uint64_t> heard{0};
  service.on_change([&] {
    if (inside.fetch_add(1) > 0) ++beside;
    const std::uint64_t seq = service.status().seq;
    std::this_thread::sleep_for(1ms);
    EXPECT_GE(seq, heard.exchange(seq));
    --inside;
  });
  {
    std::vector<std::jthread> threads;
    for (const bool open : {true, false})
      threads.emplace_back([&, open] {
        for (std::int64_t at = 0; at < 50; ++at) service.show({{}, open, at});
      });
  }
  EXPECT_EQ(beside, 0);
  EXPECT_EQ(heard, service.status().seq);
}

}  // namespace
}  // namespace cellcal::daemon::testing
