// An edge node with Debian's mosquitto.

#include "daemon/plant/line/edge_node.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <thread>

#include "daemon/plant/line/line_status.h"
#include "sparkplug_b.pb.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/plant/line/broker.h"
#include "tests/daemon/plant/line/listener.h"

namespace cellcal::daemon::testing {
namespace {

using namespace std::chrono_literals;
using namespace plant::sparkplug;
using Payload = cellcal::sparkplug::Payload;

Payload read(const Heard& heard) {
  Payload payload;
  EXPECT_TRUE(payload.ParseFromString(heard.payload)) << heard.topic;
  return payload;
}

const cellcal::sparkplug::Metric* metric(const Payload& payload, const std::string& name) {
  for (const auto& one : payload.metrics())
    if (one.name() == name) return &one;
  return nullptr;
}

std::vector<Payload> of_type(const std::vector<Heard>& heard, const std::string& type) {
  std::vector<Payload> all;
  for (const Heard& one : heard)
    if (one.topic == "spBv1.0/graz/" + type + "/weld-3") all.push_back(read(one));
  return all;
}

std::string rebirth() {
  return payload({{kRebirth, DataType::kBoolean, true}}, 1, std::nullopt, Types::kDeclared);
}

struct ASparkplugNode : ::testing::Test {
  EdgeNode::Parts parts() {
    EdgeNode::Parts all;
    all.config.plant = "graz";
    all.config.cell = "weld-3";
    all.config.host = "127.0.0.1";
    all.config.port = broker.port();
    all.config.tls = false;
    all.every = 10ms;
    all.first_wait = all.longest_wait = 50ms;
    all.metrics = [this] {
      CellNow now;
      now.software = "1";
      now.phase = "idle";
      now.session = CellNow::Session{1, "calibrate", touches, 40, {}};
      return metrics_of(now);
    };
    return all;
  }
  std::vector<Heard> until_there_are(std::size_t count, const std::string& type) {
    return host.until([&](const auto& all) { return of_type(all, type).size() >= count; });
  }

