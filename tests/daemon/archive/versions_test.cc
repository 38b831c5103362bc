// Published calibrations as versions: the active one, activation of another, comparison of two.

#include "daemon/archive/versions.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <functional>
#include <optional>

#include "daemon/journal/store/sqlite.h"
#include "daemon/tasks/planned_round.h"
#include "tests/daemon/certificate/recorded.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using Why = NotActivated::Why;

struct ACellsVersions : ::testing::Test {
  std::int64_t calibrate(const Recording& what = {}) { return record(*journal, what, false); }
  /// The reference of the next check and the next result.
  std::int64_t in_use() {
    const std::int64_t checked = published_session(*journal, {}, {}).id;
    // A session starting now.
    const std::int64_t next = journal->begin(journal->session(checked)->inputs, "t");
    const auto compared =
        last_calibration(*journal, journal->session(checked)->inputs.cell_name, next, false);
    EXPECT_EQ(compared->calibration, journal->session(checked)->calibration);
    for (const Version& one : versions(*journal, 0, 9))
      EXPECT_EQ(one.active, one.session == checked) << one.session;
    return checked;
  }
  void put_into_use(std::int64_t session) {
    activate(*journal,
             {session, "2026-04-01T00:00:00.000Z", "anna", "the newer one was made cold"});
  }
  std::optional<Why> refusal(const std::function<void()>& act) {
    const std::size_t before = journal->activations().size();
    try {
      act();
      return std::nullopt;
    } catch (const NotActivated& refused) {
      EXPECT_EQ(journal->activations().size(), before);
      return refused.why;
    }
  }
  std::optional<Why> why_not(std::int64_t session) {
    return refusal([&] { put_into_use(session); });
  }
  /// A session starting now.
  std::int64_t four_of(std::int64_t session) {
    return journal->begin(journal->session(session)->inputs, "t");
  }
  void damage(const std::string& sql) {
    journal.reset();
    Database(dir / "j.db").execute(sql.c_str());
    journal.emplace(dir / "j.db");
  }

  TemporaryDirectory dir;
  std::optional<Journal> journal{std::in_place, dir / "j.db"};
};

TEST_F(ACellsVersions, HasTheNewestPublishedInUseUntilAnotherIsActivatedOrPublished) {
  EXPECT_TRUE(versions(*journal, 0, 9).empty());
  const std::int64_t one = calibrate(), two = calibrate({.seed = 2});
  calibrate({.publish = false});
  EXPECT_EQ(in_use(), two);
  put_into_use(one);
  EXPECT_EQ(in_use(), one);
  const auto all = versions(*journal, 0, 9);
  ASSERT_EQ(all.size(), 2u);
  EXPECT_EQ(all[0].session, two);
  EXPECT_FALSE(all[0].activated);
  ASSERT_TRUE(all[1].activated);
  EXPECT_EQ(all[1].activated->who, "anna");
  EXPECT_EQ(all[1].activated->reason, "the newer one was made cold");
  EXPECT_GT(all[1].in_scope->mean_u95_m, all[1].predicted_m);
  const auto newest_and_used = versions(*journal, one, 1);
  ASSERT_EQ(newest_and_used.size(), 2u);
  EXPECT_TRUE(newest_and_used[1].active);
  const std::int64_t three = calibrate({.seed = 3});
  EXPECT_EQ(in_use(), three);
}

TEST_F(ACellsVersions, RollsBackOneByOneToTheFirst) {
  const std::int64_t one = calibrate(), two = calibrate({.seed = 2});
  calibrate({.publish = false});
  const std::int64_t four = calibrate({.seed = 4});
  const auto back = [&] {
    return roll_back(*journal, 0, {0, "2026-04-01T00:00:00.000Z", "ben", "loose torch"});
  };
  EXPECT_EQ(in_use(), four);
  EXPECT_EQ(back(), two);
  EXPECT_EQ(in_use(), two);
  EXPECT_EQ(back(), one);
  EXPECT_EQ(in_use(), one);
  EXPECT_EQ(refusal(back), Why::kNothingBefore);
  EXPECT_EQ(in_use(), one);
  EXPECT_EQ(journal->activations().size(), 2u);
}

TEST_F(ACellsVersions, BeforeTheFirstOfALineAreNamedAsThoseOfOtherNumbers) {
  const std::int64_t one = calibrate(), two = calibrate({.seed = 2});
  put_into_use(one);
  try {
    roll_back(*journal, 0, {0, "2026-04-01T00:00:00.000Z", "ben", "a mistake"});
    FAIL() << "session " << two << " was in use before, and was left by a step back";
  } catch (const NotActivated& refused) {
    EXPECT_EQ(
        refused.what(),
        fmt::format(
            "session {}, which is in use, is the first of its line. Put another one into use by its "
            "number: 'cellcal versions', 'cellcal activate ID'",
            one));
  }
}

