// Bodies of POST /v1/run as sent by cellcal run, check, qualify, find and dry-run, with a scripted daemon.

#include <gtest/gtest.h>

#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <nlohmann/json.hpp>
#include <thread>

#include "daemon/api/http/server.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using nlohmann::json;

/// Refuses every session, and keeps the body.
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
  std::string body_;
  boost::asio::io_context context_;
  HttpServer server_{context_,
                     dir_ / "s",
                     {[](Request&) { return std::optional<Response>(); },
                      [this](const Request& request, bool) {
                        body_ = request.body;
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
            usual("dry-run", {{"cell", "/c.toml"}, {"touches", 50}, {"check", 7}}));
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

}  // namespace
}  // namespace cellcal::daemon::testing
