#include "daemon/fleet/api/fleet_server.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "daemon/api/http/http.h"
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

TEST_F(FleetApi, RefusesWhatIsWrong) {
  for (const char* missing :
       {"/", "/v1/fleet", "/v1/fleet/cells/graz/nobody", "/v1/fleet/cells/a'b/c",
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
