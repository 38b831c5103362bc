// A daemon with the emulated cell, and Debian's mosquitto.

#include <gtest/gtest.h>

#include <thread>

#include "calib/syntax/input_file.h"
#include "daemon_fixture.h"
#include "tests/daemon/plant/publisher/broker.h"
#include "tests/daemon/plant/publisher/listener.h"

namespace cellcal::daemon::testing {
namespace {

std::string plant_of(const Broker& broker) {
  return "[plant]\nplant = \"graz\"\ncell = \"weld-3\"\nbroker = \"127.0.0.1\"\ntls = false\nport = " +
         std::to_string(broker.port()) + "\ntouches = true\n";
}

TEST(a_session, is_told_of_to_the_plant_whole_in_order_and_once) {
  const TemporaryDirectory broker_dir;
  Broker broker(broker_dir.path());
  Listener plant(broker.port(), "plant", "cellcal/#");
  DaemonFixture fixture(plant_of(broker));
  fixture.start();
  const Outcome run = fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "8", "--check", "2"});
  ASSERT_EQ(run.status, 3) << run.err << fixture.log();
  const auto heard = plant.until([](const auto& all) {
    return !all.empty() && all.back().topic == "cellcal/graz/weld-3/fact/alarm";
  });
  const auto facts = facts_in(heard);
  std::size_t touches = 0, phases = 0, calibrations = 0;
  for (std::size_t i = 0; i < facts.size(); ++i) {
    EXPECT_EQ(facts[i].number, static_cast<std::int64_t>(i) + 1);
    EXPECT_EQ(facts[i].session, 1);
    touches += std::holds_alternative<plant::TouchFact>(facts[i].body) ? 1 : 0;
    phases += std::holds_alternative<plant::PhaseFact>(facts[i].body) ? 1 : 0;
    if (const auto* result = std::get_if<plant::CalibrationFact>(&facts[i].body)) {
      ++calibrations;
      EXPECT_TRUE(result->document == calib::read_file(fixture.dir / "state/sessions/1/calibration.json"))
          << "byte for byte";
      EXPECT_FALSE(result->robot.empty());
    }
  }
  EXPECT_EQ(touches, fixture.status()["touches"]);
  EXPECT_GT(phases, touches);
  EXPECT_EQ(calibrations, 1u);
  EXPECT_EQ(std::get<plant::AlarmFact>(facts.back().body).news, "withheld");
  EXPECT_TRUE(presence_in(heard)->mock);
  const auto line = nlohmann::json::parse(http_request(fixture.socket(), "GET", "/v1/plant").body);
  EXPECT_EQ(line["connected"], true) << line;
  EXPECT_EQ(line["newest"], static_cast<std::int64_t>(facts.size()));
  fixture.daemon->signal(SIGTERM);
  EXPECT_EQ(fixture.daemon->wait(), 0);
  EXPECT_TRUE(presence_in(plant.until([](const auto& all) {
                return !presence_in(all)->online;
              }))->farewell);
}

TEST(a_session, that_was_killed_without_a_broker_is_told_of_when_there_is_one) {
  const TemporaryDirectory broker_dir;
  Broker broker(broker_dir.path());
  broker.kill();
  DaemonFixture fixture(plant_of(broker));
  fixture.start();
  http_request(fixture.socket(), "POST", "/v1/run", nlohmann::json{{"cell", CELLCAL_DEMO_CELL}, {"touches", 400}}.dump());
  fixture.wait_for_touches(3);
  fixture.daemon->signal(SIGKILL);
  fixture.daemon->wait();
  broker.start();
  Listener plant(broker.port(), "plant", "cellcal/#");
  fixture.start();
  const auto facts = facts_in(plant.until([](const auto& all) {
    return !all.empty() && all.back().payload.find("\"state\":\"interrupted\"") != std::string::npos;
  }));
  for (std::size_t i = 0; i < facts.size(); ++i)
    EXPECT_EQ(facts[i].number, static_cast<std::int64_t>(i) + 1);
  EXPECT_GT(facts.size(), 4u);
}

}  // namespace
}  // namespace cellcal::daemon::testing
