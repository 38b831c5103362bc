// cellcal frames --send, --sent, --restore as a subprocess, with a scripted daemon.

#include <gtest/gtest.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <boost/asio/post.hpp>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <thread>

#include "calib/files/calibration_json.h"
#include "daemon/api/http/server.h"
#include "daemon/krl/frames.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"
#include "tests/daemon/krl/fixture.h"

namespace cellcal::daemon::testing {
namespace {

using nlohmann::json;

/// A calibration that measured the tip; the demo's cell states it as certain.
calib::Calibration measured() {
  calib::Cell with_tip = cell();
  with_tip.tool.tcp_sigma_m.setConstant(1e-3);
  calib::Random random(1);
  return calib::testing::random_calibration(with_tip, random);
}

class FramesSent : public ::testing::Test {
 protected:
  FramesSent() {
    calib::Calibration found = measured();
    in_use_ = calib::calibration_to_json(found);
    std::ofstream(dir_ / "cal.json") << in_use_;
    in_use_ += "\n";
    found.verdict.judged = false;
    std::ofstream(dir_ / "withheld.json") << calib::calibration_to_json(found);
    std::ofstream(dir_ / "as stated.json") << calib::calibration_to_json(calibration());
  }
  ~FramesSent() override {
    boost::asio::post(context_, [this] {
      server_.stop();
      context_.stop();
    });
    thread_.join();
  }
  Response answer(const Request& request) {
    const std::lock_guard lock(mutex_);
    asked_.emplace_back(request.method + " " + request.path,
                        request.body.empty() ? json() : json::parse(request.body));
    if (request.path == "/v1/frames/read")
      return {
          .body =
              R"({"frame": "TOOL_DATA[1]", "xyz_mm": [59.9, 50.5, 410.3], "abc_deg": [38.84, 3.59, 0]})"};
    if (request.path == "/v1/versions")
      return {.body = in_use_.empty()
                          ? "[]"
                          : R"([{"session": 3, "active": false}, {"session": 2, "active": true}])"};
    if (request.path == "/v1/sessions/2/calibration.json") return {.body = in_use_};
    if (request.method == "GET" && problem_)
      return {.body = R"({"configured": true, "problem": "frames.json is damaged", "frames": []})"};
    if (request.method == "GET")
      return {
          .body =
              R"({"configured": true, "problem": null, "frames": [{"id": 7, "frame": "TOOL_DATA[1]",
        "time": "2026-11-20T10:00:00Z", "outcome": "unknown", "by": "anna", "reason": "r", "words": "read it",
        "before": {"xyz_mm": [59.9, 50.5, 410.3], "abc_deg": [38.84, 3.59, 0]}}]})"};
    const bool good = good_sets_ > 0 && good_sets_-- > 0;
    return {
        good ? 201 : status_, "application/json",
        R"({"id": 8, "frame": "TOOL_DATA[1]", "error": "TOOL_DATA[1]: unknown", "words": "TOOL_DATA[1] set"})"};
  }
  Outcome frames(std::vector<std::string> more) const {
    more.insert(more.begin(), {CELLCAL, "frames", "--socket", dir_ / "s"});
    return run_program(more);
  }
  Outcome send(std::vector<std::string> more, const char* calibration = "cal.json") const {
    more.insert(more.begin(), {"--calibration", dir_ / calibration, "--tool", "1", "--send"});
    return frames(std::move(more));
  }
  std::size_t asked(const std::string& what) const {
    return static_cast<std::size_t>(
        std::ranges::count(asked_, what, [](const auto& one) { return one.first; }));
  }

  TemporaryDirectory dir_;
  std::mutex mutex_;
  std::vector<std::pair<std::string, json>> asked_;
  int status_ = 201, good_sets_ = 0;  ///< this many before status_
  bool problem_ = false;
  std::string in_use_;  ///< the calibration of session 2
  boost::asio::io_context context_;
  HttpServer server_{
      context_,
      dir_ / "s",
      {[](Request&) { return std::optional<Response>(); },
       [this](const Request& request, bool) { return std::optional(answer(request)); },
       [](const Request&) { return false; }}};
  std::thread thread_{[this] { context_.run(); }};
};

TEST_F(FramesSent, SaysWhatTheControllerHadAndSendsWhatWasConfirmed) {
  const Outcome outcome = send({"--confirm"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.err.find("TOOL_DATA[1] now  {X 59.9000,Y 50.5000,Z 410.3000,A 38.84000"),
            std::string::npos)
      << outcome.err;
  ASSERT_EQ(asked("POST /v1/frames"), 1U);
  const json body = asked_.back().second;
  EXPECT_EQ(body["frame"], "TOOL_DATA[1]");
  EXPECT_EQ(body["was"]["xyz_mm"][2], 410.3);
  EXPECT_EQ(body["confirm"], true);
  krl::FramesRequest tool;
  tool.tool = 1;
  const calib::FrameMmDeg frame = krl::propose_frames(measured(), tool).frames.at(0).frame;
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_NEAR(body["values"]["xyz_mm"][i].get<double>(), frame.xyz_mm[i], 1e-6);
  EXPECT_EQ(body["values"]["abc_deg"], body["was"]["abc_deg"]) << "touches say nothing of it";
  EXPECT_NE(outcome.err.find("TOOL_DATA[1] moves by "), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("mm (k=2); A, B, C stay"), std::string::npos) << outcome.err;
}

TEST_F(FramesSent, AreNoneOfABaseWhereNobodySaysWhereTheRobotStands) {
  const Outcome outcome = frames({"--calibration", dir_ / "cal.json", "--tool", "1", "--base",
                                  "3=S1,S2,S3", "--send", "--confirm"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("$machine.dat"), std::string::npos) << outcome.err;
  EXPECT_EQ(asked("POST /v1/frames"), 0U) << "nor the tool before it";
}

TEST_F(FramesSent, AreNoneOfATipThatTheTouchesDidNotMeasure) {
  const Outcome outcome = send({"--confirm", "--other-calibration"}, "as stated.json");
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("xyz_sigma_mm"), std::string::npos) << outcome.err;
  EXPECT_EQ(asked("POST /v1/frames"), 0U);
}

TEST_F(FramesSent, AreNoneWhereNobodyConfirmed) {
  const Outcome outcome = send({});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("--confirm"), std::string::npos) << outcome.err;
  EXPECT_EQ(asked("POST /v1/frames"), 0U);
  EXPECT_EQ(frames({"--restore", "7"}).status, 1);
  EXPECT_EQ(asked("POST /v1/frames/restore"), 0U);
}

