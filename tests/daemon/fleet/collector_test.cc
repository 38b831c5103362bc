#include "daemon/fleet/collector.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>

#include "tests/daemon/fleet/facts.h"
#include "tests/daemon/fleet/running.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::fleet {
namespace {

using testing::ask;
using testing::config_of;
using testing::Database;
using testing::kPaint;
using testing::kWeld;
using testing::MqttBroker;
using testing::Publication;
using testing::publish;
using testing::Running;
using testing::within_reach;

std::vector<Publication> alarms(const plant::CellName& cell, int from, int to) {
  std::vector<Publication> all;
  for (int number = from; number <= to; ++number)
    all.push_back(testing::publication(testing::alarm(cell, number)));
  return all;
}

TEST(FleetCollector, EveryKindArrivesOnceThoughSentTwiceAndOutOfOrder) {
  const MqttBroker broker;
  const std::string database = Database::shared().emptied();
  const Running collector(config_of(broker, database));
  std::vector<Publication> all;
  all.reserve(22);
  std::int64_t number = 0;
  for (const plant::FactBody& body : testing::one_of_each())
    all.push_back(testing::publication(testing::fact(kWeld, ++number, body)));
  all.insert(all.end(), all.begin(), all.begin() + number);
  std::shuffle(all.begin(), all.end(), std::minstd_rand(7));
  publish(broker.port(), all);
  ASSERT_TRUE(within_reach([&] { return collector.counters().messages == 22u; }));
  EXPECT_EQ(testing::count_of_each(database), "1|1|1|1|1|1|1|1|1|1|1");
  EXPECT_EQ(collector.counters().twice, 11u);
  EXPECT_EQ(ask(database, "SELECT numbers FROM fleet.journals"), "{[1,12)}");
}

TEST(FleetCollector, IsGreetedOverTlsAndAcknowledgesThere) {
  const daemon::testing::TemporaryDirectory folder;
  const std::string stem = (folder / "broker").string();
  ASSERT_EQ(
      std::system(
          ("openssl req -x509 -newkey ec -pkeyopt ec_paramgen_curve:prime256v1 -nodes -days 2 -subj /CN=broker "
           "-addext subjectAltName=IP:127.0.0.1 -keyout " +
           stem + ".key -out " + stem + ".pem 2>/dev/null")
              .c_str()),
      0);
  // The broker runs as another user.
  std::filesystem::permissions(folder.path(), std::filesystem::perms(0755));
  std::filesystem::permissions(stem + ".key", std::filesystem::perms(0644));
  const MqttBroker broker("certfile " + stem + ".pem\nkeyfile " + stem + ".key\n");
  const std::string database = Database::shared().emptied();
  CollectorConfig config = config_of(broker, database);
  config.broker.tls = true;
  config.broker.ca = stem + ".pem";
  const Running collector(config);
  ASSERT_TRUE(collector.counters().broker_up);
  const Publication one = testing::publication(testing::alarm(kWeld, 1));
  std::ofstream(folder / "message") << one.payload;
  ASSERT_EQ(std::system(("mosquitto_pub -h 127.0.0.1 -V 5 -q 1 --cafile " + stem + ".pem -p " +
                         std::to_string(broker.port()) + " -t " + one.topic + " -f " +
                         (folder / "message").string())
                            .c_str()),
            0);
  EXPECT_TRUE(within_reach([&] { return collector.counters().facts == 1u; }));
}

TEST(FleetCollector, TwoSideBySideShareTheWorkAndStoreEachOnce) {
  const MqttBroker broker;
  const std::string database = Database::shared().emptied();
  CollectorConfig first = config_of(broker, database, "one"),
                  second = config_of(broker, database, "two");
  first.broker.group = second.broker.group = "both";
  const Running one(first), two(second);
  std::vector<Publication> all = alarms(kWeld, 1, 150);
  for (const Publication& again : alarms(kPaint, 1, 150)) all.push_back(again);
  for (const Publication& again : alarms(kWeld, 1, 150)) all.push_back(again);
  publish(broker.port(), all);
  ASSERT_TRUE(
      within_reach([&] { return one.counters().messages + two.counters().messages == 450u; }));
  EXPECT_GT(one.counters().messages, 0u);
  EXPECT_GT(two.counters().messages, 0u);
  EXPECT_EQ(
      ask(database, "SELECT count(*), count(DISTINCT (journal_id, number)) FROM fleet.alarms"),
      "300|300");
}

TEST(FleetCollector, TwoThatBothHaveAllStoreEachOnce) {
  const MqttBroker broker;
  const std::string database = Database::shared().emptied();
  const Running one(config_of(broker, database, "one")), two(config_of(broker, database, "two"));
  publish(broker.port(), alarms(kWeld, 1, 200));
  ASSERT_TRUE(within_reach(
      [&] { return one.counters().messages == 200u && two.counters().messages == 200u; }));
  EXPECT_EQ(one.counters().facts + two.counters().facts, 200u);
  EXPECT_EQ(ask(database, "SELECT count(*), count(DISTINCT number) FROM fleet.alarms"), "200|200");
}

TEST(FleetCollector, BadMessagesAreQuarantinedWithTheReasonAndTheNextGoodOneIsStored) {
  const MqttBroker broker;
  const std::string database = Database::shared().emptied();
  const Running collector(config_of(broker, database));
  Publication others = testing::publication(testing::alarm(kPaint, 1));
  others.topic = "cellcal/graz/weld-3/fact/alarm";  // one cell impersonates another
  Publication cut = testing::publication(testing::alarm(kWeld, 1));
  cut.payload.resize(cut.payload.size() / 2);
  Publication changed = testing::publication(testing::fact(kWeld, 1, testing::one_of_each()[1]));
  changed.payload.replace(changed.payload.find("KUKA"), 4, "XXXX");
  plant::Fact timeless = testing::alarm(kWeld, 1);
  timeless.time = "2026-02-30T00:00:00Z";
  publish(broker.port(), {others,
                          cut,
                          changed,
                          testing::publication(timeless),
                          {"cellcal/graz/weld-3/fact/newer", "{}"},
                          {"cellcal/graz/a b/fact/alarm", "{}"},
                          {"cellcal/graz/weld-3/presence", ""},
                          {"cellcal/graz/weld-3/fact/alarm", std::string(9u << 20, '[')},
                          testing::publication(testing::alarm(kWeld, 1))});
  ASSERT_TRUE(within_reach([&] { return collector.counters().messages == 9u; }));
  EXPECT_EQ(ask(database, "SELECT count(*) FROM fleet.alarms"), "1");
  EXPECT_EQ(ask(database, "SELECT plant, cell, why, count FROM fleet.refusals ORDER BY 1, 2, 3"),
            "||topic|1\ngraz|weld-3|size|1\ngraz|weld-3|message|6");
  EXPECT_EQ(
      ask(database,
          "SELECT count(*) FROM fleet.quarantine WHERE words LIKE '%cell: differs from the topic%'"),
      "1");
  EXPECT_EQ(
      ask(database,
          "SELECT count(*) FROM fleet.quarantine WHERE words LIKE '%sha256: does not match the text%'"),
      "1");
  EXPECT_EQ(ask(database, "SELECT why, count(*) FROM fleet.quarantine GROUP BY 1 ORDER BY 1"),
            "topic|1\nsize|1\nmessage|6");
}

TEST(FleetCollector, AFloodingCellIsRefusedAndTheOthersAreStored) {
  const MqttBroker broker;
  const std::string database = Database::shared().emptied();
  CollectorConfig config = config_of(broker, database);
  config.allowance.burst = 50.0;
  config.allowance.messages_per_s = 1e-6;
  const Running collector(config);
  std::vector<Publication> all = alarms(kWeld, 1, 300);
  all.push_back(testing::publication(testing::alarm(kPaint, 1)));
  publish(broker.port(), all);
  ASSERT_TRUE(within_reach([&] { return collector.counters().messages == 301u; }));
  EXPECT_EQ(
      ask(database,
          "SELECT cell, count(*) FROM fleet.alarms JOIN fleet.journals j ON j.id = journal_id "
          "JOIN fleet.cells c ON c.id = cell_id GROUP BY 1 ORDER BY 1"),
      "paint-1|1\nweld-3|50");
  EXPECT_EQ(ask(database, "SELECT why, count FROM fleet.refusals"), "rate|250");
  EXPECT_EQ(ask(database, "SELECT count(*) FROM fleet.quarantine"), "0");
}

TEST(FleetCollector, PresenceThatTheBrokerRetainedIsThereAfterAStart) {
  const MqttBroker broker;
  const plant::Presence birth{kWeld, true, false, "j1", 5, "1.9.0", "2026-11-22T20:00:00Z", true};
  publish(broker.port(),
          {{plant::to_text({kWeld, plant::Subject::kPresence, ""}), plant::to_json(birth), true}});
  const std::string database = Database::shared().emptied();
  const Running collector(config_of(broker, database));
  ASSERT_TRUE(within_reach([&] { return collector.counters().messages == 1u; }));
  EXPECT_EQ(ask(database, "SELECT cell, online, mock FROM fleet.cell_states"), "weld-3|t|t");
}

}  // namespace
}  // namespace cellcal::daemon::fleet
