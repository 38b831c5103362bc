// The daemon's interface to the process of its connection, over their socket.

#include "daemon/plant/desk/desk.h"

#include <gtest/gtest.h>

#include <boost/asio/executor_work_guard.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <thread>

#include "daemon/api/http/server.h"
#include "daemon/plant/line/cell_metrics.h"
#include "daemon/plant/messages/fact.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using namespace std::chrono_literals;
using namespace plant;

struct GivenOutbox final : Outbox {
  WaitingCount count() override { return {"j", 7, 3, 1, "graz/weld-2"}; }
  std::vector<WaitingFact> facts(std::int64_t after, std::size_t most) override {
    if (away) throw OutboxError("the disk is away");
    if (meanwhile) meanwhile();
    std::vector<WaitingFact> all;
    for (std::int64_t row = after + 1; row <= 3 && all.size() < most; ++row)
      all.push_back({row, "j", row + 10, 2, "alarm", Worth::kResult,
                     R"({"text":"a \n \"quoted\" one"})" + std::to_string(row)});
    return all;
  }
  void acknowledge(const std::vector<std::int64_t>& rows) override {
    acknowledged.insert(acknowledged.end(), rows.begin(), rows.end());
  }
  bool away = false;
  std::function<void()> meanwhile;  ///< while facts are composed
  std::vector<std::int64_t> acknowledged;
};

PlantConfig a_plant() {
  PlantConfig plant;
  plant.plant = "graz";
  plant.cell = "weld-3";
  plant.host = "broker.plant.example";
  plant.ca = "/etc/cellcal/plant-ca.pem";
  plant.user = "weld-3";
  plant.password_file = "/etc/cellcal/plant.password";
  plant.sparkplug = true;
  return plant;
}

Proposal a_proposal(const std::string& id) {
  return {{"graz", "weld-3"}, id, ProposalKind::kCheck, 0, "", "M. Huber", "drift", "t"};
}

/// Desk and socket, with a clock of the test.
struct DeskTest : ::testing::Test {
  DeskTest() {
    Desk::Parts parts;
    parts.now = [this] { return now; };
    parts.utc = [this] { return utc; };
    parts.proposal = [this](const Proposal& proposal) {
      proposals.push_back(proposal);
      return answered;
    };
    parts.metrics = [this] {
      if (unreadable) throw std::runtime_error("the disk is away");
      sparkplug::CellNow cell;
      cell.phase = "idle";
      cell.calibration = sparkplug::CellNow::InUse{3, 1.5, true, 0.0001, {}};
      return sparkplug::metrics_of(cell);
    };
    parts.publish_health = [this] { ++health; };
    subject = std::make_unique<Desk>(parts);
    server = std::make_unique<HttpServer>(
        context, socket(),
        ServerParts{[](Request&) { return std::nullopt; },
                    [this](const Request& request, bool) { return subject->answer(request); },
                    {},
                    {.body = kMostDeskBody}});
    thread = std::thread([this] { context.run(); });
  }
  ~DeskTest() override {
    boost::asio::post(context, [this] {
      server->stop();
      context.stop();
    });
    thread.join();
  }
  void use(const PlantConfig& plant) { subject->use(outbox, plant, true); }
  std::filesystem::path socket() const { return dir / "s"; }

  TemporaryDirectory dir;
  Desk::Time now{Desk::Time::clock::now()};
  std::string utc = "2026-01-01T00:00:00.000Z";
  std::vector<Proposal> proposals;
  bool answered = true, unreadable = false;
  int health = 0;
  std::shared_ptr<GivenOutbox> outbox = std::make_shared<GivenOutbox>();
  std::unique_ptr<Desk> subject;
  boost::asio::io_context context;
  std::unique_ptr<HttpServer> server;
  std::thread thread;
};

