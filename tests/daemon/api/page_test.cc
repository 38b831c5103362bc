// Files of the page and values that it draws, by requests.

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "daemon/api/handlers.h"
#include "daemon/api/http/http.h"
#include "daemon/tasks/options.h"
#include "tests/daemon/api/without_hardware.h"

namespace cellcal::daemon {
namespace {

using nlohmann::json;

std::string header(const Response& response, const std::string& name) {
  for (const auto& [key, value] : response.headers)
    if (key == name) return value;
  return "";
}

struct APage : ::testing::Test, testing::WithoutHardware {
  Response ask(const std::string& target, const std::string& method = "GET") {
    Request request = parse_target(method, target, "");
    request.caller.role = Role::kView;
    return *api.answer(request);
  }
  std::int64_t begin(const std::string& state_words = "") {
    const std::int64_t id = journal.begin(read_inputs(CELLCAL_DEMO_CELL), "t0");
    if (!state_words.empty()) journal.record(id, RecordEnd{Ending::kFailed, state_words}, "t1");
    return id;
  }

  Api api{service, journal, nullptr, page_answer};
};

TEST_F(APage, ComesWithAPolicyThatLetsNothingInFromElsewhere) {
  const Response page = ask("/");
  EXPECT_EQ(page.status, 200);
  EXPECT_EQ(page.type, "text/html; charset=utf-8");
  const std::string policy = header(page, "Content-Security-Policy");
  EXPECT_NE(policy.find("default-src 'none'"), std::string::npos) << policy;
  EXPECT_NE(policy.find("frame-ancestors 'none'"), std::string::npos) << policy;
  EXPECT_EQ(policy.find("unsafe"), std::string::npos) << policy;
  EXPECT_EQ(policy.find("http"), std::string::npos) << policy;
  EXPECT_EQ(header(page, "Cache-Control"), "no-cache");
}

TEST_F(APage, IsNotSentAgainToOneWhoHasIt) {
  Request again = parse_target("GET", "/", "");
  again.headers["if-none-match"] = header(ask("/"), "ETag");
  const Response same = *api.answer(again);
  EXPECT_EQ(same.status, 304);
  EXPECT_TRUE(same.body.empty());
  again.headers["if-none-match"] = "\"another\"";
  EXPECT_EQ(api.answer(again)->status, 200);
}

TEST_F(APage, HasNoOtherFilesThanItsOwn) {
  for (const char* target : {"/page/", "/page/x.js", "/page/../journal.db", "//", "/index.html",
                             "/page/%2e%2e/tokens.json", "/v1", "/v1/"}) {
    EXPECT_EQ(ask(target).status, 404) << target;
  }
  EXPECT_NE(ask("/", "POST").status, 200);
}

TEST_F(APage, HasNothingToDrawBeforeTheFirstSession) {
  EXPECT_EQ(ask("/v1/scene").status, 404);
  EXPECT_EQ(json::parse(ask("/v1/drift").body).at("sessions").size(), 0u);
  for (const char* target :
       {"/v1/sessions/1/plan", "/v1/sessions/1/figures", "/v1/scene?session=1"})
    EXPECT_EQ(ask(target).status, 404) << target;
}

TEST_F(APage, DrawsTheCellOfTheNewestSessionOrOfTheOneThatIsAskedFor) {
  const std::int64_t first = begin("no-contact: S2"), second = begin("no-contact: S3");
  EXPECT_EQ(json::parse(ask("/v1/scene").body).at("session"), second);
  const json scene = json::parse(ask("/v1/scene?session=" + std::to_string(first)).body);
  EXPECT_EQ(scene.at("session"), first);
  EXPECT_EQ(scene.at("joints").size(), 6u);
  EXPECT_EQ(scene.at("targets").size(), 4u);
  for (const char* session : {"x", "-1", "1e3", "99999999999999999999", "%78"})
    EXPECT_EQ(ask(std::string("/v1/scene?session=") + session).status, 400) << session;
}

TEST_F(APage, ShowsTheTouchesOfASessionThatWasNeverIdentified) {
  const std::int64_t id = begin();
  calib::Touch touch;
  touch.joint_rad = {0.1, -1.2, 1.1, 0.4, 0.9, -0.7};
  touch.target = "S1";
  journal.record(id, RecordTouch{0, touch});
  const json figures = json::parse(ask("/v1/sessions/" + std::to_string(id) + "/figures").body);
  EXPECT_EQ(figures.at("touches").size(), 1u);
  EXPECT_EQ(figures.at("touches").at(0).at("target"), "S1");
  EXPECT_TRUE(figures.at("result").is_null());
}

TEST_F(APage, SaysWhyThereIsNoPlanOfASessionOfAnEarlierDaemon) {
  const Response none = ask("/v1/sessions/" + std::to_string(begin("x")) + "/plan");
  EXPECT_EQ(none.status, 404);
  EXPECT_NE(none.body.find("not in memory"), std::string::npos) << none.body;
}

TEST(APlantsPage, StandsAtTheCollectorsOwnDoorAndAtNoCells) {
  const auto of_cell = page_answer(parse_target("GET", "/", ""));
  const auto of_plant = page_answer_at(parse_target("GET", "/", ""), kFleetPage);
  ASSERT_TRUE(of_cell && of_plant);
  EXPECT_NE(of_cell->body, of_plant->body);
  EXPECT_FALSE(page_answer(parse_target("GET", "/fleet", "")));
  EXPECT_FALSE(page_answer_at(parse_target("GET", "/fleet", ""), kFleetPage));
}

TEST_F(APage, ThatIsDrawnMayWaitForTheDiskAndItselfDoesNot) {
  for (const char* target :
       {"/v1/scene", "/v1/drift", "/v1/sessions/1/plan", "/v1/sessions/1/figures"})
    EXPECT_TRUE(Api::is_slow(parse_target("GET", target, ""))) << target;
  EXPECT_FALSE(Api::is_slow(parse_target("GET", "/", "")));
}

TEST_F(APage, IsForEverybodyAndWhatItDrawsIsNot) {
  const auto refused = [this](const char* target) {
    Request request = parse_target("GET", target, "");
    request.headers["host"] = "127.0.0.1:8080";
    return api.admit_network(request).has_value();
  };
  EXPECT_FALSE(refused("/"));
  for (const char* target :
       {"/v1/scene", "/v1/drift", "/v1/sessions/1/plan", "/v1/sessions/1/figures"})
    EXPECT_TRUE(refused(target)) << target;
}

}  // namespace
}  // namespace cellcal::daemon
