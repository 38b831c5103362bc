// Operator commands and their effect on the controllers. Independent of timing.

#include "sim/emulator/control.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <future>
#include <stdexcept>
#include <thread>

#include "drivers/kuka/krl/krl_files.h"
#include "sim/krc/eki_server.h"
#include "sim/krc/krc_udp.h"

namespace cellcal::sim {
namespace {

bool has(const std::string& text, const std::string& words) {
  return text.find(words) != std::string::npos;
}

/// Without a peer: its messages concern the operator only.
KrcUdp lonely() {
  ControllerConfig config;
  config.timeout_cycles = 1'000'000'000;
  return KrcUdp(config, {});
}

TEST(Operator, StopsAndResetsRsi) {
  KrcUdp krc = lonely();
  krc.start();
  EXPECT_TRUE(has(obey(krc, "status"), "RSI runs"));
  EXPECT_TRUE(has(obey(krc, " estop "), "EMERGENCY STOP"));
  EXPECT_TRUE(has(obey(krc, "reset"), "is pressed"));
  EXPECT_TRUE(has(obey(krc, "release"), "RSI stopped")) << "nothing starts by itself";
  EXPECT_TRUE(has(obey(krc, "reset"), "RSI runs"));
  EXPECT_TRUE(has(obey(krc, "drives off"), "Drives off"));
  EXPECT_TRUE(has(obey(krc, "reset"), "Drives are off"));
  EXPECT_TRUE(has(obey(krc, "drives on"), "RSI stopped"));
  EXPECT_TRUE(has(obey(krc, "reset"), "RSI runs"));
  EXPECT_TRUE(has(obey(krc, "cancel"), "cancelled"));
  EXPECT_TRUE(has(obey(krc, "t1"), "RSI stopped"));
  EXPECT_TRUE(has(obey(krc, "reset"), "RSI runs"));
  EXPECT_TRUE(has(obey(krc, "override 30"), "RSI runs")) << "it does not scale corrections";
  EXPECT_TRUE(has(obey(krc, "start off"), "Start key released"));
  EXPECT_TRUE(has(obey(krc, "aut"), "RSI stopped"));
  EXPECT_TRUE(has(obey(krc, "reset"), "RSI runs"));
  EXPECT_TRUE(has(obey(krc, "ext"), "RSI stopped"));
  EXPECT_TRUE(has(obey(krc, "reset"), "RSI runs"));
  EXPECT_TRUE(has(obey(krc, "block on"), "RSI runs"));
  EXPECT_TRUE(has(obey(krc, "unplug"), "RSI runs"));
}

TEST(Operator, CommandsNobodyKnowsAreAnsweredWithTheList) {
  KrcUdp krc = lonely();
  for (const char* line :
       {"jump", "drives", "drives maybe", "estop now", "override", "override 101", "override 50x"})
    EXPECT_TRUE(has(obey(krc, line), "Commands:")) << line;
  EXPECT_EQ(obey(krc, "  "), "");
}

/// Within the programs' first passes.
bool becomes_ready(EkiServer& krc) {
  for (int i = 0; i < 1000; ++i) {
    if (obey(krc, "status").rfind("ready", 0) == 0) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  return false;
}

TEST(Operator, StopsAndResetsTheEkiProgram) {
  EkiControllerConfig config;
  config.files = drivers::eki_files({});
  EkiServerOptions options;
  options.port = 0;
  EkiServer krc(config, options);
  krc.start();
  EXPECT_TRUE(becomes_ready(krc));
  EXPECT_TRUE(has(obey(krc, "status"), "ready, no client"));
  EXPECT_TRUE(has(obey(krc, "estop"), "not ready"));
  EXPECT_TRUE(has(obey(krc, "release"), "not ready"));
  EXPECT_TRUE(has(obey(krc, "reset"), "ready"));
  EXPECT_TRUE(becomes_ready(krc));
  EXPECT_EQ(obey(krc, "override 30").rfind("ready", 0), 0u);
  EXPECT_TRUE(has(obey(krc, "override 300"), "Commands:"));
  EXPECT_EQ(obey(krc, "reconfigure").rfind("ready", 0), 0u);
  EXPECT_TRUE(has(obey(krc, "t2"), "not ready"));
}

TEST(Operator, ReadsAFaultOfTheEkiProgram) {
  drivers::EkiFilesConfig files;
  files.tool = 20;  // beyond TOOL_DATA[16]
  EkiControllerConfig config;
  config.files = drivers::eki_files(files);
  EkiServerOptions options;
  options.port = 0;
  EkiServer krc(config, options);
  krc.start();
  std::string status;
  for (int i = 0; i < 1000 && !has(status, "pendant: "); ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
    status = obey(krc, "status");
  }
  EXPECT_TRUE(has(status, "not ready")) << status;
  EXPECT_TRUE(has(status, "pendant: cellcal_eki.src")) << status;
}

TEST(Operator, FifoIsMadeAndGivesLineByLine) {
  const std::string path =
      (std::filesystem::temp_directory_path() / ("cellcal_control_" + std::to_string(::getpid())))
          .string();
  std::promise<void> both;
  std::vector<std::string> lines;
  {
    Control control(path, [&](std::string_view line) {
      lines.emplace_back(line);
      if (lines.size() == 2) both.set_value();
      return std::string();
    });
    const int writer = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
    ASSERT_GE(writer, 0);
    ASSERT_EQ(::write(writer, "drives o", 8), 8);
    ASSERT_EQ(::write(writer, "ff\nstatus\n", 10), 10);
    ::close(writer);
    both.get_future().wait();
  }
  std::filesystem::remove(path);
  EXPECT_EQ(lines, (std::vector<std::string>{"drives off", "status"}));
  EXPECT_THROW(Control("/nowhere/at/all", [](std::string_view) { return std::string(); }),
               std::runtime_error);
}

}  // namespace
}  // namespace cellcal::sim
