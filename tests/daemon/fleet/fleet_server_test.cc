#include "daemon/fleet/api/fleet_server.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "daemon/api/http/http.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/fleet/facts.h"

namespace cellcal::daemon::fleet {
namespace {

using nlohmann::json;
using testing::Database;

const plant::CellName kWeld{"graz", "weld-3"};

class FleetApi : public ::testing::Test {
 protected:
  FleetApi() {
    Store store{{database}};
    Batch batch;
    std::int64_t number = 0;
    for (const plant::FactBody& body : testing::one_of_each())
      batch.facts.push_back(testing::fact(kWeld, ++number, body));
    store.write(batch);
    server = std::make_unique<FleetServer>(Listen{socket, "127.0.0.1", 0}, database, counters);
  }
  Response get(const std::string& target) const { return http_request(socket, "GET", target); }

  std::string database = Database::shared().create();
  std::string socket = ::testing::TempDir() + "fleet-api-" + std::to_string(::getpid());
  Counters counters;
  std::unique_ptr<FleetServer> server;
};

TEST_F(FleetApi, AnswersWhatIsThere) {
  EXPECT_EQ(json::parse(get("/v1/fleet/cells").body).at("cells").at(0).at("cell"), "weld-3");
  EXPECT_EQ(json::parse(get("/v1/fleet/cells/graz/weld-3").body).at("calibrations").size(), 1u);
  EXPECT_EQ(get("/v1/fleet/cells/graz/weld-3/calibrations/j1/7").body, testing::a_calibration());
  EXPECT_EQ(get("/v1/fleet/cells/graz/weld-3/checks/j1/7").body, "{\"a\": 1}\n");
  EXPECT_EQ(
      json::parse(get("/v1/fleet/cells/graz/weld-3/certificates/j1/7").body).at("files").size(),
      2u);
  EXPECT_EQ(json::parse(get("/v1/fleet/compare?robot=KR%205+R1400&joint=A2").body)
                .at("corrections")
                .size(),
            1u);
  EXPECT_EQ(get("/v1/fleet/overdue").status, 200);
  EXPECT_NE(get("/metrics").body.find("\ncellcal_fleet_cells 1\n"), std::string::npos);
  EXPECT_NE(server->port(), 0);
}

TEST_F(FleetApi, ThePageOfAPlantIsThereAlsoWhileTheDatabaseIsNot) {
  Database::shared().crash();
  const Response page = get("/");
  Database::shared().start();
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.type.substr(0, 9), "text/html");
}

TEST_F(FleetApi, RefusesWhatIsWrong) {
  for (const char* missing :
       {"/v1/fleet", "/v1/fleet/cells/graz/nobody", "/v1/fleet/cells/a'b/c",
        "/v1/fleet/cells/graz/weld-3/x/j1/7", "/v1/fleet/cells/graz/weld-3/calibrations/j1/8",
        "/v1/fleet/cells/graz/weld-3/calibrations/j1/7/8"})
    EXPECT_EQ(get(missing).status, 404) << missing;
  for (const char* wrong :
       {"/v1/fleet/compare", "/v1/fleet/compare?robot=%00&joint=A1",
        "/v1/fleet/compare?robot=%ff&joint=A1", "/v1/fleet/cells/graz/weld-3/checks/j1/x",
        "/v1/fleet/cells/graz/weld-3/checks/j1/99999999999999999999"})
    EXPECT_EQ(get(wrong).status, 400) << wrong;
  EXPECT_EQ(http_request(socket, "POST", "/v1/fleet/cells", "{}").status, 405);
}

TEST_F(FleetApi, TheCommandsSayItInWordsAndExportTheSameBytes) {
  const auto fleet = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {CELLCAL, "fleet"});
    words.insert(words.end(), {"--socket", socket});
    return daemon::testing::run_program(words);
  };
  const auto status = fleet({"status"});
  EXPECT_EQ(status.status, 0) << status.err;
  EXPECT_NE(status.out.find("0 of 1 cells need attention"), std::string::npos) << status.out;
  EXPECT_EQ(json::parse(fleet({"status", "--json"}).out).at("cells").size(), 1u);
  EXPECT_EQ(fleet({"overdue"}).status, 0);
  testing::ask(database, "UPDATE fleet.calibrations SET at = '2020-01-01'");
  const auto overdue = fleet({"overdue"});
  EXPECT_EQ(overdue.status, 3);
  EXPECT_NE(overdue.out.find("graz/weld-3"), std::string::npos);
  EXPECT_NE(fleet({"status"}).out.find("calibration due (since 2020-12-31)"), std::string::npos);
  EXPECT_NE(fleet({"compare", "--robot", "KR 5 R1400", "--joint", "A2"}).out.find("theta"),
            std::string::npos);
  EXPECT_EQ(fleet({"export", "graz/weld-3"}).out, testing::a_calibration());
  EXPECT_EQ(fleet({"export", "graz/weld-3", "--check", "--session", "7"}).out, "{\"a\": 1}\n");
  const std::filesystem::path folder = socket + "-certificate";
  EXPECT_EQ(fleet({"export", "graz/weld-3", "--certificate", "-o", folder}).status, 0);
  std::ifstream in(folder / "sums.sig", std::ios::binary);
  EXPECT_EQ((std::string{std::istreambuf_iterator<char>(in), {}}), std::string("\0\xff\x80", 3));
  std::filesystem::remove_all(folder);
}

TEST_F(FleetApi, TheCommandsNameWhatIsWrong) {
  using daemon::testing::run_program;
  const auto missing = run_program(
      {CELLCAL, "fleet", "export", "graz/weld-3", "--session", "99", "--socket", socket});
  EXPECT_EQ(missing.status, 1);
  const auto nobody = run_program({CELLCAL, "fleet", "status", "--socket", "/nowhere/fleet.sock"});
  EXPECT_EQ(nobody.status, 1);
  EXPECT_NE(nobody.err.find("systemctl start cellcal-fleet"), std::string::npos);
  EXPECT_EQ(run_program({CELLCAL, "fleet", "export", "weld-3", "--socket", socket}).status, 2);
  EXPECT_EQ(run_program({CELLCAL, "fleet", "compare"}).status, 2);
}

TEST_F(FleetApi, SaysThatTheDatabaseIsAwayAndAnswersWhenItIsBack) {
  ASSERT_EQ(get("/v1/fleet/cells").status, 200);
  Database::shared().crash();
  EXPECT_EQ(get("/v1/fleet/cells").status, 503);
  EXPECT_EQ(get("/metrics").status, 200);
  Database::shared().start();
  EXPECT_EQ(get("/v1/fleet/cells").status, 200);
}

}  // namespace
}  // namespace cellcal::daemon::fleet
