// From the journal to Debian's mosquitto.

#include "daemon/plant/line/publisher.h"

#include <gtest/gtest.h>
#include <signal.h>
#include <spdlog/sinks/ostream_sink.h>
#include <spdlog/spdlog.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <thread>

#include "black_hole.h"
#include "broker.h"
#include "calib/files/input_file.h"
#include "cell_line.h"
#include "daemon/journal/store/sqlite.h"
#include "daemon/plant/desk/journal_outbox.h"
#include "daemon/plant/line/mqtt_line.h"
#include "daemon/plant/messages/fact.h"
#include "daemon/plant/messages/presence.h"
#include "hostile_broker.h"
#include "listener.h"
#include "strict_listener.h"
#include "tests/daemon/journal/disks/away_disk.h"
#include "tests/daemon/journal/images.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using plant::Fact, plant::LineProblem;
using std::chrono::milliseconds;

constexpr const char* kAll = "cellcal/#";

std::function<bool(const std::vector<Heard>&)> number_heard(std::int64_t number) {
  return [number](const std::vector<Heard>& heard) {
    for (const Fact& fact : facts_in(heard))
      if (fact.number == number) return true;
    return false;
  };
}

template <class F>
void wait_until(F done) {
  bool met = done();
  for (int i = 0; i < 6000 && !met; ++i) {
    std::this_thread::sleep_for(milliseconds(10));
    met = done();
  }
  ASSERT_TRUE(met) << "it never came";
}

/// Every number from 1 on, in order, with the same content in all repetitions.
void expect_whole(const std::vector<Heard>& heard, std::int64_t last) {
  std::map<std::int64_t, Fact> all;
  std::int64_t newest = 0;
  for (const Fact& fact : facts_in(heard)) {
    const auto [there, is_new] = all.emplace(fact.number, fact);
    EXPECT_EQ(there->second, fact) << "the same number, another fact";
    EXPECT_TRUE(!is_new || fact.number == newest + 1) << fact.number << " behind " << newest;
    newest = std::max(newest, fact.number);
  }
  EXPECT_EQ(newest, last);
  EXPECT_EQ(all.size(), static_cast<std::size_t>(last));
}

struct PublisherTest : ::testing::Test {
  PlantConfig config(std::uint16_t port) const {
    PlantConfig plant;
    plant.plant = "graz";
    plant.cell = "weld-3";
    plant.host = "127.0.0.1";
    plant.port = port;
    plant.tls = false;
    plant.touches = true;
    return plant;
  }
  CellLine::Parts parts(Journal& journal, std::uint16_t port) const {
    CellLine::Parts all{journal, config(port)};
    all.first_wait = all.longest_wait = all.refused_wait = milliseconds(50);
    all.stored_wait = milliseconds(300);
    return all;
  }
  TemporaryDirectory dir, broker_dir;
};

struct PublisherWithABroker : PublisherTest {
  Broker broker{broker_dir.path()};
  Journal journal{dir / "j.db"};
};

TEST_F(PublisherWithABroker, SaysEveryFactOnceAndInOrderAndIsBornAndDiesRetained) {
  Listener plant(broker.port(), "plant", kAll);
  {
    const CellLine running(parts(journal, broker.port()));
    plant.store();
    const std::int64_t id = fill(journal, 40);
    journal.record(id, RecordEnd{Ending::kFailed, "no packet for 44 ms"}, "t9");
    journal.activate({id, "2026-01-02T00:00:00.000Z", "anna", "warm"});
    plant.until(number_heard(43));
    EXPECT_TRUE(presence_in(plant.all())->online);
    wait_until([&] { return journal.outbox().rows == 0; });
    EXPECT_TRUE(running.status().connected);
    EXPECT_GE(running.status().acknowledged, 43u);
  }
  expect_whole(plant.all(), 43);
  const auto facts = facts_in(plant.all());
  EXPECT_EQ(std::get<plant::SessionFact>(facts[41].body).failure, "no packet for 44 ms");
  EXPECT_EQ(std::get<plant::TouchFact>(facts[1].body).joint_rad, touch_at(0.1).joint_rad);
  EXPECT_EQ(std::get<plant::ActivationFact>(facts[42].body).by, "anna");
  Listener late(broker.port(), "late", kAll);
  const auto retained =
      late.until([](const auto& heard) { return presence_in(heard).has_value(); });
  EXPECT_TRUE(retained[0].retained);
  EXPECT_FALSE(presence_in(retained)->online);
  EXPECT_TRUE(presence_in(retained)->farewell);
}

