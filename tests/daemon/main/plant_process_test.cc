// Hostile or invalid data from a broker affect the process of the connection only.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <thread>

#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"
#include "daemon_fixture.h"
#include "tests/daemon/plant/line/hostile_broker.h"

namespace cellcal::daemon::testing {
namespace {

using nlohmann::json;

struct HostileBrokerTest : ::testing::Test {
  HostileBrokerTest()
      : fixture(
            "[plant]\nplant = \"graz\"\ncell = \"weld-3\"\nbroker = \"127.0.0.1\"\ntls = false\n"
            "port = " +
            std::to_string(broker.port()) + "\ntouches = true\n") {
    fixture.start();
    line = std::make_unique<Background>(
        std::vector<std::string>{CELLCAL_PLANT, "--socket", fixture.dir / "plant/s",
                                 "--longest-wait", "1"},
        fixture.dir / "plant.log");
  }
  template <class F>
  void wait_until(F done) const {
    // Evaluated once per step: the condition may become false again at the next.
    bool met = done();
    for (int i = 0; i < 6000 && !met; ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      met = done();
    }
    ASSERT_TRUE(met) << fixture.log() << content(fixture.dir / "plant.log");
  }
  json plant() const { return fixture.get("/v1/plant"); }
  json proposals() const { return fixture.get("/v1/proposals")["proposals"]; }
  /// Numbers of all received facts, over all connections.
  std::set<std::int64_t> numbers() const {
    std::set<std::int64_t> all;
    for (const auto& one : broker.published())
      if (one.topic.find("/fact/") != std::string::npos)
        all.insert(plant::fact_from_json(one.payload, *plant::topic_of(one.topic)).number);
    return all;
  }
  HostileBroker broker;
  DaemonFixture fixture;
  std::unique_ptr<Background> line;
};

TEST_F(HostileBrokerTest, EndsTheProcessOfTheLineInMidSessionAndTheSessionGoesOn) {
  wait_until([&] { return broker.lines() == 1; });
  fixture.begin({{"cell", CELLCAL_DEMO_CELL}, {"touches", 60}, {"check", 8}});
  int lines = 1;
  for (const std::string& packet : deadly_packets()) {
    fixture.wait_for_touches(5 * lines);
    const pid_t before = line->working();
    ASSERT_EQ(broker.say(packet), 1);
    wait_until([&] { return broker.lines() == lines + 1; });
    EXPECT_NE(line->working(), before) << "another process";
    ++lines;
  }
  EXPECT_EQ(fixture.get("/v1/health")["ok"], true);
  wait_until([&] { return fixture.status()["phase"] == "done"; });
  EXPECT_EQ(fixture.status()["session"], 1);
  EXPECT_EQ(fixture.status()["interruptions"], 0);
  EXPECT_EQ(fixture.status()["links"]["robot"]["late"], 0);
  wait_until([&] { return plant()["restarts"] == 2 && plant()["connected"] == true; });
  // Nothing is acknowledged as stored: each connection gets all facts from the first on.
  std::set<std::int64_t> all;
  wait_until([&] {
    all = numbers();
    return all.size() == plant()["newest"];
  });
  EXPECT_EQ(*all.begin(), 1);
  EXPECT_EQ(*all.rbegin(), static_cast<std::int64_t>(all.size()));
}

TEST_F(HostileBrokerTest, GetsNoMemoryForAPacketOf256Megabytes) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer's own books are larger";
#endif
  wait_until([&] { return broker.lines() == 1; });
  const pid_t process = line->working();
  broker.say(std::string("\x30\xff\xff\xff\x7f", 5) + std::string(std::size_t{1} << 20, 'x'));
  wait_until([&] { return broker.lines() == 2; });
  EXPECT_EQ(line->working(), process) << "it is the line alone that is lost";
  const std::string status = content("/proc/" + std::to_string(process) + "/status");
  const auto peak = status.find("VmHWM:");
  ASSERT_NE(peak, std::string::npos);
  EXPECT_LT(std::stoll(status.substr(peak + 6)), 100 * 1024) << "kB";
}

TEST_F(HostileBrokerTest, ThatProposes20000TimesWhatIsNoProposalFillsNoLog) {
  wait_until([&] { return broker.lines() == 1; });
  std::string flood;
  for (int i = 0; i < 20000; ++i)
    flood +=
        publish_packet("cellcal/graz/weld-3/proposal/p-" + std::to_string(i), "{\"format\": 7}");
  const plant::Proposal last{
      {"graz", "weld-3"}, "p-last", plant::ProposalKind::kCheck, 0, "", "M. Huber", "drift", "t"};
  broker.say(flood + publish_packet("cellcal/graz/weld-3/proposal/p-last", plant::to_json(last)));
  wait_until([&] { return proposals().size() == 1; });  // all before it have been received
  EXPECT_NE(content(fixture.dir / "plant.log").find("not understood"), std::string::npos);
  EXPECT_LT(content(fixture.dir / "plant.log").size(), 2000u);
  EXPECT_LT(fixture.log().size(), 4000u);
}

TEST_F(HostileBrokerTest, HasNothingInTheProcessThatHoldsTheArmAndNoWayToItsSocket) {
  wait_until([&] { return broker.lines() == 1; });
  const auto maps = [](pid_t process) {
    return content("/proc/" + std::to_string(process) + "/maps");
  };
  for (const char* library : {"libmosquitto", "libprotobuf"}) {
    EXPECT_EQ(maps(fixture.daemon->pid()).find(library), std::string::npos) << library;
    EXPECT_NE(maps(line->working()).find(library), std::string::npos) << library;
  }
  const std::string socket = fixture.dir / "plant/s";
  for (const char* path : {"/v1/run", "/v1/abort", "/v1/versions/activate", "/v1/tokens",
                           "/v1/proposals/p-1/accept?as=graz/weld-3"})
    EXPECT_GE(http_request(socket, "POST", path, "{}").status, 404) << path;
  EXPECT_EQ(http_request(socket, "GET", "/v1/status").status, 404);
  EXPECT_EQ(fixture.status()["phase"], "idle");
}

TEST(ADaemon, WhoseDoorForTheLineCannotBeOpenedSaysSoAndHoldsTheArmAllTheSame) {
  DaemonFixture fixture;
  std::ofstream(fixture.dir / "plant") << "no folder";
  fixture.start();
  EXPECT_EQ(fixture.status()["phase"], "idle");
  EXPECT_NE(fixture.log().find("no line to a plant: "), std::string::npos) << fixture.log();
}

}  // namespace
}  // namespace cellcal::daemon::testing
