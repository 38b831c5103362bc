// The whole daemon over the network.

#include <gtest/gtest.h>
#include <signal.h>

#include "daemon_fixture.h"
#include "tests/daemon/api/schema.h"
#include "tests/daemon/api/tcp_peer.h"

namespace cellcal::daemon::testing {
namespace {

using nlohmann::json;

std::uint16_t free_port() {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t length = sizeof address;
  ::bind(fd, reinterpret_cast<sockaddr*>(&address), length);
  ::getsockname(fd, reinterpret_cast<sockaddr*>(&address), &length);
  ::close(fd);
  return ntohs(address.sin_port);
}

void expect_events_as_described(const std::string& stream) {
  const Description description(CELLCAL_OPENAPI);
  const std::map<std::string, std::string> schemas{
      {"status", "Status"}, {"touch", "TouchEvent"}, {"robot", "RobotEvent"}};
  std::string name;
  std::istringstream lines(stream.substr(stream.find("\r\n\r\n") + 4));
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("event: ", 0) == 0) name = line.substr(7);
    if (line.rfind("data: ", 0) != 0 || lines.eof()) continue;
    EXPECT_EQ(description.complaint(json::parse(line.substr(6)), schemas.at(name)), "") << line;
  }
}

struct ADaemonOnTheNetwork : ::testing::Test {
  ADaemonOnTheNetwork()
      : port(free_port()),
        fixture("[http]\nlisten = \"127.0.0.1:" + std::to_string(port) + "\"\ncell_folders = [\"" +
                std::filesystem::path(CELLCAL_DEMO_CELL).parent_path().string() + "\"]\n") {}

  struct Answer {
    int status = 0;
    std::string text;
    json body() const {
      return json::parse(text.substr(text.find("\r\n\r\n") + 4), nullptr, false);
    }
  };
  Answer ask(const std::string& token, const std::string& method, const std::string& path,
             const std::string& body = "") const {
    std::string request =
        method + " " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n";
    if (!token.empty()) request += "Authorization: Bearer " + token + "\r\n";
    request += "Content-Length: " + std::to_string(body.size()) + "\r\n\r\n" + body;
    Answer answer;
    answer.text = TcpPeer(port, request).read_all();
    if (answer.text.size() > 12) answer.status = std::stoi(answer.text.substr(9, 3));
    return answer;
  }
  std::string add_token(const std::string& role) const {
    const Outcome made = fixture.cellcal({"token", "add", "--role", role, "--name", "t-" + role});
    EXPECT_EQ(made.status, 0) << made.err;
    EXPECT_EQ(made.out.size(), 65u) << made.out;
    return made.out.substr(0, made.out.size() - 1);
  }
  void wait_until_idle() const {
    while (fixture.status()["running"] == true)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }

  std::uint16_t port;
  DaemonFixture fixture;
};

TEST_F(ADaemonOnTheNetwork, ShowsHealthToAllAndASessionToThoseWithAToken) {
  fixture.start();
  EXPECT_EQ(ask("", "GET", "/v1/health").body()["ok"], true);
  EXPECT_EQ(ask("", "GET", "/v1/status").status, 401);
  const std::string look = add_token("look");
  EXPECT_EQ(ask(look, "GET", "/v1/status").body()["phase"], "idle");
  EXPECT_EQ(ask(look, "POST", "/v1/abort").status, 403);
  EXPECT_EQ(fixture.cellcal({"token", "list"}).out.find(look), std::string::npos);
  EXPECT_NE(fixture.cellcal({"token", "list"}).out.find("t-look"), std::string::npos);
  EXPECT_EQ(fixture.cellcal({"token", "remove", "t-look"}).status, 0);
  EXPECT_EQ(ask(look, "GET", "/v1/status").status, 401);
  const Outcome none = fixture.cellcal({"token", "remove", "t-look"});
  EXPECT_EQ(none.status, 1);
  EXPECT_NE(none.err.find("no such token"), std::string::npos) << none.err;
  EXPECT_EQ(fixture.log().find(look), std::string::npos) << "the log holds no token";
}