TEST_F(FramesSent, ThatAreUnknownAreNoSuccess) {
  status_ = 502;
  const Outcome outcome = send({"--confirm"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("TOOL_DATA[1]: unknown"), std::string::npos) << outcome.err;
  EXPECT_EQ(frames({"--restore", "7", "--confirm"}).status, 1);
  const Outcome as_json = send({"--confirm", "--json"});
  EXPECT_EQ(as_json.status, 1);
  EXPECT_EQ(json::parse(as_json.out).at(0).at("id"), 8) << "its number for --restore";
}

TEST_F(FramesSent, AreAllReadAndShownBeforeTheFirstAndToldWhereOneFails) {
  std::ofstream(dir_ / "$machine.dat") << "$ROBROOT={X 0.0,Y 0.0,Z 0.0,A 0.0,B 0.0,C 0.0}\n";
  const std::vector<std::string> two{"--base", "3=S1,S2,S3", "--confirm", "--config",
                                     dir_ / "$machine.dat"};
  good_sets_ = 1;
  status_ = 409;
  const Outcome outcome = send(two);
  EXPECT_EQ(outcome.status, 1);
  ASSERT_EQ(asked_.size(), 6U);
  EXPECT_EQ(asked_[3].first, "POST /v1/frames/read") << "the second, before the first is set";
  EXPECT_NE(outcome.err.find("BASE_DATA[3] moves by "), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("1 of 2 frames set before that"), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("TOOL_DATA[1]: 'cellcal frames --restore 8'"), std::string::npos)
      << outcome.err;
}

TEST_F(FramesSent, ThatWereNeverSentAreNotAskedFor) {
  const Outcome outcome = frames({"--restore", "9"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("no frame was sent under number 9"), std::string::npos) << outcome.err;
  problem_ = true;
  EXPECT_NE(frames({"--restore", "7"}).err.find("frames.json is damaged"), std::string::npos);
  EXPECT_EQ(asked("POST /v1/frames/read"), 0U);
}

TEST_F(FramesSent, AreNeverThoseOfAWithheldCalibration) {
  EXPECT_EQ(send({"--confirm"}, "withheld.json").status, 3);
  EXPECT_EQ(send({"--confirm", "--withheld"}, "withheld.json").status, 3);
  EXPECT_TRUE(asked_.empty());
}

TEST_F(FramesSent, AreThoseOfTheCalibrationInUseUnlessAnotherIsAskedFor) {
  in_use_ = calib::calibration_to_json(calibration(2));
  const Outcome outcome = send({"--confirm"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("not the calibration in use on this daemon (session 2)"),
            std::string::npos)
      << outcome.err;
  in_use_.clear();
  EXPECT_NE(send({"--confirm"}).err.find("--other-calibration"), std::string::npos);
  EXPECT_EQ(asked("POST /v1/frames"), 0U);
  EXPECT_EQ(send({"--confirm", "--other-calibration"}).status, 0);
  EXPECT_EQ(asked("POST /v1/frames"), 1U);
}

TEST_F(FramesSent, AreNoneWhereConfigDatIsOfAnotherController) {
  std::ofstream(dir_ / "$config.dat")
      << "TOOL_DATA[1]={X 59.9,Y 50.6,Z 410.3,A 38.84,B 3.59,C 0.0}\n";
  const Outcome outcome = send({"--confirm", "--config", dir_ / "$config.dat"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("the controller's own $config.dat"), std::string::npos) << outcome.err;
  EXPECT_EQ(asked("POST /v1/frames"), 0U);
}

TEST_F(FramesSent, AreListedAndSetBack) {
  EXPECT_NE(frames({"--sent"}).out.find("unknown   by anna (r): read it"), std::string::npos)
      << frames({"--sent"}).out;
  const Outcome back = frames({"--restore", "7", "--confirm"});
  ASSERT_EQ(back.status, 0) << back.err;
  EXPECT_NE(back.err.find("TOOL_DATA[1] now  {X 59.9000"), std::string::npos) << back.err;
  EXPECT_EQ(asked_.back().second["id"], 7);
}

TEST_F(FramesSent, AndWrongUseIsToldByStatus2) {
  EXPECT_EQ(frames({}).status, 2);
  EXPECT_EQ(frames({"--send"}).status, 2);
  EXPECT_EQ(frames({"--sent", "--restore", "7"}).status, 2);
}

}  // namespace
}  // namespace cellcal::daemon::testing
