// Bodies of POST /v1/run as sent by cellcal run, check, qualify, find and dry-run, and what status, show and history print
// of answers, with a scripted daemon.

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <thread>

#include "daemon/api/http/server.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using nlohmann::json;

/// Refuses every session, and keeps the body; gives the scripted answers by their path.
class ARunRequest : public ::testing::Test {
 protected:
  ~ARunRequest() override {
    boost::asio::post(context_, [this] {
      server_.stop();
      context_.stop();
    });
    thread_.join();
  }
  json body_of(const std::string& command, std::vector<std::string> more) {
    more.insert(more.begin(), {CELLCAL, command, "--socket", dir_ / "s"});
    const Outcome outcome = run_program(more);
    EXPECT_NE(outcome.err.find("refused by the script"), std::string::npos) << outcome.err;
    return json::parse(body_);
  }

  TemporaryDirectory dir_;
  std::string said(std::vector<std::string> command) {
    command.insert(command.begin(), CELLCAL);
    command.insert(command.end(), {"--socket", dir_ / "s"});
    const Outcome outcome = run_program(command);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return outcome.out;
  }

  std::string body_;
  std::map<std::string, json> answers_;
  boost::asio::io_context context_;
  HttpServer server_{context_,
                     dir_ / "s",
                     {[](Request&) { return std::optional<Response>(); },
                      [this](const Request& request, bool) {
                        body_ = request.body;
                        if (const auto at = answers_.find(request.path); at != answers_.end())
                          return std::optional(Response{.body = at->second.dump()});
                        return std::optional(error(422, "refused by the script"));
                      },
                      [](const Request&) { return false; }}};
  std::thread thread_{[this] { context_.run(); }};
};

/// Body of a command without options.
json usual(const char* kind, const json& more) {
  json body{{"kind", kind},   {"target", ""},    {"load", ""},
            {"check", 10},    {"seed", 1},       {"region", "workspace"},
            {"find", false},  {"update", false}, {"accept_change", false},
            {"resume", false}};
  body.update(more);
  return body;
}

TEST_F(ARunRequest, StatesTheOptionsOfTheCommandAndItsDefaults) {
  EXPECT_EQ(
      body_of("run", {"--cell", "/c.toml", "--goal", "0.25", "--seed", "3", "--load", "L"}),
      usual("calibrate", {{"cell", "/c.toml"}, {"goal_mm", 0.25}, {"seed", 3}, {"load", "L"}}));
  EXPECT_EQ(body_of("dry-run", {"--cell", "/c.toml", "--check", "7"}),
            usual("dry-run", {{"cell", "/c.toml"}, {"touches", 100}, {"check", 7}}));
  EXPECT_EQ(body_of("find", {"--cell", "/c.toml"}), usual("find", {{"cell", "/c.toml"}}));
  EXPECT_EQ(body_of("qualify", {"--cell", "/c.toml", "--target", "S2"}),
            usual("qualify", {{"cell", "/c.toml"}, {"target", "S2"}}));
  EXPECT_EQ(body_of("check", {}), usual("check", json::object()));
  EXPECT_EQ(
      body_of("check", {"--calibration", "7", "--temperature", "21.5", "--mastered", "A2,A3"}),
      usual("check", {{"calibration", 7}, {"temperature_c", 21.5}, {"mastered", {"A2", "A3"}}}));
}

TEST_F(ARunRequest, LeavesTheTouchesOfAFullSessionOutOfAnUpdateBeforeItAndOfAResumedSession) {
  EXPECT_EQ(body_of("run", {"--resume", "--touches", "30", "--goal", "0.2", "--seed", "5"}),
            (json{{"kind", "calibrate"},
                  {"target", ""},
                  {"load", ""},
                  {"update", false},
                  {"resume", true}}));
  EXPECT_EQ(
      body_of("run", {"--cell", "/c.toml", "--update", "--or-full", "--touches", "30", "--find"}),
      (json{{"kind", "calibrate"},
            {"cell", "/c.toml"},
            {"target", ""},
            {"load", ""},
            {"update", true},
            {"resume", false}}));
  EXPECT_EQ(body_of("run", {"--cell", "/c.toml", "--update", "--touches", "30"}).at("touches"), 30);
}

TEST_F(ARunRequest, NamesTheCellFileByItsAbsolutePath) {
  EXPECT_EQ(body_of("find", {"--cell", "c.toml"}).at("cell"),
            std::filesystem::absolute("c.toml").string());
}

using AnAnswer = ARunRequest;

