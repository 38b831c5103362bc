#include <gtest/gtest.h>
#include <spdlog/spdlog.h>

#include <csignal>
#include <fstream>
#include <pqxx/pqxx>

#include "tests/daemon/cli/process.h"
#include "tests/daemon/fleet/facts.h"
#include "tests/daemon/fleet/faults/faulty_plant.h"
#include "tests/daemon/fleet/running.h"
#include "tests/daemon/plant/line/hostile_broker.h"
#include "tests/daemon/plant/line/strict_listener.h"

namespace cellcal::daemon::fleet {
namespace {

using daemon::testing::Background;
using testing::ask;
using testing::config_of;
using testing::Database;
using testing::kWeld;
using testing::MqttBroker;
using testing::Publication;
using testing::publish;
using testing::Running;
using testing::within_reach;

std::vector<Publication> alarms(int from, int to) {
  std::vector<Publication> all;
  for (int number = from; number <= to; ++number)
    all.push_back(testing::publication(testing::alarm(kWeld, number)));
  return all;
}

std::string stored(const std::string& database) {
  return ask(database, "SELECT count(*), count(DISTINCT number) FROM fleet.alarms");
}

bool arrive(const std::string& database, int count) {
  const std::string all = std::to_string(count) + "|" + std::to_string(count);
  return within_reach([&] { return stored(database) == all; });
}

/// The program, with its own folder.
class Program {
 public:
  Program(std::uint16_t broker, const std::string& database)
      : folder_(::testing::TempDir() + "fleet-" + std::to_string(::getpid())) {
    std::filesystem::create_directories(folder_);
    std::ofstream(folder_ + "/fleet.toml")
        << "format = \"cellcal.fleet/1\"\n[broker]\nhost = \"127.0.0.1\"\nport = " << broker
        << "\nclient = \"killed\"\n[database]\nconnection = \"" << database
        << "\"\n[http]\nsocket = \"" << folder_ << "/socket\"\n";
    start();
  }
  ~Program() {
    process_.reset();
    std::filesystem::remove_all(folder_);
  }
  void start() {
    process_ = std::make_unique<Background>(
        std::vector<std::string>{CELLCAL_FLEET, "--config", folder_ + "/fleet.toml"},
        folder_ + "/log");
  }
  int end(int signal) {
    process_->signal(signal);
    return process_->wait();
  }
  /// True once it has connected this many times.
  bool is_ready(int times = 1) const {
    return within_reach([&] {
      const std::string log = words();
      std::size_t at = 0;
      int met = 0;
      while ((at = log.find("broker: connected", at)) != std::string::npos) ++at, ++met;
      return met >= times;
    });
  }
  std::string words() const {
    std::ifstream in(folder_ + "/log");
    return {std::istreambuf_iterator<char>(in), {}};
  }
  pid_t working() const { return process_->working(); }

