// From the journal to the tables: a cell's publisher, Debian's broker, the collector, Debian's database.

#include <gtest/gtest.h>

#include "daemon/journal/journal.h"
#include "tests/daemon/fleet/facts.h"
#include "tests/daemon/fleet/running.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/plant/line/cell_line.h"

namespace cellcal::daemon::fleet {
namespace {

using testing::ask;
using testing::Database;
using testing::MqttBroker;
using testing::Running;
using testing::within_reach;

void report(Journal& journal, int count) {
  const plant::FactBody body = plant::AlarmFact{"done", "weld-3: done", "0.4 mm"};
  for (int i = 0; i < count; ++i)
    journal.report(0, {plant::kind_of(body), Worth::kResult, plant::body_to_json(body)});
}

daemon::testing::CellLine::Parts publisher_of(Journal& journal, const MqttBroker& broker) {
  PlantConfig config;
  config.plant = "graz";
  config.cell = "weld-3";
  config.host = "127.0.0.1";
  config.port = broker.port();
  config.tls = false;
  daemon::testing::CellLine::Parts parts{journal, config};
  parts.first_wait = parts.longest_wait = parts.refused_wait = std::chrono::milliseconds(50);
  parts.stored_wait = std::chrono::milliseconds(300);
  return parts;
}

TEST(FromAJournal, AllIsInTheTablesAndTheCellIsToldSoAndSaysFarewell) {
  const MqttBroker broker;
  const std::string database = Database::shared().emptied();
  const Running collector(testing::config_of(broker, database));
  const daemon::testing::TemporaryDirectory folder;
  Journal journal(folder / "j.db");
  {
    const daemon::testing::CellLine cell(publisher_of(journal, broker));
    report(journal, 50);
    EXPECT_TRUE(within_reach([&] {
      return ask(database, "SELECT count(*), count(DISTINCT number) FROM fleet.alarms") == "50|50";
    }));
    EXPECT_EQ(ask(database, "SELECT online FROM fleet.cell_states"), "t");
    EXPECT_TRUE(within_reach([&] { return journal.outbox().rows == 0; }))
        << "all is known to be stored";
  }
  EXPECT_TRUE(
      within_reach([&] { return ask(database, "SELECT farewell FROM fleet.cell_states") == "t"; }));
  EXPECT_EQ(ask(database, "SELECT max(at) > now() - interval '1 hour' FROM fleet.alarms"), "t");
}

}  // namespace
}  // namespace cellcal::daemon::fleet
