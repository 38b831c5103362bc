// Reports queued in a journal, as messages; the publisher's tests cover the connection.

#include "daemon/plant/desk/journal_outbox.h"

#include <gtest/gtest.h>

#include "daemon/plant/messages/fact.h"
#include "tests/daemon/archive/checked_journal.h"
#include "tests/daemon/journal/disks/away_disk.h"
#include "tests/daemon/journal/images.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using plant::JournalOutbox, plant::WaitingFact;

PlantConfig config_of(const char* cell) {
  PlantConfig plant;
  plant.plant = "graz";
  plant.cell = cell;
  plant.touches = true;
  return plant;
}

plant::Fact fact_of(const WaitingFact& waiting, const char* cell = "weld-3") {
  return plant::fact_from_json(waiting.text, {{"graz", cell}, plant::Subject::kFact, waiting.kind});
}

struct JournalOutboxTest : ::testing::Test {
  std::int64_t report(std::size_t bytes) {
    const std::int64_t id = fill(journal, 0);
    journal.report(id, plant::report_of(plant::CertificateFact{
                           "1-0123456789ab", {{"certificate.pdf", std::string(bytes, 'x')}}}));
    return id;
  }
  TemporaryDirectory dir;
  Journal journal{dir / "j.db"};
};

TEST_F(JournalOutboxTest, HandsOutWhatWaitsAsMessagesInOrderUntilItIsAcknowledged) {
  JournalOutbox outbox({journal, config_of("weld-3")});
  fill(journal, 3);
  const auto facts = outbox.facts(0, 10);
  ASSERT_EQ(facts.size(), 4u);
  for (std::size_t i = 0; i < facts.size(); ++i) {
    const plant::Fact fact = fact_of(facts[i]);
    EXPECT_EQ(fact.number, static_cast<std::int64_t>(i) + 1);
    EXPECT_EQ(fact.number, facts[i].number);
    EXPECT_EQ(fact.journal, facts[i].source);
    EXPECT_EQ(facts[i].text.find('\n'), std::string::npos);
    EXPECT_EQ(facts[i].worth, plant::worth_of(fact.body));
  }
  EXPECT_EQ(outbox.facts(facts[0].row, 1).front().number, 2);
  outbox.acknowledge({facts[0].row, facts[1].row});
  EXPECT_EQ(outbox.facts(0, 10).front().number, 3);
  EXPECT_EQ(outbox.count().newest, 4);
  EXPECT_EQ(outbox.count().rows, 2);
}

TEST_F(JournalOutboxTest, HandsOutFewAtOnceWhereTheyAreLarge) {
  JournalOutbox outbox({journal, config_of("weld-3")});
  for (int i = 0; i < 4; ++i) report(2'000'000);
  const auto facts = outbox.facts(0, 16);
  EXPECT_GE(facts.size(), 2u);
  EXPECT_LE(facts.size(), 4u) << "of eight";
}

TEST_F(JournalOutboxTest, HandsOutANoticeOfWhatNoPlantTakes) {
  JournalOutbox outbox({journal, config_of("weld-3")});
  report(plant::kLargestMessage);
  const auto facts = outbox.facts(1, 10);
  ASSERT_EQ(facts.size(), 1u);
  EXPECT_EQ(facts[0].kind, "dropped");
  const plant::Fact notice = fact_of(facts[0]);
  EXPECT_EQ(std::get<plant::DroppedFact>(notice.body).reason, plant::DropReason::kTooLarge);
  EXPECT_EQ(fact_of(outbox.facts(1, 10)[0]), notice) << "it stands in its place";
}

TEST_F(JournalOutboxTest, StaysWithinItsBoundWhateverAPlantIsAnsweredAndTellsWhatItDropped) {
  PlantConfig config = config_of("weld-3");
  config.outbox_megabytes = 1.0;
  JournalOutbox outbox({journal, config});
  const std::string words(500, 'x');
  for (int i = 0; i < 3000; ++i)
    journal.report(0, plant::report_of(plant::AnswerFact{"p-1", false, "cellcald", words},
                                       plant::Worth::kTelemetry));
  EXPECT_LE(journal.outbox().bytes, 1'000'000);
  EXPECT_GT(journal.outbox().rows, 1000) << "the newest are told";
  std::int64_t dropped = 0;
  for (const WaitingFact& waiting : outbox.facts(0, 3000)) {
    const plant::Fact fact = fact_of(waiting);
    if (const auto* notice = std::get_if<plant::DroppedFact>(&fact.body)) dropped += notice->count;
  }
  EXPECT_GT(dropped, 0);
}