TEST_F(DeskTest, SaysWhichLineThereIsToBeAndHowTheCellStands) {
  EXPECT_FALSE(report_to_desk(socket(), {}).plant);
  EXPECT_FALSE(subject->status()) << "no plant is named";
  use(a_plant());
  const Orders orders = report_to_desk(socket(), {});
  ASSERT_TRUE(orders.plant);
  EXPECT_EQ(*orders.plant, a_plant());
  EXPECT_TRUE(orders.mock);
  EXPECT_EQ(orders.daemon, report_to_desk(socket(), {}).daemon);
  EXPECT_FALSE(orders.daemon.empty());
  sparkplug::CellNow cell;
  cell.phase = "idle";
  cell.calibration = sparkplug::CellNow::InUse{3, 1.5, true, 0.0001, {}};
  EXPECT_EQ(orders.metrics, sparkplug::metrics_of(cell));
  PlantConfig without = a_plant();
  without.sparkplug = false;
  use(without);
  EXPECT_TRUE(report_to_desk(socket(), {}).metrics.empty());
}

TEST_F(DeskTest, KeepsTheMetricsWhereTheCellCannotBeLookedAt) {
  use(a_plant());
  unreadable = true;
  EXPECT_EQ(report_to_desk(socket(), {}).metrics, sparkplug::metrics_of({}));
  unreadable = false;
  const auto known = report_to_desk(socket(), {}).metrics;
  unreadable = true;
  EXPECT_EQ(report_to_desk(socket(), {}).metrics, known);
}

TEST_F(DeskTest, KnowsOfTheLineWhatWasSaidLastAndNamesAProcessThatIsNotHeardWithItsTime) {
  use(a_plant());
  EXPECT_EQ(subject->status()->facts.problem, LineProblem::kNone) << "it may yet come";
  utc = "2026-01-01T00:00:07.000Z";
  const LineStatus line{true, LineProblem::kNoCollector, "no subscriber", "t1", 12};
  report_to_desk(socket(), {line, LineStatus{false, LineProblem::kLost, "lost", "t2", 3}, 4});
  now += kDeskSilence;
  const LinesStatus heard = *subject->status();
  EXPECT_TRUE(heard.facts.connected);
  EXPECT_EQ(heard.facts.problem, LineProblem::kNoCollector);
  EXPECT_EQ(heard.facts.words, "no subscriber");
  EXPECT_EQ(heard.facts.since, "t1");
  EXPECT_EQ(heard.facts.acknowledged, 12u);
  EXPECT_EQ(heard.sparkplug->words, "lost");
  EXPECT_EQ(heard.restarts, 4u);
  now += 1ms;
  const LinesStatus silent = *subject->status();
  EXPECT_FALSE(silent.facts.connected);
  EXPECT_EQ(silent.facts.problem, LineProblem::kNotRunning);
  EXPECT_EQ(silent.facts.since, "2026-01-01T00:00:07.000Z");
  EXPECT_NE(silent.facts.words.find("process not running since 2026-01-01T00:00:07.000Z"),
            std::string::npos);
  EXPECT_EQ(silent.sparkplug->problem, LineProblem::kNotRunning);
  report_to_desk(socket(), {line, {}, 5});
  EXPECT_TRUE(subject->status()->facts.connected);
}

TEST_F(DeskTest, TakesNoProcessForGoneThatWaitsForWhatIsComposed) {
  use(a_plant());
  report_to_desk(socket(), {});
  outbox->meanwhile = [this] { now += 2 * kDeskSilence; };
  DeskClient(socket(), a_plant()).facts(0, 9);
  EXPECT_EQ(subject->status()->facts.problem, LineProblem::kNone);
}

