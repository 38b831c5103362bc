// Notifications to systemd: ready, watchdog, status, stopping.

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstring>

#include "daemon/main/systemd_notifier.h"
#include "daemon_fixture.h"

namespace cellcal::daemon::testing {
namespace {

class NotifySocket {
 public:
  explicit NotifySocket(const std::string& path) : fd_(::socket(AF_UNIX, SOCK_DGRAM, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strncpy(address.sun_path, path.c_str(), sizeof address.sun_path - 1);
    if (::bind(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) != 0) {
      throw std::runtime_error("no notify socket");
    }
  }
  ~NotifySocket() { ::close(fd_); }
  NotifySocket(const NotifySocket&) = delete;
  NotifySocket& operator=(const NotifySocket&) = delete;

  /// Reads until a message contains this word; limited by ctest's timeout.
  void wait_for(const std::string& word) {
    std::string message;
    while (message.find(word) == std::string::npos) {
      char buffer[1024];
      const ssize_t got = ::recv(fd_, buffer, sizeof buffer, 0);
      ASSERT_GE(got, 0);
      message.assign(buffer, static_cast<std::size_t>(got));
    }
  }

 private:
  int fd_;
};

TEST(Systemd, HearsReadyWatchdogAndStopping) {
  DaemonFixture fixture;
  const std::string path = fixture.dir / "notify";
  NotifySocket notify(path);
  fixture.start({"NOTIFY_SOCKET=" + path, "WATCHDOG_USEC=100000"});
  notify.wait_for("READY=1");
  notify.wait_for("WATCHDOG=1");
  notify.wait_for("WATCHDOG=1");
  fixture.daemon->signal(SIGTERM);
  notify.wait_for("STOPPING=1");
  EXPECT_EQ(fixture.daemon->wait(), 0);
}

TEST(Systemd, IsToldOneLineWhateverADevicesWordsHold) {
  Status status;
  status.phase = Phase::kFailed;
  status.failure =
      Failure{FailureKind::kUnexpectedEvent, "refused\nWATCHDOG=trigger\r\n\x1b[31mREADY=1"};
  const std::string text = notification_of(status);
  EXPECT_EQ(text.rfind("STATUS=failed, ", 0), 0u) << text;
  EXPECT_NE(text.find("refused WATCHDOG=trigger"), std::string::npos) << text;
  for (const char c : text) EXPECT_GE(static_cast<unsigned char>(c), 0x20) << text;
}

TEST(TheJournal, GetsPrioritiesInFrontOfTheLines) {
  DaemonFixture fixture;
  fixture.start({"JOURNAL_STREAM=8:1"});
  fixture.daemon->signal(SIGTERM);
  fixture.daemon->wait();
  EXPECT_EQ(fixture.log().find("<6>cellcald "), 0u) << fixture.log();
}

}  // namespace
}  // namespace cellcal::daemon::testing