TEST_F(ACellsVersions, ThatWereGivenBackDoNotComeAgainByARollBack) {
  const std::int64_t one = calibrate(), two = calibrate({.seed = 2});
  put_into_use(one);
  const std::int64_t three = calibrate({.seed = 3});
  EXPECT_EQ(roll_back(*journal, 0, {0, "2026-04-01T00:00:00.000Z", "ben", "loose torch"}), one);
  EXPECT_EQ(in_use(), one);
  put_into_use(two);
  EXPECT_EQ(roll_back(*journal, 0, {0, "2026-04-01T00:00:00.000Z", "ben", "loose torch"}), one);
  EXPECT_NE(three, in_use());
}

TEST_F(ACellsVersions, AreThoseBeforeAMistakenActivationAfterARollBack) {
  const auto back = [&] {
    return roll_back(*journal, 0, {0, "2026-04-01T00:00:00.000Z", "ben", "not this one"});
  };
  const std::int64_t one = calibrate(), two = calibrate({.seed = 2}),
                     three = calibrate({.seed = 3});
  put_into_use(one);
  EXPECT_EQ(back(), three);
  EXPECT_EQ(in_use(), three);
  EXPECT_EQ(back(), two);
  EXPECT_EQ(back(), one);
}

TEST_F(ACellsVersions, AreNotActivatedWhereTheyAreWithheldInUseOrNone) {
  const std::int64_t one = calibrate(), withheld = calibrate({.publish = false});
  EXPECT_EQ(why_not(withheld), Why::kWithheld);
  EXPECT_EQ(why_not(one), Why::kActive);
  EXPECT_EQ(why_not(99), Why::kNoSession);
  EXPECT_EQ(why_not(journal->begin(journal->session(one)->inputs, "t")), Why::kWithheld);
  EXPECT_EQ(in_use(), one);
}

TEST_F(ACellsVersions, OfAnotherRobotToolOrJournalAreNotActivated) {
  const std::int64_t serial_7 = calibrate({.identity = "[identity]\nrobot_serial = \"7\"\n"});
  const std::int64_t longer =
      calibrate({.identity = "[identity]\nrobot_serial = \"8\"\n", .longer_tool_m = 0.02});
  EXPECT_EQ(why_not(serial_7), Why::kForeign);
  const std::int64_t serial_8 = calibrate({.identity = "[identity]\nrobot_serial = \"8\"\n"});
  EXPECT_EQ(why_not(longer), Why::kForeign) << "of another tool";
  EXPECT_EQ(why_not(serial_7), Why::kForeign) << "of another arm of the same nominal geometry";
  const std::int64_t unknown = calibrate();
  EXPECT_EQ(why_not(serial_8), Why::kForeign) << "the newest does not say which arm it is of";
  calibrate({.identity = "[identity]\nrobot_serial = \"8\"\n"});
  EXPECT_EQ(why_not(unknown), Why::kForeign) << "nobody knows which arm it was";
  EXPECT_EQ(why_not(serial_8), std::nullopt);
  Journal other(dir / "other.db");
  const std::int64_t theirs = record(other, {.seed = 9}, false);
  const auto [imported, is_new] = journal->import(other.rows(theirs), "rows");
  EXPECT_EQ(why_not(imported), Why::kForeign);
  EXPECT_EQ(in_use(), serial_8);
}

TEST_F(ACellsVersions, ThatAreDamagedAreNotActivatedAndNothingOlderTakesTheirPlace) {
  const std::int64_t one = calibrate(), two = calibrate({.seed = 2}),
                     three = calibrate({.seed = 3});
  put_into_use(two);
  EXPECT_EQ(in_use(), two);
  damage("UPDATE touch SET target='S9' WHERE session=2 AND number=0");
  EXPECT_EQ(why_not(two), Why::kDamaged);
  const std::string cell = journal->session(one)->inputs.cell_name;
  const auto refused = [&](const std::function<void()>& act) {
    try {
      act();
      return std::string();
    } catch (const NotUsable& unusable) {
      EXPECT_EQ(unusable.why, Why::kDamaged);
      return std::string(unusable.what());
    }
  };
  for (const std::string& words : {refused([&] { published_session(*journal, {}, {}); }),
                                   refused([&] { published_session(*journal, cell, two); }),
                                   refused([&] { calibration_of(*journal, two); }), refused([&] {
                                     last_calibration(*journal, cell, four_of(one), false);
                                   })}) {
    EXPECT_NE(words.find("session 2: row "), std::string::npos) << words;
    EXPECT_NE(words.find("'cellcal activate ID --reason WHY'"), std::string::npos) << words;
  }
  EXPECT_FALSE(last_calibration(*journal, cell, four_of(one), true))
      << "accepted: held against none";
  EXPECT_FALSE(version_in_use(*journal));
  const auto all = versions(*journal, 0, 9);
  ASSERT_EQ(all.size(), 3u);
  EXPECT_TRUE(all[1].active);
  EXPECT_NE(all[1].trouble.find("row "), std::string::npos);
  EXPECT_EQ(roll_back(*journal, 0, {0, "t", "a", "b"}), one) << "was in use before";
  EXPECT_EQ(in_use(), one);
  put_into_use(three);
  damage("UPDATE touch SET target='S9' WHERE session=1 AND number=0");
  EXPECT_EQ(why_not(one), Why::kDamaged);
  EXPECT_EQ(in_use(), three) << "what is not in use may be damaged";
}

