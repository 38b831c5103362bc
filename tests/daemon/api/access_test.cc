// Network access: authentication and roles, without a socket.

#include "daemon/api/access.h"

#include <gtest/gtest.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "daemon/api/handlers.h"
#include "daemon/api/http/http.h"
#include "daemon/cell_form/cell_form.h"
#include "daemon/unattended/schedule.h"
#include "daemon/unattended/service_session_gateway.h"
#include "tests/daemon/api/without_hardware.h"

namespace cellcal::daemon {
namespace {

using nlohmann::json;

constexpr const char* kSomewhere = "10.0.0.77";

struct AnApiOnTheNetwork : ::testing::Test, testing::WithoutHardware {
  AnApiOnTheNetwork() {
    for (const Role role : {Role::kView, Role::kOperate, Role::kAdminister}) {
      secret[role] = tokens.add(to_string(role), role, "2026-01-01T00:00:00Z");
    }
    spdlog::set_default_logger(std::make_shared<spdlog::logger>(
        "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  }
  ~AnApiOnTheNetwork() override { spdlog::set_default_logger(logger); }

  Request request(const std::string& method, const std::string& target,
                  const std::map<std::string, std::string>& headers, const std::string& body = "") {
    Request one = parse_target(method, target, body);
    one.headers = headers;
    one.headers.emplace("host", "10.0.0.5:8080");
    one.peer = kSomewhere;
    return one;
  }
  /// Admission and answer, as in the server.
  Response ask(Request one) {
    if (auto refusal = api.admit_network(one)) return *refusal;
    return *api.answer(one);
  }
  Response ask(Role role, const std::string& method, const std::string& target,
               const std::string& body = "") {
    std::map<std::string, std::string> headers;
    if (role != Role::kNone) headers["authorization"] = "Bearer " + secret[role];
    return ask(request(method, target, headers, body));
  }
  static std::string words(const Response& response) {
    return json::parse(response.body).value("error", "");
  }
  static std::string header(const Response& response, const std::string& name) {
    for (const auto& [key, value] : response.headers) {
      if (key == name) return value;
    }
    return "";
  }
  /// The cookie that a browser sends back.
  std::string log_in(Role role) {
    const Response in = ask(request("POST", "/v1/login", {}, json{{"token", secret[role]}}.dump()));
    EXPECT_EQ(in.status, 200) << in.body;
    const std::string set = header(in, "Set-Cookie");
    return set.substr(0, set.find(';'));
  }

  std::ostringstream log;
  std::shared_ptr<spdlog::logger> logger = spdlog::default_logger();
  TokenStore tokens{dir / "tokens.json"};
  Access access{tokens, {{"cell7.plant.example"}, 8080, true}};
  Api api{service, journal, &access};
  std::map<Role, std::string> secret;
};

TEST_F(AnApiOnTheNetwork, LetsEachRoleDoWhatTheTableSaysAndNothingElse) {
  for (const Api::Route& route : Api::routes()) {
    std::string path = route.path;
    if (const std::size_t open = path.find('{'); open != std::string::npos) {
      path.replace(open, path.find('}') - open + 1, "7");
    }
    for (const Role role : {Role::kNone, Role::kView, Role::kOperate, Role::kAdminister}) {
      const int status = ask(role, route.method, path).status;
      const std::string what = std::string(route.method) + " " + path + " as " + to_string(role);
      if (role >= route.role) {
        EXPECT_NE(status, 401) << what;
        EXPECT_NE(status, 403) << what;
      } else {
        EXPECT_EQ(status, role == Role::kNone ? 401 : 403) << what;
      }
    }
  }
}

TEST_F(AnApiOnTheNetwork, ShowsNothingButHealthWithoutAToken) {
  for (const Api::Route& route : Api::routes()) {
    const std::string path = route.path;
    const bool open = path == "/v1/health" || path == "/v1/login" || path == "/v1/logout";
    EXPECT_EQ(route.role == Role::kNone, open) << path;
  }
  const Response health = ask(Role::kNone, "GET", "/v1/health");
  EXPECT_EQ(health.status, 200);
  EXPECT_EQ(json::parse(health.body).size(), 2u);
  for (const char* path : {"/v1/", "/v1/status", "/v1/nothing", "/v1/sessions/1/x"}) {
    EXPECT_EQ(ask(Role::kNone, "GET", path).status, 401) << path;
  }
}

TEST_F(AnApiOnTheNetwork, RefusesWhatIsNoToken) {
  const std::string good = secret[Role::kView];
  for (const std::string& given :
       {std::string("Bearer "), "Bearer " + good + " ", "Bearer " + good.substr(1),
        "bearer " + good, good, "Basic " + good, "Bearer " + std::string(64, '0'),
        std::string("Bearer \0x", 9)}) {
    const Response no = ask(request("GET", "/v1/status", {{"authorization", given}}));
    EXPECT_EQ(no.status, 401) << given;
    EXPECT_GT(no.hold.count(), 0) << given;
  }
  // The hash in the file is not a token.
  for (const Token& token : tokens.list()) {
    const std::string hash = "Bearer " + token.sha256;
    EXPECT_EQ(ask(request("GET", "/v1/status", {{"authorization", hash}})).status, 401);
  }
}

TEST_F(AnApiOnTheNetwork, SlowsAnAddressThatTriesAndNobodyWhoHasAToken) {
  std::chrono::milliseconds before{0};
  for (int i = 0; i < 12; ++i) {
    Request wrong = request("GET", "/v1/status", {{"authorization", "Bearer guess"}});
    const auto hold = ask(wrong).hold;
    EXPECT_GE(hold, before) << i;
    before = hold;
    EXPECT_EQ(ask(Role::kOperate, "POST", "/v1/abort").hold.count(), 0);
  }
  EXPECT_EQ(before, std::chrono::seconds(5));
  Request other = request("GET", "/v1/status", {{"authorization", "Bearer guess"}});
  other.peer = "10.0.0.78";
  EXPECT_LT(ask(other).hold, std::chrono::seconds(1));
  EXPECT_EQ(ask(Role::kNone, "GET", "/v1/status").hold.count(), 0) << "it has tried nothing";
}

TEST_F(AnApiOnTheNetwork, AnswersABrowserWhoseLoginHasEndedAtOnceAndTakesItsCookieBack) {
  const std::string cookie = log_in(Role::kView);
  ask(request("POST", "/v1/logout", {{"cookie", cookie}}));
  for (int i = 0; i < 20; ++i) {
    const Response ended = ask(request("GET", "/v1/status", {{"cookie", cookie}}));
    EXPECT_EQ(ended.status, 401);
    EXPECT_EQ(ended.hold.count(), 0) << i;
    const auto sent =
        std::ranges::find(ended.headers, "Set-Cookie", [](const auto& one) { return one.first; });
    ASSERT_NE(sent, ended.headers.end());
    EXPECT_NE(sent->second.find("Max-Age=0"), std::string::npos) << sent->second;
  }
  Request wrong = request("GET", "/v1/status", {{"authorization", "Bearer guess"}});
  EXPECT_LT(ask(wrong).hold, std::chrono::seconds(1)) << "the login that ended counts as no guess";
}

TEST_F(AnApiOnTheNetwork, WritesOfAttemptsIntoTheLogButNotWhatWasTried) {
  const std::string guess(64, 'a');
  for (int i = 0; i < 100; ++i) {
    ask(request("GET", "/v1/status", {{"authorization", "Bearer " + guess}}));
  }
  const std::string text = log.str();
  EXPECT_NE(text.find(kSomewhere), std::string::npos) << text;
  EXPECT_EQ(text.find("aaaa"), std::string::npos) << text;
  EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 10) << "a log is not to be flooded";
}

TEST_F(AnApiOnTheNetwork, LogsABrowserInAndOut) {
  const std::string cookie = log_in(Role::kView);
  const Response me = ask(request("GET", "/v1/me", {{"cookie", "a=b; " + cookie + "; c=d"}}));
  EXPECT_EQ(json::parse(me.body), (json{{"role", "look"}, {"name", "look"}}));
  EXPECT_EQ(cookie.find(secret[Role::kView]), std::string::npos) << "the cookie is no token";
  EXPECT_EQ(ask(request("POST", "/v1/run", {{"cookie", cookie}}, "{}")).status, 403);
  EXPECT_EQ(ask(request("POST", "/v1/logout", {{"cookie", cookie}})).status, 200);
  EXPECT_EQ(ask(request("GET", "/v1/me", {{"cookie", cookie}})).status, 401) << "replayed";
  for (const char* body : {"", "{", "[]", "{}", "{\"token\": 3}", "{\"token\": \"x\", \"y\": 1}"}) {
    EXPECT_EQ(ask(request("POST", "/v1/login", {}, body)).status, 400) << body;
  }
  const Response wrong = ask(request("POST", "/v1/login", {}, R"({"token": "x"})"));
  EXPECT_EQ(wrong.status, 401);
  EXPECT_GT(wrong.hold.count(), 0);
}

TEST_F(AnApiOnTheNetwork, GivesACookieThatScriptsAndOtherSitesDoNotGet) {
  const Response in =
      ask(request("POST", "/v1/login", {}, json{{"token", secret[Role::kView]}}.dump()));
  for (const char* part : {"HttpOnly", "SameSite=Strict", "Secure", "Path=/"}) {
    EXPECT_NE(header(in, "Set-Cookie").find(part), std::string::npos) << part;
  }
  Access plain{tokens, {}};
  const Response without =
      plain.log_in(request("POST", "/v1/login", {}, json{{"token", secret[Role::kView]}}.dump()));
  EXPECT_EQ(header(without, "Set-Cookie").find("Secure"), std::string::npos);
}

TEST_F(AnApiOnTheNetwork, EndsLoginsWithTheirToken) {
  const std::string cookie = log_in(Role::kView);
  EXPECT_EQ(ask(Role::kAdminister, "DELETE", "/v1/tokens/look").status, 200);
  EXPECT_EQ(ask(request("GET", "/v1/me", {{"cookie", cookie}})).status, 401);
  EXPECT_EQ(ask(Role::kView, "GET", "/v1/me").status, 401);
  // A new token with the same name is a different one.
  EXPECT_EQ(
      ask(Role::kAdminister, "POST", "/v1/tokens", R"({"name": "look", "role": "look"})").status,
      201);
  EXPECT_EQ(ask(request("GET", "/v1/me", {{"cookie", cookie}})).status, 401);
}

TEST_F(AnApiOnTheNetwork, KnowsABrowserAfterARestartUntilItsTokenIsRemovedOrAMonthIsOver) {
  const std::filesystem::path file = dir / "sign-ins.json";
  const Token look = *tokens.find(secret[Role::kView]),
              operate = *tokens.find(secret[Role::kOperate]);
  auto now = std::chrono::system_clock::now();
  const auto clock = [&] { return now; };
  std::string one, other, ended;
  {
    SignIns before(tokens, file, clock);
    one = before.begin(look);
    other = before.begin(operate);
    ended = before.begin(look);
    before.end(ended);
  }
  EXPECT_EQ(std::filesystem::status(file).permissions(), std::filesystem::perms(0600));
  std::ostringstream kept;
  kept << std::ifstream(file).rdbuf();
  EXPECT_EQ(kept.str().find(one), std::string::npos) << "who reads the file gets no cookie";
  now += std::chrono::hours(29 * 24);
  {
    SignIns restarted(tokens, file, clock);
    ASSERT_TRUE(restarted.find(one));
    EXPECT_EQ(restarted.find(one)->name, "look");
    EXPECT_FALSE(restarted.find(ended)) << "signed out";
    tokens.remove("operate");
    EXPECT_FALSE(restarted.find(other)) << "its token is gone";
  }
  now += std::chrono::hours(29 * 24);
  EXPECT_TRUE(SignIns(tokens, file, clock).find(one)) << "30 days after its last use";
  now += std::chrono::hours(31 * 24);
  EXPECT_FALSE(SignIns(tokens, file, clock).find(one));
}

TEST_F(AnApiOnTheNetwork, TakesNoSignInsFromAFileThatOthersMayWriteOrThatIsDamaged) {
  const std::filesystem::path file = dir / "sign-ins.json";
  std::string cookie;
  {
    SignIns before(tokens, file);
    cookie = before.begin(*tokens.find(secret[Role::kView]));
  }
  std::filesystem::permissions(file, std::filesystem::perms(0660));
  EXPECT_FALSE(SignIns(tokens, file).find(cookie));
  EXPECT_NE(log.str().find("sign in again"), std::string::npos);
  for (const char* text :
       {"", "{", "{}", R"({"format": "cellcal.sign-ins/1", "sign_ins": [{}]})"}) {
    std::filesystem::remove(file);
    std::ofstream(file) << text;
    std::filesystem::permissions(file, std::filesystem::perms(0600));
    EXPECT_FALSE(SignIns(tokens, file).find(cookie)) << text;
  }
}

TEST_F(AnApiOnTheNetwork, EndsNoneButItsOwnLoginsWhenATokenLogsInTooOften) {
  const auto status = [&](const std::string& cookie) {
    return ask(request("GET", "/v1/me", {{"cookie", cookie}})).status;
  };
  const std::string others = log_in(Role::kView), used = log_in(Role::kOperate);
  const std::string unused = log_in(Role::kOperate);
  std::string newest;
  for (int i = 0; i < 300; ++i) {
    newest = log_in(Role::kOperate);
    EXPECT_EQ(status(used), 200) << i;
  }
  EXPECT_EQ(status(newest), 200);
  EXPECT_EQ(status(unused), 401) << "of one token some are enough";
  EXPECT_EQ(status(others), 200);
}

TEST_F(AnApiOnTheNetwork, EndsWhatIsFollowedWithTheTokenOrTheLogin) {
  const Response by_token =
      ask(request("GET", "/v1/events", {{"authorization", "Bearer " + secret[Role::kView]}}));
  const std::string cookie = log_in(Role::kOperate);
  const Response by_cookie = ask(request("GET", "/v1/events", {{"cookie", cookie}}));
  ASSERT_TRUE(by_token.stream && by_cookie.stream);
  EXPECT_NE(by_token.stream->next()->find("event: status"), std::string::npos);
  EXPECT_NE(by_cookie.stream->next()->find("event: status"), std::string::npos);
  tokens.remove("look");
  EXPECT_FALSE(by_token.stream->next());
  EXPECT_EQ(*by_cookie.stream->next(), "");
  ask(request("POST", "/v1/logout", {{"cookie", cookie}}));
  EXPECT_FALSE(by_cookie.stream->next());
}

TEST_F(AnApiOnTheNetwork, RefusesWhatAPageOfSomebodyElseSends) {
  const std::string cookie = log_in(Role::kOperate);
  const auto abort = [&](const std::string& origin) {
    return ask(request("POST", "/v1/abort", {{"cookie", cookie}, {"origin", origin}}));
  };
  for (const char* origin :
       {"http://evil.example", "null", "", "http://10.0.0.5:8081", "http://10.0.0.5",
        "http://10.0.0.5:8080.evil.example", "ftp://10.0.0.5:8080"}) {
    const Response no = abort(origin);
    EXPECT_EQ(no.status, 403) << origin;
    EXPECT_NE(words(no).find(origin), std::string::npos) << words(no);
  }
  EXPECT_EQ(abort("http://10.0.0.5:8080").status, 403) << "this daemon speaks TLS";
  EXPECT_EQ(abort("HTTPS://10.0.0.5:8080").status, 409) << "nothing to abort";
  EXPECT_EQ(ask(request("POST", "/v1/login", {{"origin", "http://evil.example"}},
                        json{{"token", secret[Role::kView]}}.dump()))
                .status,
            403);
}

TEST_F(AnApiOnTheNetwork, RefusesNamesThatAreNotItsOwn) {
  const auto status = [&](const std::string& host) {
    Request one = request("GET", "/v1/health", {});
    one.headers["host"] = host;
    return ask(one).status;
  };
  for (const char* host : {"10.0.0.5:8080", "10.0.0.5", "localhost:8080", "[::1]:8080", "[fe80::1]",
                           "cell7.plant.example", "CELL7.plant.example:8080", "127.0.0.1:80"}) {
    EXPECT_EQ(status(host), 200) << host;
  }
  for (const char* host : {"", "evil.example", "evil.example:8080", "10.0.0.5.evil.example",
                           "x.cell7.plant.example", "[evil]", "localhost.evil.example", "0x7f.1",
                           "127.0.0.1:8080:8080", "localhost:80x", "\r\n"}) {
    EXPECT_EQ(status(host), 403) << host;
  }
}

TEST_F(AnApiOnTheNetwork, MovesNothingBeforeSomebodySaidThatTheCellIsClear) {
  api.cell_folders = {std::filesystem::path(CELLCAL_DEMO_CELL).parent_path()};
  const std::string run = json{{"cell", CELLCAL_DEMO_CELL}}.dump();
  const Response early = ask(Role::kOperate, "POST", "/v1/run", run);
  EXPECT_EQ(early.status, 412);
  EXPECT_NE(words(early).find("/v1/clear"), std::string::npos) << words(early);
  EXPECT_EQ(ask(Role::kView, "POST", "/v1/clear").status, 403);
  EXPECT_EQ(ask(Role::kOperate, "POST", "/v1/clear").status, 200);
  EXPECT_EQ(ask(Role::kAdminister, "POST", "/v1/run", run).status, 412) << "another one's word";
  // The test's backend refuses: nothing has begun, so /v1/clear still counts.
  EXPECT_EQ(ask(Role::kOperate, "POST", "/v1/run", run).status, 422);
  EXPECT_EQ(ask(Role::kOperate, "POST", "/v1/run", run).status, 422);
  EXPECT_EQ(ask(Role::kOperate, "POST", "/v1/run", "{").status, 400);
  ask(Role::kOperate, "POST", "/v1/abort");
  EXPECT_EQ(ask(Role::kOperate, "POST", "/v1/run", run).status, 412) << "void after an abort";
}

TEST_F(AnApiOnTheNetwork, NeitherReleasesTheScheduleNorBeginsByItWithoutThatWord) {
  ServiceSessionGateway gateway{service, journal};
  Schedule schedule{{gateway,
                     {[this] { return journal.schedule(); },
                      [this](const std::string& state) { journal.store_schedule(state); }},
                     [] {
                       ScheduleConfig config;
                       config.unattended = true;
                       config.program_start = ProgramStart::kCell;
                       return config;
                     },
                     {[] { return UtcSeconds{1'800'000'000}; }, std::chrono::steady_clock::now,
                      "boot", [] { return false; }},
                     {}}};
  api.schedule = &schedule;
  const std::string begin = R"({"name": "check"})";
  ASSERT_NE(schedule.picture().held_words, "");
  EXPECT_EQ(ask(Role::kOperate, "POST", "/v1/schedule/release").status, 412);
  EXPECT_EQ(ask(Role::kOperate, "POST", "/v1/schedule/begin", begin).status, 412);
  EXPECT_NE(schedule.picture().held_words, "");
  ask(Role::kOperate, "POST", "/v1/clear");
  ask(Role::kOperate, "POST", "/v1/abort");
  EXPECT_EQ(ask(Role::kOperate, "POST", "/v1/schedule/release").status, 412) << "behind an abort";
  ask(Role::kOperate, "POST", "/v1/clear");
  EXPECT_EQ(ask(Role::kOperate, "POST", "/v1/schedule/release").status, 200);
  EXPECT_EQ(schedule.picture().held_words, "");
  EXPECT_EQ(ask(Role::kOperate, "POST", "/v1/schedule/begin", begin).status, 412)
      << "it counted once";
  ask(Role::kOperate, "POST", "/v1/clear");
  EXPECT_EQ(ask(Role::kOperate, "POST", "/v1/schedule/begin", begin).status, 409)
      << "there is none";
}

TEST_F(AnApiOnTheNetwork, NamesNoFilesOfTheComputerButCellFilesAndItsOwnBackups) {
  const auto status = [&](Role role, const char* path, const json& body) {
    return ask(role, "POST", path, body.dump()).status;
  };
  const std::filesystem::path cells = std::filesystem::path(CELLCAL_DEMO_CELL).parent_path();
  const std::filesystem::path linked = dir / "linked.toml", other = dir / "other.toml";
  std::filesystem::create_symlink(CELLCAL_DEMO_CELL, linked);
  std::filesystem::copy_file(CELLCAL_DEMO_CELL, other);
  const std::filesystem::path as_link = dir / "cells";
  std::filesystem::create_directory_symlink(cells, as_link);
  api.cell_folders = {cells, dir.path() / "cells"};
  const CellFileStore shelf(dir / "made");
  api.shelf = &shelf;
  const auto answers = [&](const std::filesystem::path& file) {
    const std::string cell = json{{"cell", file}}.dump();
    const std::string asked = "/v1/cell-form?file=" + file.string();
    std::string all;
    for (const Response& one :
         {ask(Role::kOperate, "POST", "/v1/run", cell),
          ask(Role::kOperate, "POST", "/v1/doctor", cell),
          ask(Role::kOperate, "POST", "/v1/doctor/result", cell), ask(Role::kOperate, "GET", asked),
          ask(Role::kOperate, "POST", "/v1/cell-form", json{{"from", file}}.dump())})
      all += std::to_string(one.status) + " " + words(one) + "\n";
    return all;
  };
  const std::string refused = answers("/etc/passwd");
  EXPECT_EQ(refused.find("422 over the network a cell file must lie directly in " + cells.string()),
            0u)
      << refused;
  for (const std::filesystem::path& file :
       {std::filesystem::path("/nonexistent.toml"), other, linked, as_link / "cell.toml",
        cells / "." / "cell.toml", cells / ".." / cells.filename() / "cell.toml"})
    EXPECT_EQ(answers(file), refused) << file;
  EXPECT_EQ(status(Role::kOperate, "/v1/run", {{"cell", CELLCAL_DEMO_CELL}}), 412);
  EXPECT_EQ(ask(Role::kOperate, "GET", "/v1/cell-form?file=" CELLCAL_DEMO_CELL).status, 200);
  const auto backups = service.backups_dir();
  const std::filesystem::path elsewhere =
      std::filesystem::path(::testing::TempDir()) / "elsewhere.db";
  for (const std::string& file : {elsewhere.string(), (backups / ".." / "x.db").string()}) {
    EXPECT_EQ(status(Role::kAdminister, "/v1/backup", {{"file", file}}), 422) << file;
    EXPECT_FALSE(std::filesystem::exists(file));
  }
  EXPECT_EQ(status(Role::kAdminister, "/v1/backup", {{"file", (backups / "x.db").string()}}), 201);
  EXPECT_EQ(status(Role::kAdminister, "/v1/backup", {{"file", (backups / "x.db").string()}}), 422);
  std::filesystem::remove_all(backups);
  std::filesystem::create_directory_symlink(::testing::TempDir(), backups);
  EXPECT_EQ(status(Role::kAdminister, "/v1/backup", {{"file", (backups / "y.db").string()}}), 422);
}

TEST_F(AnApiOnTheNetwork, ImportsFromOneFolderAloneAndFollowsNoLink) {
  const auto answer = [&](const std::filesystem::path& directory) {
    const Response one = ask(Role::kAdminister, "POST", "/v1/import",
                             json{{"directory", directory.string()}}.dump());
    return std::to_string(one.status) + " " + words(one);
  };
  const std::string refused = answer("/etc");
  EXPECT_NE(refused.find(service.imports_dir().string()), std::string::npos) << refused;
  const auto imports = service.imports_dir();
  std::filesystem::create_directories(imports / "true" / "deep");
  std::filesystem::create_directory_symlink("/etc", imports / "link");
  for (const std::filesystem::path& elsewhere :
       {std::filesystem::path("/nonexistent"), imports / "link", imports, imports / "true" / "deep",
        imports / ".." / "imports" / "true"})
    EXPECT_EQ(answer(elsewhere), refused) << elsewhere;
  EXPECT_NE(answer(imports / "true"), refused);
  std::filesystem::create_symlink("/etc/passwd", imports / "true" / "export.json");
  EXPECT_NE(answer(imports / "true").find("is a link"), std::string::npos);
}

TEST_F(AnApiOnTheNetwork, NeedsNoWordOverTheUnixSocket) {
  Request run = parse_target("POST", "/v1/run", json{{"cell", CELLCAL_DEMO_CELL}}.dump());
  ASSERT_FALSE(api.admit_local(run));
  EXPECT_EQ(api.answer(run)->status, 422);
}

TEST_F(AnApiOnTheNetwork, DoesNotAnswerARequestThatWasNotAdmitted) {
  EXPECT_EQ(api.answer(request("GET", "/v1/status", {}))->status, 403);
}

struct AWord : ::testing::Test {
  Status in(Phase phase, std::int64_t session = 1) {
    Status status;
    status.session = session;
    status.phase = phase;
    return status;
  }
  std::chrono::steady_clock::time_point now{};
  Clearance clearance{[this] { return now; }};
};

TEST_F(AWord, CountsForOneRunOfTheOneWhoGaveIt) {
  EXPECT_FALSE(clearance.take("a"));
  clearance.acknowledge("a");
  EXPECT_FALSE(clearance.take("b"));
  EXPECT_TRUE(clearance.take("a"));
  EXPECT_FALSE(clearance.take("a"));
}

TEST_F(AWord, CountsForFiveMinutes) {
  clearance.acknowledge("a");
  now += std::chrono::seconds(300);
  EXPECT_FALSE(clearance.take("a"));
  clearance.acknowledge("a");
  now += std::chrono::seconds(299);
  EXPECT_TRUE(clearance.take("a"));
}

TEST_F(AWord, IsVoidOnceASessionIsUnderWayHasFailedOrWasAborted) {
  for (const Phase phase :
       {Phase::kPlanning, Phase::kTransit, Phase::kStopping, Phase::kFailed, Phase::kAborted}) {
    clearance.acknowledge("a");
    clearance.update(in(phase));
    EXPECT_FALSE(clearance.take("a")) << to_string(phase);
    clearance.acknowledge("a");
    EXPECT_TRUE(clearance.take("a"));
    clearance.update(in(phase, 2));
    clearance.put_back("a");
    EXPECT_FALSE(clearance.take("a")) << to_string(phase);
  }
  for (const Phase phase : {Phase::kIdle, Phase::kDone}) {
    clearance.acknowledge("a");
    clearance.update(in(phase));
    EXPECT_TRUE(clearance.take("a")) << to_string(phase);
  }
}

TEST_F(AWord, OutlastsAChangeOfTheScheduleAfterAFailedSession) {
  clearance.update(in(Phase::kFailed));
  clearance.acknowledge("a");
  clearance.update(in(Phase::kFailed));
  EXPECT_TRUE(clearance.take("a"));
  clearance.update(in(Phase::kFailed));
  clearance.put_back("a");
  EXPECT_TRUE(clearance.take("a"));
}

TEST_F(AnApiOnTheNetwork, AnswersAnAbortAtOnceWhateverTokenComesWithIt) {
  for (int i = 0; i < 8; ++i) {
    const Response no = ask(request("POST", "/v1/abort", {{"authorization", "Bearer wrong"}}));
    EXPECT_EQ(no.status, 401);
    EXPECT_EQ(no.hold.count(), 0);
  }
}

TEST(AnOrigin, OverTlsIsAPageThatCameOverTls) {
  Request request;
  request.headers = {{"host", "cell:8443"}, {"origin", "http://cell:8443"}};
  EXPECT_TRUE(origin_is_ours(request, false));
  EXPECT_FALSE(origin_is_ours(request, true));
  request.headers["origin"] = "https://cell:8443";
  EXPECT_TRUE(origin_is_ours(request, true));
}

TEST(FailedAttempts, OfOneNetworkAreCountedTogetherAndForgottenInTime) {
  std::chrono::steady_clock::time_point now{};
  FailedAttempts failed([&] { return now; });
  EXPECT_EQ(failed.add("2001:db8::1").so_far, 1);
  EXPECT_EQ(failed.add("2001:db8::2").so_far, 2);
  EXPECT_EQ(failed.add("2001:db8:1::2").so_far, 1);
  EXPECT_EQ(failed.add("10.0.0.1").so_far, 1);
  EXPECT_EQ(failed.add("10.0.0.2").so_far, 1);
  EXPECT_EQ(failed.add("::ffff:10.0.0.3").so_far, 1);
  EXPECT_EQ(failed.add("::ffff:10.0.0.4").so_far, 1) << "all of IPv4 is not one network";
  now += std::chrono::minutes(11);
  EXPECT_EQ(failed.add("2001:db8::1").so_far, 1);
  for (int i = 0; i < 5000; ++i)
    failed.add("10.1." + std::to_string(i / 250) + "." + std::to_string(i % 250));
  EXPECT_EQ(failed.add("2001:db8::1").so_far, 1) << "of so many the oldest were forgotten";
}

}  // namespace
}  // namespace cellcal::daemon
