// Interface to the service manager: exit statuses and signals.

#include <gtest/gtest.h>
#include <signal.h>

#include "daemon/journal/store/sqlite.h"
#include "daemon_fixture.h"
#include "tests/daemon/journal/images.h"

namespace cellcal::daemon::testing {
namespace {

/// The value of a key of the unit.
std::string unit_key(const std::string& key) {
  const std::string unit = content(CELLCAL_UNIT);
  const std::size_t at = unit.find("\n" + key + "=");
  if (at == std::string::npos) return "";
  const std::size_t from = at + key.size() + 2;
  return unit.substr(from, unit.find('\n', from) - from);
}

TEST(AWrongConfiguration, IsNotTriedAgainByTheServiceManager) {
  const DaemonFixture fixture("[rsi]\nsilence_cycles = 500\n");
  const Outcome outcome = run_program({CELLCALD, "--config", fixture.dir / "d.toml"});
  EXPECT_EQ(std::to_string(outcome.status), unit_key("RestartPreventExitStatus")) << outcome.err;
  EXPECT_NE(outcome.err.find("d.toml:6: rsi.silence_cycles"), std::string::npos) << outcome.err;
  const Outcome none = run_program({CELLCALD, "--config", fixture.dir / "none.toml"});
  EXPECT_EQ(std::to_string(none.status), unit_key("RestartPreventExitStatus")) << none.err;
}

TEST(ACheckOfTheConfiguration, ReadsCertificateAndKeyAsAStartWould) {
  const DaemonFixture fixture;
  const std::string certificate = fixture.dir / "c.pem", key = fixture.dir / "k.pem";
  const auto check = [&] {
    std::ofstream(fixture.dir / "d.toml")
        << "format = \"cellcal.daemon/1\"\nbackend = \"mock\"\n[http]\nlisten = \"0.0.0.0:8443\"\n"
        << "tls_certificate = \"" << certificate << "\"\ntls_key = \"" << key << "\"\n";
    return run_program({CELLCALD, "--config", fixture.dir / "d.toml", "--check"});
  };
  const Outcome none = check();
  EXPECT_EQ(none.status, 2) << none.out;
  EXPECT_NE(none.err.find("tls_certificate " + certificate), std::string::npos) << none.err;
  const std::string make =
      "openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=x -out " +
      certificate + " -keyout " + key + " 2>/dev/null";
  ASSERT_EQ(std::system(make.c_str()), 0);
  EXPECT_EQ(check().status, 0);
  ASSERT_EQ(std::system(("openssl x509 -in " + certificate + " -signkey " + key +
                         " -days -1 -out " + certificate + " 2>/dev/null")
                            .c_str()),
            0);
  EXPECT_NE(check().err.find(certificate + ": expired"), std::string::npos);
  ASSERT_EQ(std::system(make.c_str()), 0);
  std::ofstream(key) << "no key";
  const Outcome other = check();
  EXPECT_EQ(other.status, 2) << other.out;
  EXPECT_NE(other.err.find("tls_key " + key), std::string::npos) << other.err;
}

/// Waits until the log contains these words.
void wait_for_log(const DaemonFixture& fixture, const std::string& words) {
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(30);
  while (fixture.log().find(words) == std::string::npos) {
    ASSERT_LT(std::chrono::steady_clock::now(), end) << words << " is not in " << fixture.log();
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

TEST(ADaemon, LivesOnWhenItsTerminalHangsUp) {
  DaemonFixture fixture;
  fixture.start();
  for (int i = 1; i <= 3; ++i) {
    fixture.daemon->signal(SIGHUP);
    EXPECT_EQ(fixture.status()["session"], 0) << fixture.log();
  }
  fixture.daemon->signal(SIGTERM);
  EXPECT_EQ(fixture.daemon->wait(), 0);
}

TEST(AChangedConfiguration, IsInForceForTheNextSessionAndTheLogAtOnce) {
  DaemonFixture fixture("[mock]\nstart_deg = [0, -90, 90, 0, 90, 0]\n");
  fixture.start();
  EXPECT_EQ(fixture.log().find("debug"), std::string::npos);
  // Too small a limit is refused before the first motion, which shows the configuration in use.
  std::ofstream(fixture.dir / "d.toml")
      << "format = \"cellcal.daemon/1\"\nbackend = \"mock\"\nlog_level = \"debug\"\n"
      << "state_dir = \"/elsewhere\"\nsocket = \"" << fixture.socket() << "\"\n"
      << "[rsi]\ncorrection_limit_deg = 1\n";
  fixture.daemon->signal(SIGHUP);
  wait_for_log(fixture, "SIGHUP: keeps state_dir = \"" + (fixture.dir / "state").string() + "\"");
  EXPECT_EQ(fixture.log().find("stays socket"), std::string::npos) << fixture.log();
  const Outcome run =
      fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "8", "--check", "0"});
  EXPECT_EQ(run.status, 1);
  EXPECT_NE(run.err.find("correction_limit_deg"), std::string::npos) << run.err;
  EXPECT_NE(fixture.log().find("debug: session 1"), std::string::npos) << fixture.log();
}

TEST(AChangedConfiguration, DropsRawRowsAtOnceWhereItLimitsThem) {
  DaemonFixture fixture;
  std::filesystem::create_directory(fixture.dir / "state");
  {
    Journal journal(fixture.dir / "state/journal.db");
    for (int i = 0; i < 2; ++i) {
      const std::int64_t id = fill(journal, 3);
      journal.note(id, "t", std::string(1'500'000, 'x'));
      journal.record(id, RecordEnd{Ending::kDone, ""}, "2026-01-01T12:00:00.000Z");
    }
  }
  fixture.start();
  std::ofstream(fixture.dir / "d.toml", std::ios::app) << "[retention]\nmegabytes = 1\n";
  fixture.daemon->signal(SIGHUP);
  wait_for_log(fixture, "[retention]: raw events and readings of 1 sessions dropped");
}

TEST(AChangedConfiguration, ThatIsWrongChangesNothingAndIsNamedWithItsLine) {
  DaemonFixture fixture;
  fixture.start();
  const std::string good = content(fixture.dir / "d.toml");
  std::ofstream(fixture.dir / "d.toml", std::ios::app) << "[session]\nretries = 1000\n";
  fixture.daemon->signal(SIGHUP);
  wait_for_log(fixture, "SIGHUP: configuration not changed: ");
  EXPECT_NE(fixture.log().find("d.toml:6: session.retries"), std::string::npos) << fixture.log();
  EXPECT_EQ(fixture.status()["session"], 0);
  std::filesystem::remove(fixture.dir / "d.toml");
  fixture.daemon->signal(SIGHUP);
  wait_for_log(fixture, "no such file");
  std::ofstream(fixture.dir / "d.toml") << good;
  fixture.daemon->signal(SIGHUP);
  wait_for_log(fixture, "configuration read again");
}

TEST(AStart, ThatNoRepetitionHelpsIsNotTriedAgainByTheServiceManager) {
  const auto expect_end = [](const DaemonFixture& fixture, const std::string& words) {
    const Outcome outcome = run_program({CELLCALD, "--config", fixture.dir / "d.toml"});
    EXPECT_EQ(std::to_string(outcome.status), unit_key("RestartPreventExitStatus"));
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  };
  expect_end(DaemonFixture("[http]\nlisten = \"127.0.0.1:8443\"\ntls_certificate = "
                           "\"/nonexistent/c\"\ntls_key = \"/nonexistent/k\"\n"),
             "chgrp cellcal");
  const DaemonFixture other;
  std::filesystem::create_directories(other.dir / "state");
  Database(other.dir / "state/journal.db").execute("CREATE TABLE t (x)");
  expect_end(other, "the database of another program");
  const DaemonFixture elsewhere;
  std::ofstream(elsewhere.dir / "d.toml") << "format = \"cellcal.daemon/1\"\nbackend = \"mock\"\n"
                                          << "state_dir = \"/proc/cellcal\"\n";
  expect_end(elsewhere, "ReadWritePaths=");
}

TEST(AConfiguration, IsNotValidWithAFileThatCannotBeRead) {
  const DaemonFixture fixture(
      "[plant]\nplant = \"graz\"\ncell = \"weld-3\"\nbroker = \"broker.example\"\nuser = "
      "\"weld-3\"\npassword_file = \"/nonexistent/password\"\n");
  const Outcome checked = run_program({CELLCALD, "--config", fixture.dir / "d.toml", "--check"});
  EXPECT_EQ(checked.status, 2);
  EXPECT_NE(checked.err.find("/nonexistent/password: No such file"), std::string::npos)
      << checked.err;
}

TEST(AMissingCellFile, IsNamedToTheServiceWithTheFoldersThatItDoesNotSee) {
  DaemonFixture program, service;
  program.start();
  EXPECT_EQ(program.begin({{"cell", "/tmp/none.toml"}}).body.find("does not see"),
            std::string::npos);
  service.start({"STATE_DIRECTORY=/var/lib/cellcal"});  // as systemd sets it
  service.refuse({{"cell", "/tmp/none.toml"}}, 422,
                 "no such file; check the path. The service does not see /tmp");
}

TEST(ARequest, WithControlCharactersInItIsRefusedAndForgesNothing) {
  DaemonFixture fixture;
  fixture.start();
  fixture.refuse({{"cell", "/a\nsession 7 is done.toml"}}, 400, "control characters");
  EXPECT_EQ(fixture.begin({{"cell", CELLCAL_DEMO_CELL}, {"region", "a\x1b[2J"}}).status, 400);
  EXPECT_EQ(fixture.begin({{"cell", "/a\xC2\x85.toml"}}).status, 400);
  EXPECT_EQ(fixture.log().find("session 7"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon::testing
