// The API compared with its description.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "calib/files/input_file.h"
#include "daemon/api/access.h"
#include "daemon/api/handlers.h"
#include "daemon/archive/archive.h"
#include "daemon/cell_form/cell_form.h"
#include "daemon/controller/frame_station.h"
#include "daemon/doctor/examiner.h"
#include "daemon/doctor/steps.h"
#include "daemon/plant/desk/proposal_box.h"
#include "daemon/report/report.h"
#include "daemon/tasks/options.h"
#include "daemon/unattended/schedule.h"
#include "daemon/unattended/service_session_gateway.h"
#include "tests/daemon/api/schema.h"
#include "tests/daemon/api/without_hardware.h"
#include "tests/daemon/archive/checked_journal.h"

namespace cellcal::daemon {
namespace {

using nlohmann::json;
using testing::Description;

const Description& described() {
  static const Description description(CELLCAL_OPENAPI);
  return description;
}

std::string lower(std::string text) {
  for (char& letter : text) letter = static_cast<char>(std::tolower(letter));
  return text;
}

TEST(TheDescription, NamesEveryRouteOfTheTableWithItsRoleAndNoOther) {
  std::set<std::string> there, documented;
  for (const Api::Route& route : Api::routes()) {
    there.insert(lower(route.method) + " " + route.path + " " + to_string(route.role));
  }
  for (const auto& [path, methods] : described().document().at("paths").items()) {
    for (const auto& [method, operation] : methods.items()) {
      documented.insert(method + " " + path + " " + operation.at("x-role").get<std::string>());
    }
  }
  EXPECT_EQ(there, documented);
}

TEST(TheDescription, SaysOfEveryParameterInAPathWhatItIs) {
  for (const auto& [path, methods] : described().document().at("paths").items()) {
    const std::size_t open = path.find('{');
    if (open == std::string::npos) continue;
    const std::string name = path.substr(open + 1, path.find('}') - open - 1);
    for (const auto& [method, operation] : methods.items()) {
      const json& parameters = operation.at("parameters");
      EXPECT_TRUE(std::any_of(parameters.begin(), parameters.end(), [&](const json& one) {
        return one.at("name") == name && one.at("in") == "path";
      })) << path;
    }
  }
}

TEST(TheDescription, RefersToWhatItDescribes) {
  const json& schemas = described().document().at("components").at("schemas");
  const std::string text = described().document().dump();
  const std::string mark = "#/components/schemas/";
  for (std::size_t at = text.find(mark); at != std::string::npos; at = text.find(mark, at + 1)) {
    const std::size_t from = at + mark.size();
    const std::string name = text.substr(from, text.find('"', from) - from);
    EXPECT_TRUE(schemas.contains(name)) << name;
  }
}

struct ADescribedApi : ::testing::Test, testing::WithoutHardware {
  static ScheduleConfig nightly() {
    ScheduleConfig config;
    ScheduledSession always;
    always.name = "always";
    always.window.to_min = 23 * 60 + 59;
    config.sessions = {always, always};
    config.sessions[1].name = "check";
    config.sessions[1].on_request = true;
    return config;
  }
  void SetUp() override { api.schedule = &schedule; }
  /// Sends a request, and checks the answer against the description.
  Response ask(const std::string& method, const std::string& target, const std::string& body = "",
               std::string described_path = "") {
    Request request = parse_target(method, target, body);
    EXPECT_FALSE(api.admit_local(request));
    Response response = *api.answer(request);
    if (described_path.empty()) described_path = request.path;
    const json& operation = described().document().at("paths").at(described_path).at(lower(method));
    const std::string code = std::to_string(response.status);
    const json& answers = operation.at("responses");
    EXPECT_TRUE(answers.contains(code) || response.status >= 400) << method << target << code;
    const json& answer = answers.contains(code) ? answers.at(code) : answers.at("default");
    EXPECT_TRUE(answer.at("content").contains(response.type)) << method << target << response.type;
    if (response.type == "application/json") {
      const json& schema = answer.at("content").at(response.type).at("schema");
      EXPECT_EQ(described().complaint(json::parse(response.body), schema), "") << method << target;
    }
    seen.insert(lower(method) + " " + described_path);
    return response;
  }

