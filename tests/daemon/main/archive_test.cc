// Files of a session, exported from one daemon, imported into another, and recomputed.

#include <gtest/gtest.h>

#include "daemon_fixture.h"

namespace cellcal::daemon::testing {
namespace {

using nlohmann::json;

TEST(ASessionThatWasRecorded, IsExportedReplayedToTheBitImportedAndBackedUp) {
  DaemonFixture first, second;
  first.start();
  second.start();
  const Outcome run =
      first.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "40", "--check", "2"});
  ASSERT_EQ(run.status, 0) << run.err << run.out;
  const std::string directory = first.dir / "e";

  EXPECT_EQ(first.cellcal({"export", "1", directory}).status, 0);
  const Outcome here = first.cellcal({"replay", "1"});
  EXPECT_EQ(here.status, 0) << here.err;
  EXPECT_NE(here.out.find("42 touches"), std::string::npos) << here.out;
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

  for (const char* name : {"k", "other"})
    ASSERT_EQ(run_program({CELLCAL, "certificate", "--make-key", "--key", first.dir / name}).status,
              0);
  const std::string is_signed = first.dir / "signed";
  EXPECT_NE(import.out.find("not signed"), std::string::npos) << import.out;
  EXPECT_NE(
      first.cellcal({"export", "1", is_signed, "--key", first.dir / "k"}).out.find(", signed\n"),
      std::string::npos);
  EXPECT_EQ(run_program({CELLCAL, "verify", is_signed, "--key", first.dir / "k.pub"}).status, 0);
  const json whose = json::parse(
      second.cellcal({"import", is_signed, "--key", first.dir / "k.pub", "--json"}).out);
  EXPECT_EQ(whose["signature"]["verified"], true) << whose;
  EXPECT_FALSE(whose["signature"]["signed_by"].get<std::string>().empty()) << whose;
  const Outcome not_known = second.cellcal({"import", is_signed, "--key", first.dir / "other.pub"});
  EXPECT_EQ(not_known.status, 0) << not_known.err;
  EXPECT_NE(not_known.out.find("signed, not verified: "), std::string::npos) << not_known.out;
  std::ofstream(is_signed + "/report.html", std::ios::app) << " ";
  const Outcome changed = second.cellcal({"import", is_signed, "--key", first.dir / "k.pub"});
  EXPECT_EQ(changed.status, 1);
  EXPECT_NE(changed.err.find("report.html: was changed after it was signed"), std::string::npos)
      << changed.err;
  const auto certify = [&](const DaemonFixture& at, const std::string& out) {
    return at.cellcal(
        {"certificate", "1", "--no-pdf", "--key", first.dir / "k", "--out", first.dir / out});
  };
  const Outcome own = certify(first, "c1");
  EXPECT_EQ(own.status, 0) << own.err;
  const Outcome imported = certify(second, "c2");
  EXPECT_EQ(imported.status, 3) << imported.out;
  EXPECT_NE(imported.err.find("imported from another journal"), std::string::npos) << imported.err;
  EXPECT_NE(second.cellcal({"check", "--calibration", "1"}).err.find("recorded by another journal"),
            std::string::npos);

  std::string csv = content(directory + "/touches.csv");
  csv[csv.size() / 2] ^= 1;
  std::ofstream(directory + "/touches.csv") << csv;
  for (const char* command : {"import", "replay"}) {
    const Outcome refused = second.cellcal({command, directory});
    EXPECT_EQ(refused.status, 1);
    EXPECT_NE(refused.err.find("touches.csv: differs from the exported file"), std::string::npos)
        << refused.err;
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
