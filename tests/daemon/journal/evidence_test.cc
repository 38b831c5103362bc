// Data stored in addition to touches, and all elements of a touch.

#include <gtest/gtest.h>

#include <limits>

#include "calib/files/calibration_json.h"
#include "daemon/journal/store/sqlite.h"
#include "daemon/result/outcome_json.h"
#include "images.h"
#include "temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

TEST(ATouchWithAllThatOneCanHave, ComesBackBitForBit) {
  const TemporaryDirectory dir;
  calib::Touch touch = touch_at(0.3);
  touch.tool = "probe 2";
  touch.load = "part 7";
  touch.tracker_abc_rad = {{0.1, -1.0 / 3.0, 5e-324}};
  touch.turn_sigma_rad = 1e-7;
  touch.approach = {{0.0, -0.0, -1.0}};
  touch.temperature_c = 21.5;
  touch.joint_rad = {400.0, -400.0};  // angles beyond one turn
  const calib::Touch plain = touch_at(0.4);
  {
    Journal journal(dir / "j.db");
    const std::int64_t id = journal.begin({}, "t0");
    journal.record(id, RecordTouch{0, touch});
    journal.record(id, RecordTouch{1, plain});
  }
  Journal journal(dir / "j.db");
  ASSERT_EQ(journal.touches(1).size(), 2u);
  EXPECT_EQ(journal.touches(1)[0], touch);
  EXPECT_TRUE(std::signbit((*journal.touches(1)[0].approach)[1]));
  EXPECT_EQ(journal.touches(1)[1], plain);
  EXPECT_EQ(journal.session(1)->software, calib::software_version());
}

TEST(ATouch, WithATemperatureThatIsNoNumberIsRefused) {
  const TemporaryDirectory dir;
  Journal journal(dir / "j.db");
  const std::int64_t id = journal.begin({}, "t0");
  calib::Touch touch = touch_at(0.3);
  touch.temperature_c = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(journal.record(id, RecordTouch{0, touch}), JournalError);
  EXPECT_TRUE(journal.touches(id).empty());
}

drivers::ContactRecord contact() {
  drivers::ContactRecord contact;
  contact.kind = drivers::ContactEventKind::kContact;
  contact.arm_id = 65535;
  contact.sequence = 255;
  contact.event = 7;
  contact.ticks = 4294967295u;
  contact.confirmed_after_us = 1234;
  contact.bounces = 3;
  contact.sense_v = 0.125;
  contact.heard = drivers::TimePoint(std::chrono::milliseconds(2500));
  contact.first_edge = drivers::TimePoint(std::chrono::milliseconds(2000));
  contact.time_sigma_s = 1e-5;
  contact.lost = 2;
  return contact;
}

TEST(WhatWasSeenAndIsNotANumber, KeepsNoTouchFromTheDisk) {
  const TemporaryDirectory dir;
  const double none = std::numeric_limits<double>::quiet_NaN();
  Journal journal(dir / "j.db");
  const std::int64_t id = journal.begin({}, "t0");
  RecordContact seen{4, "t1", contact()};
  seen.contact.sense_v = seen.contact.time_sigma_s = none;
  journal.note(id, seen);
  journal.note(
      id, RecordChange{
              {Phase::kFastSearch, Phase::kBackingOff}, EventKind::kContact, "t2", none, 3, none});
  journal.record(id, RecordTouch{0, touch_at(0.1)});
  EXPECT_EQ(journal.touches(id).size(), 1u);
  Journal other(dir / "other.db");
  EXPECT_TRUE(other.import(journal.rows(id), "x").second);
}

