#include <gtest/gtest.h>

#include <fstream>

#include "daemon/fleet/collector.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/fleet/facts.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::fleet {
namespace {

using testing::ask;
using testing::Database;
using testing::kWeld;
using testing::Publication;

Refused not_understood(const Publication& message) {
  return {kWeld, message.topic, message.payload, Refusal::kMessage, "unknown kind"};
}

std::string left(const std::string& database) {
  return ask(database, "SELECT count(*) FROM fleet.quarantine");
}

class FleetReread : public ::testing::Test {
 protected:
  FleetReread() {
    Batch batch;
    const plant::Presence birth{kWeld, true, false, "j1", 2, "9.0", "2026-11-22T20:00:00Z", false};
    batch.refused = {
        not_understood(testing::publication(testing::alarm(kWeld, 1))),
        not_understood(testing::publication(testing::fact(kWeld, 2, testing::one_of_each()[7]))),
        not_understood(
            {plant::to_text({kWeld, plant::Subject::kPresence, ""}), plant::to_json(birth)}),
        not_understood({"cellcal/graz/weld-3/fact/newer-still", "{}"}),
        not_understood(testing::publication(testing::alarm(kWeld, 3)))};
    store.write(batch);
    // As stored by an earlier version of the program.
    ask(database,
        "UPDATE fleet.quarantine SET payload = substr(payload, 1, 20), sum = NULL WHERE "
        "convert_from(payload, 'UTF8') LIKE '%\"number\":3,%'");
  }

  std::string database = Database::shared().emptied();
  Store store{{database}};
};

TEST_F(FleetReread, StoresWhatIsUnderstoodNowAndKeepsTheRest) {
  const Reread first = reread_quarantine(store);
  EXPECT_EQ(first.stored, 3u);
  EXPECT_EQ(first.refused, 1u);
  EXPECT_EQ(first.cut.size(), 1u);
  EXPECT_EQ(ask(database, "SELECT number FROM fleet.alarms"), "1");
  EXPECT_EQ(ask(database, "SELECT number FROM fleet.phases"), "2");
  EXPECT_EQ(ask(database, "SELECT online FROM fleet.cell_states"), "t");
  EXPECT_EQ(left(database), "2");
  const Reread second = reread_quarantine(store);
  EXPECT_EQ(second.stored + second.twice, 0u);
  EXPECT_EQ(left(database), "2");
}

TEST_F(FleetReread, WhatItsCellHasSentAgainMeanwhileIsStoredOnce) {
  Batch batch;
  batch.facts = {testing::alarm(kWeld, 1)};
  store.write(batch);
  EXPECT_EQ(reread_quarantine(store).twice, 1u);
  EXPECT_EQ(ask(database, "SELECT count(*) FROM fleet.alarms"), "1");
  EXPECT_EQ(left(database), "2");
}

TEST_F(FleetReread, TheProgramSaysHowManyAndWhatCannotBeRead) {
  const daemon::testing::TemporaryDirectory folder;
  std::ofstream(folder / "fleet.toml")
      << "format = \"cellcal.fleet/1\"\n[database]\nconnection = \"" << database << "\"\n";
  const auto outcome = daemon::testing::run_program(
      {CELLCAL_FLEET, "--config", (folder / "fleet.toml").string(), "--reread-quarantine"});
  EXPECT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("3 stored, 0 were there already, 1 refused again\n"),
            std::string::npos)
      << outcome.out;
  EXPECT_NE(outcome.out.find("cellcal/graz/weld-3/fact/alarm, "), std::string::npos) << outcome.out;
}

}  // namespace
}  // namespace cellcal::daemon::fleet