TEST_F(PublisherTest, OfASecondCellOfItsNameSaysThatAnotherCellUsesIt) {
  Broker broker(broker_dir.path());
  Journal journal(dir / "j.db"), other_journal(dir / "k.db");
  auto one = parts(journal, broker.port()), other = parts(other_journal, broker.port());
  one.first_wait = one.longest_wait = milliseconds(1000);
  const CellLine running(one);
  wait_until([&] { return running.status().connected; });
  const CellLine second(other);
  wait_until([&] { return running.status().problem == LineProblem::kTakenOver; });
  const std::string words = running.status().words;
  EXPECT_NE(words.find("another cell uses this name, graz/weld-3"), std::string::npos) << words;
}

TEST_F(PublisherTest, ThrownOutAfterEachLoginWithoutAReasonSaysSoToo) {
  HostileBroker broker;
  broker.greet_with([] { return std::string("\xe0\x00", 2); });  // a normal disconnection
  Journal journal(dir / "j.db");
  const CellLine running(parts(journal, broker.port()));
  wait_until([&] { return running.status().problem == LineProblem::kTakenOver; });
  EXPECT_GE(broker.lines(), 3) << "once or twice may be anything";
  EXPECT_NE(running.status().words.find("another cell uses this name"), std::string::npos);
}

TEST(Takeovers, AreThreeShortLinesInARowAndNoLinesThatFailedOtherwise) {
  using std::chrono::seconds;
  const plant::LineFailure lost{LineProblem::kLost, "lost"};
  PlantConfig of;
  std::chrono::steady_clock::time_point now{};
  plant::Takeovers takeovers;
  const auto line_of = [&](seconds lasts, const plant::LineFailure& end) {
    takeovers.up(now);
    now += lasts;
    return takeovers.judged(end, of, now).problem;
  };
  EXPECT_EQ(line_of(seconds(1), lost), LineProblem::kLost);
  EXPECT_EQ(line_of(seconds(1), lost), LineProblem::kLost);
  EXPECT_EQ(line_of(seconds(60), lost), LineProblem::kLost) << "a sound line in between";
  EXPECT_EQ(line_of(seconds(1), lost), LineProblem::kLost);
  EXPECT_EQ(line_of(seconds(1), lost), LineProblem::kLost);
  const plant::LineFailure unreachable{LineProblem::kUnreachable, "down"};
  EXPECT_EQ(takeovers.judged(unreachable, of, now).problem, LineProblem::kUnreachable);
  EXPECT_EQ(line_of(seconds(1), lost), LineProblem::kLost) << "the broker was down in between";
  EXPECT_EQ(line_of(seconds(1), lost), LineProblem::kLost);
  EXPECT_EQ(line_of(seconds(1), lost), LineProblem::kTakenOver);
  EXPECT_EQ(line_of(seconds(90), lost), LineProblem::kTakenOver) << "both wait a minute by now";
  EXPECT_EQ(line_of(seconds(3600), lost), LineProblem::kLost) << "the other is gone";
  EXPECT_EQ(line_of(seconds(1), lost), LineProblem::kLost);
}

TEST_F(PublisherWithABroker, LosesNothingWhenTheBrokerIsKilledInMidSessionAndComesBack) {
  Listener plant(broker.port(), "plant", kAll);
  const CellLine running(parts(journal, broker.port()));
  fill(journal, 20);
  plant.until(number_heard(21));
  std::this_thread::sleep_for(milliseconds(1500));  // the broker has saved its session
  broker.kill();
  fill(journal, 20);
  wait_until([&] { return running.status().problem == LineProblem::kUnreachable; });
  EXPECT_NE(running.status().words.find("127.0.0.1"), std::string::npos);
  EXPECT_EQ(journal.outbox().rows, 22) << "nobody has said that the first result is stored";
  broker.start();
  plant.until(number_heard(42));
  expect_whole(plant.all(), 42);
}