TEST(EventsOfTheSensorAndChangesOfPhase, AreRowsWithTheirOwnColumnsAndChecksums) {
  const TemporaryDirectory dir;
  {
    Journal journal(dir / "j.db");
    const std::int64_t id = journal.begin({}, "t0");
    journal.note(id, RecordContact{4, "t1", contact()});
    journal.note(
        id,
        RecordChange{
            {Phase::kFastSearch, Phase::kBackingOff}, EventKind::kContact, "t2", 12.5, 3, 0.004});
    journal.record(id, RecordTouch{0, touch_at(0.1)});
  }
  Database database(dir / "j.db");
  Statement row(database,
                "SELECT touch, time, kind, arm_id, sequence, number, ticks, confirmed_after_us, "
                "bounces, sense_v, heard_s, first_edge_s, time_sigma_s, lost FROM contact");
  ASSERT_TRUE(row.step());
  const std::vector<Value> expected{std::int64_t{4},
                                    std::string("t1"),
                                    std::string("contact"),
                                    std::int64_t{65535},
                                    std::int64_t{255},
                                    std::int64_t{7},
                                    std::int64_t{4294967295},
                                    std::int64_t{1234},
                                    std::int64_t{3},
                                    0.125,
                                    2.5,
                                    2.0,
                                    1e-5,
                                    std::int64_t{2}};
  EXPECT_EQ(row.values(), expected);
  Statement change(database,
                   "SELECT time, clock_s, from_phase, to_phase, event, late_replies, "
                   "sensor_late_s FROM change");
  ASSERT_TRUE(change.step());
  const std::vector<Value> changed{std::string("t2"),
                                   12.5,
                                   std::string("fast search"),
                                   std::string("backing off"),
                                   std::string("contact"),
                                   std::int64_t{3},
                                   0.004};
  EXPECT_EQ(change.values(), changed);
}

TEST(OutcomeAndDocument, AreWrittenWithTheEndOfASessionAndArePartOfTheEvidence) {
  const TemporaryDirectory dir;
  std::int64_t id = 0;
  {
    Journal journal(dir / "j.db");
    id = fill(journal, 2);
    RecordEnd end{Ending::kDone, ""};
    end.result =
        std::make_shared<const SessionResult>(SessionResult{calib::TcpCheck{.holds = true}});
    journal.record(id, end, "t2");
  }
  {
    Journal journal(dir / "j.db");
    const auto record = journal.session(id);
    ASSERT_TRUE(record->outcome);
    EXPECT_EQ(record->outcome->kind, OutcomeKind::kHolds);
    EXPECT_EQ(record->document, document_of(SessionResult{calib::TcpCheck{.holds = true}}));
    EXPECT_TRUE(journal.sessions().front().outcome);
  }
  Database(dir / "j.db").execute("UPDATE session SET document = ''");
  Journal journal(dir / "j.db");
  EXPECT_EQ(journal.sessions().front().state, RecordState::kDamaged);
}

struct Forged {
  const char* name;
  const char* sql;
};
struct RecordedEvidence : ::testing::TestWithParam<Forged> {};

TEST_P(RecordedEvidence, ThatAnotherProgramChangedIsTold) {
  const TemporaryDirectory dir;
  {
    Journal journal(dir / "j.db");
    const std::int64_t id = journal.begin({}, "t0");
    journal.note(id, RecordContact{0, "t1", contact()});
    journal.note(id, RecordChange{});
    journal.record(id, RecordTouch{0, touch_at(0.1)});
    journal.store_calibration(id, "{}", Compared{"session 1", false, "{}"});
  }
  EXPECT_EQ(refusal(dir / "j.db"), "");
  Database(dir / "j.db").execute(GetParam().sql);
  EXPECT_NE(refusal(dir / "j.db").find("damaged"), std::string::npos);
}
INSTANTIATE_TEST_SUITE_P(
    Journal, RecordedEvidence,
    ::testing::Values(Forged{"voltage", "UPDATE contact SET sense_v=0.2"},
                      Forged{"contact_gone", "DELETE FROM contact"},
                      Forged{"phase", "UPDATE change SET to_phase='done'"},
                      Forged{"change_added", "INSERT INTO change SELECT * FROM change"},
                      Forged{"compared", "UPDATE compared SET accepted=1"},
                      Forged{"temperature", "UPDATE touch SET temperature_c=20"},
                      Forged{"load", "UPDATE touch SET load='x'"},
                      Forged{"tool", "UPDATE touch SET tool='x'"},
                      Forged{"software", "UPDATE session SET software='x'"},
                      Forged{"origin", "UPDATE session SET origin='{}'"}),
    [](const auto& forged) { return forged.param.name; });

}  // namespace
}  // namespace cellcal::daemon::testing
