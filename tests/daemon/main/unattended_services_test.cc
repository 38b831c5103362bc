#include "daemon/main/unattended_services.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <thread>

#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/unattended/hook_server.h"

namespace cellcal::daemon::testing {
namespace {

DaemonConfig posting_to(const HookServer& server) {
  DaemonConfig config;
  config.notify.webhook.emplace();
  config.notify.webhook->url = {false, "127.0.0.1", server.port(), "/"};
  return config;
}

Status aborted(std::int64_t session) {
  Status status;
  status.session = session;
  status.phase = Phase::kAborted;
  return status;
}

TEST(AnEndOfASession, IsNotifiedOnceAndThatOfTheResumedSessionAgain) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  HookServer server({kTaken});
  LiveConfig live(posting_to(server), [] { return DaemonConfig{}; });
  SessionService service{{journal, dir.path(), {}, {}}};
  UnattendedServices unattended(service, journal, live);
  Status under_way;
  under_way.phase = Phase::kTransit;
  under_way.session = 1;
  for (const Status& status :
       {aborted(1), aborted(1), under_way, aborted(1), aborted(1), under_way, aborted(2)})
    unattended.update(status);
  const auto about = [&](const char* session) {
    return std::ranges::count_if(server.requests(), [&](const std::string& request) {
      return request.find(session) != std::string::npos;
    });
  };
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (about("\"session\":2") == 0 && std::chrono::steady_clock::now() < end)
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  EXPECT_EQ(about("\"session\":2"), 1);
  EXPECT_EQ(about("\"session\":1"), 2);
}

}  // namespace
}  // namespace cellcal::daemon::testing
