// Before the first motion a session waits for its links, and reports which, what to start and the
// remaining time; Ctrl-C ends it.

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <unistd.h>

#include <array>
#include <optional>

#include "daemon_fixture.h"

namespace cellcal::daemon::testing {
namespace {

/// A serial port without a device.
class MutePort {
 public:
  MutePort() : fd_(::posix_openpt(O_RDWR | O_NOCTTY)) {
    if (fd_ < 0 || ::grantpt(fd_) != 0 || ::unlockpt(fd_) != 0) throw std::runtime_error("no pty");
    std::array<char, 128> name{};
    if (::ptsname_r(fd_, name.data(), name.size()) != 0) throw std::runtime_error("no pty");
    name_ = name.data();
  }
  ~MutePort() { ::close(fd_); }
  MutePort(const MutePort&) = delete;
  MutePort& operator=(const MutePort&) = delete;
  const std::string& name() const { return name_; }

 private:
  int fd_;
  std::string name_;
};

class ASessionBeforeItsLinks : public ::testing::TestWithParam<const char*> {
 protected:
  /// A daemon for a real cell without any device.
  void start(int wait_s) {
    const int port = 49300 + static_cast<int>(::getpid() % 200);
    std::ofstream(fixture.dir / "d.toml")
        << "format = \"cellcal.daemon/1\"\nbackend = \"" << GetParam() << "\"\nstate_dir = \""
        << (fixture.dir / "state").string() << "\"\nsocket = \"" << fixture.socket()
        << "\"\n[session]\nconnect_wait_s = " << wait_s
        << "\n[rsi]\nbind = \"127.0.0.1\"\nport = " << port
        << "\nrealtime = false\n[eki]\naddress = \"127.0.0.1\"\nport = " << port
        << "\nrealtime = false\n[contact]\ndevice = \"" << sensor.name() << "\"\n";
    fixture.start();
  }
  /// The status while it waits.
  nlohmann::json waiting() const {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (std::chrono::steady_clock::now() < end) {
      const nlohmann::json status = fixture.status();
      if (status["waiting"].is_object() || status["phase"] == "failed") return status;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return fixture.status();
  }
  std::vector<std::string> run() const {
    return {CELLCAL, "run",     "--cell", CELLCAL_DEMO_CELL, "--touches",
            "4",     "--check", "0",      "--socket",        fixture.socket()};
  }
  std::string program() const {
    return std::string(GetParam()) == "rsi" ? "CELLCAL_RSI" : "CELLCAL_EKI";
  }

  MutePort sensor;
  DaemonFixture fixture;
};
INSTANTIATE_TEST_SUITE_P(Over, ASessionBeforeItsLinks, ::testing::Values("rsi", "eki"),
                         [](const auto& one) { return std::string(one.param); });

TEST_P(ASessionBeforeItsLinks, SaysForWhichItWaitsWhatToStartAndHowLong) {
  start(600);
  fixture.begin({{"cell", CELLCAL_DEMO_CELL}, {"touches", 4}, {"check", 0}});
  const nlohmann::json first = waiting();
  ASSERT_TRUE(first["waiting"].is_object()) << first;
  EXPECT_EQ(first["waiting"]["robot"], true);
  EXPECT_EQ(first["waiting"]["contact"], true);
  EXPECT_NE(first["waiting"]["start"].get<std::string>().find("start " + program()),
            std::string::npos);
  const double left_s = first["waiting"]["left_s"];
  EXPECT_LE(left_s, 600.0);
  EXPECT_GT(left_s, 300.0);
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_LT(fixture.status()["waiting"]["left_s"].get<double>(), left_s) << "it counts down";
  const std::string words = fixture.cellcal({"status"}).out;
  EXPECT_NE(words.find("waiting for the robot controller and the contact sensor"),
            std::string::npos)
      << words;
  EXPECT_NE(words.find("start " + program() + " on the pendant"), std::string::npos) << words;
  EXPECT_EQ(fixture.cellcal({"abort"}).status, 0);
}

TEST_P(ASessionBeforeItsLinks, IsEndedByCtrlCInRunSinceNothingHasMoved) {
  start(600);
  Background run_command(run(), fixture.dir / "run.log");
  ASSERT_TRUE(waiting()["waiting"].is_object());
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // it has polled by then
  run_command.signal(SIGINT);
  EXPECT_EQ(run_command.wait(), 1);
  EXPECT_EQ(fixture.status()["phase"], "aborted");
  const std::string said = content(fixture.dir / "run.log");
  EXPECT_NE(said.find("session 1 ended before anything moved"), std::string::npos) << said;
}

TEST_P(ASessionBeforeItsLinks, IsEndedByACtrlCThatFallsIntoAQuestion) {
  start(600);
  Background run_command(run(), fixture.dir / "run.log");
  ASSERT_TRUE(waiting()["waiting"].is_object());
  fixture.daemon->signal(SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(500));  // its request is pending
  run_command.signal(SIGINT);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  fixture.daemon->signal(SIGCONT);
  EXPECT_EQ(run_command.wait(), 1);
  EXPECT_EQ(fixture.status()["phase"], "aborted") << content(fixture.dir / "run.log");
}

TEST_P(ASessionBeforeItsLinks, IsEndedByACtrlCThatFallsIntoItsRequest) {
  start(600);
  fixture.daemon->signal(SIGSTOP);
  Background run_command(run(), fixture.dir / "run.log");
  std::this_thread::sleep_for(std::chrono::milliseconds(1000));  // the request is pending
  run_command.signal(SIGINT);
  std::this_thread::sleep_for(std::chrono::milliseconds(100));
  fixture.daemon->signal(SIGCONT);
  EXPECT_EQ(run_command.wait(), 1);
  EXPECT_EQ(fixture.status()["phase"], "aborted") << content(fixture.dir / "run.log");
}

TEST_P(ASessionBeforeItsLinks, IsLeftAloneByCtrlCInWatch) {
  start(600);
  fixture.begin({{"cell", CELLCAL_DEMO_CELL}, {"touches", 4}, {"check", 0}});
  ASSERT_TRUE(waiting()["waiting"].is_object());
  Background watch({CELLCAL, "watch", "--socket", fixture.socket()}, fixture.dir / "watch.log");
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  watch.signal(SIGINT);
  EXPECT_EQ(watch.wait(), 0) << content(fixture.dir / "watch.log");
  EXPECT_EQ(fixture.status()["phase"], "connecting");
}

TEST_P(ASessionBeforeItsLinks, ThatWaitedInVainSaysWhatWasToBeStarted) {
  start(1);
  const Outcome outcome = run_program(run());
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("link-not-ready: robot: "), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("Start " + program() + " on the pendant"), std::string::npos)
      << outcome.err;
  EXPECT_NE(outcome.err.find("Contact sensor: "), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("Waited 1 s ([session] connect_wait_s)"), std::string::npos)
      << outcome.err;
}

}  // namespace
}  // namespace cellcal::daemon::testing
