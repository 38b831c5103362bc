// A dry run from the command line.

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <regex>
#include <thread>

#include "daemon/journal/journal.h"
#include "daemon_fixture.h"

namespace cellcal::daemon::testing {
namespace {

TEST(ADryRun, GoesTheWayThatTheCalibrationOfTheSameOptionsGoesAndIsNone) {
  DaemonFixture fixture(kFast);
  fixture.start();
  const std::vector<std::string> options{"--cell", CELLCAL_DEMO_CELL, "--touches",
                                         "12",     "--check",         "2"};
  const auto with_options = [&](std::string command) {
    std::vector<std::string> all{std::move(command)};
    all.insert(all.end(), options.begin(), options.end());
    return fixture.cellcal(all);
  };
  const Outcome dry = with_options("dry-run");
  ASSERT_EQ(dry.status, 0) << dry.err << fixture.log();
  EXPECT_EQ(dry.out.find("14 stand-offs reached, the tip met nothing"), 0u) << dry.out;
  const Outcome touched = with_options("run");
  EXPECT_TRUE(touched.status == 0 || touched.status == 3) << touched.err;

  EXPECT_EQ(fixture.get("/v1/sessions/1")["kind"], "dry-run");
  EXPECT_EQ(fixture.get("/v1/sessions/1")["outcome"]["kind"], "nothing_met");
  EXPECT_EQ(fixture.get("/v1/sessions/1")["outcome"]["touches"], 14);
  EXPECT_EQ(fixture.get("/v1/sessions/1")["state"], "done");
  EXPECT_EQ(fixture.get("/v1/sessions/1")["touches"], 0);
  EXPECT_EQ(http_request(fixture.socket(), "GET", "/v1/sessions/1/calibration.json").status, 404);
  const std::string history = fixture.cellcal({"history"}).out;
  EXPECT_NE(history.find("dry run: "), std::string::npos);
  EXPECT_EQ(history.find("0/14"), std::string::npos) << "no touch is made, none is missing\n"
                                                     << history;

  fixture.daemon.reset();
  Journal journal(fixture.dir / "state" / "journal.db");
  const auto first = journal.session(1), second = journal.session(2);
  ASSERT_TRUE(first && second);
  EXPECT_FALSE(first->plan_hash.empty());
  EXPECT_EQ(first->plan_hash, second->plan_hash);
  EXPECT_TRUE(journal.readings(1).empty());
}

TEST(ADryRun, IsRefusedWhereItCannotBeOne) {
  DaemonFixture fixture(kFast);
  fixture.start();
  const auto refused = [&](nlohmann::json body, int status, const std::string& words) {
    body["kind"] = "dry-run";
    if (!body.contains("cell")) body["cell"] = CELLCAL_DEMO_CELL;
    fixture.refuse(body, status, words);
  };
  refused({{"goal_mm", 0.2}}, 422, "planned path");
  refused({{"find", true}}, 422, "planned path");
  refused({{"target", "S1"}}, 422, "applies to a qualification");
  refused({{"calibration", 1}}, 422, "applies to a check");

  const std::filesystem::path demo(CELLCAL_DEMO_CELL);
  std::filesystem::copy_file(demo.parent_path() / "kr5_worn.toml", fixture.dir / "kr5_worn.toml");
  const std::string cell = fixture.dir / "cell.toml";
  std::ofstream(cell) << std::regex_replace(
      content(demo), std::regex("centre_mm = \\[1080[^\n]*\ncentre_sigma_mm[^\n]*"),
      "search_low_mm = [1060, -340, 310]\nsearch_high_mm = [1100, -300, 350]");
  refused({{"cell", cell}}, 422, "Find them with 'cellcal find', and state centre_mm");
}

TEST(ADryRun, IsNeverWhatAnAbortedCalibrationIsGoneOnWith) {
  DaemonFixture fixture(kFast);
  fixture.start();
  const nlohmann::json whole{{"cell", CELLCAL_DEMO_CELL}, {"touches", 40}};
  ASSERT_EQ(fixture.begin(whole).status, 201);
  fixture.wait_for_touches(2);
  if (http_request(fixture.socket(), "POST", "/v1/abort").status != 202)
    GTEST_SKIP() << "this machine was too slow to abort it before its end";
  while (fixture.status()["running"]) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  for (const char* kind : {"dry-run", "find", "check", "qualify"}) {
    SCOPED_TRACE(kind);
    fixture.refuse({{"kind", kind}, {"resume", true}}, 422, "leave kind out");
  }
  EXPECT_FALSE(fixture.status()["running"]);
}

TEST(ADryRun, ThatWasAbortedIsNotResumedAndNamesTheCommandOfANewOne) {
  DaemonFixture fixture(kFast);
  fixture.start();
  const nlohmann::json whole{
      {"kind", "dry-run"}, {"cell", CELLCAL_DEMO_CELL}, {"touches", 60}, {"seed", 5}};
  ASSERT_EQ(fixture.begin(whole).status, 201);
  if (http_request(fixture.socket(), "POST", "/v1/abort").status != 202)
    GTEST_SKIP() << "this machine was too slow to abort it before its end";
  while (fixture.status()["running"]) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ASSERT_EQ(fixture.status()["phase"], "aborted");
  const std::string anew = std::string("cellcal dry-run --cell ") + CELLCAL_DEMO_CELL +
                           " --touches 60 --check 10 --seed 5";
  EXPECT_EQ(fixture.status()["anew"], anew);
  const Outcome resumed = fixture.cellcal({"run", "--resume"});
  EXPECT_EQ(resumed.status, 1);
  EXPECT_NE(resumed.err.find("not resumed. Start a new one: '" + anew), std::string::npos)
      << resumed.err;
}

}  // namespace
}  // namespace cellcal::daemon::testing
