// A session that only finds the spheres.

#include <gtest/gtest.h>

#include <string>

#include "changed_cell.h"

namespace cellcal::daemon::testing {
namespace {

TEST(finding, ends_with_the_centres_of_all_spheres_as_lines_for_the_cell_file) {
  DaemonFixture fixture(kFast);
  const std::string text = content(CELLCAL_DEMO_CELL);
  fixture.start();
  const Outcome outcome = fixture.cellcal({"find", "--cell", CELLCAL_DEMO_CELL});
  ASSERT_EQ(outcome.status, 0) << outcome.err << fixture.log();
  EXPECT_NE(outcome.out.find("S1: centre_mm = ["), std::string::npos) << outcome.out;
  EXPECT_EQ(content(CELLCAL_DEMO_CELL), text) << "no file is changed";

  const auto found = nlohmann::json::parse(
      http_request(fixture.socket(), "GET", "/v1/sessions/1/found.json").body);
  EXPECT_EQ(found["format"], "cellcal.found/1");
  ASSERT_EQ(found["spheres"].size(), 4u);
  for (const auto& sphere : found["spheres"]) {
    EXPECT_GE(sphere["touches"], 6);
    EXPECT_EQ(sphere["u_mm"], 5.0);
  }
  const auto stated = [&](const char* id) { return text.find(id) != std::string::npos; };
  for (const auto& sphere : found["spheres"]) {
    EXPECT_TRUE(stated(sphere["target"].get<std::string>().c_str()));
    // Stated with a sigma of 10 mm, and the emulated spheres stand within two of them.
    EXPECT_LT(sphere["moved_mm"].get<double>(), 25.0);
  }
  const auto shown =
      nlohmann::json::parse(http_request(fixture.socket(), "GET", "/v1/sessions/1").body);
  EXPECT_EQ(shown["kind"], "find");
  EXPECT_EQ(shown["state"], "done");
  EXPECT_EQ(shown["outcome"]["kind"], "found");
  EXPECT_EQ(shown["outcome"]["spheres"].size(), 4u);
  EXPECT_EQ(fixture.status()["outcome"]["kind"], "found");
  EXPECT_TRUE(fixture.status()["publish"].is_null()) << "no calibration is withheld";
  EXPECT_EQ(http_request(fixture.socket(), "GET", "/v1/sessions/1/calibration.json").status, 404);
}

class AFindThatFails : public AChangedCell, public ::testing::WithParamInterface<const char*> {};

TEST_P(AFindThatFails, leaves_the_arm_where_the_next_one_begins) {
  restart(GetParam());
  for (int session = 1; session <= 2; ++session) {
    const Outcome lost = fixture.cellcal({"find", "--cell", CELLCAL_DEMO_CELL});
    EXPECT_EQ(lost.status, 1) << lost.out << lost.err;
    const std::string failure = get("/v1/sessions/" + std::to_string(session))["failure"];
    EXPECT_TRUE(failure.starts_with("not-found: ")) << failure << fixture.log();
  }
}
INSTANTIATE_TEST_SUITE_P(with_another_tip_than_the_file_has, AFindThatFails,
                         ::testing::Values("tool_shift_mm = [25.0, 0.0, 0.0]\n",
                                           "tool_shift_mm = [0.0, 30.0, 0.0]\n",
                                           "tool_shift_mm = [12.0, 12.0, 12.0]\n"));

TEST(finding, has_its_own_end) {
  DaemonFixture fixture(kFast);
  fixture.start();
  for (const auto& more : {nlohmann::json{{"goal_mm", 0.2}}, nlohmann::json{{"touches", 20}}}) {
    nlohmann::json body = more;
    body["kind"] = "find";
    body["cell"] = CELLCAL_DEMO_CELL;
    const Response answer = http_request(fixture.socket(), "POST", "/v1/run", body.dump());
    EXPECT_EQ(answer.status, 422) << answer.body;
    EXPECT_NE(answer.body.find("leave goal_mm and touches out"), std::string::npos) << answer.body;
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
