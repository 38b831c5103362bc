// A qualification from the command line.

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "daemon_fixture.h"

namespace cellcal::daemon::testing {
namespace {

const std::string kFastAndNoisy = std::string(kFast) + "[mock]\ncontact_noise_mm = 0.02\n";

TEST(AQualification, MeasuresTheContactsAndIsNoCalibration) {
  DaemonFixture fixture(kFastAndNoisy);
  fixture.start();
  const Outcome outcome =
      fixture.cellcal({"qualify", "--cell", CELLCAL_DEMO_CELL, "--target", "S2", "--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.err << fixture.log();
  const auto result = nlohmann::json::parse(outcome.out);
  EXPECT_EQ(result["format"], "cellcal.qualification/1");
  EXPECT_EQ(result["target"], "S2");
  EXPECT_EQ(result["touches"], 18);
  EXPECT_EQ(result["places"], 6);
  EXPECT_TRUE(result["passed"]);
  // The cell's contacts scatter by 0.02 mm, the angles by 0.0005 deg.
  const double noise = result["touch_noise_mm"]["value"], sigma = result["touch_noise_mm"]["sigma"];
  EXPECT_NEAR(noise, 0.02, 4.0 * sigma);
  EXPECT_GT(noise, 0.008);
  EXPECT_EQ(result["overtravel"].size(), 3u);
  EXPECT_GT(result["overtravel"][0]["median_mm"], result["overtravel"][1]["median_mm"]);

  const std::string session = "/v1/sessions/1";
  EXPECT_EQ(http_request(fixture.socket(), "GET", session + "/calibration.json").status, 404);
  EXPECT_EQ(http_request(fixture.socket(), "GET", session + "/qualification.json").status, 200);
  const auto shown = fixture.get(session);
  EXPECT_EQ(shown["kind"], "qualify");
  EXPECT_EQ(shown["state"], "done");
  EXPECT_EQ(fixture.status()["kind"], "qualify");
  EXPECT_EQ(shown["outcome"]["kind"], "qualified");
  EXPECT_TRUE(fixture.status()["publish"].is_null()) << "no calibration is withheld";
  const Outcome words = fixture.cellcal({"history"});
  EXPECT_NE(words.out.find("qualification: "), std::string::npos) << words.out;
}

TEST(AQualification, ThatWasAbortedIsGoneOnWithAsOne) {
  DaemonFixture fixture(kFastAndNoisy);
  fixture.start();
  const nlohmann::json body{{"kind", "qualify"}, {"cell", CELLCAL_DEMO_CELL}};
  ASSERT_EQ(fixture.begin(body).status, 201);
  fixture.wait_for_touches(3);
  if (http_request(fixture.socket(), "POST", "/v1/abort").status != 202)
    GTEST_SKIP() << "this machine was too slow to abort it before its end";
  while (fixture.status()["running"]) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  ASSERT_EQ(fixture.status()["phase"], "aborted") << fixture.log();
  const Outcome resumed = fixture.cellcal({"run", "--resume"});
  EXPECT_EQ(resumed.status, 0) << resumed.err;
  EXPECT_NE(resumed.out.find("18 touches on S1 at 6 places"), std::string::npos) << resumed.out;
  EXPECT_NE(resumed.out.find("result: qualified"), std::string::npos) << resumed.out;
}

TEST(AQualification, IsRefusedWhereItCannotBeOne) {
  DaemonFixture fixture;
  fixture.start();
  const auto refused = [&](nlohmann::json body, int status, const std::string& words) {
    if (!body.contains("cell")) body["cell"] = CELLCAL_DEMO_CELL;
    fixture.refuse(body, status, words);
  };
  refused({{"kind", "qualify"}, {"target", "S9"}}, 422, "There are: S1, S2, S3, S4");
  refused({{"kind", "qualify"}, {"goal_mm", 0.2}}, 422, "a qualification has its own touches");
  refused({{"target", "S1"}}, 422, "a calibration touches all targets");
  refused({{"kind", "polish"}}, 400,
          "\\\"calibrate\\\", \\\"qualify\\\", \\\"find\\\", \\\"dry-run\\\" or \\\"check\\\"");
  refused({{"kind", "qualify"}, {"target", "S\n1"}}, 400, "control characters");
  refused({{"kind", 3}}, 400, "wrong type");
  EXPECT_EQ(fixture.status()["session"], 0);
}

TEST(AQualification, NeedsTwoSpeedsToReadTheDelayOff) {
  DaemonFixture fixture("[motion]\nfast_search_mm_s = 2.5\n");
  fixture.start();
  fixture.refuse({{"kind", "qualify"}, {"cell", CELLCAL_DEMO_CELL}}, 422,
                 "fast_search_mm_s = 2.5 and slow_search_mm_s = 2");
}

}  // namespace
}  // namespace cellcal::daemon::testing
