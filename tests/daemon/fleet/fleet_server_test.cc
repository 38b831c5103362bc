#include "daemon/fleet/fleet_server.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>

#include "daemon/api/http/http.h"
#include "daemon/certificate/signed_files.h"
#include "daemon/fleet/judge.h"
#include "tests/daemon/api/schema.h"
#include "tests/daemon/api/tcp_peer.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/fleet/facts.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::fleet {
namespace {

using nlohmann::json;
using testing::Database;
using testing::kWeld;

class FleetApi : public ::testing::Test {
 protected:
  FleetApi() {
    Store store{{database}};
    Batch batch;
    std::int64_t number = 0;
    for (const plant::FactBody& body : testing::one_of_each())
      batch.facts.push_back(testing::fact(kWeld, ++number, body));
    store.write(batch);
    server = std::make_unique<FleetServer>(Listen{socket, "127.0.0.1", 0, {"fleet.plant.example"}},
                                           database, counters);
  }
  Response get(const std::string& target) const { return http_request(socket, "GET", target); }

  std::string database = Database::shared().emptied();
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

TEST_F(FleetApi, AnswersAsItIsDescribed) {
  Store store{{database}};
  Batch batch;  // a cell with little data, with numbers missing
  batch.facts.push_back(testing::alarm(testing::kPaint, 5));
  store.write(batch);
  testing::ask(database, "UPDATE fleet.calibrations SET at = '2020-01-01'");
  testing::ask(database, "UPDATE fleet.journals SET settled = 4 WHERE numbers = '{[5,6)}'");
  testing::ask(database,
               "INSERT INTO fleet.quarantine_counts VALUES ('graz', 'paint-1', 'rate', 3, now())");
  const daemon::testing::Description described(CELLCAL_FLEET_OPENAPI);
  const auto complaint = [&](const std::string& target, const std::string& schema) {
    return described.complaint(json::parse(get(target).body), schema);
  };
  EXPECT_EQ(complaint("/v1/fleet/cells", "FleetCells"), "");
  EXPECT_EQ(complaint("/v1/fleet/cells/graz/weld-3", "FleetCellSeen"), "");
  EXPECT_EQ(complaint("/v1/fleet/cells/graz/paint-1", "FleetCellSeen"), "");
  EXPECT_EQ(complaint("/v1/fleet/cells/graz/weld-3/certificates/j1/7", "CertificateFiles"), "");
  EXPECT_EQ(complaint("/v1/fleet/compare?robot=KR%205+R1400&joint=A2", "Corrections"), "");
  EXPECT_EQ(complaint("/v1/fleet/overdue", "Overdue"), "");
  EXPECT_EQ(complaint("/v1/fleet/compare", "FleetError"), "");
  const json little = json::parse(get("/v1/fleet/cells/graz/paint-1").body);
  EXPECT_EQ(little.at("gaps").size(), 1u);
  EXPECT_EQ(little.at("refused").size(), 1u);
}

TEST_F(FleetApi, AnswersOnTheLoopbackUnderThisComputersNamesAlone) {
  const auto status = [&](const std::string& host) {
    daemon::testing::TcpPeer peer(
        server->port(), "GET /metrics HTTP/1.1\r\nHost: " + host + "\r\nConnection: close\r\n\r\n");
    return peer.read_all().substr(0, 12);
  };
  EXPECT_EQ(status("127.0.0.1:8090"), "HTTP/1.1 200");
  EXPECT_EQ(status("localhost"), "HTTP/1.1 200");
  EXPECT_EQ(status("fleet.plant.example"), "HTTP/1.1 200");
  EXPECT_EQ(status("evil.example"), "HTTP/1.1 403");
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

TEST_F(FleetApi, ACertificateGoesFromItsCellThroughThePlantToWhoeverVerifiesIt) {
  const daemon::testing::TemporaryDirectory folder;
  std::filesystem::create_directory(folder / "made");
  const std::map<std::string, std::string> files{{"certificate.html", "<p>0.096 mm</p>"},
                                                 {"certificate.pdf", std::string("%PDF\0\xFF", 6)},
                                                 {"rows.jsonl", std::string(300'000, '7')}};
  std::vector<std::string> names;
  for (const auto& [name, text] : files) {
    std::ofstream(folder / "made" / name, std::ios::binary) << text;
    names.push_back(name);
  }
  signing::make_key(folder / "key");
  signing::sign_files(folder / "made", names, {"8-abc", "Q. Auditor", "2026-11-22T20:00:00Z", ""},
                      signing::PrivateKey(folder / "key"));
  plant::CertificateFact certificate{"8-abc", {}};
  for (const auto& one : std::filesystem::directory_iterator(folder / "made")) {
    std::ifstream in(one.path(), std::ios::binary);
    certificate.files.push_back({one.path().filename(), {std::istreambuf_iterator<char>(in), {}}});
  }
  ASSERT_EQ(certificate.files.size(), 5u);
  // As received from the broker.
  const testing::Publication message = testing::publication(testing::fact(kWeld, 12, certificate));
  Meters meters({});
  Batch batch;
  judge({message.topic, message.payload}, meters, {}, batch);
  Store store{{database}};
  ASSERT_EQ(store.write(batch).facts, 1u);

  const auto run = [&](std::vector<std::string> words) {
    words.insert(words.begin(), CELLCAL);
    return daemon::testing::run_program(words);
  };
  const std::string out = (folder / "out").string(), key = (folder / "key.pub").string();
  ASSERT_EQ(run({"fleet", "export", "graz/weld-3", "--certificate", "-o", out, "--socket", socket})
                .status,
            0);
  const auto verified = run({"verify", out, "--key", key});
  EXPECT_EQ(verified.status, 0) << verified.err;
  EXPECT_NE(verified.out.find("verified: certificate 8-abc"), std::string::npos) << verified.out;
  testing::ask(
      database,
      "UPDATE fleet.certificate_files SET bytes = 'x', sha256 = encode(sha256('x'), 'hex') WHERE name = 'rows.jsonl'");
  ASSERT_EQ(run({"fleet", "export", "graz/weld-3", "--certificate", "-o", out, "--socket", socket})
                .status,
            0);
  EXPECT_EQ(run({"verify", out, "--key", key}).status, 3) << "the plant changed it";
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

TEST_F(FleetApi, SaysThatTheDatabaseIsAwayHasThePageMeanwhileAndAnswersWhenItIsBack) {
  ASSERT_EQ(get("/v1/fleet/cells").status, 200);
  Database::shared().crash();
  EXPECT_EQ(get("/v1/fleet/cells").status, 503);
  EXPECT_EQ(get("/metrics").status, 200);
  const Response page = get("/");
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.type.substr(0, 9), "text/html");
  Database::shared().start();
  EXPECT_EQ(get("/v1/fleet/cells").status, 200);
}

}  // namespace
}  // namespace cellcal::daemon::fleet
