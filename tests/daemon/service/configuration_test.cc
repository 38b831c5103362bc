// Parts of the daemon's configuration that apply to a session, and from when.

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "daemon/service/service.h"
#include "daemon/tasks/options.h"
#include "drivers/error.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/runner/fakes.h"

namespace cellcal::daemon::testing {
namespace {

const SearchLimits kByFlag{0.0025, 1, "with eki stop = \"flag\""};

struct ASessionThatIsResumed : ::testing::Test {
  /// Reason why it is not resumed under these limits; "devices" if it would be.
  std::string refusal(
      const TouchPolicy& touch, const SearchLimits& limits,
      const std::function<std::unique_ptr<Backend>()>& backend = [] {
        throw drivers::ConfigError("devices");
        return std::unique_ptr<Backend>();
      }) {
    Journal journal(dir / "j.db");
    SessionInputs inputs = read_inputs(CELLCAL_DEMO_CELL);
    SessionOptions options;
    options.touch = touch;
    inputs.options = options_to_json(options);
    const std::int64_t id = journal.begin(inputs, "t0");
    journal.record(id, RecordEnd{Ending::kAborted, ""}, "t1");
    SessionService service{
        {journal,
         dir.path(),
         [&](const calib::Cell&, double, const std::string&) { return backend(); },
         {{}, {}, 0, limits}}};
    RunRequest request;
    request.resume = true;
    std::string why;
    try {
      service.start(request);
    } catch (const std::exception& refused) {
      why = refused.what();
    }
    EXPECT_TRUE(journal.newest_resumable()) << "it stays as it was";
    return why;
  }
  TemporaryDirectory dir;
};

TEST_F(ASessionThatIsResumed, IsNotMixedWithTouchesOfAnEmulatedCell) {
  EXPECT_EQ(
      refusal({}, {},
              [] {
                auto fake = std::make_unique<FakeBackend>();
                fake->is_emulated = true;
                return fake;
              }),
      "session 1 has touched the real arm, and the configuration now has an emulated cell. Set backend as it "
      "was, or start a new session");
}

TEST_F(ASessionThatIsResumed, StatesAllInterruptionsOfItsRecord) {
  Journal journal(dir / "j.db");
  SessionInputs inputs = read_inputs(CELLCAL_DEMO_CELL);
  SessionOptions options;
  inputs.options = options_to_json(options);
  const std::int64_t id = journal.begin(inputs, "t0");
  for (const auto by : {drivers::Interruption::kLateBytes, drivers::Interruption::kPacketsStopped})
    journal.note(id, RecordCause{"t1", by});
  journal.record(id, RecordEnd{Ending::kAborted, ""}, "t2");
  SessionService service{{journal,
                          dir.path(),
                          [](const calib::Cell&, double, const std::string&) {
                            return std::make_unique<FakeBackend>();
                          },
                          {}}};
  RunRequest request;
  request.resume = true;
  service.start(request);
  EXPECT_EQ(service.status().interruptions, journal.interruptions(id));
  EXPECT_EQ(service.status().interruptions.total(), 2);
}

TEST(ASessionThatWasLeft, IsOfItsOwnKind) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  SessionInputs inputs = read_inputs(CELLCAL_DEMO_CELL);
  SessionOptions options;
  options.kind = SessionKind::kDryRun;
  inputs.options = options_to_json(options);
  journal.record(journal.begin(inputs, "t0"), RecordEnd{Ending::kAborted, ""}, "t1");
  const SessionService service{{journal, dir.path(), {}, {}}};
  ASSERT_TRUE(service.status().interrupted);
  EXPECT_EQ(service.status().interrupted->kind, "dry-run");
}

TEST_F(ASessionThatIsResumed, IsRefusedWhereTodaysLinkStopsTooSlowlyForItsSearches) {
  TouchPolicy touch;
  EXPECT_EQ(refusal(touch, {}), "devices");
  const std::string fast = refusal(touch, kByFlag);
  EXPECT_NE(
      fast.find("has fast_search_mm_s = 10 mm/s, at most 2.5 mm/s are permitted with eki stop"),
      std::string::npos)
      << fast;
  touch.fast_m_s = touch.slow_m_s = 0.003;
  EXPECT_NE(refusal(touch, kByFlag).find("fast_search_mm_s = 3 mm/s"), std::string::npos);
  touch.fast_m_s = 2.5 * 1e-3;
  touch.slow_m_s = 0.001;
  EXPECT_NE(refusal(touch, kByFlag).find("has confirm_every = 8, at most 1"), std::string::npos);
  touch.confirm_every = 1;
  EXPECT_EQ(refusal(touch, kByFlag), "devices");
}

TEST(ASession, ThatBeginsWhileTheConfigurationIsReadAgainHasAllOfOne) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  // With the one a qualification begins, with the other it is refused before its devices are requested.
  SessionSettings slow;
  slow.touch.fast_m_s = slow.touch.slow_m_s;
  std::atomic<int> mixed{0};
  const MakeBackend fast_devices = [](const calib::Cell&, double,
                                      const std::string&) -> std::unique_ptr<Backend> {
    throw drivers::ConfigError("devices");
  };
  const MakeBackend slow_devices = [&](const calib::Cell&, double,
                                       const std::string&) -> std::unique_ptr<Backend> {
    ++mixed;
    throw drivers::ConfigError("mixed");
  };
  SessionService service{{journal, dir.path(), fast_devices, {}}};
  std::jthread reloads([&](const std::stop_token& stop) {
    for (bool fast = false; !stop.stop_requested(); fast = !fast) {
      fast ? service.use({}, fast_devices) : service.use(slow, slow_devices);
      std::this_thread::yield();
    }
  });
  RunRequest request;
  request.kind = SessionKind::kQualify;
  request.cell = CELLCAL_DEMO_CELL;
  for (int begun = 0, refused = 0; begun < 20 || refused < 20;) {
    try {
      service.start(request);
    } catch (const drivers::ConfigError&) {
      ++begun;
    } catch (const RequestError&) {
      ++refused;
    }
  }
  EXPECT_EQ(mixed, 0);
}

TEST(ADryRun, HasATenthOfTheAxisSpeedsAtMostAndNoOtherSessionHas) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  std::vector<double> shares;
  const MakeBackend devices = [&](const calib::Cell&, double most_speed,
                                  const std::string&) -> std::unique_ptr<Backend> {
    shares.push_back(most_speed);
    throw drivers::ConfigError("devices");
  };
  SessionService service{{journal, dir.path(), devices, {}}};
  RunRequest request;
  request.cell = CELLCAL_DEMO_CELL;
  for (const SessionKind kind :
       {SessionKind::kDryRun, SessionKind::kCalibrate, SessionKind::kQualify}) {
    request.kind = kind;
    EXPECT_THROW(service.start(request), drivers::ConfigError);
  }
  EXPECT_EQ(shares, (std::vector<double>{0.1, 1.0, 1.0}));
}

}  // namespace
}  // namespace cellcal::daemon::testing