TEST_F(PublisherTest, ThatWasKilledIsFollowedByOneThatSaysTheSameUnderTheSameNumbers) {
  Broker broker(broker_dir.path());
  const pid_t cell = ::fork();
  if (cell == 0) {
    Journal journal(dir / "j.db");
    const CellLine running(parts(journal, broker.port()));
    for (;;) fill(journal, 3);
  }
  Listener plant(broker.port(), "plant", kAll);
  plant.until([](const auto& heard) { return facts_in(heard).size() > 30; });
  ::kill(cell, SIGKILL);
  ::waitpid(cell, nullptr, 0);
  plant.until([](const auto& heard) { return !presence_in(heard) || !presence_in(heard)->online; });
  const plant::Presence will = *presence_in(plant.all());
  EXPECT_FALSE(will.farewell) << "the will";
  std::optional<plant::Presence> birth;
  for (const Heard& one : plant.all())
    if (const auto presence = presence_in({one}); presence && presence->online) birth = presence;
  ASSERT_TRUE(birth);
  EXPECT_EQ(will.time, birth->time) << "so that the plant takes it for the later of the two";
  EXPECT_EQ(will.number, birth->number);
  const std::int64_t first = facts_in(plant.all())[0].number;
  Journal journal(dir / "j.db");
  const std::int64_t before = journal.outbox().newest;
  const CellLine running(parts(journal, broker.port()));
  plant.until(number_heard(before + 1));
  const auto facts = facts_in(plant.all());
  EXPECT_EQ(std::get<plant::SessionFact>(facts.back().body).state,
            plant::SessionState::kInterrupted);
  std::set<std::int64_t> numbers;
  std::map<std::int64_t, Fact> same;
  for (const Fact& fact : facts) {
    numbers.insert(fact.number);
    EXPECT_EQ(same.emplace(fact.number, fact).first->second, fact);
  }
  EXPECT_EQ(numbers.size(), static_cast<std::size_t>(before + 1 - first + 1)) << "no gap";
  EXPECT_EQ(facts.back().journal, facts.front().journal);
}

TEST_F(PublisherWithABroker, KeepsAResultUntilThePlantSaysThatItIsStoredWhateverTheBrokerHasLost) {
  auto plant = std::make_unique<Listener>(broker.port(), "plant", kAll);
  const CellLine running(parts(journal, broker.port()));
  const std::int64_t id = fill(journal, 3);
  journal.record(id, RecordEnd{Ending::kFailed, "no packet for 44 ms"}, "t9");
  plant->until(number_heard(5));
  wait_until([&] { return journal.outbox().rows == 2; });  // telemetry is gone, two results remain
  EXPECT_EQ(journal.waiting(0, 9).front().number, 1);
  EXPECT_EQ(journal.waiting(0, 9).back().number, 5);
  // Messages received by the plant are lost with the broker and its queue.
  plant.reset();
  broker.kill();
  for (const auto& file : std::filesystem::directory_iterator(broker_dir.path()))
    if (file.path().extension() == ".db") std::filesystem::remove(file.path());
  broker.start();
  Listener other(broker.port(), "other", kAll);
  other.until(number_heard(5));
  const auto facts = facts_in(other.all());
  EXPECT_EQ(facts.front().number, 1);
  EXPECT_EQ(journal.outbox().rows, 2);
  other.store();
  wait_until([&] { return journal.outbox().rows == 0; });
}

TEST_F(PublisherWithABroker, ThatNobodyCollectsFromKeepsAllAndSaysSo) {
  const CellLine running(parts(journal, broker.port()));
  fill(journal, 2);
  wait_until([&] { return running.status().problem == LineProblem::kNoCollector; });
  EXPECT_TRUE(running.status().connected);
  EXPECT_EQ(journal.outbox().rows, 3);
  Listener plant(broker.port(), "plant", kAll);
  plant.store();
  plant.until(number_heard(3));
  expect_whole(plant.all(), 3);
  wait_until([&] { return journal.outbox().rows == 0; });
}

TEST_F(PublisherWithABroker, HandsAProposalOnUntilItIsAnsweredAndLeavesWhatIsNone) {
  Listener plant(broker.port(), "plant", kAll);
  const plant::Proposal proposal{
      {"graz", "weld-3"}, "p-1", plant::ProposalKind::kCheck, 0, "", "M. Huber", "drift", "t"};
  const std::string topic = to_text(plant::Topic{proposal.of, plant::Subject::kProposal, "p-1"});
  plant.say("cellcal/graz/weld-3/proposal/p-0", "{\"format\": 7}", true);
  plant.say(topic, to_json(proposal), true);
  std::atomic<int> heard = 0;
  std::atomic<bool> answered = false;
  CellLine::Parts all = parts(journal, broker.port());
  all.proposal = [&](const plant::Proposal& one) {
    EXPECT_EQ(one, proposal);
    ++heard;
    return answered.load();
  };
  {
    const CellLine running(all);
    wait_until([&] { return heard == 1; });
  }
  answered = true;
  {
    const CellLine running(all);
    wait_until([&] { return heard == 2; });
    plant.until([&](const auto& words) {
      return std::any_of(words.begin(), words.end(), [&](const Heard& one) {
        return one.topic == topic && one.payload.empty();
      });
    });
  }
  const CellLine running(all);
  fill(journal, 1);
  plant.until(number_heard(2));
  EXPECT_EQ(heard, 2) << "it was taken away";
}