  TokenStore tokens{dir / "tokens.json"};
  Access access{tokens, {}};
  Examiner examiner{
      {[](const std::filesystem::path&, Findings& findings, const auto&, std::stop_token) {
         findings.warn("plan", "A4 travels far", "widen it");
         findings.fail("rsi packets", "none", "start it");
       },
       [this] { service.hold("the doctor is looking"); }, [this] { service.release(); },
       [] { return "t"; }, [] { return std::string("c"); }}};
  ScheduleConfig config = nightly();
  ServiceSessionGateway gateway{service, journal};
  Schedule schedule{{gateway,
                     {[this] { return journal.schedule(); },
                      [this](const std::string& state) { journal.store_schedule(state); }},
                     [this] { return config; },
                     {[] { return UtcSeconds{1'800'000'000}; }, std::chrono::steady_clock::now,
                      "boot", [] { return true; }},
                     {}}};
  plant::ProposalBox proposals{
      {dir.path(), [](const plant::Proposal&, const plant::Say&) { throw BusyError("later"); },
       [](const plant::AnswerFact&, plant::Worth) {}, [](plant::ProposalKind) { return false; }}};
  /// A controller with one frame, TOOL_DATA[3].
  drivers::EkiFrameValues on_controller{59.9, 50.5, 410.3, 38.84, 3.59, 0.0};
  drivers::EkiFrameEnd next_set = drivers::EkiFrameEnd::kSet;
  bool sets_frames = false;
  drivers::EkiFrameResult exchange(const drivers::EkiFrameRequest& request,
                                   const drivers::EkiFrameChoice& choice) {
    drivers::EkiFrameResult result;
    if (request.number != 3) {
      result.end = drivers::EkiFrameEnd::kRefused;
      result.refusal = drivers::EkiFrameDone::kNoSuchNumber;
      return result;
    }
    const auto values = choice ? choice(on_controller) : std::nullopt;
    result.end = values ? next_set : drivers::EkiFrameEnd::kRead;
    result.old_values = on_controller;
    if (values) on_controller = *values;
    if (result.end != drivers::EkiFrameEnd::kUnknown) result.new_values = on_controller;
    return result;
  }
  FrameStation frames{{dir / "frames.json",
                       [this] {
                         return sets_frames
                                    ? FrameStation::Exchange([this](const auto& r, const auto& c) {
                                        return exchange(r, c);
                                      })
                                    : FrameStation::Exchange();
                       },
                       [] { return std::string("t"); }}};
  Api api{service, journal, &access, {}, &examiner};
  std::set<std::string> seen;
};

TEST_F(ADescribedApi, AnswersAsItIsDescribed) {
  SessionInputs inputs = read_inputs(CELLCAL_DEMO_CELL);
  inputs.options = options_to_json({});
  const std::int64_t id = journal.begin(inputs, "t0");
  journal.note(id, "2026-01-01T00:00:00.000Z", "planning -> transit on planned");
  calib::Touch touch;
  touch.joint_rad = {0.1, -1.5, 1.5, 0.1, 1.2, 0.0};
  touch.target = "S1";
  journal.record(id, RecordTouch{0, touch});
  journal.record(id, RecordEnd{Ending::kFailed, "no-contact: S2"}, "2026-01-01T00:00:03.000Z");

  EXPECT_EQ(ask("GET", "/v1/health").status, 200);
  EXPECT_EQ(ask("GET", "/v1/me").status, 200);
  EXPECT_EQ(ask("GET", "/metrics").status, 200);
  EXPECT_EQ(ask("POST", "/v1/login", R"({"token": "x"})").status, 409);
  EXPECT_EQ(ask("POST", "/v1/logout").status, 200);
  EXPECT_EQ(ask("GET", "/v1/status").status, 200);
  EXPECT_EQ(ask("GET", "/v1/watch?since=0").status, 200);
  EXPECT_EQ(ask("GET", "/v1/events").status, 200);
  EXPECT_EQ(ask("GET", "/v1/events?since=x").status, 400);
  EXPECT_EQ(ask("POST", "/v1/run", "{}").status, 400);
  EXPECT_EQ(ask("POST", "/v1/run", R"({"cell": "/nonexistent"})").status, 422);
  EXPECT_EQ(ask("POST", "/v1/abort").status, 409);
  EXPECT_EQ(ask("POST", "/v1/clear").status, 200);
  schedule.update();
  const json shown = json::parse(ask("GET", "/v1/schedule").body);
  EXPECT_EQ(shown["entries"][0]["last"]["why"], "unattended-off");
  EXPECT_FALSE(shown["entries"][0]["now"].is_null());
  EXPECT_EQ(ask("POST", "/v1/schedule/begin", R"({"name": "check"})").status, 409);
  EXPECT_EQ(ask("POST", "/v1/schedule/begin", R"({"name": 1})").status, 400);
  EXPECT_EQ(ask("POST", "/v1/schedule/release").status, 200);
  EXPECT_EQ(ask("GET", "/v1/sessions").status, 200);
  EXPECT_EQ(ask("GET", "/v1/sessions?limit=1&before=9").status, 200);
  EXPECT_EQ(ask("GET", "/v1/sessions?limit=0").status, 400);
  const std::string one = "/v1/sessions/1";
  EXPECT_EQ(ask("GET", one, "", "/v1/sessions/{id}").status, 200);
  EXPECT_EQ(ask("GET", "/v1/sessions/2", "", "/v1/sessions/{id}").status, 404);
  EXPECT_EQ(ask("GET", one + "/touches", "", "/v1/sessions/{id}/touches").status, 200);
  EXPECT_EQ(ask("GET", one + "/events", "", "/v1/sessions/{id}/events").status, 200);
  EXPECT_EQ(ask("GET", one + "/touches.csv", "", "/v1/sessions/{id}/touches.csv").status, 200);
  EXPECT_EQ(ask("GET", one + "/figures", "", "/v1/sessions/{id}/figures").status, 200);
  EXPECT_EQ(ask("GET", one + "/plots", "", "/v1/sessions/{id}/plots").status, 404);
  EXPECT_EQ(ask("GET", one + "/plan", "", "/v1/sessions/{id}/plan").status, 404);
  EXPECT_EQ(ask("GET", "/v1/scene").status, 200);
  EXPECT_EQ(ask("GET", "/v1/drift").status, 200);
  EXPECT_EQ(ask("GET", "/v1/readiness").status, 200);
  EXPECT_EQ(ask("GET", "/v1/doctor").status, 200);
  EXPECT_EQ(ask("POST", "/v1/doctor", R"({"cell": "cell.toml"})").status, 422);
  EXPECT_EQ(ask("POST", "/v1/doctor", "{}").status, 400);
  const std::string cell = json{{"cell", CELLCAL_DEMO_CELL}}.dump();
  EXPECT_EQ(ask("POST", "/v1/doctor", cell).status, 202);
  examiner.stop();
  EXPECT_EQ(ask("GET", "/v1/doctor").status, 200);
  json result{{"cell", CELLCAL_DEMO_CELL},
              {"cell_sha256", calib::sha256(text_of_cell(CELLCAL_DEMO_CELL))},
              {"config_sha256", "c"},
              {"checks", {{{"check", "plan"}, {"outcome", "ok"}, {"found", "f"}, {"advice", ""}}}}};
  EXPECT_EQ(ask("POST", "/v1/doctor/result", result.dump()).status, 200);
  EXPECT_EQ(json::parse(ask("GET", "/v1/doctor").body).at("green"), true);
  result["checks"][0]["said"] = {
      {"found", {{"id", "say.doctor.circuit.open"}, {"values", {{"volts", 5.0}}}}}, {"advice", ""}};
  EXPECT_EQ(ask("POST", "/v1/doctor/result", result.dump()).status, 200);
  const json german = json::parse(ask("GET", "/v1/doctor?language=de", "", "/v1/doctor").body);
  EXPECT_EQ(german.at("checks")[0].at("found"), "5,00 V, offen; Leitungen F, S und E in Ordnung");
  EXPECT_EQ(ask("GET", "/v1/doctor?language=tlh", "", "/v1/doctor").status, 400);
  result["config_sha256"] = "d";
  EXPECT_EQ(ask("POST", "/v1/doctor/result", result.dump()).status, 409) << "another configuration";
  result["config_sha256"] = "c";
  result["cell_sha256"] = "d";
  EXPECT_EQ(ask("POST", "/v1/doctor/result", result.dump()).status, 409) << "another cell file";
  result["checks"][0]["outcome"] = "fine";
  EXPECT_EQ(ask("POST", "/v1/doctor/result", result.dump()).status, 400);
  EXPECT_EQ(ask("GET", "/v1/readiness").status, 200);
  for (const char* file : {"touches.csv", "calibration.json", "qualification.json", "found.json",
                           "check.json", "report.html"}) {
    const std::string path = "/v1/sessions/{id}/" + std::string(file);
    EXPECT_EQ(ask("GET", "/v1/sessions/2/" + std::string(file), "", path).status, 404);
  }
  EXPECT_EQ(ask("GET", one + "/export", "", "/v1/sessions/{id}/export").status, 200);
  EXPECT_EQ(ask("GET", "/v1/sessions/2/export", "", "/v1/sessions/{id}/export").status, 404);
  const std::string file = nlohmann::json{{"file", (dir / "copy.db").string()}}.dump();
  EXPECT_EQ(ask("POST", "/v1/backup", file).status, 201);
  EXPECT_EQ(ask("POST", "/v1/backup", file).status, 422) << "it replaces nothing";
  EXPECT_EQ(ask("POST", "/v1/backup", R"({"file": "not absolute"})").status, 422);
  EXPECT_EQ(ask("POST", "/v1/retain", R"({"days": 1, "dry_run": true})").status, 200);
  EXPECT_EQ(ask("POST", "/v1/retain", "{}").status, 422);
  EXPECT_EQ(ask("POST", "/v1/retain", R"({"days": 0})").status, 400);
  EXPECT_EQ(ask("GET", "/v1/cell-form").status, 404) << "this daemon makes none";
  const CellFileStore shelf(dir / "cells");
  api.shelf = &shelf;
  EXPECT_EQ(ask("GET", "/v1/cell-form").status, 200);
  const std::string form =
      R"({"name": "weld", "form": {"robot": "kr5_r1400", "tool": {"xyz_mm": [60, 50, 410]}, "lengths": [], "spheres": [)"
      R"({"id": "S1", "diameter_mm": 50, "centre_mm": [900, 0, 400]}]}})";
  EXPECT_EQ(ask("POST", "/v1/cell-form", form).status, 201);
  EXPECT_EQ(ask("POST", "/v1/cell-form", form).status, 409) << "it is there";
  EXPECT_EQ(ask("POST", "/v1/cell-form", "{}").status, 422);
  json faulty = json::parse(form);
  faulty["name"] = "other";
  faulty["form"]["spheres"][0]["diameter_mm"] = -50;
  const Response refused = ask("POST", "/v1/cell-form", faulty.dump());
  EXPECT_EQ(refused.status, 422);
  EXPECT_EQ(json::parse(refused.body).at("key"), "spheres.0.diameter_mm") << refused.body;
  faulty["name"] = "../other";
  EXPECT_EQ(json::parse(ask("POST", "/v1/cell-form", faulty.dump()).body).at("key"), "name");
  EXPECT_EQ(ask("POST", "/v1/cell-form", R"({"more": 1})").status, 400);
  EXPECT_EQ(ask("POST", "/v1/cell-form/lists", R"({"spheres": "id,diameter_mm\nS1,50\n"})").status,
            200);
  EXPECT_EQ(ask("POST", "/v1/cell-form/lists", R"({"spheres": "id,diameter_mm\nS1,x\n"})").status,
            422);
  std::string machine = calib::read_file(CELLCAL_MACHINE_DATA);
  EXPECT_EQ(ask("POST", "/v1/cell-form/robot", json{{"machine_data", machine}}.dump()).status, 422)
      << "no speeds";
  for (int axis = 1; axis <= 6; ++axis)
    machine += "\n$RAT_MOT_AX[" + std::to_string(axis) + "]={N 100,D 1}";
  const auto imported =
      ask("POST", "/v1/cell-form/robot", nlohmann::json{{"machine_data", machine}}.dump());
  ASSERT_EQ(imported.status, 201) << imported.body;
  const auto robot = json::parse(imported.body);
  EXPECT_TRUE(std::filesystem::exists(robot.at("name").get<std::string>())) << robot;
  const auto robots = json::parse(ask("GET", "/v1/cell-form").body).at("robots");
  EXPECT_EQ(std::ranges::count(robots, robot), 1) << robots;
  auto of_it = json::parse(form);
  of_it["name"] = "imported";
  of_it["form"]["robot"] = robot.at("name");
  EXPECT_EQ(ask("POST", "/v1/cell-form", of_it.dump()).status, 201);
  of_it["form"]["robot"] = (dir / "other.robot.toml").string();
  std::filesystem::copy_file(robot.at("name").get<std::string>(), dir / "other.robot.toml");
  EXPECT_EQ(ask("POST", "/v1/cell-form", of_it.dump()).status, 422) << "not in the cells' folder";
  EXPECT_FALSE(robot.contains("linear_unit"));
  const auto carried =
      ask("POST", "/v1/cell-form/robot",
          nlohmann::json{{"machine_data", machine + "\n$EX_KIN={ET1 #ERSYS,ET2 #NONE}"}}.dump());
  ASSERT_EQ(carried.status, 201) << carried.body;
  EXPECT_NE(
      json::parse(carried.body).at("linear_unit").at("missing").get<std::string>().find("$ET1_AX"),
      std::string::npos)
      << carried.body;
  const std::string on_unit =
      machine +
      "\n$EX_AX_NUM=1\n$AXIS_TYPE[7]=1\n$SOFTN_END[7]=-10.0\n$SOFTP_END[7]=3000.0\n"
      "$EX_KIN={ET1 #ERSYS,ET2 #NONE}\n$ET1_AX={TR_A1 #E1,TR_A2 #NONE,TR_A3 #NONE}\n"
      "$ET1_TA1KR={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C -90.0}\n"
      "$ET1_TFLA3={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 90.0}";
  const auto with_unit =
      ask("POST", "/v1/cell-form/robot",
          nlohmann::json{{"machine_data", on_unit}, {"unit_speed_mm_s", 1500.0}}.dump());
  ASSERT_EQ(with_unit.status, 201) << with_unit.body;
  const auto unit = json::parse(with_unit.body).at("linear_unit");
  EXPECT_EQ(unit.at("name"), "E1");
  EXPECT_EQ(unit.at("along"), (json{0.0, 1.0, 0.0}));
  EXPECT_EQ(unit.at("max_mm"), 3000.0);
  EXPECT_EQ(unit.at("max_speed_mm_s"), 1500.0);
  of_it["name"] = "on_unit";
  of_it["form"]["robot"] = json::parse(with_unit.body).at("name");
  EXPECT_EQ(ask("POST", "/v1/cell-form", of_it.dump()).status, 201);
  EXPECT_EQ(ask("POST", "/v1/cell-form/scene", json{{"form", of_it["form"]}}.dump()).status, 200);
  EXPECT_EQ(
      json::parse(ask("POST", "/v1/cell-form/robot", json{{"machine_data", on_unit}}.dump()).body)
          .at("linear_unit")
          .at("max_speed_mm_s"),
      nullptr);
  for (const json& speed : {json(0), json(-1.0), json(1e5), json("1500"), json()})
    EXPECT_EQ(ask("POST", "/v1/cell-form/robot",
                  json{{"machine_data", on_unit}, {"unit_speed_mm_s", speed}}.dump())
                  .status,
              400)
        << speed;
  EXPECT_EQ(ask("POST", "/v1/cell-form/robot", R"({"machine_data": "$LENGTH_A=inf"})").status, 422);
  EXPECT_EQ(ask("POST", "/v1/cell-form/robot", R"({"machine_data": ""})").status, 400);
  EXPECT_EQ(ask("POST", "/v1/cell-form/robot", R"({"machine_data": 1})").status, 400);
  const std::string robot_file = calib::read_file(robot.at("name").get<std::string>());
  EXPECT_EQ(ask("POST", "/v1/cell-form/robot", json{{"robot_file", robot_file}}.dump()).status,
            201);
  EXPECT_EQ(ask("POST", "/v1/cell-form/robot", R"({"robot_file": "robot = 3"})").status, 422);
  const std::string stl =
      "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 90 0 0\nvertex 0 90 0\nendloop\n"
      "endfacet\nendsolid\n";
  const auto mesh = ask("POST", "/v1/cell-form/mesh", stl);
  ASSERT_EQ(mesh.status, 201) << mesh.body;
  EXPECT_EQ(ask("POST", "/v1/cell-form/mesh", "<html>").status, 422);
  json drawn = {{"form", json::parse(form).at("form")}};
  drawn["form"]["obstacles"] = {{{"id", "fixture"},
                                 {"shape", "mesh"},
                                 {"file", json::parse(mesh.body).at("file")},
                                 {"xyz_mm", {900, 0, 100}}}};
  const auto sketch = ask("POST", "/v1/cell-form/scene", drawn.dump());
  ASSERT_EQ(sketch.status, 200) << sketch.body;
  EXPECT_EQ(json::parse(sketch.body).at("scene").at("obstacles").at(0).at("shape"), "mesh");
  EXPECT_EQ(json::parse(sketch.body).at("joints_deg").size(), 6U);
  EXPECT_EQ(ask("POST", "/v1/cell-form/scene", R"({"form": {}})").status, 422);
  EXPECT_EQ(ask("POST", "/v1/cell-form/scene", R"({"form": {}, "more": 1})").status, 400);
  drawn["form"]["spheres"] = json::array();
  EXPECT_EQ(ask("POST", "/v1/cell-form/places", drawn.dump()).status, 422) << "no sphere";
  drawn["form"]["spheres"] = {{{"id", "S1"}, {"diameter_mm", 50}},
                              {{"id", "S2"}, {"diameter_mm", 40}}};
  const auto places = ask("POST", "/v1/cell-form/places", drawn.dump());
  ASSERT_EQ(places.status, 200) << places.body;
  EXPECT_EQ(json::parse(places.body).at("spheres").at(1).at("diameter_mm"), 40);
  const std::string elsewhere = calib::read_file(CELLCAL_DEMO_CELL);
  const auto opened = ask("POST", "/v1/cell-form/read", json{{"cell", elsewhere}}.dump());
  ASSERT_EQ(opened.status, 200) << opened.body;
  EXPECT_EQ(json::parse(opened.body).at("missing"), json{"kr5_worn.toml"});
  EXPECT_EQ(ask("POST", "/v1/cell-form/read", R"({"cell": "x = "})").status, 422);
  json from_text = {
      {"name", "opened"}, {"form", json::parse(opened.body).at("form")}, {"from_text", elsewhere}};
  from_text["form"]["robot"] = "kr5_r1400";
  EXPECT_EQ(ask("POST", "/v1/cell-form", from_text.dump()).status, 201);
  from_text["from"] = "/c/cell.toml";
  EXPECT_EQ(ask("POST", "/v1/cell-form", from_text.dump()).status, 400) << "one of both";
  EXPECT_EQ(ask("POST", "/v1/position", "").status, 404);
  bool over_eki = false;
  drivers::EkiPosition position;
  api.position = [&]() -> Api::ReadPosition {
    if (!over_eki) return {};
    return [&] { return position; };
  };
  EXPECT_EQ(ask("POST", "/v1/position", "").status, 404) << "it is driven over RSI";
  over_eki = true;
  position.axes_deg.assign(6, 12.5);
  const Response read = ask("POST", "/v1/position", "");
  EXPECT_EQ(read.status, 200);
  EXPECT_EQ(json::parse(read.body).at("axes_deg").size(), 6U);
  EXPECT_TRUE(json::parse(ask("GET", "/v1/cell-form").body).at("reads_position").get<bool>());
  position = {};
  position.trouble = drivers::EkiPositionTrouble::kMoves;
  EXPECT_EQ(ask("POST", "/v1/position", "").status, 409);
  AdviceStatus advice;
  api.advice = [&] { return advice; };
  EXPECT_TRUE(json::parse(ask("GET", "/v1/drift").body).at("controller").is_null());
  advice.configured = true;
  advice.trouble = "no connection";
  EXPECT_TRUE(json::parse(ask("GET", "/v1/drift").body)["controller"]["value"].is_null());
  advice = {true, Advice::kRecalibrate, "2026-01-01T00:00:00.000Z", ""};
  EXPECT_EQ(json::parse(ask("GET", "/v1/drift").body)["controller"]["value"], 5);
  EXPECT_EQ(ask("GET", "/v1/frames").status, 404);
  api.frames = &frames;
  const std::string read_frame = R"({"frame": "TOOL_DATA[3]"})";
  EXPECT_EQ(ask("POST", "/v1/frames/read", read_frame).status, 404)
      << "the configuration allows none";
  sets_frames = true;
  EXPECT_EQ(ask("POST", "/v1/frames/read", read_frame).status, 200);
  EXPECT_EQ(ask("POST", "/v1/frames/read", R"({"frame": "TOOL_DATA[4]"})").status, 409);
  EXPECT_EQ(ask("POST", "/v1/frames/read", R"({"frame": "LOAD_DATA[4]"})").status, 400);
  json order{{"frame", "TOOL_DATA[3]"},
             {"values", {{"xyz_mm", {60.1, 50.2, 410.4}}, {"abc_deg", {38.84, 3.59, 0.0}}}},
             {"was", {{"xyz_mm", {59.9, 50.5, 410.3}}, {"abc_deg", {38.84, 3.59, 0.0}}}},
             {"reason", "calibration 7"}};
  EXPECT_EQ(ask("POST", "/v1/frames", order.dump()).status, 400) << "not confirmed";
  for (const char* yes : {"1", "\"yes\"", "false", "null"}) {
    order["confirm"] = json::parse(yes);
    EXPECT_EQ(ask("POST", "/v1/frames", order.dump()).status, 400) << yes;
  }
  order["confirm"] = true;
  for (const char* values : {"[]", "{}", R"({"xyz_mm": [1, 2], "abc_deg": [1, 2, 3]})",
                             R"({"xyz_mm": [1, 2, "3"], "abc_deg": [1, 2, 3]})",
                             R"({"xyz_mm": [1, 2, null], "abc_deg": [1, 2, 3]})",
                             R"({"xyz_mm": [1, 2, 3], "abc_deg": [1, 2, 3], "q": 1})"}) {
    json wrong = order;
    wrong["values"] = json::parse(values);
    EXPECT_EQ(ask("POST", "/v1/frames", wrong.dump()).status, 400) << values;
  }
  json far = order;
  far["values"]["xyz_mm"][2] = 150.0;
  EXPECT_EQ(ask("POST", "/v1/frames", far.dump()).status, 422) << "another tool's number";
  EXPECT_EQ(ask("POST", "/v1/frames", order.dump()).status, 201);
  EXPECT_EQ(ask("POST", "/v1/frames", order.dump()).status, 409) << "it is another one by now";
  next_set = drivers::EkiFrameEnd::kUnknown;
  EXPECT_EQ(ask("POST", "/v1/frames/restore", R"({"id": 1, "confirm": true})").status, 502);
  next_set = drivers::EkiFrameEnd::kSet;
  EXPECT_EQ(ask("POST", "/v1/frames/restore", R"({"id": 1, "confirm": true})").status, 201);
  EXPECT_EQ(on_controller[0], 59.9);
  EXPECT_EQ(ask("POST", "/v1/frames/restore", R"({"id": 9, "confirm": true})").status, 404);
  EXPECT_EQ(ask("POST", "/v1/frames/restore", R"({"id": 1})").status, 400);
  EXPECT_EQ(ask("POST", "/v1/frames/restore", R"({"id": 1.5, "confirm": true})").status, 400);
  service.hold("a session is under way");
  EXPECT_EQ(ask("POST", "/v1/frames/read", read_frame).status, 409);
  EXPECT_EQ(ask("POST", "/v1/frames/restore", R"({"id": 1, "confirm": true})").status, 409);
  const std::string other = "{\"name\": \"other\"," + form.substr(form.find(',') + 1);
  EXPECT_EQ(ask("POST", "/v1/cell-form", other).status, 409);
  EXPECT_FALSE(std::filesystem::exists(shelf.file("other")));
  service.release();
  EXPECT_EQ(ask("POST", "/v1/cell-form", other).status, 201) << "it was for the session alone";
  const json sent = json::parse(ask("GET", "/v1/frames").body);
  EXPECT_EQ(sent["frames"].size(), 3U);
  EXPECT_EQ(sent["frames"][1]["outcome"], "unknown");
  EXPECT_EQ(sent["frames"][0]["before"]["xyz_mm"][0], 59.9);
  EXPECT_EQ(ask("GET", "/v1/plant").status, 404) << "it belongs to no plant";
  api.plant_line = [] {
    const plant::LineStatus line{false, plant::LineProblem::kLogin, "login refused",
                                 "2026-01-01T00:00:00.000Z", 7};
    return plant::LinesStatus{line, line};
  };
  EXPECT_EQ(ask("GET", "/v1/plant").status, 200);
  const auto certify = [&](const std::string& of, const char* body) {
    return ask("POST", "/v1/sessions/" + of + "/certificate", body, "/v1/sessions/{id}/certificate")
        .status;
  };
  EXPECT_EQ(certify(std::to_string(id), R"({"certificate": "1-0", "files": []})"), 422)
      << "it has no calibration";
  EXPECT_EQ(certify(std::to_string(id), "{}"), 400);
  EXPECT_EQ(certify("99", R"({"certificate": "1-0", "files": []})"), 404);
  EXPECT_EQ(ask("GET", "/metrics").status, 200);
  EXPECT_EQ(json::parse(ask("GET", "/v1/proposals").body).at("proposals").size(), 0u)
      << "it belongs to no plant";
  api.proposals = &proposals;
  proposals.take(
      {{"graz", "weld-3"}, "p-1", plant::ProposalKind::kActivate, 7, "", "M. Huber", "drift", "t"},
      "t0");
  proposals.take({{"graz", "weld-3"},
                  "p-2",
                  plant::ProposalKind::kPriors,
                  0,
                  "a = 1",
                  "M. Huber",
                  "more arms",
                  "t"},
                 "t0");
  EXPECT_EQ(ask("GET", "/v1/proposals").status, 200);
  const auto say = [&](const char* which, const std::string& verb, const char* body) {
    return ask("POST", "/v1/proposals/" + std::string(which) + "/" + verb, body,
               "/v1/proposals/{id}/" + verb);
  };
  EXPECT_EQ(say("p-1", "accept", "").status, 409) << "a session is under way";
  EXPECT_EQ(say("p-3", "accept", "").status, 404);
  EXPECT_EQ(say("p-2", "refuse", "{}").status, 400) << "without a reason";
  EXPECT_EQ(say("p-2", "accept", R"({"session": 3})").status, 400);
  EXPECT_EQ(json::parse(say("p-2", "accept", R"({"by": "anna"})").body)["stand"], "accepted");
  EXPECT_EQ(say("p-2", "accept", "").status, 409) << "it was decided before";
  EXPECT_EQ(json::parse(say("p-1", "refuse", R"({"reason": "no"})").body)["stand"], "refused");
  EXPECT_EQ(ask("GET", "/v1/versions").status, 200);
  EXPECT_EQ(ask("GET", "/v1/versions?limit=0").status, 400);
  EXPECT_EQ(ask("GET", "/v1/versions/compare?before=1&after=99").status, 422);
  EXPECT_EQ(ask("GET", "/v1/versions/compare?before=98&after=99").status, 404);
  EXPECT_EQ(ask("GET", "/v1/versions/compare?before=1").status, 400);
  EXPECT_EQ(ask("POST", "/v1/versions/activate", R"({"session": 1, "reason": "cold"})").status,
            422);
  EXPECT_EQ(ask("POST", "/v1/versions/activate", R"({"session": 99, "reason": "cold"})").status,
            404);
  EXPECT_EQ(
      ask("POST", "/v1/versions/activate", R"({"session": 1, "reason": "cold", "by": "anna"})")
          .status,
      422);
  for (const char* wrong :
       {R"({"session": 1})", R"({"session": 1, "reason": " "})",
        R"({"session": 1, "reason": "a\nb"})", R"({"session": "1", "reason": "a"})",
        R"({"session": 1, "reason": "a", "by": ""})", R"({"session": 0, "reason": "a"})", "[]", "",
        R"({"session": 1, "reason": "a", "who": "me"})"})
    EXPECT_EQ(ask("POST", "/v1/versions/activate", wrong).status, 400) << wrong;
  EXPECT_EQ(ask("POST", "/v1/versions/roll-back", R"({"reason": "cold"})").status, 422);
  EXPECT_EQ(ask("POST", "/v1/versions/roll-back", "{}").status, 400);
  write_archive(make_archive(journal, id, dir / "results"), dir / "e");
  const std::string directory = nlohmann::json{{"directory", (dir / "e").string()}}.dump();
  EXPECT_EQ(ask("POST", "/v1/import", directory).status, 201);
  EXPECT_EQ(ask("POST", "/v1/import", "[]").status, 422);
  EXPECT_EQ(ask("POST", "/v1/tokens", R"({"name": "a", "role": "look"})").status, 201);
  EXPECT_EQ(ask("POST", "/v1/tokens", R"({"name": "a", "role": "look"})").status, 409);
  EXPECT_EQ(ask("POST", "/v1/tokens", R"({"name": "a", "role": "root"})").status, 400);
  EXPECT_EQ(ask("GET", "/v1/tokens").status, 200);
  EXPECT_EQ(ask("DELETE", "/v1/tokens/a", "", "/v1/tokens/{name}").status, 200);
  EXPECT_EQ(ask("DELETE", "/v1/tokens/a", "", "/v1/tokens/{name}").status, 404);
  EXPECT_EQ(seen.size(), Api::routes().size()) << "a route was not asked";
}

TEST(ADescribedChart, IsAsItIsDescribedFromTooFewChecksToAnAlarm) {
  testing::CheckedJournal checked;
  SessionService service{{checked.journal, checked.dir.path(), {}, {}}};
  Api api(service, checked.journal);
  const auto answer = [&](const char* path) {
    Request request = parse_target("GET", path, "");
    EXPECT_FALSE(api.admit_local(request));
    return api.answer(request)->body;
  };
  const auto state = [&] {
    const json drift = json::parse(answer("/v1/drift"));
    EXPECT_EQ(described().complaint(drift, std::string("Drift")), "");
    return drift.at("checks").at("state").get<std::string>();
  };
  EXPECT_EQ(state(), "too_few");
  for (int k = 0; k < 8; ++k) checked.check({.temperature_c = 20.0 + k});
  EXPECT_EQ(state(), "unknown") << "these checks are years old";
  checked.check({.result = testing::CheckedJournal::that_does_not_hold(calib::ChangeKind::kJoint)});
  EXPECT_EQ(state(), "alarms") << "also where the tool is not the cause";
  for (int k = 0; k < 2; ++k) checked.check({.shift_m = {0.5e-3, 0, 0}, .temperature_c = 21.0});
  EXPECT_EQ(state(), "alarms");
  checked.calibrate();
  const json next = json::parse(answer("/v1/drift?language=de"));
  EXPECT_EQ(described().complaint(next, std::string("Drift")), "");
  EXPECT_EQ(next.at("checks").at("others").at(0).at("points").size(), 11u);
  EXPECT_EQ(next.at("checks").at("events").at(0).at("words"), "Kalibrierung aus Sitzung 1");
  checked.journal.activate(
      {.session = 1, .time = "2026-03-01T00:00:00.000Z", .who = "anna", .reason = "test"});
  const std::string metrics = answer("/metrics");
  EXPECT_NE(metrics.find("cellcal_drift_state{state=\"alarms\"} 1\n"), std::string::npos)
      << metrics;
  EXPECT_NE(metrics.find("cellcal_drift_checks 10\n"), std::string::npos);
}

TEST(ADescribedComparison, OfTwoPublishedCalibrationsIsAsItIsDescribed) {
  testing::CheckedJournal checked;
  checked.calibrate();
  SessionService service{{checked.journal, checked.dir.path(), {}, {}}};
  Api api(service, checked.journal);
  Request request = parse_target("GET", "/v1/versions/compare?before=1&after=2", "");
  EXPECT_FALSE(api.admit_local(request));
  const Response answer = *api.answer(request);
  ASSERT_EQ(answer.status, 200) << answer.body;
  const json compared = json::parse(answer.body);
  EXPECT_EQ(described().complaint(compared, std::string("Comparison")), "");
  EXPECT_TRUE(compared.at("comparable").get<bool>());
}

TEST_F(ADescribedApi, GivesThePlotsThatASessionLeftInTheLanguageAskedFor) {
  journal.begin({"/c/cell.toml", "c", "r", "r", "{}"}, "t");
  EXPECT_EQ(ask("GET", "/v1/sessions/1/plots", "", "/v1/sessions/{id}/plots").status, 404);
  const std::filesystem::path results = service.results_dir(1);
  std::filesystem::create_directories(results);
  for (const std::string& code : calib::Language::codes()) {
    const calib::Language language = *calib::Language::of(code);
    std::ofstream(results / plots_name(language))
        << plots_json(1, {"<svg>" + code + "</svg>", {"<svg/>", "<svg/>"}, ""});
    const json plots = json::parse(
        ask("GET", "/v1/sessions/1/plots?language=" + code, "", "/v1/sessions/{id}/plots").body);
    EXPECT_EQ(described().complaint(plots, std::string("Plots")), "");
    EXPECT_EQ(plots.at("before_after"), "<svg>" + code + "</svg>");
    EXPECT_EQ(plots.at("by_joint").size(), 2u);
  }
}

TEST_F(ADescribedApi, GivesItsListsPageByPage) {
  for (int i = 0; i < 5; ++i) journal.begin({"/c/cell.toml", "c", "r", "r", "{}"}, "t");
  const json two = json::parse(ask("GET", "/v1/sessions?limit=2&before=4").body);
  ASSERT_EQ(two.size(), 2u);
  EXPECT_EQ(two[0]["id"], 3);
  EXPECT_EQ(json::parse(ask("GET", "/v1/sessions").body).size(), 5u);
  for (int i = 0; i < 7; ++i) journal.note(2, "t" + std::to_string(i), "words of it");
  const auto events = [&](const std::string& query) {
    return json::parse(
        ask("GET", "/v1/sessions/2/events" + query, "", "/v1/sessions/{id}/events").body);
  };
  std::string read;
  std::string query = "?limit=3";
  for (bool more = true; more;) {
    const json page = events(query);
    for (const json& one : page["events"]) read += one["time"].get<std::string>();
    more = page["more"];
    query = "?limit=3&after=" + std::to_string(page["events"].back()["index"].get<int>());
  }
  EXPECT_EQ(read, "t0t1t2t3t4t5t6");
  EXPECT_TRUE(events("?after=6")["events"].empty());
  EXPECT_TRUE(events("?after=9223372036854775807")["events"].empty());
  EXPECT_EQ(events("")["events"][0]["words"], "words of it");
  for (const char* wrong : {"?after=x", "?after=-1", "?limit=0", "?limit=1001",
                            "?limit=", "?after=99999999999999999999"}) {
    EXPECT_EQ(
        ask("GET", std::string("/v1/sessions/2/touches") + wrong, "", "/v1/sessions/{id}/touches")
            .status,
        400)
        << wrong;
  }
}

TEST(ADescribedStatus, HasNothingThatIsNotDescribedEvenWhereAllOfItIsThere) {
  Status status;
  status.residual_m = status.goal_m = status.u95_m = status.mean_error_m = status.time_left_s = 1.0;
  status.waiting = Waiting{true, false, 3.0, "start it"};
  status.failure = Failure{FailureKind::kUnexpectedEvent, "words"};
  SessionOutcome& outcome = status.outcome.emplace();
  outcome.tcp_shift = TcpShift{{1e-3, 0.0, 0.0}, 1e-4};
  outcome.change = calib::Explanation{.kind = calib::ChangeKind::kTouch, .name = "S1", .touch = 2};
  outcome.not_found = outcome.unsteady = {"S1"};
  outcome.spheres = {{"S1", {1.0, 0.0, 0.5}, 5e-3, 9, 1e-3}, {"S2", {1.0, 0.0, 0.5}, 5e-3, 9, {}}};
  outcome.not_as_stated = {QualificationFinding::kDelayNotAsStated};
  outcome.withheld_by = {calib::FindingKind::kNoGain};
  outcome.update = calib::UpdateOutcome::kNotResolved;
  status.reasons = {"a"};
  outcome.contacts = {"a text", {"say.qualify.stop", {{"ms", 1.0}, {"n", 2}}}};
  status.interrupted = InterruptedSession{1, 2, 3, "t", RecordState::kFailed, ""};
  status.interrupted->failure = FailureKind::kWindowOver;
  status.schedule = ScheduleSeen{"held", true, 1'800'000'000};
  status.links = std::make_shared<const LinkReport>();
  EXPECT_EQ(described().complaint(json::parse(status_to_json(status)), std::string("Status")), "");
  status.outcome->change = calib::Explanation{.kind = calib::ChangeKind::kTool};
  EXPECT_EQ(described().complaint(json::parse(status_to_json(status)), std::string("Status")), "");
  MadeTouch made;
  made.touch.joint_rad = {1.0};
  EXPECT_EQ(described().complaint(json::parse(made_touch_to_json(made)), std::string("TouchEvent")),
            "");
  made.tip_m = {1.0, 2.0, 3.0};
  made.residual_m = made.u95_m = 0.1;
  made.touch.positioner_rad = {0.4};
  EXPECT_EQ(described().complaint(json::parse(made_touch_to_json(made)), std::string("TouchEvent")),
            "");
  LinkReport links;
  links.robot.actual_rad = {0.1, 0.2, 0.3};
  for (const std::size_t turning : {0u, 1u}) {
    links.positioner_axes = turning;
    const json event = json::parse(joints_to_json(1, links));
    EXPECT_EQ(described().complaint(event, std::string("RobotEvent")), "");
    EXPECT_EQ(event.at("joints_deg").size(), 3u - turning);
    EXPECT_EQ(event.contains("positioner_deg"), turning > 0);
  }
}

TEST(ADescribedStatus, ThatIsNotAsDescribedIsFoundOut) {
  const json sound = json::parse(status_to_json({}));
  json status = sound;
  EXPECT_EQ(described().complaint(status, std::string("Status")), "");
  for (const auto& [key, value] : sound.items()) {
    json without = status;
    without.erase(key);
    EXPECT_NE(described().complaint(without, std::string("Status")), "") << key;
    json wrong = status;
    wrong[key] = json::array({json::object()});
    EXPECT_NE(described().complaint(wrong, std::string("Status")), "") << key;
  }
  status["more"] = 1;
  EXPECT_NE(described().complaint(status, std::string("Status")), "");
}

}  // namespace
}  // namespace cellcal::daemon