TEST_F(ACellsVersions, WhoseSessionIsMissingOrAlteredItselfIsNotAsIfItWereNotThere) {
  for (
      const char* sql :
      {"UPDATE session SET cell_text='other' WHERE id=2",
       "UPDATE session SET calibration=replace(calibration, '\"verdict\"', '\"verdikt\"') WHERE id=2",
       "UPDATE session SET state='dome' WHERE id=2", "DELETE FROM session WHERE id=2"}) {
    journal.reset();
    std::filesystem::remove_all(dir / "j");
    std::filesystem::create_directory(dir / "j");
    journal.emplace(dir / "j/j.db");
    const std::int64_t one = calibrate();
    calibrate({.seed = 2});
    journal.reset();
    Database(dir / "j/j.db").execute(sql);
    journal.emplace(dir / "j/j.db");
    EXPECT_EQ(refusal([&] { published_session(*journal, {}, {}); }), Why::kDamaged) << sql;
    put_into_use(one);
    EXPECT_EQ(in_use(), one) << sql;
  }
}

TEST_F(ACellsVersions, AreNotHiddenByADamagedSessionThatPublishedNothing) {
  const std::int64_t one = calibrate();
  const std::int64_t withheld = calibrate({.publish = false});
  const std::int64_t began = journal->begin(journal->session(one)->inputs, "t");
  journal->record(began, RecordTouch{0, journal->touches(one)[0]});
  journal->record(began, RecordEnd{Ending::kDone, ""}, "t1");
  damage(("UPDATE touch SET target='S9' WHERE number=0 AND session IN (" +
          std::to_string(withheld) + "," + std::to_string(began) + ")")
             .c_str());
  EXPECT_EQ(in_use(), one);
}

TEST_F(ACellsVersions, ThatMustNotBeActivatedAreNotCheckedAgainstEither) {
  const std::int64_t longer = calibrate({.longer_tool_m = 0.02});
  calibrate();
  Journal other(dir / "other.db");
  const std::int64_t theirs = record(other, {.seed = 9}, false);
  const auto [imported, is_new] = journal->import(other.rows(theirs), "rows");
  for (const std::int64_t session : {longer, imported}) {
    EXPECT_EQ(why_not(session), Why::kForeign) << session;
    EXPECT_EQ(refusal([&] { published_session(*journal, {}, session); }), Why::kForeign) << session;
  }
}

TEST_F(ACellsVersions, OfAnActivationThatWasForgedStayAsTheyWere) {
  calibrate();
  const std::int64_t two = calibrate({.seed = 2});
  damage("INSERT INTO activation VALUES (1, 't', 'nobody', 'x')");
  EXPECT_EQ(in_use(), two);
}

TEST_F(ACellsVersions, DoNotChangeWhatAnEarlierResultWasHeldAgainst) {
  const std::int64_t one = calibrate(), two = calibrate({.seed = 2}),
                     three = calibrate({.seed = 3});
  put_into_use(one);
  const std::string cell = journal->session(three)->inputs.cell_name;
  EXPECT_EQ(last_calibration(*journal, cell, three, false)->calibration,
            journal->session(two)->calibration);
}

TEST_F(ACellsVersions, ComparedNameHowFarTheyAreApartAndWhatMoved) {
  const std::int64_t one = calibrate({.fit = 80}), same = calibrate({.fit = 80, .seed = 2}),
                     moved = calibrate({.remastered_rad = 2e-3, .fit = 80, .seed = 3});
  const Comparison alike = compare(*journal, one, same);
  ASSERT_TRUE(alike.apart);
  EXPECT_TRUE(alike.workspace);
  EXPECT_LT(alike.apart->mean_apart_m, 2.0 * alike.expected_m);
  const Comparison apart = compare(*journal, one, moved);
  ASSERT_TRUE(apart.apart);
  EXPECT_GT(apart.apart->mean_apart_m, 2.0 * alike.apart->mean_apart_m);
  ASSERT_FALSE(apart.parameters.moved.empty());
  const calib::MovedParameter& most = apart.parameters.moved[0];
  EXPECT_EQ(most.name, "A2.theta");
  EXPECT_NEAR(most.after - most.before, -2e-3, most.expanded);
  EXPECT_LT(alike.parameters.moved.size(), 10u) << "one in twenty by chance";
  const std::int64_t longer = calibrate({.longer_tool_m = 0.02});
  EXPECT_FALSE(compare(*journal, one, longer).apart);
  EXPECT_EQ(refusal([&] { compare(*journal, one, 99); }), Why::kNoSession);
  EXPECT_EQ(refusal([&] { compare(*journal, calibrate({.publish = false}), one); }),
            Why::kWithheld);
}

}  // namespace
}  // namespace cellcal::daemon::testing
