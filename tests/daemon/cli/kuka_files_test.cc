// 'cellcal kuka-files' and 'cellcal doctor' as processes.

#include <gtest/gtest.h>
#include <zip.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/daemon/cli/content.h"
#include "tests/daemon/cli/process.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

class KukaFiles : public ::testing::Test {
 protected:
  void configure(const std::string& more, const std::string& backend = "eki") {
    std::ofstream(dir / "d.toml") << "format = \"cellcal.daemon/1\"\nbackend = \"" + backend +
                                         "\"\n[contact]\n"
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

TEST_F(KukaFiles, WritesTheSetOfTheConfigurationAndSaysWhereItGoes) {
  configure("[eki]\naddress = \"10.1.2.3\"\n[controller]\ninput = 33\n");
  const Outcome outcome = make();
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  EXPECT_NE(outcome.out.find("EthernetKRL"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("$IN[33]"), std::string::npos) << outcome.out;
  EXPECT_NE(outcome.out.find("WorkVisual project: add the files"), std::string::npos)
      << "a deployment may remove what was copied: " << outcome.out;
  const std::filesystem::path folder = dir.path() / "krc/new";
  EXPECT_NE(content(folder / "CellcalEki.xml").find("<IP>10.1.2.3</IP>"), std::string::npos);
  EXPECT_NE(content(folder / "cellcal_eki.src").find("$IN[33]==TRUE"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(folder / "cellcal_eki.dat"));
  EXPECT_TRUE(std::filesystem::exists(folder / "cellcal_sub.sub"));
}

TEST_F(KukaFiles, TellsProgramsTheSameAsJson) {
  configure("");
  const Outcome outcome = make({"--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  const auto json = nlohmann::json::parse(outcome.out);
  ASSERT_EQ(json.at("files").size(), 5u);
  for (const auto& one : json.at("files")) {
    EXPECT_TRUE(std::filesystem::exists(one.at("file").get<std::string>()));
    EXPECT_FALSE(one.at("goes_to").get<std::string>().empty());
  }
}

TEST_F(KukaFiles, WritesRsisSetWhereItIsAskedFor) {
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

TEST_F(KukaFiles, OfRsiNeedAnAddressThatTheControllerCanSendTo) {
  configure("");
  const Outcome outcome = make({"--wire", "rsi"});
  EXPECT_EQ(outcome.status, 1);
  // The key, its file, and the available addresses.
  for (const char* word : {"d.toml", "[controller]", "pc_address = \"A.B.C.D\"", "127.0.0.1"}) {
    EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
}

TEST_F(KukaFiles, OfRsi3AreOneUnitOfThreeAndWhatBelongsToIt) {
  configure("[rsi]\nbind = \"10.0.0.5\"\n[controller]\nrsi_version = 3\n");
  const Outcome outcome = make({"--wire", "rsi", "--json"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  for (const char* name : {"cellcal_rsi.rsi", "cellcal_rsi.rsi.xml", "cellcal_rsi.rsi.diagram"}) {
    EXPECT_TRUE(std::filesystem::exists(dir.path() / "krc/new" / name)) << name;
  }
  const auto json = nlohmann::json::parse(outcome.out);
  for (const auto& one : json.at("files")) {
    const std::string file = one.at("file"), place = one.at("goes_to");
    EXPECT_EQ(place.find("SensorInterface") == std::string::npos, file.ends_with(".src")) << file;
  }
}

TEST_F(KukaFiles, OfRsi6AreImportedIntoAProjectAndThereAreNoneOfEki) {
  configure("[rsi]\nbind = \"10.0.0.5\"\n[controller]\nrsi_version = 6\n", "rsi");
  const Outcome outcome = make({"--wire", "rsi"});
  ASSERT_EQ(outcome.status, 0) << outcome.err;
  for (const char* words : {"KRC/R1/Program", "iiQKA.RobotSensorInterface, Context",
                            "Ethernet configurations", "deploy"})
    EXPECT_NE(outcome.out.find(words), std::string::npos) << words << outcome.out;
  EXPECT_EQ(outcome.out.find("WorkVisual"), std::string::npos) << outcome.out;
  const Outcome eki = make({"--wire", "eki"});
  EXPECT_EQ(eki.status, 1);
  EXPECT_NE(eki.err.find("EthernetKRL 6 is not supported"), std::string::npos) << eki.err;
}

TEST_F(KukaFiles, OfAReleaseThatIsNotServedNameThoseThatAre) {
  configure("[rsi]\nbind = \"10.0.0.5\"\n[controller]\nrsi_version = 7\n");
  const Outcome outcome = make({"--wire", "rsi"});
  EXPECT_EQ(outcome.status, 1);
  for (const char* words : {"d.toml", "rsi_version",
                            "3 (KSS 8.2 to 8.4), 4 (KSS 8.5 and 8.6), 5 "
                            "(KSS 8.7) or 6 (iiQKA.OS2)",
                            "EthernetKRL 6"})
    EXPECT_NE(outcome.err.find(words), std::string::npos) << words << outcome.err;
}

TEST_F(KukaFiles, ThatWereMadePassAndThatWereEditedAreRefusedByLine) {
  configure("[rsi]\nbind = \"10.0.0.5\"\n");
  ASSERT_EQ(make({"--wire", "rsi"}).status, 0);
  const std::vector<std::string> verify{CELLCAL,  "kuka-files", "--config", dir / "d.toml",
                                        "--wire", "rsi",        "--verify", dir / "krc/new"};
  const Outcome sound = run_program(verify);
  EXPECT_EQ(sound.status, 0) << sound.out << sound.err;
  EXPECT_EQ(sound.out.rfind("ok", 0), 0u) << sound.out;
  configure("[rsi]\nbind = \"10.0.0.5\"\nsentype = \"Other\"\nport = 50000\n");
  const Outcome other = run_program(verify);
  EXPECT_EQ(other.status, 1);
  EXPECT_NE(other.err.find("cellcal_rsi_ethernet.xml:7: PORT is 49152"), std::string::npos)
      << other.err;
  EXPECT_NE(other.err.find("and 1 more"), std::string::npos) << other.err;
  EXPECT_NE(other.out.find("SENTYPE is \"ImFree\""), std::string::npos) << other.out;
  std::vector<std::string> as_json = verify;
  as_json.emplace_back("--json");
  const auto json = nlohmann::json::parse(run_program(as_json).out);
  EXPECT_EQ(json.at("fits"), false);
  EXPECT_EQ(json.at("objections").size(), 2u);
}

TEST_F(KukaFiles, AreVerifiedInABackupToo) {
  configure("[rsi]\nbind = \"10.0.0.5\"\n");
  ASSERT_EQ(make({"--wire", "rsi"}).status, 0);
  const std::string zip = dir / "backup.ZIP";
  zip_t* archive = zip_open(zip.c_str(), ZIP_CREATE, nullptr);
  const auto add = [&](const std::string& path, const std::string& file) {
    zip_file_add(archive, path.c_str(), zip_source_file(archive, file.c_str(), 0, -1), 0);
  };
  for (const auto& one : std::filesystem::directory_iterator(dir / "krc/new"))
    add("C/KRC/" + one.path().filename().string(), one.path());
  add("KRC/R1/other.xml", dir / "d.toml");
  ASSERT_EQ(zip_close(archive), 0);
  const auto verify = [&] {
    return run_program(
        {CELLCAL, "kuka-files", "--config", dir / "d.toml", "--wire", "rsi", "--verify", zip});
  };
  const Outcome sound = verify();
  EXPECT_EQ(sound.out.rfind("ok", 0), 0u) << sound.out << sound.err;
  configure("[rsi]\nbind = \"10.0.0.5\"\nport = 50000\n");
  EXPECT_NE(verify().err.find("cellcal_rsi_ethernet.xml:7: PORT is 49152"), std::string::npos);
}

TEST_F(KukaFiles, OfRsiKeepTheRangesOfTheCellsRobot) {
  configure("[rsi]\nbind = \"10.0.0.5\"\n");
  const std::string cell = CELLCAL_DEMO_CELL;
  const Outcome without = make({"--wire", "rsi"});
  EXPECT_NE(without.out.find("no --cell CELL"), std::string::npos) << without.out;
  const std::vector<std::string> verify{CELLCAL,  "kuka-files", "--config", dir / "d.toml",
                                        "--wire", "rsi",        "--verify", dir / "krc/new",
                                        "--cell", cell};
  const Outcome wide = run_program(verify);
  EXPECT_EQ(wide.status, 0) << wide.err;
  EXPECT_NE(wide.out.find("without the cell's ranges"), std::string::npos) << wide.out;
  ASSERT_EQ(make({"--wire", "rsi", "--cell", cell}).status, 0);
  EXPECT_NE(content(dir / "krc/new/cellcal_rsi.src").find("CC_LOW($SOFTN_END[1],-155.1,"),
            std::string::npos);
  EXPECT_EQ(run_program(verify).out.rfind("ok", 0), 0U);
}

TEST_F(KukaFiles, NeedAFolderToGoToOrOneToLookAt) {
  configure("");
  const Outcome neither = run_program({CELLCAL, "kuka-files", "--config", dir / "d.toml"});
  EXPECT_EQ(neither.status, 2);
  EXPECT_NE(neither.err.find("--verify"), std::string::npos) << neither.err;
  EXPECT_EQ(make({"--verify", dir.path().string()}).status, 2);
}

TEST_F(KukaFiles, ThatAreNotThereAreNamed) {
  configure("");
  const Outcome none =
      run_program({CELLCAL, "kuka-files", "--config", dir / "d.toml", "--verify", dir / "nowhere"});
  EXPECT_EQ(none.status, 1);
  EXPECT_NE(none.err.find("nowhere"), std::string::npos) << none.err;
}

TEST(Doctor, PrintsALineForEachCheckAndFailsWithOneReason) {
  const TemporaryDirectory dir;
  std::ofstream(dir / "d.toml") << "format = \"cellcal.daemon/1\"\nbackend = \"mock\"\nsocket = \""
                                << (dir / "s").string() << "\"\n";
  const Outcome green = run_program({CELLCAL, "doctor", "--config", dir / "d.toml"});
  EXPECT_EQ(green.status, 0) << green.err;
  EXPECT_EQ(green.out.rfind("ok       configuration", 0), 0u) << green.out;
  EXPECT_NE(green.out.find("read the warnings"), std::string::npos) << green.out;
  EXPECT_TRUE(green.err.empty()) << green.err;
  const Outcome red =
      run_program({CELLCAL, "doctor", "--config", dir / "d.toml", "--cell", dir / "none.toml"});
  EXPECT_EQ(red.status, 1);
  EXPECT_EQ(red.err, "cellcal doctor: cell file failed\n");
  EXPECT_NE(red.out.find("FAILED   cell file"), std::string::npos) << red.out;
  EXPECT_EQ(run_program({CELLCAL, "doctor", "--for", "0"}).status, 2);
  EXPECT_NE(run_program({CELLCAL, "doctor", "--help"}).out.find("Example: cellcal doctor"),
            std::string::npos);
}

TEST_F(KukaFiles, FailsByFileAndKeyAndWritesNothing) {
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
