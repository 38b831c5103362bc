// 'cellcal kuka-files' as a process.

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

std::string content(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::stringstream text;
  text << file.rdbuf();
  return text.str();
}

class kuka_files : public ::testing::Test {
 protected:
  void configure(const std::string& more) {
    std::ofstream(dir / "d.toml") << "format = \"cellcal.daemon/1\"\nbackend = \"eki\"\n[contact]\n"
                                     "device = \"/dev/ttyUSB0\"\n"
                                  << more;
  }
  Outcome make(std::vector<std::string> more = {}) {
    std::vector<std::string> arguments{CELLCAL,        "kuka-files", "--config",
                                       dir / "d.toml", "-o",         dir / "krc/new"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return run_program(arguments);
  }
  TemporaryDirectory dir;
};

TEST_F(kuka_files, writes_the_set_of_the_configuration_and_says_where_it_goes) {
  configure("[eki]\naddress = \"10.1.2.3\"\n[controller]\ninput = 33\n");
  const Outcome outcome = make();
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("EthernetKRL"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("$IN[33]"), std::string::npos) << outcome.out;
  const std::filesystem::path folder = dir.path() / "krc/new";
  EXPECT_NE(content(folder / "CellcalEki.xml").find("<IP>10.1.2.3</IP>"), std::string::npos);
  EXPECT_NE(content(folder / "cellcal_eki.src").find("$IN[33]==TRUE"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder / "cellcal_eki.dat"));
  EXPECT_TRUE(std::filesystem::exists(folder / "cellcal_sub.sub"));
}

TEST_F(kuka_files, tells_programs_the_same_as_json) {
  configure("");
  const Outcome outcome = make({"--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  ASSERT_EQ(json.at("files").size(), 4u);
  for (const auto& one : json.at("files")) {
    EXPECT_TRUE(std::filesystem::exists(one.at("file").get<std::string>()));
    EXPECT_FALSE(one.at("goes_to").get<std::string>().empty());
  }
}

TEST_F(kuka_files, writes_rsis_set_where_it_is_asked_for) {
  configure("[rsi]\nsentype = \"Cellcal\"\nbind = \"10.0.0.5\"\n[controller]\nrsi_version = 3\n");
  const Outcome outcome = make({"--wire", "rsi"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("SensorInterface"), std::string::npos) << outcome.out;
  const std::filesystem::path folder = dir.path() / "krc/new";
  const std::string channel = content(folder / "cellcal_rsi_ethernet.xml");
  EXPECT_NE(channel.find("<SENTYPE>Cellcal</SENTYPE>"), std::string::npos);
  EXPECT_NE(channel.find("<IP_NUMBER>10.0.0.5</IP_NUMBER>"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder / "cellcal_rsi.rsi.xml"));
  EXPECT_FALSE(std::filesystem::exists(folder / "CellcalEki.xml"));
}

TEST_F(kuka_files, of_rsi_need_an_address_that_the_controller_can_send_to) {
  configure("");
  const Outcome outcome = make({"--wire", "rsi"});
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("pc_address"), std::string::npos) << outcome.err;
}

TEST_F(kuka_files, fails_by_file_and_key_and_writes_nothing) {
  configure("[controller]\ninput = 0\n");
  const Outcome outcome = make();
  EXPECT_EQ(outcome.status, 1);
  EXPECT_NE(outcome.err.find("input"), std::string::npos) << outcome.err;
  EXPECT_FALSE(std::filesystem::exists(dir.path() / "krc"));
  configure("[eki]\naddress = \"krc.local\"\n");
  EXPECT_EQ(make().status, 1);
  EXPECT_FALSE(std::filesystem::exists(dir.path() / "krc"));
}

}  // namespace
}  // namespace cellcal::daemon::testing