TEST_F(PublisherTest, KeepsWhatTheBrokerRefusesSaysSoAndSendsItWhenItMay) {
  std::ofstream(broker_dir / "acl")
      << "topic write cellcal/graz/weld-3/presence\ntopic read cellcal/#\n"
         "topic write cellcal/graz/weld-3/fact/session\n";
  Broker broker(broker_dir.path(),
                "allow_anonymous true\nacl_file " + (broker_dir / "acl").string() + "\n");
  Listener plant(broker.port(), "plant", kAll);
  Journal journal(dir / "j.db");
  const CellLine running(parts(journal, broker.port()));
  const std::int64_t id = fill(journal, 0);
  journal.activate({id, "2026-01-02T00:00:00.000Z", "anna", "warm"});
  wait_until([&] { return running.status().problem == LineProblem::kRefused; });
  EXPECT_TRUE(running.status().connected);
  EXPECT_EQ(journal.waiting(0, 9).back().report.kind, "activation");
  broker.kill();
  std::ofstream(broker_dir / "acl") << "topic readwrite cellcal/#\n";
  broker.start();
  plant.store();
  wait_until([&] { return journal.outbox().rows == 0; });
  EXPECT_EQ(running.status().problem, LineProblem::kNone);
}

TEST_F(PublisherWithABroker, GivesTheBrokerNoMoreResultsThanSoManyThatNobodyHasStored) {
  Listener plant(broker.port(), "plant", kAll);
  CellLine::Parts few = parts(journal, broker.port());
  few.most_unstored = 3;
  few.stored_wait = std::chrono::seconds(60);
  const CellLine running(few);
  const std::int64_t id = fill(journal, 0);
  for (int i = 0; i < 7; ++i) journal.activate({id, "2026-01-02T00:00:00.000Z", "anna", "warm"});
  wait_until([&] { return running.status().problem == LineProblem::kNotStored; });
  const std::size_t given = facts_in(plant.all_acknowledged()).size();
  EXPECT_GE(given, 3u);
  EXPECT_LE(given, 3u + 16u) << "and those that were under way";
  for (int i = 0; i < 30; ++i) journal.activate({id, "2026-01-02T00:00:00.000Z", "anna", "warm"});
  std::this_thread::sleep_for(milliseconds(100));
  EXPECT_EQ(facts_in(plant.all_acknowledged()).size(), given);
  plant.store();
  plant.until(number_heard(38));
  expect_whole(plant.all(), 38);
  wait_until([&] { return running.status().problem == LineProblem::kNone; });
}

const Fact* fact_with(const std::vector<Fact>& facts, std::int64_t number) {
  const auto found =
      std::ranges::find_if(facts, [&](const Fact& fact) { return fact.number == number; });
  return found == facts.end() ? nullptr : &*found;
}

plant::CertificateFact certificate_of(std::size_t bytes) {
  return {"1-0123456789ab", {{"certificate.pdf", std::string(bytes, 'x')}}};
}

TEST_F(PublisherWithABroker, SaysOfAFactThatIsTooLargeForAnyPlantThatItIsDroppedAndGoesOn) {
  Listener plant(broker.port(), "plant", kAll);
  plant.store();
  const CellLine running(parts(journal, broker.port()));
  const std::int64_t id = fill(journal, 0);
  const Report large = plant::report_of(certificate_of(plant::kLargestMessage));
  journal.report(id, large);
  journal.activate({id, "2026-01-02T00:00:00.000Z", "anna", "warm"});
  wait_until([&] { return journal.outbox().rows == 0; });
  const auto facts = facts_in(plant.all());
  const Fact* const notice = fact_with(facts, 2);
  ASSERT_NE(notice, nullptr);
  EXPECT_EQ(std::get<plant::DroppedFact>(notice->body),
            (plant::DroppedFact{2, 2, 1, plant::DropReason::kTooLarge, "certificate",
                                static_cast<std::int64_t>(large.body.size())}));
  EXPECT_EQ(notice->session, id);
  EXPECT_NE(fact_with(facts, 3), nullptr);
}

