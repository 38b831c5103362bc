// A daemon with the emulated cell, and Debian's mosquitto.

#include <gtest/gtest.h>

#include <algorithm>
#include <set>
#include <thread>

#include "calib/files/input_file.h"
#include "daemon/journal/journal.h"
#include "daemon/plant/line/edge_node.h"
#include "daemon/plant/messages/fact.h"
#include "daemon_fixture.h"
#include "tests/daemon/certificate/recorded.h"
#include "tests/daemon/plant/line/broker.h"
#include "tests/daemon/plant/line/listener.h"

namespace cellcal::daemon::testing {
namespace {

std::string plant_of(const Broker& broker) {
  return "[plant]\nplant = \"graz\"\ncell = \"weld-3\"\nbroker = \"127.0.0.1\"\ntls = false\nport = " +
         std::to_string(broker.port()) + "\ntouches = true\n";
}

/// The process with the connection, and a supervisor that restarts it.
struct Line : Background {
  explicit Line(const DaemonFixture& fixture)
      : Background({CELLCAL_PLANT, "--socket", fixture.dir / "plant/s", "--longest-wait", "1"},
                   fixture.dir / "plant.log") {}
};

TEST(ASession, IsToldOfToThePlantWholeInOrderAndOnce) {
  const TemporaryDirectory broker_dir;
  Broker broker(broker_dir.path());
  Listener plant(broker.port(), "plant", "cellcal/#");
  DaemonFixture fixture(plant_of(broker));
  fixture.start();
  Line line(fixture);
  const Outcome run =
      fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "8", "--check", "2"});
  ASSERT_EQ(run.status, 3) << run.err << fixture.log();
  // The final phase may follow the alarm, which is written with the end.
  const auto heard = plant.until([](const auto& all) {
    return std::ranges::count(all, "cellcal/graz/weld-3/fact/alarm", &Heard::topic) > 0;
  });
  const auto facts = facts_in(heard);
  std::size_t touches = 0, residuals = 0, phases = 0, calibrations = 0;
  for (std::size_t i = 0; i < facts.size(); ++i) {
    EXPECT_EQ(facts[i].number, static_cast<std::int64_t>(i) + 1);
    EXPECT_EQ(facts[i].session, 1);
    if (const auto* touch = std::get_if<plant::TouchFact>(&facts[i].body)) {
      EXPECT_TRUE(touch->tip_m) << "touch " << touch->index;
      residuals += touch->residual_m ? 1 : 0;
      ++touches;
    }
    phases += std::holds_alternative<plant::PhaseFact>(facts[i].body) ? 1 : 0;
    if (const auto* result = std::get_if<plant::CalibrationFact>(&facts[i].body)) {
      ++calibrations;
      EXPECT_TRUE(result->document ==
                  calib::read_file(fixture.dir / "state/sessions/1/calibration.json"))
          << "byte for byte";
      EXPECT_FALSE(result->robot.empty());
      ASSERT_TRUE(result->near_m);
      EXPECT_GT(result->u95_near_m.value_or(0.0), 0.0);
    }
  }
  EXPECT_EQ(touches, fixture.status()["touches"]);
  EXPECT_GE(residuals, 6u) << "there is none of one that the estimate cannot judge";
  EXPECT_GT(phases, touches);
  EXPECT_EQ(calibrations, 1u);
  for (const plant::Fact& fact : facts) {
    const auto* alarm = std::get_if<plant::AlarmFact>(&fact.body);
    EXPECT_TRUE(alarm == nullptr || alarm->news == "withheld");
  }
  EXPECT_TRUE(presence_in(heard)->mock);
  const auto stands = fixture.get("/v1/plant");
  EXPECT_EQ(stands["connected"], true) << stands;
  EXPECT_GE(stands["newest"], static_cast<std::int64_t>(facts.size()));
  EXPECT_EQ(std::ranges::count(plant.all(), "cellcal/graz/weld-3/fact/alarm", &Heard::topic), 1)
      << "once";
  line.signal(SIGTERM);
  EXPECT_EQ(line.wait(), 0);
  EXPECT_TRUE(presence_in(plant.until([](const auto& all) {
                return !presence_in(all)->online;
              }))->farewell);
}