TEST_F(JournalOutboxTest, SaysThatTheDiskIsAwayAndDropsNothingForIt) {
  JournalOutbox outbox({journal, config_of("weld-3")});
  const std::int64_t id =
      journal.begin({"c", std::string(std::size_t{4} << 20, 'c'), "r", "r", "{}"}, "t0");
  journal.store_calibration(id, "composed when it is read");
  journal.record(id, RecordEnd{Ending::kDone, ""}, "t1");
  EXPECT_EQ(outbox.facts(0, 10).size(), 3u);
  {
    const AwayDisk away(dir.path());
    EXPECT_THROW(
        {
          for (const WaitingFact& fact : outbox.facts(0, 10)) EXPECT_NE(fact.kind, "dropped");
          outbox.facts(1, 10);
        },
        plant::OutboxError);
  }
  EXPECT_EQ(outbox.facts(0, 10).size(), 3u);
}

TEST_F(JournalOutboxTest, ThatTakesAnothersPlaceMissesNoFactAndGoesOnUnderItsOwnName) {
  auto before = std::make_unique<JournalOutbox>(JournalOutbox::Parts{journal, config_of("weld-3")});
  fill(journal, 0);
  PlantConfig renamed = config_of("weld-4");
  JournalOutbox now({journal, renamed});
  before.reset();
  journal.activate({1, "2026-01-02T00:00:00.000Z", "anna", "warm"});
  EXPECT_EQ(now.count().elsewhere, 1);
  EXPECT_EQ(now.count().elsewhere_address, "graz/weld-3");
  const auto facts = now.facts(0, 10);
  ASSERT_EQ(facts.size(), 2u);
  EXPECT_EQ(facts[0].kind, "session");
  EXPECT_EQ(fact_of(facts[1], "weld-4").number, 2);
}

TEST(JournalOutboxOfACell, BeginsEachSourceWithTheCalibrationInUse) {
  CheckedJournal cell;
  const CheckedJournal::Files files{.cell = "[identity]\nrobot_serial = \"1234\"\n"};
  const std::int64_t first = cell.calibrate({}, files);
  cell.calibrate({}, files);
  cell.journal.activate({first, "2026-01-02T00:00:00.000Z", "anna", "warm"});
  for (const char* name : {"weld-3", "weld-4"}) {
    JournalOutbox outbox({cell.journal, config_of(name)});
    const auto facts = outbox.facts(0, 10);
    ASSERT_EQ(facts.size(), 4u);
    const plant::Fact used = fact_of(facts[0], name), since = fact_of(facts[3], name);
    EXPECT_TRUE(std::get<plant::CalibrationFact>(used.body).published);
    EXPECT_EQ(used.session, first);
    EXPECT_EQ(std::get<plant::ActivationFact>(since.body).by, "anna");
    EXPECT_EQ(since.session, first);
  }
}

TEST_F(JournalOutboxTest, GoesOnWhereTheJournalCannotReportToTheOneThatWasToTakeItsPlace) {
  JournalOutbox before({journal, config_of("weld-3")});
  const std::int64_t id =
      journal.begin({"c", std::string(std::size_t{4} << 20, 'c'), "r", "r", "{}"}, "t0");
  EXPECT_TRUE(journal.session(id)) << "and no name is in a cache any more";
  {
    const AwayDisk away(dir.path());
    EXPECT_THROW(JournalOutbox({journal, config_of("weld-4")}), JournalError);
  }
  journal.activate({id, "2026-01-02T00:00:00.000Z", "anna", "warm"});
  EXPECT_EQ(before.facts(0, 10).size(), 2u);
}

TEST_F(JournalOutboxTest, OfAJournalThatGoesOnWithoutItsHeadTellsWhichNumbersItDropped) {
  {
    Journal before(dir / "other.db");
    const JournalOutbox outbox({before, config_of("weld-3")});
    fill(before, 3);
  }
  std::filesystem::remove(dir / "other.db.head");
  Journal now(dir / "other.db");
  JournalOutbox outbox({now, config_of("weld-3")});
  const auto facts = outbox.facts(0, 10);
  ASSERT_GE(facts.size(), 2u);
  EXPECT_EQ(facts[0].number, 1);
  EXPECT_EQ(facts[1].source, facts[0].source);
  EXPECT_EQ(fact_of(facts[1]).number, 4);
  EXPECT_EQ(std::get<plant::DroppedFact>(fact_of(facts[1]).body), (plant::DroppedFact{2, 4, 3}));
}

}  // namespace
}  // namespace cellcal::daemon::testing
