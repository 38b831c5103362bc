// TLS, passwords and rights, with Debian's mosquitto and the shipped configuration.

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>
#include <thread>

#include "broker.h"
#include "cell_line.h"
#include "listener.h"
#include "tests/daemon/journal/images.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using plant::LineProblem;

constexpr const char* kFact = R"({"format":"cellcal.plant/1"})";

/// `name`.pem and .key, signed by `by`; self-signed if that is empty.
void make_certificate(const std::filesystem::path& dir, const std::string& name,
                      const std::string& by) {
  std::vector<std::string> words{"openssl",
                                 "req",
                                 "-x509",
                                 "-newkey",
                                 "ec",
                                 "-pkeyopt",
                                 "ec_paramgen_curve:prime256v1",
                                 "-nodes",
                                 "-days",
                                 "2",
                                 "-keyout",
                                 dir / (name + ".key"),
                                 "-out",
                                 dir / (name + ".pem"),
                                 "-subj",
                                 "/CN=" + name};
  if (!by.empty())
    for (const std::string& word : std::vector<std::string>{
             "-CA", dir / (by + ".pem"), "-CAkey", dir / (by + ".key"), "-addext",
             "subjectAltName=IP:127.0.0.1", "-addext", "basicConstraints=critical,CA:FALSE"})
      words.push_back(word);
  run_tool(words);
}

struct BrokerOfAPlant : ::testing::Test {
  BrokerOfAPlant() {
    make_certificate(dir.path(), "ca", "");
    make_certificate(dir.path(), "broker", "ca");
    std::ofstream(dir / "passwords");
    for (const char* user : {"weld-3", "weld-4", "collector", "plant-operator", "sparkplug-host"})
      run_tool({"mosquitto_passwd", "-b", dir / "passwords", user, std::string("pw-") + user});
    broker = std::make_unique<Broker>(dir.path(), conf());
  }

  /// The shipped file, with the paths and the plant of this test.
  static std::string shipped(const std::string& name) {
    std::ifstream file(std::filesystem::path(CELLCAL_BROKER_FILES) / name);
    std::stringstream text;
    text << file.rdbuf();
    EXPECT_FALSE(text.str().empty()) << name;
    return text.str();
  }
  std::string conf() {
    std::ofstream(dir / "acl") << replaced(shipped("cellcal.acl"), "PLANT", "graz");
    std::string text = shipped("cellcal.conf");
    text = replaced(text, "listener 8883\n", "");
    text = replaced(text, "/etc/mosquitto/cellcal/", dir.path().string() + "/");
    return text;
  }
  static std::string replaced(std::string text, const std::string& what, const std::string& by) {
    EXPECT_NE(text.find(what), std::string::npos) << what;
    for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
      text.replace(at, what.size(), by);
    return text;
  }

  Login login(const std::string& user) const { return {user, "pw-" + user, dir / "ca.pem"}; }
  CellLine::Parts parts(Journal& journal) const {
    PlantConfig plant;
    plant.plant = "graz";
    plant.cell = plant.user = "weld-3";
    plant.host = "127.0.0.1";
    plant.port = broker->port();
    plant.ca = dir / "ca.pem";
    plant.password_file = dir / "pw";
    std::ofstream(dir / "pw") << "pw-weld-3\n";
    CellLine::Parts all{journal, plant};
    all.first_wait = all.longest_wait = all.refused_wait = std::chrono::milliseconds(50);
    return all;
  }
  LineProblem problem_of(CellLine::Parts wrong) const {
    const CellLine running(std::move(wrong));
    for (int i = 0; i < 3000 && running.status().problem == LineProblem::kNone; ++i)
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    EXPECT_FALSE(running.status().connected);
    EXPECT_NE(running.status().words.find("under [plant]"), std::string::npos)
        << running.status().words;
    return running.status().problem;
  }

  TemporaryDirectory dir;
  std::unique_ptr<Broker> broker;
};

TEST_F(BrokerOfAPlant, IsSpokenToOverTlsWithAPassword) {
  Listener collector(broker->port(), "collector", "$share/collectors/cellcal/+/+/fact/#",
                     login("collector"));
  Journal journal(dir / "j.db");
  const CellLine running(parts(journal));
  fill(journal, 1);
  const auto heard = collector.until([](const auto& all) { return !all.empty(); });
  EXPECT_EQ(heard[0].topic, "cellcal/graz/weld-3/fact/session");
}

TEST_F(BrokerOfAPlant, IsRefusedByNameWhereItIsNotVouchedFor) {
  make_certificate(dir.path(), "other", "");
  Journal journal(dir / "j.db");
  CellLine::Parts wrong = parts(journal);
  wrong.config.ca = dir / "other.pem";
  EXPECT_EQ(problem_of(wrong), LineProblem::kCertificate);
  wrong.config.ca = dir / "none.pem";
  EXPECT_EQ(problem_of(wrong), LineProblem::kFiles);
  CellLine::Parts misnamed = parts(journal);
  misnamed.config.host = "localhost";  // not the name in the certificate
  EXPECT_EQ(problem_of(misnamed), LineProblem::kCertificate);
}