TEST(ASession, IsSeenByASparkplugHostAndNoneBeginsByOne) {
  const TemporaryDirectory broker_dir;
  Broker broker(broker_dir.path());
  Listener host(broker.port(), "host", "spBv1.0/#");
  DaemonFixture fixture(plant_of(broker) + "sparkplug = true\n");
  fixture.start();
  Line line(fixture);
  const auto is = [](const Heard& one, const std::string& type) {
    return one.topic == "spBv1.0/graz/" + type + "/weld-3";
  };
  const auto has = [&](const std::string& type, const std::string& words) {
    return [=](const std::vector<Heard>& all) {
      return std::ranges::any_of(all, [&](const Heard& one) {
        return is(one, type) && one.payload.find(words) != std::string::npos;
      });
    };
  };
  host.until(has("NBIRTH", "Calibration/u95 mm"));
  const Outcome run =
      fixture.cellcal({"run", "--cell", CELLCAL_DEMO_CELL, "--touches", "8", "--check", "2"});
  ASSERT_EQ(run.status, 3) << run.err << fixture.log();
  host.until(has("NDATA", "Session/Touches"));
  host.until(has("NDATA", "done"));
  for (const char* command : {"NCMD", "DCMD"})
    for (const char* metric : {"State/Running", "Session/Number", "Node Control/Rebirth"})
      host.say(std::string("spBv1.0/graz/") + command + "/weld-3",
               plant::sparkplug::payload({{metric, plant::sparkplug::DataType::kBoolean, true}}, 1,
                                         std::nullopt, plant::sparkplug::Types::kDeclared));
  host.until([&](const auto& all) {
    return std::ranges::count_if(all, [&](const Heard& one) { return is(one, "NBIRTH"); }) == 2;
  });
  EXPECT_EQ(fixture.status()["phase"], "done");
  EXPECT_EQ(fixture.status()["session"], 1);
  const auto stands = fixture.get("/v1/plant");
  EXPECT_EQ(stands["sparkplug"]["connected"], true) << stands;
  fixture.daemon->signal(SIGTERM);
  EXPECT_EQ(fixture.daemon->wait(), 0);
  host.until(has("NDEATH", "bdSeq"));
}

TEST(ASession, ThatWasKilledWithoutABrokerIsToldOfWhenThereIsOne) {
  const TemporaryDirectory broker_dir;
  Broker broker(broker_dir.path());
  broker.kill();
  DaemonFixture fixture(plant_of(broker));
  fixture.start();
  Line line(fixture);
  fixture.begin({{"cell", CELLCAL_DEMO_CELL}, {"touches", 400}});
  fixture.wait_for_touches(3);
  fixture.daemon->signal(SIGKILL);
  fixture.daemon->wait();
  broker.start();
  Listener plant(broker.port(), "plant", "cellcal/#");
  fixture.start();
  const auto facts = facts_in(plant.until([](const auto& all) {
    return std::ranges::any_of(all, [](const Heard& one) {  // others may follow
      return one.payload.find("\"state\":\"interrupted\"") != std::string::npos;
    });
  }));
  std::int64_t newest = 0;
  for (const plant::Fact& fact : facts) {
    if (fact.number <= newest) continue;  // sent again, since its acknowledgement was late
    EXPECT_EQ(fact.number, newest + 1);
    newest = fact.number;
  }
  EXPECT_GT(newest, 4);
}

TEST(ACell, ThatGetsAnotherNameEndsItsLineAndSpeaksUnderTheNewOne) {
  const TemporaryDirectory broker_dir;
  Broker broker(broker_dir.path());
  Listener plant(broker.port(), "plant", "cellcal/#");
  DaemonFixture fixture(plant_of(broker));
  fixture.start();
  Line line(fixture);
  plant.until([](const auto& all) { return presence_in(all).has_value(); });
  std::string settings = content(fixture.dir / "d.toml");
  settings.replace(settings.find("weld-3"), 6, "weld-4");
  std::ofstream(fixture.dir / "d.toml") << settings;
  fixture.daemon->signal(SIGHUP);
  const auto heard = plant.until([](const auto& all) {
    return presence_in(all)->of.cell == "weld-4" && presence_in(all)->online;
  });
  std::vector<std::pair<std::string, bool>> presences;
  for (const Heard& one : heard)
    if (const auto presence = presence_in({one}))
      presences.emplace_back(presence->of.cell, presence->farewell);
  EXPECT_EQ(presences,
            (decltype(presences){{"weld-3", false}, {"weld-3", true}, {"weld-4", false}}));
}