TEST_F(AnAnswer, ThatTheBackupIsWrittenIsNoneWhereTheFileIsMissing) {
  answers_["/v1/backup"] = {{"bytes", 4096}, {"remarks", json::array()}};
  const std::vector<std::string> command{CELLCAL, "backup", dir_ / "b.db", "--socket", dir_ / "s"};
  const Outcome missing = run_program(command);
  EXPECT_EQ(missing.status, 1);
  EXPECT_NE(missing.err.find("written where only the daemon sees it"), std::string::npos)
      << missing.err;
  std::ofstream(dir_ / "b.db") << "rows";
  EXPECT_EQ(run_program(command).status, 0);
}

TEST_F(AnAnswer, OfTheStatusIsSaidInTheReadersLanguageAlone) {
  answers_["/v1/status"] = {
      {"session", 3},
      {"running", true},
      {"phase", "slow search"},
      {"target", "S2"},
      {"touches", 12},
      {"planned", 48},
      {"residual_mm", 0.0341},
      {"time_left_s", 200.4},
      {"waiting", {{"robot", true}, {"contact", true}, {"start", "X"}}},
      {"interruptions", 2},
      {"interruptions_by_cause", {{"packets-stopped", 2}}},
      {"arm", {{"motion", "at rest"}, {"packet_age_s", 0.1}}},
      {"links", {{"robot", {{"packets", 5}, {"mode", "T1"}}}, {"contact", {{"frames", 50}}}}}};
  const std::string english = said({"status"});
  for (const char* part :
       {"session 3: slow search\n", "waiting for the robot controller and the contact sensor: X\n",
        "interruptions: 2: 2 controller packets stopped, each resumed automatically\n",
        "arm: at rest (packet 0.1 s old)\n", "; mode T1\n", "contact link: firmware unknown"})
    EXPECT_NE(english.find(part), std::string::npos) << part << "\n" << english;
  const std::string german = said({"status", "--language", "de"});
  for (const char* word : {"session", "waiting", "interruptions", "resumed", "arm:", "packet ",
                           "link", "mode ", "firmware", "late", "round trip", "left"})
    EXPECT_EQ(german.find(word), std::string::npos) << word << "\n" << german;
  answers_["/v1/status"].erase("waiting");
  EXPECT_NE(said({"status"}).find("12/48 S2 slow search  residual 0.034 mm  3 min 20 s left\n"),
            std::string::npos);
  EXPECT_NE(said({"status", "--language", "de"})
                .find("12/48 S2 langsame Suche  Restfehler 0,034 mm  noch 3 min 20 s\n"),
            std::string::npos);
}

TEST_F(AnAnswer, OfTheStatusNamesWhatFollowsALeftSession) {
  json left{{"session", 3}, {"started", "2026-11-28"}, {"kind", "calibrate"},
            {"touches", 5}, {"planned", 48},           {"ending", "failed"},
            {"anew", ""},   {"failure", nullptr}};
  const auto said_of = [&](const char* failure, bool resumable) {
    left["failure"] = failure;
    left["resumable"] = resumable;
    answers_["/v1/status"] = {{"session", 0}, {"phase", "idle"}, {"interrupted", left}};
    return said({"status"});
  };
  EXPECT_NE(said_of("device", true).find("'cellcal run --resume'"), std::string::npos);
  EXPECT_NE(said_of("a-later-kind", true).find("'cellcal run --resume'"), std::string::npos);
  for (
      const auto& [failure, then] :
      {std::pair(
           "not-found",
           "A sphere was not located. Measure its centre, correct the cell file, then start a new session."),
       std::pair("plan-changed", "Start a new session."),
       std::pair("identify", "Make more touches, ")}) {
    const std::string words = said_of(failure, false);
    EXPECT_NE(words.find(then), std::string::npos) << words;
    EXPECT_EQ(words.find("--resume"), std::string::npos) << words;
  }
}

TEST_F(AnAnswer, OfASessionEndsInItsOutcomeBelowItsEvents) {
  answers_["/v1/sessions/3"] = {{"id", 3},
                                {"started", "2026-11-28"},
                                {"kind", "check"},
                                {"state", "done"},
                                {"outcome", {{"kind", "does_not_hold"}, {"words", {"TCP moved"}}}},
                                {"events", {"began", "touch 1"}}};
  const std::string shown = said({"show", "3"});
  EXPECT_NE(shown.find("does not hold"), std::string::npos) << shown;
  EXPECT_NE(shown.find("check: "), std::string::npos) << shown;
  EXPECT_TRUE(shown.ends_with("  began\n  touch 1\noutcome: TCP moved\n")) << shown;
  answers_["/v1/sessions"] = json::array({answers_["/v1/sessions/3"]});
  const std::string german = said({"history", "--language", "de"});
  EXPECT_NE(german.find("gilt nicht"), std::string::npos) << german;
  EXPECT_NE(german.find("Zelle oder Fehler"), std::string::npos) << german;
}

}  // namespace
}  // namespace cellcal::daemon::testing
