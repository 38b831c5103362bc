#include "daemon/api/handlers.h"

#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "tests/daemon/api/without_hardware.h"
#include "tests/daemon/journal/disks/stalling_disk.h"

namespace cellcal::daemon {
namespace {

using nlohmann::json;

struct AnApi : ::testing::Test, testing::WithoutHardware {
  Response ask(const std::string& method, const std::string& target, const std::string& body = "") {
    return *api.answer(local(method, target, body));
  }
  Request local(const std::string& method, const std::string& target,
                const std::string& body = "") {
    Request request = parse_target(method, target, body);
    EXPECT_FALSE(api.admit_local(request));
    return request;
  }
  std::string error(const Response& response) {
    return json::parse(response.body).at("error").get<std::string>();
  }

  Api api{service, journal};
};

TEST_F(AnApi, AnswersStatusAndAbortWhileTheJournalWaitsForAStalledDisk) {
  testing::StallingDisk disk;
  Journal stalled(dir / "stalled.db");
  SessionService idle{{stalled, dir.path(), {}, {}}};
  Api answering(idle, stalled);
  disk.stall();
  std::thread writer([&] { stalled.begin({"c", "c", "r", "r", "{}"}, "t"); });
  disk.wait_until_stalled();
  const auto answer = [&](const char* method, const char* target) {
    const Request request = local(method, target);
    EXPECT_FALSE(Api::is_slow(request)) << target;
    return answering.answer(request)->status;
  };
  EXPECT_EQ(answer("GET", "/v1/status"), 200);
  EXPECT_EQ(answer("GET", "/v1/watch"), 200);
  EXPECT_EQ(answer("POST", "/v1/abort"), 409) << "no session is running";
  EXPECT_TRUE(Api::is_slow(local("POST", "/v1/run")));
  for (const char* target : {"/v1/sessions", "/v1/sessions/1/touches.csv"}) {
    EXPECT_TRUE(Api::is_slow(local("GET", target))) << target;
  }
  disk.release();
  writer.join();
}

TEST_F(AnApi, TellsOfTheSessionThatAKilledDaemonLeft) {
  {
    Journal left(dir / "left.db");
    const std::int64_t id = left.begin({"c", "c", "r", "r", "{}"}, "2026-01-01T00:00:00.000Z");
    left.record(id, RecordPlan{"h", 12});
    left.record(id, RecordTouch{0, {}});
  }
  Journal found(dir / "left.db");
  SessionService after{{found, dir.path(), {}, {}}};
  const json status = json::parse(status_to_json(after.status()));
  EXPECT_EQ(status["phase"], "idle");
  EXPECT_EQ(status["interrupted"]["session"], 1);
  EXPECT_EQ(status["interrupted"]["touches"], 1);
  EXPECT_EQ(status["interrupted"]["planned"], 12);
  EXPECT_EQ(status["interrupted"]["ending"], "interrupted");
  EXPECT_EQ(status["interrupted"]["started"], "2026-01-01T00:00:00.000Z");
  EXPECT_TRUE(json::parse(status_to_json(service.status()))["interrupted"].is_null());
}

TEST(AStatus, NamesWhetherAResumeGoesOnWithTheSession) {
  const auto resumable = [](const Status& status) {
    const json all = json::parse(status_to_json(status));
    return status.interrupted ? all["interrupted"]["resumable"] : all["resumable"];
  };
  const auto ended = [](Phase phase, const std::string& anew = {}) {
    Status status;
    status.session = 3;
    status.phase = phase;
    status.anew = anew;
    return status;
  };
  const auto left = [](const std::string& anew = {}) {
    Status status;
    status.interrupted.emplace().anew = anew;
    return status;
  };
  EXPECT_EQ(resumable({}), false);
  EXPECT_EQ(resumable(ended(Phase::kDone)), false);
  EXPECT_EQ(resumable(ended(Phase::kAborted)), true);
  EXPECT_EQ(resumable(ended(Phase::kAborted, "cellcal check")), false);
  EXPECT_EQ(resumable(left()), true);
  EXPECT_EQ(resumable(left("cellcal check")), false);
  std::set<FailureKind> again;
  for (const FailureKind kind : all_values<FailureKind>()) {
    Status failed = ended(Phase::kFailed), before = left();
    failed.failure = Failure{kind, {}};
    before.interrupted->failure = kind;
    EXPECT_EQ(resumable(failed), resumable(before)) << to_string(kind);
    if (resumable(failed) == false) again.insert(kind);
  }
  EXPECT_EQ(again,
            (std::set{FailureKind::kNotFound, FailureKind::kPlanChanged, FailureKind::kIdentify}));
}

TEST_F(AnApi, BeginsNoSessionWhileSomethingElseHasTheDevices) {
  const std::string run = json{{"cell", CELLCAL_DEMO_CELL}}.dump();
  service.hold("the doctor is looking");
  const Response busy = ask("POST", "/v1/run", run);
  EXPECT_EQ(busy.status, 409);
  EXPECT_EQ(error(busy), "the doctor is looking");
  EXPECT_THROW(service.hold("another"), BusyError);
  service.release();
  EXPECT_NE(ask("POST", "/v1/run", run).status, 409)
      << "it has no devices, and that is another error";
  service.hold("again");
  service.shutdown();
  service.release();
  EXPECT_THROW(service.hold("too late"), BusyError);
}

TEST_F(AnApi, WithoutADoctorWithinSaysWhatToUse) {
  for (const char* path : {"/v1/doctor", "/v1/readiness"}) EXPECT_EQ(ask("GET", path).status, 404);
  EXPECT_NE(error(ask("POST", "/v1/doctor", R"({"cell": "/c"})")).find("cellcal doctor"),
            std::string::npos);
}

TEST_F(AnApi, OpensNoneOfTheJournalsFilesAsACellFile) {
  for (const auto& file : journal.files()) {
    const Response no = ask("POST", "/v1/run", json{{"cell", file.string()}}.dump());
    EXPECT_EQ(no.status, 422);
    EXPECT_NE(error(no).find("is the journal of this daemon"), std::string::npos) << error(no);
  }
}

TEST_F(AnApi, IsIdleAtFirst) {
  const Response response = ask("GET", "/v1/status");
  EXPECT_EQ(response.status, 200);
  const json status = json::parse(response.body);
  EXPECT_EQ(status["phase"], "idle");
  EXPECT_EQ(status["running"], false);
  EXPECT_EQ(status["finding"], false);
  EXPECT_TRUE(status["residual_mm"].is_null());
  EXPECT_TRUE(status["failure"].is_null());
  EXPECT_TRUE(status["links"].is_null());
  EXPECT_FALSE(status["version"].get<std::string>().empty());
}

TEST(AStatus, HoldsTheQualityOfBothLinksInTheUnitsThatItsKeysName) {
  LinkReport report;
  report.open = true;
  report.robot.cycle_s = 0.004;
  report.robot.late = 2;
  report.robot.mode = drivers::OperatingMode::kT1;
  report.robot.quality.jitter_s = 0.0003;
  report.robot.quality.reply_p99_s = 0.0001;
  report.contact.identity = {1, {1, 2, 3}, 0xABC, 42, 0x2ad3, {}};
  report.contact.quality.frames = 100;
  report.contact.quality.clock_sigma_s = 20e-6;
  report.contact.quality.round_trip = {0.0005, 0.0, 0.0};
  report.contact.quality.late_worst_s = 0.040;
  Status status;
  status.links = std::make_shared<const LinkReport>(report);
  const json links = json::parse(status_to_json(status)).at("links");
  EXPECT_EQ(links.at("open"), true);
  const json& robot = links.at("robot");
  EXPECT_DOUBLE_EQ(robot.at("cycle_ms"), 4.0);
  EXPECT_EQ(robot.at("late"), 2);
  EXPECT_EQ(robot.at("mode"), "T1");
  EXPECT_TRUE(robot.at("override_percent").is_null()) << "the link does not tell";
  EXPECT_DOUBLE_EQ(robot.at("jitter_ms"), 0.3);
  EXPECT_DOUBLE_EQ(robot.at("reply_ms").at("p99"), 0.1);
  const json& contact = links.at("contact");
  EXPECT_EQ(contact.at("firmware"), "1.2.3");
  EXPECT_EQ(contact.at("uid"), "00000abc");
  EXPECT_EQ(contact.at("boot_id"), 42);
  EXPECT_EQ(contact.at("config_crc"), "2ad3");
  EXPECT_EQ(contact.at("frames"), 100);
  EXPECT_DOUBLE_EQ(contact.at("clock_sigma_us"), 20.0);
  EXPECT_DOUBLE_EQ(contact.at("round_trip_ms").at("min"), 0.5);
  EXPECT_DOUBLE_EQ(contact.at("late_ms").at("worst"), 40.0);
  EXPECT_DOUBLE_EQ(contact.at("late_ms").at("limit"), 25.0);
  EXPECT_EQ(contact.at("late_ms").at("over"), 0);
}

TEST(AStatus, HasNullForWhatASilentSensorHasNotSent) {
  LinkReport report;
  report.contact.quality.frames = 100;
  Status status;
  status.links = std::make_shared<const LinkReport>(report);
  const json contact = json::parse(status_to_json(status)).at("links").at("contact");
  for (const char* key :
       {"in_contact", "loop_ok", "round_trip_ms", "clock_sigma_us", "clock_drift_ppm", "sense_v"})
    EXPECT_TRUE(contact.at(key).is_null()) << key;
}

TEST_F(AnApi, KnowsItsResourcesAndTheirMethods) {
  EXPECT_EQ(ask("GET", "/").status, 404);
  EXPECT_EQ(ask("GET", "/v1/stat").status, 404);
  EXPECT_EQ(ask("GET", "/v1/run").status, 405);
  EXPECT_EQ(ask("DELETE", "/v1/sessions").status, 405);
  EXPECT_EQ(ask("POST", "/v1/status").status, 405);
}

TEST_F(AnApi, RefusesRunRequestsThatAreWrongInThemselves) {
  for (const char* body :
       {"", "{", "[]", "7", "null", "{\"cell\": 3}", "{}", "{\"cell\": \"/x\", \"colour\": 1}",
        "{\"cell\": \"/x\", \"touches\": \"many\"}", "{\"cell\": \"/x\", \"touches\": -4}",
        "{\"cell\": \"/x\", \"touches\": 4.5}", "{\"cell\": \"/x\", \"touches\": 1e300}",
        "{\"cell\": \"/x\\n/y\"}", "{\"cell\": \"/x\\u001b[2J\"}",
        "{\"cell\": \"/x\", \"touches\": 99999999999}",
        "{\"cell\": \"/x\", \"touches\": 18446744073709551615}",
        "{\"cell\": \"/x\", \"resume\": 1}"}) {
    const Response response = ask("POST", "/v1/run", body);
    EXPECT_EQ(response.status, 400) << body;
    EXPECT_FALSE(error(response).empty()) << body;
  }
  EXPECT_EQ(ask("POST", "/v1/run", std::string(60000, '[')).status, 400);
}

TEST(ARunRequest, IsReadWithAllItsKeys) {
  const RunRequest request = run_request(
      R"({"cell": "/c.toml", "kind": "check", "target": "S2", "calibration": 7, "mastered": ["A2", "A3"],
          "temperature_c": 21.5, "load": "L", "touches": 30, "goal_mm": 1, "region": "near", "find": true,
          "update": true, "accept_change": true, "check": 0, "seed": 2147483647, "resume": true})");
  EXPECT_EQ(request.cell, "/c.toml");
  EXPECT_EQ(request.kind, SessionKind::kCheck);
  EXPECT_EQ(request.target, "S2");
  EXPECT_EQ(request.calibration, 7);
  EXPECT_EQ(request.mastered, (std::vector<std::string>{"A2", "A3"}));
  EXPECT_EQ(request.temperature_c, 21.5);
  EXPECT_EQ(request.load, "L");
  EXPECT_EQ(request.fit_touches, 30);
  EXPECT_EQ(request.goal_mm, 1.0);
  EXPECT_EQ(request.region, "near");
  EXPECT_TRUE(request.find && request.update && request.accept_change && request.resume);
  EXPECT_EQ(request.check_touches, 0);
  EXPECT_EQ(request.seed, 2147483647u);
}

TEST_F(AnApi, RefusesRunRequestsWhoseFilesCannotBeUsed) {
  const Response relative = ask("POST", "/v1/run", R"({"cell": "cell.toml"})");
  EXPECT_EQ(relative.status, 422);
  EXPECT_NE(error(relative).find("absolute"), std::string::npos);
  const Response missing = ask("POST", "/v1/run", R"({"cell": "/nonexistent/cell.toml"})");
  EXPECT_EQ(missing.status, 422);
  EXPECT_NE(error(missing).find("/nonexistent/cell.toml"), std::string::npos) << error(missing);
  std::ofstream(dir / "bad.toml") << "format = \"cellcal.cell/1\"\nrobot = 3\n";
  const Response bad = ask("POST", "/v1/run", json{{"cell", (dir / "bad.toml").string()}}.dump());
  EXPECT_EQ(bad.status, 422);
  EXPECT_NE(error(bad).find("bad.toml"), std::string::npos) << error(bad);
  EXPECT_EQ(ask("POST", "/v1/run", R"({"cell": "/x", "touches": 3})").status, 422);
  EXPECT_TRUE(journal.sessions().empty()) << "nothing of it may begin a session";
}

TEST_F(AnApi, HasNothingToResumeAndNothingToAbort) {
  EXPECT_EQ(ask("POST", "/v1/run", R"({"resume": true})").status, 422);
  EXPECT_EQ(ask("POST", "/v1/abort").status, 409);
}

TEST_F(AnApi, DoesNotBeginWhereTheBackendCannotBePutTogether) {
  const std::string request = json{{"cell", CELLCAL_DEMO_CELL}}.dump();
  const Response response = ask("POST", "/v1/run", request);
  EXPECT_EQ(response.status, 422) << response.body;
  EXPECT_EQ(error(response), "no hardware in this test");
  EXPECT_TRUE(journal.sessions().empty());
  // And the next request is not refused as busy.
  EXPECT_EQ(ask("POST", "/v1/run", request).status, 422);
}

TEST_F(AnApi, ListsSessionsAndShowsOne) {
  const std::int64_t id = journal.begin({"/c/cell.toml", "c", "r", "r", "{}"}, "t0");
  journal.note(id, "t1", "bytes \xff of a device");
  journal.record(id, RecordEnd{Ending::kFailed, "no-contact: S2"}, "t2");
  const json list = json::parse(ask("GET", "/v1/sessions").body);
  ASSERT_EQ(list.size(), 1u);
  EXPECT_EQ(list[0]["state"], "failed");
  const json one = json::parse(ask("GET", "/v1/sessions/" + std::to_string(id)).body);
  EXPECT_EQ(one["failure"], "no-contact: S2");
  EXPECT_EQ(one["events"].size(), 1u);
  EXPECT_EQ(ask("GET", "/v1/sessions/1/report.html").status, 404);
}

TEST_F(AnApi, SaysWhereTheTimeOfASessionWent) {
  const std::int64_t id = journal.begin({"/c/cell.toml", "c", "r", "r", "{}"}, "t0");
  using enum Phase;
  journal.note(id, RecordChange{.change = {kPlanning, kTransit}, .clock_s = 10.0});
  journal.note(id, RecordChange{.change = {kTransit, kRecording}, .clock_s = 12.0});
  journal.note(id, RecordChange{.change = {kRecording, kRetreat}, .clock_s = 12.25});
  journal.record(id, RecordEnd{Ending::kFailed, "no-contact: S2"}, "2026-01-01T00:00:03.000Z");
  const json times = json::parse(ask("GET", "/v1/sessions/1").body)["times"];
  EXPECT_EQ(times["touches"], 1);
  EXPECT_DOUBLE_EQ(times["total_s"], 2.25);
  ASSERT_EQ(times["activities"].size(), 8u);
  EXPECT_EQ(times["activities"][0]["activity"], "transit and retreat");
  EXPECT_EQ(times["activities"][0]["driver"], "axis limits");
  EXPECT_EQ(times["activities"][0]["count"], 1);
  EXPECT_DOUBLE_EQ(times["activities"][0]["total_s"], 2.0);
}

TEST_F(AnApi, NeverLetsARequestNameAFile) {
  journal.begin({"/c/cell.toml", "c", "r", "r", "{}"}, "t0");
  for (const char* target :
       {"/v1/sessions/0", "/v1/sessions/0/report.html", "/v1/sessions/2", "/v1/sessions/-1",
        "/v1/sessions/", "/v1/sessions/1/", "/v1/sessionsX", "/v1/sessions/1/../../journal.db",
        "/v1/sessions/1/journal.db", "/v1/sessions/1%2f..", "/v1/sessions/99999999999999999999",
        "/v1/sessions/1x/report.html", "/v1/sessions//etc/passwd"}) {
    EXPECT_EQ(ask("GET", target).status, 404) << target;
  }
}

TEST_F(AnApi, GivesTheTouchesOfAnUnfinishedSession) {
  const std::string robot = R"(format = "cellcal.robot/1"
name = "n"
source = "s"
gravity = [0.0, 0.0, -9.81]
[tolerance]
length_mm = 0.7
angle_deg = 0.035
[[joint]]
name = "A1"
sign = 1
offset_deg = 0.0
d_mm = 0.0
a_mm = 0.0
alpha_deg = 0.0
beta_deg = 0.0
errors = []
min_deg = -90.0
max_deg = 90.0
max_speed_deg_s = 100.0
)";
  const std::string cell = R"(format = "cellcal.cell/1"
robot = "r.toml"
[tool]
xyz_mm = [0.0, 0.0, 100.0]
[[target]]
id = "S1"
kind = "sphere"
diameter_mm = 50.0
[touch]
sigma_mm = 0.03
)";
  const std::int64_t id = journal.begin({"c.toml", cell, "r.toml", robot, "{}"}, "t0");
  calib::Touch touch;
  touch.joint_rad = {0.5};
  touch.target = "S1";
  journal.record(id, RecordTouch{0, touch});
  const Response csv = ask("GET", "/v1/sessions/1/touches.csv");
  EXPECT_EQ(csv.status, 200) << csv.body;
  EXPECT_EQ(csv.type, "text/csv");
  EXPECT_NE(csv.body.find("S1"), std::string::npos);
}

TEST_F(AnApi, WaitsForNewsUnlessThereAreSome) {
  EXPECT_FALSE(api.answer(local("GET", "/v1/watch?since=0"), false));
  const Response late = *api.answer(local("GET", "/v1/watch?since=0"), true);
  EXPECT_EQ(late.status, 200);
  EXPECT_EQ(late.body, "");
  for (const char* since : {"x", "-1", "1e3", "99999999999999999999", "%2d1"}) {
    EXPECT_EQ(ask("GET", std::string("/v1/watch?since=") + since).status, 400) << since;
  }
}

TEST(ATarget, IsSplitAtItsMarks) {
  const Request request = parse_target("GET", "/a/b?x=1&y=&z&x=2", "body");
  EXPECT_EQ(request.path, "/a/b");
  EXPECT_EQ(request.query.at("x"), "1");
  EXPECT_EQ(request.query.at("y"), "");
  EXPECT_EQ(request.query.at("z"), "");
  EXPECT_EQ(request.body, "body");
  EXPECT_EQ(parse_target("GET", "?", "").path, "");
}

}  // namespace
}  // namespace cellcal::daemon
