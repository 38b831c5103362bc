// What the service manager meets: exit statuses and signals.

#include <gtest/gtest.h>
#include <signal.h>

#include "daemon_fixture.h"

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

TEST(a_wrong_configuration, is_not_tried_again_by_the_service_manager) {
  const DaemonFixture fixture("[rsi]\nsilence_cycles = 500\n");
  const Outcome outcome = run_program({CELLCALD, "--config", fixture.dir / "d.toml"});
  EXPECT_EQ(std::to_string(outcome.status), unit_key("RestartPreventExitStatus")) << outcome.err;
  EXPECT_NE(outcome.err.find("d.toml:6: rsi.silence_cycles"), std::string::npos) << outcome.err;
  const Outcome none = run_program({CELLCALD, "--config", fixture.dir / "none.toml"});
  EXPECT_EQ(std::to_string(none.status), unit_key("RestartPreventExitStatus")) << none.err;
}

TEST(a_daemon, lives_on_when_its_terminal_hangs_up) {
  DaemonFixture fixture;
  fixture.start();
  for (int i = 1; i <= 3; ++i) {
    fixture.daemon->signal(SIGHUP);
    EXPECT_EQ(fixture.status()["session"], 0) << fixture.log();
  }
  fixture.daemon->signal(SIGTERM);
  EXPECT_EQ(fixture.daemon->wait(), 0);
  const std::string log = fixture.log();
  EXPECT_NE(log.find("SIGHUP ignored: the configuration is read at the start only"),
            std::string::npos)
      << log;
}

TEST(a_request, with_control_characters_in_it_is_refused_and_forges_nothing) {
  DaemonFixture fixture;
  fixture.start();
  const auto post = [&](const nlohmann::json& body) {
    return http_request(fixture.socket(), "POST", "/v1/run", body.dump());
  };
  const Response cell = post({{"cell", "/a\nsession 7 is done.toml"}});
  EXPECT_EQ(cell.status, 400) << cell.body;
  EXPECT_NE(cell.body.find("control characters"), std::string::npos) << cell.body;
  EXPECT_EQ(post({{"cell", CELLCAL_DEMO_CELL}, {"region", "a\x1b[2J"}}).status, 400);
  EXPECT_EQ(post({{"cell", "/a\xC2\x85.toml"}}).status, 400);
  EXPECT_EQ(fixture.log().find("session 7"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon::testing