  TemporaryDirectory dir;
  Broker broker{dir.path()};
  Listener host{broker.port(), "host", "spBv1.0/#"};
  std::atomic<std::int64_t> touches{3};
};

TEST_F(ASparkplugNode, IsBornWithAllOfItsMetricsAndTellsWhatChanges) {
  const EdgeNode node(parts());
  const auto births = of_type(until_there_are(1, "NBIRTH"), "NBIRTH");
  EXPECT_EQ(births[0].seq(), 0U);
  EXPECT_GT(births[0].timestamp(), 1700000000000U);
  ASSERT_NE(metric(births[0], "bdSeq"), nullptr);
  EXPECT_EQ(metric(births[0], "bdSeq")->long_value(), 0U);
  ASSERT_NE(metric(births[0], kRebirth), nullptr);
  EXPECT_FALSE(metric(births[0], kRebirth)->boolean_value());
  EXPECT_TRUE(metric(births[0], kRebirth)->has_boolean_value());
  for (const Metric& one : metrics_of({})) {
    ASSERT_NE(metric(births[0], one.name), nullptr) << one.name;
    EXPECT_EQ(metric(births[0], one.name)->datatype(), static_cast<std::uint32_t>(one.type));
  }
  touches = 4;
  const auto data = of_type(until_there_are(1, "NDATA"), "NDATA");
  EXPECT_EQ(data[0].seq(), 1U);
  ASSERT_EQ(data[0].metrics_size(), 1) << "what did not change is not told again";
  EXPECT_EQ(data[0].metrics(0).name(), "Session/Touches");
  EXPECT_EQ(data[0].metrics(0).long_value(), 4U);
  for (const Heard& one : host.all()) EXPECT_FALSE(one.retained) << one.topic;
}

TEST_F(ASparkplugNode, CountsItsMessagesUpTo255AndGoesOnWith0) {
  EdgeNode::Parts quick = parts();
  quick.every = 1ms;
  quick.metrics = [this, before = parts().metrics] {
    ++touches;
    return before();
  };
  const EdgeNode node(std::move(quick));
  const auto data = of_type(until_there_are(300, "NDATA"), "NDATA");
  for (std::size_t i = 0; i < data.size(); ++i) EXPECT_EQ(data[i].seq(), (i + 1) % 256) << i;
}

TEST_F(ASparkplugNode, IsBornAgainWhereAHostAsksAndByNothingElseThatItHears) {
  const EdgeNode node(parts());
  until_there_are(1, "NBIRTH");
  touches = 5;
  until_there_are(1, "NDATA");
  for (const std::string& noise :
       {std::string(), std::string("not protobuf"), std::string(100000, '\xff'),
        payload({{"Session/Touches", DataType::kInt64, std::int64_t{0}}}, 1, {}, Types::kDeclared)})
    host.say("spBv1.0/graz/NCMD/weld-3", noise);
  host.say("spBv1.0/graz/NCMD/weld-4", rebirth());
  host.say("spBv1.0/graz/NCMD/weld-3", rebirth());
  const auto heard = until_there_are(2, "NBIRTH");
  const auto births = of_type(heard, "NBIRTH");
  EXPECT_EQ(births[1].seq(), 0U);
  EXPECT_EQ(metric(births[1], "bdSeq")->long_value(), 0U) << "it is the same line";
  EXPECT_EQ(metric(births[1], "Session/Touches")->long_value(), 5U);
  touches = 6;
  EXPECT_EQ(of_type(until_there_are(2, "NDATA"), "NDATA")[1].seq(), 1U);
  EXPECT_EQ(of_type(host.all(), "NBIRTH").size(), 2U);
}

TEST_F(ASparkplugNode, AnswersAHostThatNeverStopsAskingOnceInItsTime) {
  EdgeNode::Parts slow = parts();
  slow.every = 300ms;
  const auto begun = std::chrono::steady_clock::now();
  const EdgeNode node(std::move(slow));
  until_there_are(1, "NBIRTH");
  for (int i = 0; i < 200; ++i) host.say("spBv1.0/graz/NCMD/weld-3", rebirth());
  until_there_are(2, "NBIRTH");
  std::this_thread::sleep_for(700ms);
  const std::size_t births = of_type(host.all(), "NBIRTH").size();
  EXPECT_LE(births,
            2U + static_cast<std::size_t>((std::chrono::steady_clock::now() - begun) / 300ms));
  EXPECT_LT(births, 200U);
}

TEST_F(ASparkplugNode, ThatLosesItsLineIsDeadAndBornUnderTheNextNumber) {
  const EdgeNode node(parts());
  until_there_are(1, "NBIRTH");
  { const Listener other(broker.port(), "cellcal-graz-weld-3-sparkplug", ""); }
  const auto heard = until_there_are(2, "NBIRTH");
  const auto deaths = of_type(heard, "NDEATH");
  ASSERT_EQ(deaths.size(), 1U);
  EXPECT_EQ(metric(deaths[0], "bdSeq")->long_value(), 0U);
  EXPECT_FALSE(deaths[0].has_seq());
  EXPECT_EQ(metric(of_type(heard, "NBIRTH")[1], "bdSeq")->long_value(), 1U);
}

TEST_F(ASparkplugNode, ThatEndsInOrderSaysItsDeathOnce) {
  {
    const EdgeNode node(parts());
    until_there_are(1, "NBIRTH");
  }
  const auto deaths = of_type(until_there_are(1, "NDEATH"), "NDEATH");
  EXPECT_EQ(metric(deaths[0], "bdSeq")->long_value(), 0U);
  std::this_thread::sleep_for(200ms);
  EXPECT_EQ(of_type(host.all(), "NDEATH").size(), 1U) << "the will is not sent as well";
}

TEST_F(ASparkplugNode, IsBornWhenItIsKnownHowTheCellStands) {
  EdgeNode::Parts unknown = parts();
  std::atomic<bool> known{false};
  unknown.metrics = [&, metrics = unknown.metrics] {
    return known ? metrics() : std::vector<Metric>();
  };
  const EdgeNode node(std::move(unknown));
  for (int i = 0; i < 500 && !node.status().connected; ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(node.status().acknowledged, 0U);
  known = true;
  EXPECT_EQ(
      metric(of_type(until_there_are(1, "NBIRTH"), "NBIRTH")[0], "Session/Touches")->long_value(),
      3U);
}

TEST_F(ASparkplugNode, ThatLeavesWithoutAFarewellIsDeclaredDeadAllTheSame) {
  {
    EdgeNode node(parts());
    until_there_are(1, "NBIRTH");
    node.close_with_will();
  }
  until_there_are(1, "NDEATH");
}

TEST_F(ASparkplugNode, WithoutABrokerSaysSoTriesAgainAndEndsAtOnce) {
  broker.kill();
  const EdgeNode node(parts());
  for (int i = 0; i < 500 && node.status().words.empty(); ++i) std::this_thread::sleep_for(10ms);
  EXPECT_EQ(node.status().problem, plant::LineProblem::kUnreachable);
  EXPECT_FALSE(node.status().connected);
  broker.start();
  const Listener again(broker.port(), "again", "spBv1.0/#");
  again.until([](const auto& all) { return !of_type(all, "NBIRTH").empty(); });
  EXPECT_TRUE(node.status().connected);
}

}  // namespace
}  // namespace cellcal::daemon::testing
