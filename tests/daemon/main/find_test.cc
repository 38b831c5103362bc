// A session that only locates the spheres.

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <thread>

#include "calib/model/units.h"
#include "changed_cell.h"
#include "daemon/journal/journal.h"

namespace cellcal::daemon::testing {
namespace {

TEST(Finding, EndsWithTheCentresOfAllSpheresAsLinesForTheCellFile) {
  DaemonFixture fixture(kFast);
  const std::string text = content(CELLCAL_DEMO_CELL);
  fixture.start();
  const Outcome outcome = fixture.cellcal({"find", "--cell", CELLCAL_DEMO_CELL});
  ASSERT_EQ(outcome.status, 0) << outcome.err << fixture.log();
  EXPECT_NE(outcome.out.find("S1: centre_mm = ["), std::string::npos) << outcome.out;
  EXPECT_EQ(content(CELLCAL_DEMO_CELL), text) << "no file is changed";

  const auto found = fixture.get("/v1/sessions/1/found.json");
  EXPECT_EQ(found["format"], "cellcal.found/1");
  ASSERT_EQ(found["spheres"].size(), 4u);
  for (const auto& sphere : found["spheres"]) {
    EXPECT_GE(sphere["touches"], 6);
    EXPECT_EQ(sphere["u_mm"], 5.0);
  }
  const auto stated = [&](const char* id) { return text.find(id) != std::string::npos; };
  for (const auto& sphere : found["spheres"]) {
    EXPECT_TRUE(stated(sphere["target"].get<std::string>().c_str()));
    // Stated with a sigma of 10 mm; the emulated spheres are within two of them.
    EXPECT_LT(sphere["moved_mm"].get<double>(), 25.0);
  }
  const auto shown = fixture.get("/v1/sessions/1");
  EXPECT_EQ(shown["kind"], "find");
  EXPECT_EQ(shown["state"], "done");
  EXPECT_EQ(shown["outcome"]["kind"], "found");
  EXPECT_EQ(shown["outcome"]["spheres"].size(), 4u);
  EXPECT_EQ(fixture.status()["outcome"]["kind"], "found");
  EXPECT_TRUE(fixture.status()["publish"].is_null()) << "no calibration is withheld";
  EXPECT_EQ(http_request(fixture.socket(), "GET", "/v1/sessions/1/calibration.json").status, 404);
}

TEST(Finding, DoesWithoutTheWarningOfRoughCentresThatASearchByThemHas) {
  DaemonFixture fixture(kFast);
  fixture.start();
  const std::filesystem::path demo(CELLCAL_DEMO_CELL), cell = fixture.dir / "cell.toml";
  std::filesystem::copy_file(demo.parent_path() / "kr5_worn.toml", fixture.dir / "kr5_worn.toml");
  std::string text = content(demo);
  const std::string stated = "centre_sigma_mm = 10.0";
  text.replace(text.find(stated), stated.size(), "centre_sigma_mm = 12.0");
  std::ofstream(cell) << text;
  const Outcome found = fixture.cellcal({"find", "--cell", cell});
  EXPECT_EQ(found.status, 0) << found.err << fixture.log();
  EXPECT_TRUE(fixture.status()["warnings"].empty()) << fixture.status()["warnings"];
  const Outcome run = fixture.cellcal({"run", "--cell", cell, "--touches", "12", "--check", "0"});
  EXPECT_NE(run.err.find("warning: sphere S1: centre_sigma_mm = 12.0, limit 11.0 mm"),
            std::string::npos)
      << run.err;
  EXPECT_NE(run.err.find("'cellcal run --find'"), std::string::npos) << run.err;
}

class AFindThatFails : public AChangedCell, public ::testing::WithParamInterface<const char*> {};

TEST_P(AFindThatFails, LeavesTheArmWhereTheNextOneBegins) {
  restart(GetParam());
  for (int session = 1; session <= 2; ++session) {
    const Outcome lost = fixture.cellcal({"find", "--cell", CELLCAL_DEMO_CELL});
    EXPECT_EQ(lost.status, 1) << lost.out << lost.err;
    const std::string failure = get("/v1/sessions/" + std::to_string(session))["failure"];
    EXPECT_TRUE(failure.starts_with("not-found: ")) << failure << fixture.log();
  }
}
INSTANTIATE_TEST_SUITE_P(WithAnotherTipThanTheFileHas, AFindThatFails,
                         ::testing::Values("tool_shift_mm = [25.0, 0.0, 0.0]\n",
                                           "tool_shift_mm = [0.0, 30.0, 0.0]\n",
                                           "tool_shift_mm = [12.0, 12.0, 12.0]\n"));

enum class Left { kAborted, kKilled };

class AFindThatIsLeft : public AChangedCell, public ::testing::WithParamInterface<Left> {
 protected:
  /// Leaves a session after this many touches, in a new state directory; the interrupted search.
  calib::SearchUnderWay leave_behind(int touches) {
    fixture.daemon.reset();
    std::filesystem::remove_all(fixture.dir / "state");
    restart("");
    const nlohmann::json body{{"kind", "find"}, {"cell", CELLCAL_DEMO_CELL}};
    EXPECT_EQ(fixture.begin(body).status, 201);
    fixture.wait_for_touches(touches);
    if (GetParam() == Left::kKilled) {
      fixture.daemon->signal(SIGKILL);
    } else {
      EXPECT_EQ(http_request(fixture.socket(), "POST", "/v1/abort", "").status, 202);
      wait_for_end();
      EXPECT_EQ(get("/v1/sessions/1")["state"], "aborted");
    }
    fixture.daemon.reset();
    const auto left = Journal(fixture.dir / "state" / "journal.db").search_left();
    EXPECT_TRUE(left) << fixture.log();
    return left ? left->search : calib::SearchUnderWay{};
  }
  void wait_for_end() const {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (fixture.status()["phase"] != "aborted" && std::chrono::steady_clock::now() < end)
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
  /// Along the search, with an offset of one axis.
  static calib::JointVector on(const calib::SearchUnderWay& search, double share,
                               double beside_rad) {
    calib::JointVector at = search.way.back();
    for (std::size_t i = 0; i < at.size(); ++i) at[i] += share * (search.end[i] - at[i]);
    at[0] += beside_rad;
    return at;
  }
  Outcome find_from(const calib::JointVector& at) {
    std::string start = "start_deg = [";
    for (const double rad : at) start += fmt::format("{:.9f}, ", rad * calib::kDegPerRad);
    restart(start + "]\n");
    return fixture.cellcal({"find", "--cell", CELLCAL_DEMO_CELL});
  }
};

TEST_P(AFindThatIsLeft, IsLeftByTheNextTheWayItCameAndByNoneThatWasJogged) {
  int refused = 0;
  // In contact, and twice without contact.
  for (const auto& [touches, share] : {std::pair(2, 0.5), std::pair(9, 0.5), std::pair(9, 0.7)}) {
    SCOPED_TRACE(fmt::format("{} touches, {} of the search", touches, share));
    const calib::SearchUnderWay search = leave_behind(touches);
    ASSERT_FALSE(search.end.empty());
    const Outcome jogged = find_from(on(search, share, 1.0 * calib::kRadPerDeg));
    if (jogged.status == 0) continue;  // at a position with a known retreat
    ++refused;
    const std::string failure = get("/v1/sessions/2")["failure"];
    EXPECT_TRUE(failure.starts_with("plan: the arm is where") ||
                failure.starts_with("contact-closed: "))
        << failure;
    const Outcome next = find_from(on(search, share, 0.0));
    EXPECT_EQ(next.status, 0) << next.err << fixture.log();
  }
  EXPECT_GT(refused, 0);
}
INSTANTIATE_TEST_SUITE_P(InMidSearch, AFindThatIsLeft,
                         ::testing::Values(Left::kAborted, Left::kKilled));

TEST(Finding, HasItsOwnEnd) {
  DaemonFixture fixture(kFast);
  fixture.start();
  for (const auto& more : {nlohmann::json{{"goal_mm", 0.2}}, nlohmann::json{{"touches", 20}}}) {
    nlohmann::json body = more;
    body["kind"] = "find";
    body["cell"] = CELLCAL_DEMO_CELL;
    fixture.refuse(body, 422, "leave goal_mm and touches out");
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