TEST_F(ADaemonOnTheNetwork, RunsASessionOnceTheCellWasSaidToBeClear) {
  fixture.start();
  const std::string operate = add_token("operate"), look = add_token("look");
  const std::string run = json{{"cell", CELLCAL_DEMO_CELL}, {"touches", 8}, {"check", 0}}.dump();
  EXPECT_EQ(ask(operate, "POST", "/v1/run", run).status, 412);
  EXPECT_EQ(ask(operate, "POST", "/v1/clear").status, 200);
  TcpPeer follower(port, "GET /v1/events HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer " +
                             look + "\r\n\r\n");
  follower.read_until("event: status");
  EXPECT_EQ(ask(operate, "POST", "/v1/run", run).status, 201);
  EXPECT_EQ(ask(operate, "POST", "/v1/run", run).status, 409) << "one is under way";
  EXPECT_EQ(ask(operate, "POST", "/v1/clear").status, 409) << "one is under way";
  const std::string cell = json{{"cell", CELLCAL_DEMO_CELL}}.dump();
  EXPECT_EQ(ask(operate, "POST", "/v1/doctor", cell).status, 409) << "it has the devices";
  EXPECT_EQ(ask(look, "POST", "/v1/doctor", cell).status, 403) << "it reads a file";
  wait_until_idle();
  EXPECT_EQ(fixture.status()["phase"], "done");
  const std::string events = follower.read_until("\"phase\":\"done\"");
  for (int index = 0; index < 8; ++index) {
    const std::string one = "data: {\"index\":" + std::to_string(index) + ",";
    EXPECT_NE(events.find(one), std::string::npos) << index;
    EXPECT_EQ(events.find(one), events.rfind(one)) << index;
  }
  expect_events_as_described(events);
  EXPECT_EQ(ask(operate, "POST", "/v1/run", run).status, 412) << "it counted once";
  EXPECT_EQ(ask(look, "GET", "/v1/sessions/1/touches?limit=3&after=3").body()["touches"].size(),
            3u);
  EXPECT_EQ(ask(look, "GET", "/v1/sessions/1/touches").body()["more"], false);
  const Description description(CELLCAL_OPENAPI);
  const std::map<std::string, std::string> answers{{"/v1/status", "Status"},
                                                   {"/v1/sessions/1", "Session"},
                                                   {"/v1/sessions/1/touches", "Touches"},
                                                   {"/v1/sessions/1/events", "Events"},
                                                   {"/v1/sessions/1/figures", "Figures"},
                                                   {"/v1/sessions/1/plan", "Plan"},
                                                   {"/v1/scene", "Scene"},
                                                   {"/v1/drift", "Drift"}};
  for (const auto& [path, schema] : answers) {
    EXPECT_EQ(description.complaint(ask(look, "GET", path).body(), schema), "") << path;
  }
}

TEST_F(ADaemonOnTheNetwork, TakesAnAbortWithoutAWordBehindWhichTheCellIsNotClear) {
  fixture.start();
  const std::string operate = add_token("operate");
  const std::string run = json{{"cell", CELLCAL_DEMO_CELL}, {"touches", 100}}.dump();
  ASSERT_EQ(ask(operate, "POST", "/v1/clear").status, 200);
  ASSERT_EQ(ask(operate, "POST", "/v1/run", run).status, 201);
  fixture.wait_for_touches(1);
  EXPECT_EQ(ask(operate, "POST", "/v1/abort").status, 202);
  wait_until_idle();
  EXPECT_EQ(fixture.status()["phase"], "aborted");
  EXPECT_EQ(ask(operate, "POST", "/v1/run", R"({"resume": true})").status, 412);
}

TEST_F(ADaemonOnTheNetwork, EndsWithFollowersConnectedAndSaysWhereItListened) {
  fixture.start();
  const std::string look = add_token("look");
  TcpPeer follower(port, "GET /v1/events HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer " +
                             look + "\r\n\r\n");
  follower.read_until("event: status");
  fixture.daemon->signal(SIGTERM);
  EXPECT_EQ(fixture.daemon->wait(), 0) << fixture.log();
  EXPECT_NE(fixture.log().find("port " + std::to_string(port)), std::string::npos) << fixture.log();
}

TEST_F(ADaemonOnTheNetwork, DoesNotStartWhereItsPortIsTaken) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(::bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(fd, 1), 0);
  const Outcome outcome = run_program({CELLCALD, "--config", fixture.dir / "d.toml"});
  ::close(fd);
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("listen of [http]"), std::string::npos) << outcome.err;
}

}  // namespace
}  // namespace cellcal::daemon::testing
