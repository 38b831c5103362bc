#pragma once
// A daemon with the emulated cell in its own directory.

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <thread>

#include "daemon/api/http/http.h"
#include "tests/daemon/cli/content.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {

/// A fast arm, for tests that do not concern the motion.
inline constexpr const char* kFast =
    "[motion]\nspeed_percent = 80\nacceleration_deg_s2 = 600\njerk_deg_s3 = 8000\n";

class DaemonFixture {
 public:
  explicit DaemonFixture(const std::string& more = "") {
    std::ofstream(dir / "d.toml") << "format = \"cellcal.daemon/1\"\nbackend = \"mock\"\n"
                                  << "state_dir = \"" << (dir / "state").string() << "\"\n"
                                  << "socket = \"" << socket() << "\"\n"
                                  << more;
  }

  std::string socket() const { return dir / "s"; }
  std::string log() const { return content(dir / "log"); }

  void start(const std::vector<std::string>& environment = {}) {
    daemon = std::make_unique<Background>(
        std::vector<std::string>{CELLCALD, "--config", dir / "d.toml"}, dir / "log", environment);
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (std::chrono::steady_clock::now() < end) {
      try {
        http_request(socket(), "GET", "/v1/status");
        return;
      } catch (const SocketError&) {  // not up yet
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
      }
    }
    FAIL() << "the daemon does not answer: " << log();
  }

  Outcome cellcal(std::vector<std::string> arguments) const {
    arguments.insert(arguments.begin(), CELLCAL);
    arguments.insert(arguments.end(), {"--socket", socket()});
    return run_program(arguments);
  }
  nlohmann::json get(const std::string& path) const {
    return nlohmann::json::parse(http_request(socket(), "GET", path).body);
  }
  nlohmann::json status() const { return get("/v1/status"); }
  Response begin(const nlohmann::json& session) const {
    return http_request(socket(), "POST", "/v1/run", session.dump());
  }
  void refuse(const nlohmann::json& session, int status, const std::string& words) const {
    const Response answer = begin(session);
    EXPECT_EQ(answer.status, status) << answer.body;
    EXPECT_NE(answer.body.find(words), std::string::npos) << answer.body;
  }
  /// Waits until this many touches are on disk.
  void wait_for_touches(int touches) const {
    const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (status()["touches"] < touches && std::chrono::steady_clock::now() < end) {
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    ASSERT_GE(status()["touches"], touches) << log();
  }

  TemporaryDirectory dir;
  std::unique_ptr<Background> daemon;
};

}  // namespace cellcal::daemon::testing
