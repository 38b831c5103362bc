// What a session leaves, out of one daemon and into another, and computed again.

#include <gtest/gtest.h>

#include "daemon_fixture.h"

namespace cellcal::daemon::testing {
namespace {

using nlohmann::json;

TEST(a_session_that_was_recorded, is_exported_replayed_to_the_bit_imported_and_backed_up) {
  DaemonFixture first, second;
  first.start();
  second.start();
  const Outcome run =
      first.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "8", "--check", "2"});
  ASSERT_TRUE(run.status == 0 || run.status == 3) << run.err;
  const std::string directory = first.dir / "e";

  EXPECT_EQ(first.cellcal({"export", "1", directory}).status, 0);
  const Outcome here = first.cellcal({"replay", "1"});
  EXPECT_EQ(here.status, 0) << here.err;
  EXPECT_NE(here.out.find("10 touches"), std::string::npos) << here.out;
  EXPECT_NE(here.out.find("same to the bit"), std::string::npos) << here.out;
  const Outcome offline = run_program({CELLCAL, "replay", directory, "--json"});
  EXPECT_TRUE(json::parse(offline.out)["same"]) << offline.out;

  const Outcome import = second.cellcal({"import", directory});
  EXPECT_EQ(import.status, 0) << import.err;
  EXPECT_EQ(second.cellcal({"replay", "1"}).status, 0);
  const json listed = json::parse(second.cellcal({"history", "--json"}).out);
  EXPECT_EQ(listed[0]["imported"]["session"], 1);
  EXPECT_NE(second.cellcal({"import", directory}).out.find("in the journal already"),
            std::string::npos);
  EXPECT_EQ(second.cellcal({"run", "--resume"}).status, 1) << "what was imported is not resumed";

  const std::string copy = first.dir / "copy.db";
  const Outcome backup = first.cellcal({"backup", copy, "--json"});
  EXPECT_EQ(json::parse(backup.out)["bytes"], std::filesystem::file_size(copy)) << backup.err;
  EXPECT_EQ(first.cellcal({"backup", copy}).status, 1);

  std::string csv = content(directory + "/touches.csv");
  csv[csv.size() / 2] ^= 1;
  std::ofstream(directory + "/touches.csv") << csv;
  for (const char* command : {"import", "replay"}) {
    const Outcome refused = second.cellcal({command, directory});
    EXPECT_EQ(refused.status, 1);
    EXPECT_NE(refused.err.find("touches.csv: is not as it was exported"), std::string::npos)
        << refused.err;
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