TEST_F(BrokerOfAPlant, RefusesAWrongPasswordAndTheCellSaysSo) {
  Journal journal(dir / "j.db");
  CellLine::Parts wrong = parts(journal);
  std::ofstream(dir / "pw") << "guessed\n";
  EXPECT_EQ(problem_of(wrong), LineProblem::kLogin);
  wrong.config.user.clear();
  EXPECT_EQ(problem_of(wrong), LineProblem::kLogin) << "nobody speaks without a name";
}

TEST_F(BrokerOfAPlant, LetsNoCellSpeakForAnother) {
  Listener cell(broker->port(), "thief", "", login("weld-4"));
  const auto refused = [&](const char* topic) {
    return cell.say(topic, kFact).value_or(0x80) >= 0x80;
  };
  EXPECT_FALSE(refused("cellcal/graz/weld-4/fact/alarm"));
  EXPECT_FALSE(refused("cellcal/graz/weld-4/presence"));
  EXPECT_FALSE(refused("cellcal/graz/weld-4/proposal/p-1")) << "it takes away what it has answered";
  EXPECT_TRUE(refused("cellcal/graz/weld-3/fact/alarm"));
  EXPECT_TRUE(refused("cellcal/graz/weld-3/presence"));
  EXPECT_TRUE(refused("cellcal/linz/weld-4/fact/alarm")) << "nor in another plant";
  EXPECT_TRUE(refused("cellcal/graz/weld-3/proposal/p-1"));
  EXPECT_TRUE(refused("cellcal/graz/weld-4/stored")) << "nor vouch for the plant";
}

TEST_F(BrokerOfAPlant, LetsEachCellBeItsOwnSparkplugNodeAndAHostAskItForABirth) {
  Listener host(broker->port(), "host", "spBv1.0/#", login("sparkplug-host"));
  Listener other(broker->port(), "other", "spBv1.0/#", login("weld-3"));
  Listener cell(broker->port(), "cell", "", login("weld-4"));
  for (const char* type : {"NBIRTH", "NDATA", "NDEATH"})
    cell.say("spBv1.0/graz/" + std::string(type) + "/weld-4", "p");
  host.say("spBv1.0/graz/NCMD/weld-3", "p");
  const auto born = host.until([](const auto& all) { return all.size() >= 4; });
  EXPECT_EQ(born[2].topic, "spBv1.0/graz/NDEATH/weld-4");
  const auto asked = other.until([](const auto& all) { return !all.empty(); });
  EXPECT_EQ(asked[0].topic, "spBv1.0/graz/NCMD/weld-3");
  EXPECT_EQ(other.all().size(), 1u) << "it hears no other cell";
}

TEST_F(BrokerOfAPlant, LetsNoCellBeAnothersSparkplugNode) {
  for (const char* topic : {"spBv1.0/graz/NBIRTH/weld-3", "spBv1.0/graz/NDEATH/weld-3",
                            "spBv1.0/graz/NCMD/weld-3", "spBv1.0/STATE/host"}) {
    Listener thief(broker->port(), "thief", "", login("weld-4"));
    EXPECT_GE(thief.say(topic, "p").value_or(0x80), 0x80) << topic;
  }
  Listener host(broker->port(), "host", "", login("sparkplug-host"));
  EXPECT_GE(host.say("spBv1.0/graz/NBIRTH/weld-4", "p").value_or(0x80), 0x80)
      << "a host is no node";
}

TEST_F(BrokerOfAPlant, LetsACellHearNoFactsOfOthersAndNoOtherCellsProposals) {
  Listener curious(broker->port(), "curious", "#", login("weld-4"));
  Listener collector(broker->port(), "collector", "cellcal/#", login("collector"));
  Listener planner(broker->port(), "planner", "", login("plant-operator"));
  Listener cell(broker->port(), "cell", "", login("weld-3"));
  EXPECT_LT(cell.say("cellcal/graz/weld-3/fact/alarm", kFact).value_or(0x80), 0x80);
  EXPECT_LT(planner.say("cellcal/graz/weld-3/proposal/p-1", kFact).value_or(0x80), 0x80);
  EXPECT_LT(planner.say("cellcal/graz/weld-4/proposal/p-1", kFact).value_or(0x80), 0x80);
  EXPECT_GE(collector.say("cellcal/graz/weld-4/proposal/p-1", kFact).value_or(0x80), 0x80)
      << "it proposes nothing";
  EXPECT_GE(planner.say("cellcal/graz/weld-4/fact/alarm", kFact).value_or(0x80), 0x80);
  collector.until([](const auto& all) { return all.size() >= 1; });
  const auto heard = curious.until([](const auto& all) { return !all.empty(); });
  ASSERT_EQ(heard.size(), 1u);
  EXPECT_EQ(heard[0].topic, "cellcal/graz/weld-4/proposal/p-1");
}

}  // namespace
}  // namespace cellcal::daemon::testing