TEST_F(DeskTest, ShortensWhatALineSaysOfItself) {
  use(a_plant());
  LineStatus line;
  line.words = std::string(100'000, '\xff');
  report_to_desk(socket(), {line, {}, 0});
  EXPECT_LE(subject->status()->facts.words.size(), 4096u);
}

TEST_F(DeskTest, HandsOutWhatWaitsByteForByteAndTakesWhatIsStored) {
  use(a_plant());
  DeskClient client(socket(), a_plant());
  EXPECT_EQ(client.count(), outbox->count());
  const auto facts = client.facts(1, 9), expected = outbox->facts(1, 9);
  ASSERT_EQ(facts.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(facts[i].row, expected[i].row);
    EXPECT_EQ(facts[i].number, expected[i].number);
    EXPECT_EQ(facts[i].source, expected[i].source);
    EXPECT_EQ(facts[i].kind, "alarm");
    EXPECT_EQ(facts[i].worth, Worth::kResult);
    EXPECT_EQ(facts[i].text, expected[i].text);
  }
  EXPECT_EQ(client.facts(0, 1).size(), 1u);
  std::vector<std::int64_t> rows(2500);
  for (std::size_t i = 0; i < rows.size(); ++i) rows[i] = static_cast<std::int64_t>(i);
  client.acknowledge(rows);
  EXPECT_EQ(outbox->acknowledged, rows);
}

TEST_F(DeskTest, AnswersAFailureOfTheDiskAsOne) {
  use(a_plant());
  outbox->away = true;
  DeskClient client(socket(), a_plant());
  try {
    client.facts(0, 1);
    FAIL();
  } catch (const OutboxError& error) {
    EXPECT_STREQ(error.what(), "the disk is away");
  }
}

TEST_F(DeskTest, GivesALineUnderAnEarlierNameNothing) {
  use(a_plant());
  PlantConfig earlier = a_plant();
  earlier.cell = "weld-2";
  DeskClient client(socket(), earlier);
  EXPECT_THROW(client.facts(0, 9), OutboxError);
  EXPECT_THROW(client.acknowledge({1}), OutboxError);
  EXPECT_TRUE(outbox->acknowledged.empty());
}

TEST_F(DeskTest, TakesProposalsAndSoManyAMinute) {
  use(a_plant());
  DeskClient client(socket(), a_plant());
  EXPECT_TRUE(client.propose(a_proposal("p-0")));
  EXPECT_EQ(proposals.at(0), a_proposal("p-0"));
  answered = false;
  EXPECT_FALSE(client.propose(a_proposal("p-1")));
  int taken = 2;
  try {
    for (int i = 2; i < 1000; ++i, ++taken) client.propose(a_proposal("p-" + std::to_string(i)));
    FAIL();
  } catch (const OutboxError&) {
  }
  EXPECT_EQ(taken, kMostProposals);
  now += 1min;
  client.propose(a_proposal("p-1000"));
}

TEST_F(DeskTest, TakesNoProposalThatIsNoneOrAnotherCells) {
  use(a_plant());
  Proposal other = a_proposal("p-1");
  other.of.cell = "weld-4";
  DeskClient client(socket(), a_plant());
  EXPECT_THROW(client.propose(other), OutboxError);
  for (const std::string& body :
       {std::string("{}"), std::string("no JSON"), std::string(300'000, '[')})
    EXPECT_EQ(http_request(socket(), "POST", "/v1/proposals/p-1?as=graz/weld-3", body).status, 422);
  EXPECT_TRUE(proposals.empty());
}

TEST_F(DeskTest, RefusesWhatIsNoReportAndIsLargerThanAny) {
  use(a_plant());
  for (const std::string& body : {std::string("{}"), std::string("["), std::string(200'000, '['),
                                  std::string(R"({"facts": {"connected": 1}, "restarts": -1})")})
    EXPECT_EQ(http_request(socket(), "POST", "/v1/line", body).status, 422);
  EXPECT_EQ(http_request(socket(), "GET", "/v1/facts?as=graz/weld-3&after=x&most=1").status, 400);
  EXPECT_EQ(http_request(socket(), "POST", "/v1/stored?as=graz/weld-3", R"({"rows": [-1]})").status,
            422);
  try {
    EXPECT_GE(
        http_request(socket(), "POST", "/v1/line", std::string(kMostDeskBody + 1, ' ')).status,
        400);
  } catch (const SocketError&) {  // disconnected
  }
}

TEST_F(DeskTest, AsksForTheHealthEverySoOftenWhileThereIsAProcess) {
  PlantConfig plant = a_plant();
  plant.health_minutes = 10.0;
  use(plant);
  report_to_desk(socket(), {});
  now += 9min;
  report_to_desk(socket(), {});
  EXPECT_EQ(health, 0);
  now += 1min;
  EXPECT_EQ(health, 0) << "nobody is there";
  report_to_desk(socket(), {});
  report_to_desk(socket(), {});
  EXPECT_EQ(health, 1);
  now += 10min;
  report_to_desk(socket(), {});
  EXPECT_EQ(health, 2);
}

TEST_F(DeskTest, ThatDoesNotAnswerIsNotWaitedForWithoutEnd) {
  EXPECT_THROW(report_to_desk(dir / "none", {}), SocketError);
}

}  // namespace
}  // namespace cellcal::daemon::testing