 private:
  std::string folder_;
  std::unique_ptr<Background> process_;
};

TEST(FleetFaults, KilledBetweenReceiptAndCommitTheNextOneStoresAllOnce) {
  const MqttBroker broker;
  const std::string database = Database::shared().emptied();
  Program program(broker.port(), database);
  ASSERT_TRUE(program.is_ready());
  publish(broker.port(), alarms(1, 5));
  ASSERT_TRUE(arrive(database, 5));
  {
    pqxx::connection connection(database);
    pqxx::work holder(connection);
    holder.exec("LOCK TABLE fleet.alarms IN ACCESS EXCLUSIVE MODE");
    publish(broker.port(), alarms(6, 40));
    // It has received some, and waits for the table.
    ASSERT_TRUE(within_reach([&] {
      return ask(database,
                 "SELECT count(*) > 0 FROM pg_stat_activity WHERE wait_event_type = 'Lock' AND "
                 "datname = current_database()") == "t";
    }));
    EXPECT_EQ(program.end(SIGKILL), 128 + SIGKILL);
  }
  EXPECT_EQ(stored(database), "5|5");
  program.start();
  EXPECT_TRUE(arrive(database, 40));
  EXPECT_EQ(program.end(SIGTERM), 0);
}

TEST(FleetFaults, APacketThatEndsTheCollectorCostsNoFactAndItBeginsAgainByItself) {
  const MqttBroker broker;
  daemon::testing::StrictListener strict(broker.port(), std::size_t{1} << 30);
  const std::string database = Database::shared().emptied();
  Program program(strict.port(), database);
  ASSERT_TRUE(program.is_ready());
  publish(broker.port(), alarms(1, 5));
  ASSERT_TRUE(arrive(database, 5));
  int lines = 1;
  for (const std::string& packet : daemon::testing::deadly_packets()) {
    const pid_t before = program.working();
    strict.say(packet);
    ASSERT_TRUE(within_reach([&] { return program.working() != before; })) << program.words();
    publish(broker.port(), alarms(6, 40 * lines));  // while it is down
    ASSERT_TRUE(program.is_ready(++lines)) << program.words();
    EXPECT_TRUE(arrive(database, 40 * (lines - 1))) << stored(database);
  }
  EXPECT_EQ(program.end(SIGTERM), 0);
}

TEST(FleetFaults, TheLargestFactsFitIntoTheCollectorAndAPacketOf256MegabytesDoesNot) {
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
  GTEST_SKIP() << "a sanitizer's own books are larger";
#endif
  const MqttBroker broker;
  daemon::testing::StrictListener strict(broker.port(), std::size_t{1} << 30);
  const std::string database = Database::shared().emptied();
  Program program(strict.port(), database);
  ASSERT_TRUE(program.is_ready());
  std::vector<Publication> certificates;
  for (int number = 1; number <= 8; ++number)
    certificates.push_back(testing::publication(testing::fact(
        kWeld, number,
        plant::CertificateFact{"7-abc", {{"certificate.pdf", std::string(5'500'000, 'x')}}})));
  publish(broker.port(), certificates);
  EXPECT_TRUE(within_reach([&] {
    return ask(database, "SELECT count(*) FROM fleet.certificates") == "8";
  })) << program.words();
  const pid_t process = program.working();
  strict.say(std::string("\x30\xff\xff\xff\x7f", 5) + std::string(std::size_t{1} << 20, 'x'));
  ASSERT_TRUE(program.is_ready(2)) << program.words();
  EXPECT_EQ(program.working(), process) << "it is the connection alone that is lost";
  std::ifstream status("/proc/" + std::to_string(process) + "/status");
  long peak_kb = 0;
  for (std::string word; status >> word;)
    if (word == "VmHWM:") status >> peak_kb;
  EXPECT_GT(peak_kb, 0);
  EXPECT_LT(peak_kb, 200 * 1024);
  RecordProperty("peak_kb", static_cast<int>(peak_kb));
  publish(broker.port(), alarms(9, 9));
  EXPECT_TRUE(arrive(database, 1));
}

// Broker, database and collector killed, duplicate and reordered facts, clock steps, a cell that was offline. tests/experiments/run fleet_faults runs
// longer, with networks that are cut.
TEST(FleetFaults, WhateverHappensEveryResultIsThereOnceAndInOrder) {
  spdlog::set_level(spdlog::level::err);
  testing::FaultOptions options;
  options.collector = CELLCAL_FLEET;
  options.cells = 3;
  options.collectors = 1;
  options.offline_days = 0.1;
  options.rounds = 1;
  options.pause_s = 0.1;
  options.outage_s = 0.1;
  const testing::FaultReport report = testing::run_faults(options, Database::shared(), nullptr);
  spdlog::set_level(spdlog::level::info);
  const testing::Tally& tally = report.tally;
  EXPECT_GT(tally.results, 20u);
  EXPECT_EQ(tally.stored_results, tally.results);
  EXPECT_EQ(tally.missing_results, 0u);
  EXPECT_EQ(tally.twice, 0u);
  EXPECT_EQ(tally.out_of_order, 0u);
  EXPECT_EQ(tally.strangers, 0u);
  EXPECT_EQ(tally.altered, 0u);
  EXPECT_EQ(tally.refused, 0u);
  EXPECT_EQ(tally.states_wrong, 0u);
}

TEST(FleetFaults, WhatIsPublishedWhileTheCollectorIsDownWaitsInTheBrokerAcrossItsRestart) {
  MqttBroker broker;
  const std::string database = Database::shared().emptied();
  { const Running collector(config_of(broker, database)); }
  publish(broker.port(), alarms(1, 1500));
  broker.stop();
  broker.start();
  const Running collector(config_of(broker, database));
  EXPECT_TRUE(arrive(database, 1500));
}

TEST(FleetFaults, TheSampleIsAConfigurationAndWrongOnesEndWithStatusTwo) {
  using daemon::testing::run_program;
  EXPECT_EQ(run_program({CELLCAL_FLEET, "--config", CELLCAL_FLEET_SAMPLE, "--check"}).status, 0);
  const auto none = run_program({CELLCAL_FLEET, "--config", "/nowhere/fleet.toml"});
  EXPECT_EQ(none.status, 2);
  EXPECT_NE(none.err.find("/nowhere/fleet.toml"), std::string::npos);
}

}  // namespace
}  // namespace cellcal::daemon::fleet