struct BrokerWithALimit : PublisherTest, ::testing::WithParamInterface<const char*> {};

TEST_P(BrokerWithALimit, KeepsNoFactFromThePlantOnceItTakesLargerOnes) {
  Broker broker(broker_dir.path(), std::string("allow_anonymous true\n") + GetParam() + "\n");
  Listener plant(broker.port(), "plant", kAll);
  plant.store();
  Journal journal(dir / "j.db");
  const CellLine running(parts(journal, broker.port()));
  const std::int64_t id = fill(journal, 0);
  const plant::CertificateFact large = certificate_of(30000);
  journal.report(id, report_of(large));
  journal.activate({id, "2026-01-02T00:00:00.000Z", "anna", "warm"});
  wait_until([&] { return journal.outbox().rows == 1; });
  wait_until([&] { return running.status().problem == LineProblem::kTooLarge; });
  EXPECT_TRUE(running.status().connected);
  EXPECT_NE(running.status().words.find("fact 2: "), std::string::npos) << running.status().words;
  EXPECT_NE(fact_with(facts_in(plant.all()), 3), nullptr) << "it goes on";
  EXPECT_EQ(fact_with(facts_in(plant.all()), 2), nullptr);
  broker.kill();
  const std::filesystem::path file = broker_dir / "mosquitto.conf";
  std::string settings = calib::read_file(file);
  settings.replace(settings.find(GetParam()), std::string(GetParam()).size(), "");
  std::ofstream(file) << settings;
  broker.start();
  wait_until([&] { return journal.outbox().rows == 0; });
  const auto facts = facts_in(plant.all());
  ASSERT_NE(fact_with(facts, 2), nullptr);
  EXPECT_EQ(std::get<plant::CertificateFact>(fact_with(facts, 2)->body), large);
  wait_until([&] { return running.status().problem == LineProblem::kNone; });
}

INSTANTIATE_TEST_SUITE_P(Publisher, BrokerWithALimit,
                         ::testing::Values("message_size_limit 20000", "max_packet_size 20000"));

TEST_F(PublisherTest, NamesTheBrokersLimitWhereThatSaysItAndHowManyFactsAreTooLarge) {
  Broker broker(broker_dir.path(), "allow_anonymous true\nmax_packet_size 20000\n");
  Listener plant(broker.port(), "plant", kAll);
  plant.store();
  Journal journal(dir / "j.db");
  const CellLine running(parts(journal, broker.port()));
  const std::int64_t id = fill(journal, 0);
  for (int i = 0; i < 3; ++i) journal.report(id, plant::report_of(certificate_of(30000)));
  const auto says = [&](const char* words) {
    return running.status().words.find(words) != std::string::npos;
  };
  wait_until([&] { return says("; 2 more facts likewise"); });
  EXPECT_TRUE(says("(limit 20000)")) << running.status().words;
  EXPECT_TRUE(says("Set message_size_limit there to 8388608")) << running.status().words;
}

TEST_F(PublisherWithABroker, GoesOnWithoutTheFactForWhichABrokerEndedTheLineAndTriesItOnALaterOne) {
  StrictListener strict(broker.port(), 20000);
  Listener plant(broker.port(), "plant", kAll);
  plant.store();
  const CellLine running(parts(journal, strict.port()));
  const std::int64_t id = fill(journal, 0);
  const plant::CertificateFact large = certificate_of(30000);
  journal.report(id, report_of(large));
  journal.activate({id, "2026-01-02T00:00:00.000Z", "anna", "warm"});
  wait_until([&] { return journal.outbox().rows == 1; });
  wait_until([&] { return running.status().words.find("fact 2: ") != std::string::npos; });
  EXPECT_EQ(running.status().problem, LineProblem::kTooLarge);
  EXPECT_TRUE(running.status().connected);
  const int ended = strict.ended();
  EXPECT_GE(ended, 1);
  std::this_thread::sleep_for(milliseconds(400));
  EXPECT_EQ(strict.ended(), ended) << "the line is not lost for it again and again";
  strict.accept_all();
  wait_until([&] { return journal.outbox().rows == 0; });
  ASSERT_NE(fact_with(facts_in(plant.all()), 2), nullptr);
  EXPECT_EQ(std::get<plant::CertificateFact>(fact_with(facts_in(plant.all()), 2)->body), large);
}