TEST(ACertificate, OfAnEmulatedCellIsSentToThePlantUnderTheNumberThatSaysSo) {
  const TemporaryDirectory broker_dir;
  Broker broker(broker_dir.path());
  DaemonFixture fixture(plant_of(broker));
  std::filesystem::create_directory(fixture.dir / "state");
  {
    Journal journal(fixture.dir / "state/journal.db");
    record(journal, {.emulated = true}, false);
  }
  fixture.start();
  const Outcome made = fixture.cellcal(
      {"certificate", "1", "--no-pdf", "--no-sign", "--out", fixture.dir / "c", "--json"});
  ASSERT_EQ(made.status, 0) << made.err;
  const auto printed = nlohmann::json::parse(made.out);
  EXPECT_EQ(printed["plant"], true);
  EXPECT_TRUE(printed["number"].get<std::string>().starts_with("emulated-1-")) << printed;
}

TEST(ACertificate, ReachesThePlantByteForByteWithWhatVerifiesIt) {
  const TemporaryDirectory broker_dir;
  Broker broker(broker_dir.path());
  Listener plant(broker.port(), "plant", "cellcal/#");
  DaemonFixture fixture(plant_of(broker));
  std::filesystem::create_directory(fixture.dir / "state");
  {
    Journal journal(fixture.dir / "state/journal.db");
    record(journal, {}, false);
  }
  fixture.start();
  Line line(fixture);
  ASSERT_EQ(run_program({CELLCAL, "certificate", "--make-key", "--key", fixture.dir / "k"}).status,
            0);
  const Outcome made = fixture.cellcal({"certificate", "1", "--no-pdf", "--key", fixture.dir / "k",
                                        "--out", fixture.dir / "c", "--json"});
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_EQ(nlohmann::json::parse(made.out)["plant"], true);
  const auto heard = plant.until([](const auto& all) {
    return !all.empty() && all.back().topic == "cellcal/graz/weld-3/fact/certificate";
  });
  const auto facts = facts_in(heard);
  const auto& certificate = std::get<plant::CertificateFact>(facts.back().body);
  EXPECT_EQ(certificate.certificate, nlohmann::json::parse(made.out)["number"]);
  EXPECT_EQ(facts.back().session, 1);
  EXPECT_EQ(certificate.files.size(), 6u);
  for (const plant::CertificateFile& file : certificate.files)
    EXPECT_TRUE(file.bytes == calib::read_file(fixture.dir / ("c/" + file.name))) << file.name;

  const auto issue = [&](const char* out, std::vector<std::string> more) {
    more.insert(more.begin(), {"certificate", "1", "--no-pdf", "--key", fixture.dir / "k", "--out",
                               fixture.dir / out});
    const Outcome again = fixture.cellcal(more);
    EXPECT_EQ(again.status, 0) << again.err;
    return again.out;
  };
  const auto newest = [&] { return fixture.get("/v1/plant")["newest"]; };
  const auto before = newest();
  EXPECT_NE(issue("d", {}).find("already sent to the plant"), std::string::npos);
  EXPECT_EQ(newest(), before) << "it says the same, some time later";
  EXPECT_NE(issue("e", {"--issued-by", "A. Name"}).find("on its way to the plant"),
            std::string::npos);
  EXPECT_EQ(newest(), before.get<std::int64_t>() + 1);

  const auto post = [&](const plant::CertificateFact& fact) {
    return http_request(fixture.socket(), "POST", "/v1/sessions/1/certificate",
                        plant::body_to_json(fact));
  };
  EXPECT_EQ(post({"1-000000000000", {}}).status, 422);
  nlohmann::json odd = nlohmann::json::parse(plant::body_to_json(certificate));
  odd["content"] = "no sum";
  EXPECT_EQ(http_request(fixture.socket(), "POST", "/v1/sessions/1/certificate", odd.dump()).status,
            400);
  const Response large = post({certificate.certificate, {{"a.pdf", std::string(5'600'000, 'x')}}});
  EXPECT_EQ(large.status, 413);
  EXPECT_NE(large.body.find("5.6 MB"), std::string::npos) << large.body;
}

