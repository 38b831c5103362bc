#include "daemon/unattended/notifier.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
#include <atomic>
#include <fstream>

#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/unattended/hook_server.h"
#include "tests/daemon/unattended/smtp_server.h"

namespace cellcal::daemon {
namespace {

using testing::HookServer;

Notice aborted() {
  Notice notice;
  notice.news = News::kAborted;
  notice.session = 7;
  return notice;
}

NotifyConfig hook(const HookServer& server) {
  NotifyConfig config;
  config.webhook.emplace();
  config.webhook->url = {false, "127.0.0.1", server.port(), "/"};
  return config;
}

TEST(ANotifier, TriesAgainBehindAWaitUntilItIsTaken) {
  HookServer server({testing::kBroken, testing::kBroken, testing::kTaken});
  Notifier notifier({[&] { return hook(server); }, "c", std::chrono::milliseconds(1)});
  notifier.notify([] { return aborted(); });
  notifier.drain();
  EXPECT_EQ(server.requests().size(), 3u);
  EXPECT_NE(server.requests()[2].find("\"news\":\"aborted\""), std::string::npos);
}

TEST(ANotifier, GivesUpWhereAllRetriesAreUsedAndGoesOnWithTheNext) {
  HookServer server({testing::kBroken, testing::kBroken, testing::kTaken});
  NotifyConfig config = hook(server);
  config.webhook->retries = 1;
  Notifier notifier({[&] { return config; }, "c", std::chrono::milliseconds(1)});
  notifier.notify([] { return aborted(); });
  notifier.notify([] { return std::nullopt; });
  notifier.notify([]() -> std::optional<Notice> { throw std::runtime_error("unreadable"); });
  notifier.notify([] { return aborted(); });
  notifier.drain();
  EXPECT_EQ(server.requests().size(), 3u);
}

TEST(ANotifier, MailsAndPostsTheSameInTheConfiguredLanguage) {
  testing::TemporaryDirectory dir;
  HookServer server({testing::kTaken});
  std::ofstream(dir / "sendmail") << "#!/bin/sh\ncat > '" << (dir / "mail").string() << "'\n";
  ::chmod((dir / "sendmail").c_str(), 0755);
  NotifyConfig config = hook(server);
  config.language = calib::Language::of("de").value();
  config.mail = MailConfig{{"a@b"}, "c@d", dir / "sendmail", {}};
  Notifier notifier({[&] { return config; }, "c", std::chrono::milliseconds(1)});
  notifier.notify([] { return aborted(); });
  notifier.drain();
  std::ifstream mail(dir / "mail");
  const std::string text((std::istreambuf_iterator<char>(mail)), {});
  EXPECT_NE(text.find("Subject: =?utf-8?Q?Sitzung_7=3A_abgebrochen?="), std::string::npos) << text;
  ASSERT_EQ(server.requests().size(), 1u);
  EXPECT_NE(server.requests()[0].find("Sitzung 7: abgebrochen"), std::string::npos);
}

TEST(ANotifier, MailsAgainToThoseAloneThatWereBusy) {
  testing::SmtpServer server({.first_answers = {{"RCPT TO:<a@", "451 busy"}}});
  NotifyConfig config;
  config.mail = MailConfig{{"a@plant.example", "b@plant.example"}, "c@d", "", {}};
  config.mail->server.emplace();
  config.mail->server->host = "127.0.0.1";
  config.mail->server->port = server.port();
  Notifier notifier({[&] { return config; }, "c", std::chrono::milliseconds(1)});
  notifier.notify([] { return aborted(); });
  notifier.drain();
  const std::vector<std::string> lines = server.lines();
  EXPECT_EQ(std::ranges::count(lines, "RCPT TO:<a@plant.example>"), 2);
  EXPECT_EQ(std::ranges::count(lines, "RCPT TO:<b@plant.example>"), 1) << "it has it";
  EXPECT_EQ(std::ranges::count(lines, "DATA"), 2);
}

TEST(ANotifier, RecordsTheNextWhileOneWaitsForItsNextAttempt) {
  HookServer server({testing::kBroken});
  std::atomic<int> recorded{0};
  Notifier notifier({.config = [&] { return hook(server); },
                     .host = "c",
                     .first_wait = std::chrono::hours(1),
                     .also = [&] { return [&](const Notice&) { ++recorded; }; }});
  notifier.notify([] { return aborted(); });
  while (server.requests().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  notifier.notify([] { return aborted(); });
  while (recorded < 2) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(server.requests().size(), 1u) << "it is delivered behind the first";
}

TEST(ANotifier, EndsWhileItWaitsForTheNextAttemptAndAsksForNothingWhereNobodyIsTold) {
  HookServer server({testing::kBroken});
  bool asked = false;
  NotifyConfig nobody;
  {
    Notifier quiet({[&] { return nobody; }, "c", std::chrono::milliseconds(1)});
    quiet.notify([&] {
      asked = true;
      return aborted();
    });
    quiet.drain();
    Notifier waiting({[&] { return hook(server); }, "c", std::chrono::hours(1)});
    waiting.notify([] { return aborted(); });
    while (server.requests().empty()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_FALSE(asked);
  EXPECT_EQ(server.requests().size(), 1u);
}

}  // namespace
}  // namespace cellcal::daemon