/// More than SQLite keeps in its cache.
const SessionInputs kLargeInputs{"c", std::string(std::size_t{4} << 20, 'c'), "r", "r", "{}"};

void calibrate(Journal& journal, std::int64_t session) {
  journal.store_calibration(session, "composed when it is read");
  journal.record(session, RecordEnd{Ending::kDone, ""}, "t1");
}

TEST_F(PublisherTest, SaysOfAResultOfADamagedSessionThatItIsDroppedAndGoesOn) {
  Broker broker(broker_dir.path());
  {
    Journal journal(dir / "j.db");
    const CellLine nobody_collects(parts(journal, broker.port()));
    calibrate(journal, fill(journal, 0));
  }
  Database(dir / "j.db").execute("UPDATE session SET cell_text='other' WHERE id=1");
  Listener plant(broker.port(), "plant", kAll);
  plant.store();
  Journal journal(dir / "j.db");
  const CellLine running(parts(journal, broker.port()));
  plant.until(number_heard(3));
  wait_until([&] { return journal.outbox().rows == 0; });
  const auto facts = facts_in(plant.all());
  const Fact* const notice = fact_with(facts, 2);
  ASSERT_NE(notice, nullptr);
  EXPECT_EQ(
      std::get<plant::DroppedFact>(notice->body),
      (plant::DroppedFact{2, 2, 1, plant::DropReason::kDamaged, "calibration", std::nullopt}));
  EXPECT_EQ(notice->session, 1);
}

TEST_F(PublisherWithABroker, WaitsForADiskThatIsAwayAndDropsNothingForIt) {
  Listener plant(broker.port(), "plant", kAll);
  CellLine::Parts soon = parts(journal, broker.port());
  soon.journal_wait = milliseconds(50);
  const CellLine running(soon);
  calibrate(journal, journal.begin(kLargeInputs, "t0"));
  plant.until(number_heard(3));  // not acknowledged as stored: it is read and sent again
  {
    const AwayDisk away(dir.path());
    wait_until([&] { return running.status().problem == LineProblem::kJournal; });
    std::this_thread::sleep_for(3 * soon.journal_wait);
  }
  plant.store();
  wait_until([&] { return journal.outbox().rows == 0; });
  EXPECT_TRUE(running.status().connected);
  for (const Fact& fact : facts_in(plant.all())) {
    EXPECT_FALSE(std::holds_alternative<plant::DroppedFact>(fact.body)) << fact.number;
  }
}

TEST_F(PublisherWithABroker, OpensItsLineOnceTheDiskSaysWhichNumbersThereAre) {
  broker.kill();
  const CellLine running(parts(journal, broker.port()));
  const std::int64_t id = journal.begin(kLargeInputs, "t0");
  for (int i = 0; i < 100 && running.status().problem != LineProblem::kJournal; ++i) {
    EXPECT_TRUE(journal.session(id)) << "and the outbox is in no cache any more";
    const AwayDisk away(dir.path());
    std::this_thread::sleep_for(milliseconds(100));
  }
  EXPECT_EQ(running.status().problem, LineProblem::kJournal);
  broker.start();
  Listener plant(broker.port(), "plant", kAll);
  plant.until(number_heard(1));
  EXPECT_TRUE(running.status().connected);
}

TEST_F(PublisherWithABroker, UnderAnotherNameSaysWhatWaitsForTheEarlierOneAndWhatToDo) {
  {
    CellLine::Parts earlier = parts(journal, broker.port());
    earlier.config.cell = "weld-2";
    const CellLine running(earlier);
    fill(journal, 0);  // without a collector: it waits
  }
  Listener plant(broker.port(), "plant", kAll);
  plant.store();
  CellLine::Parts all = parts(journal, broker.port());
  {
    const CellLine running(all);
    journal.activate({1, "2026-01-02T00:00:00.000Z", "anna", "warm"});
    wait_until([&] { return running.status().problem == LineProblem::kRenamed; });
    EXPECT_NE(running.status().words.find("graz/weld-2"), std::string::npos);
    for (const Heard& one : plant.all())
      EXPECT_EQ(one.topic.find("weld-2/fact"), std::string::npos);
    plant.until(number_heard(2));
    EXPECT_TRUE(std::holds_alternative<plant::ActivationFact>(facts_in(plant.all())[1].body));
  }
  all.config.former = {"graz/weld-2"};
  const CellLine running(all);
  wait_until([&] { return journal.outbox().rows == 0; });
  const auto facts = facts_in(plant.all());
  const auto waited = std::ranges::find_if(
      facts, [&](const Fact& fact) { return fact.journal != facts.front().journal; });
  ASSERT_NE(waited, facts.end());
  EXPECT_EQ(waited->of.cell, "weld-3");
  EXPECT_TRUE(std::holds_alternative<plant::SessionFact>(waited->body));
}