Outcome propose(const Broker& broker, std::vector<std::string> what) {
  what.insert(what.begin(), {CELLCAL, "fleet", "propose", "graz/weld-3"});
  what.insert(what.end(), {"--broker", "127.0.0.1", "--port", std::to_string(broker.port()),
                           "--no-tls", "--by", "M. Huber", "--json"});
  return run_program(what);
}

/// Waits until the cell's newest proposal is in this state.
void wait_for_stand(const DaemonFixture& fixture, const std::string& id, const std::string& stand) {
  std::string last;
  for (int i = 0; i < 1000; ++i) {
    last = http_request(fixture.socket(), "GET", "/v1/proposals").body;
    const auto all = nlohmann::json::parse(last)["proposals"];
    if (!all.empty() && all[0]["id"] == id && all[0]["stand"] == stand) return;
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  FAIL() << last;
}

const plant::AnswerFact* answer_to(const std::string& id, const std::vector<plant::Fact>& facts) {
  for (const plant::Fact& fact : facts)
    if (const auto* answer = std::get_if<plant::AnswerFact>(&fact.body);
        answer && answer->proposal == id)
      return answer;
  return nullptr;
}

TEST(AProposalOfThePlant, IsSeenAndAcceptedAtTheCellAnsweredAndTakenFromTheBroker) {
  const TemporaryDirectory broker_dir;
  Broker broker(broker_dir.path());
  Listener plant(broker.port(), "plant", "cellcal/#");
  DaemonFixture fixture(plant_of(broker));
  fixture.start();
  Line line(fixture);
  std::ofstream(fixture.dir / "wrong.toml")
      << "[[session]]\nname = \"nightly\"\nkind = \"dance\"\n";
  const Outcome wrong =
      propose(broker, {"--schedule", fixture.dir / "wrong.toml", "--reason", "nights"});
  EXPECT_EQ(wrong.status, 1);
  EXPECT_NE(wrong.err.find("kind"), std::string::npos) << wrong.err;
  const Outcome proposed = propose(broker, {"--check", "--reason", "A3 drifts", "--id", "p-17"});
  ASSERT_EQ(proposed.status, 0) << proposed.err;
  wait_for_stand(fixture, "p-17", "open");
  EXPECT_NE(fixture.cellcal({"proposals"}).out.find("check this cell, by M. Huber: A3 drifts"),
            std::string::npos);
  ASSERT_EQ(
      run_program({CELLCAL, "proposals", "--socket", fixture.socket(), "accept", "p-17"}).status,
      0);
  const auto answered = [](const std::string& id) {
    return [id](const std::vector<Heard>& all) { return answer_to(id, facts_in(all)) != nullptr; };
  };
  EXPECT_TRUE(answer_to("p-17", facts_in(plant.until(answered("p-17"))))->accepted);
  EXPECT_EQ(fixture.status()["phase"], "idle") << "nothing moves by it";

  const Outcome other = propose(broker, {"--calibrate", "--reason", "yearly", "--id", "p-18"});
  ASSERT_EQ(other.status, 0) << other.err;
  wait_for_stand(fixture, "p-18", "open");
  ASSERT_EQ(propose(broker, {"--withdraw", "p-18", "--reason", "done by hand"}).status, 0);
  wait_for_stand(fixture, "p-18", "withdrawn");
  EXPECT_FALSE(answer_to("p-18", facts_in(plant.until(answered("p-18"))))->accepted);
  EXPECT_NE(
      run_program({CELLCAL, "proposals", "--socket", fixture.socket(), "accept", "p-18"}).status,
      0);

  // Removed when the daemon connects again at the latest.
  fixture.daemon->signal(SIGTERM);
  fixture.daemon->wait();
  fixture.start();
  const auto gone = [](const std::vector<Heard>& all) {
    std::set<std::string> taken;
    for (const Heard& one : all)
      if (one.payload.empty()) taken.insert(one.topic);
    return taken.contains("cellcal/graz/weld-3/proposal/p-17") &&
           taken.contains("cellcal/graz/weld-3/proposal/p-18");
  };
  plant.until(gone);
}

}  // namespace
}  // namespace cellcal::daemon::testing