TEST_F(PublisherWithABroker, SaysInTheLogOnceAMinuteWhatItDoesNotUnderstandHoweverMuchComes) {
  std::ostringstream log;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  {
    Listener plant(broker.port(), "plant", kAll);
    plant.store();
    const CellLine running(parts(journal, broker.port()));
    wait_until([&] { return running.status().connected; });
    for (int i = 0; i < 300; ++i)
      plant.say("cellcal/graz/weld-3/proposal/p-" + std::to_string(i), "{\"format\": 7}");
    fill(journal, 0);
    plant.until(number_heard(1));
    wait_until([&] { return journal.outbox().rows == 0; });
  }
  spdlog::set_default_logger(before);
  const std::string words = log.str();
  const auto first = words.find("not understood");
  ASSERT_NE(first, std::string::npos) << words;
  EXPECT_EQ(words.find("not understood", first + 1), std::string::npos) << words;
}

TEST_F(PublisherTest, SaysInTheLogOnceAMinuteThatItsLineComesAndGoes) {
  HostileBroker broker;
  const std::string goes_away("\xe0\x02\x8b\x00", 4);  // DISCONNECT, server shutting down
  broker.greet_with([&] { return goes_away; });
  Journal journal(dir / "j.db");
  std::ostringstream log;
  const auto before = spdlog::default_logger();
  spdlog::set_default_logger(std::make_shared<spdlog::logger>(
      "test", std::make_shared<spdlog::sinks::ostream_sink_mt>(log)));
  {
    CellLine::Parts quick = parts(journal, broker.port());
    quick.first_wait = quick.longest_wait = milliseconds(2);
    const CellLine running(quick);
    wait_until([&] { return broker.lines() > 50; });
  }
  spdlog::set_default_logger(before);
  const std::string words = log.str();
  EXPECT_LT(std::ranges::count(words, '\n'), 10) << words;
  EXPECT_NE(words.find("connected to"), std::string::npos) << words;
}

TEST_F(PublisherWithABroker, ThatLeavesWithoutAFarewellIsLostToThePlant) {
  Listener plant(broker.port(), "plant", kAll);
  {
    CellLine running(parts(journal, broker.port()));
    plant.until([](const auto& heard) { return presence_in(heard).has_value(); });
    running.publisher().close_with_will();
  }
  EXPECT_FALSE(presence_in(plant.until([](const auto& heard) {
                 return !presence_in(heard)->online;
               }))->farewell);
}

TEST_F(PublisherTest, EndsAtOnceWhileTheResolverDoesNotAnswer) {
  Journal journal(dir / "j.db");
  CellLine::Parts all = parts(journal, 1883);
  all.config.host = kBlackHole;
  const auto begun = std::chrono::steady_clock::now();
  {
    const CellLine running(all);
    wait_until([&] { return asked_black_hole() > 0; });
    fill(journal, 1);
    EXPECT_FALSE(running.status().connected);
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begun, std::chrono::seconds(2));
  EXPECT_EQ(asked_black_hole(), 1) << "it is still asked";
  answer_black_hole();
  EXPECT_EQ(journal.outbox().rows, 2);
}

TEST_F(PublisherTest, EndsAtOnceWhereNobodyAnswersAndWhatWaitsStays) {
  std::uint16_t nobody = 0;
  { nobody = Broker(broker_dir.path()).port(); }
  Journal journal(dir / "j.db");
  {
    const CellLine running(parts(journal, nobody));
    fill(journal, 2);
    wait_until([&] { return running.status().problem == LineProblem::kUnreachable; });
  }
  EXPECT_EQ(journal.outbox().rows, 3);
}

}  // namespace
}  // namespace cellcal::daemon::testing
