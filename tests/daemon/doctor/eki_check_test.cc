#include "daemon/doctor/robot_check.h"
#include "tests/daemon/doctor/outcome_of.h"

namespace cellcal::daemon::testing {
namespace {

EkiSeen sound_eki() {
  EkiSeen seen;
  seen.connected = seen.up = true;
  seen.observed_s = 10.0;
  seen.peer = "172.31.1.147:54600";
  drivers::EkiCoreState& s = seen.newest;
  s.states = 500;
  s.cycle_s = 0.02;
  s.decimals_seen = 5;
  s.ready = s.drives = true;
  s.mode = drivers::OperatingMode::kT1;
  s.trouble = drivers::EkiTrouble::kNone;
  return seen;
}

Findings judged(const EkiSeen& seen, EkiExpected expected = {true, 17, false}) {
  Findings findings;
  judge_eki(seen, expected, findings);
  expect_advice(findings);
  return findings;
}

TEST(AnEkiLink, ThatIsSoundHasNothingFailed) {
  const Findings findings = judged(sound_eki());
  EXPECT_TRUE(findings.green());
  EXPECT_EQ(findings.count(Outcome::kWarning), 1u);  // the wiring of the input was not observed
  EXPECT_EQ(judged(sound_eki(), {false, 17}).count(Outcome::kWarning), 0u);
}

TEST(AnEkiLink, ThatIsNotThereGetsTheChecklist) {
  EkiSeen seen;
  seen.last_words = "no connection";
  const Findings findings = judged(seen);
  EXPECT_NE(finding_of(findings, "eki connection").advice.find("CELLCAL_SUB"), std::string::npos);
  EXPECT_EQ(findings.count(Outcome::kSkipped), 4u);
}

TEST(AnEkiLink, WithoutStatesOrObeyingAnotherFailsByItsOwnWords) {
  EkiSeen seen = sound_eki();
  seen.up = false;
  seen.last_words = "the controller obeys session 5";
  EXPECT_EQ(finding_of(judged(seen), "eki states").found, seen.last_words);
}

TEST(AnEkiLink, IsJudgedByElementsDecimalsAndReadiness) {
  EkiSeen seen = sound_eki();
  seen.newest.bad_documents = 1;
  seen.newest.last_error = drivers::EkiError::kMissing;
  EXPECT_EQ(outcome_of(judged(seen), "eki elements"), Outcome::kFailed);
  seen = sound_eki();
  seen.newest.unread_by_controller = 2;
  EXPECT_EQ(outcome_of(judged(seen), "eki elements"), Outcome::kFailed);
  seen = sound_eki();
  seen.newest.decimals_seen = 2;
  EXPECT_EQ(outcome_of(judged(seen), "eki decimals"), Outcome::kFailed);
  seen.newest.ready = false;
  EXPECT_EQ(outcome_of(judged(seen), "eki readiness"), Outcome::kWarning);
  seen.newest.fault = 3;
  EXPECT_EQ(outcome_of(judged(seen), "eki readiness"), Outcome::kFailed);
  seen.newest.cycle_s = 0.1;
  EXPECT_EQ(outcome_of(judged(seen), "eki states"), Outcome::kWarning);
  seen.lost = true;
  EXPECT_EQ(outcome_of(judged(seen), "eki states"), Outcome::kFailed);
}

TEST(AnEkiLink, ShowsTheSubmitProgramsLongestPassAndWarnsWhereStopsWaitForIt) {
  EkiSeen seen = sound_eki();
  EXPECT_EQ(finding_of(judged(seen), "eki states").found.find("pass"), std::string::npos);
  seen.newest.longest_pass_ms = 24;
  EXPECT_EQ(outcome_of(judged(seen), "eki states"), Outcome::kOk);
  EXPECT_NE(finding_of(judged(seen), "eki states").found.find("longest pass of CELLCAL_SUB 24 ms"),
            std::string::npos);
  seen.newest.longest_pass_ms = 60;
  EXPECT_EQ(outcome_of(judged(seen), "eki states"), Outcome::kWarning);
}

TEST(AContactInput, IsProvenByChangingWithTheContactAlone) {
  const auto outcome = [](bool input, bool contact, bool on) {
    EkiSeen seen = sound_eki();
    seen.input.changed = input;
    seen.input.contact_changed = contact;
    seen.input.on_while_open = on;
    seen.newest.input = on;
    return outcome_of(judged(seen), "eki contact input");
  };
  EXPECT_EQ(outcome(true, true, false), Outcome::kOk);
  EXPECT_EQ(outcome(false, true, false), Outcome::kFailed);
  EXPECT_EQ(outcome(true, false, false), Outcome::kFailed);
  EXPECT_EQ(outcome(false, false, true), Outcome::kFailed);
  EXPECT_EQ(outcome(false, false, false), Outcome::kWarning);
}

TEST(AContactInput, ThatACutWireWouldLeaveFreeIsAWarning) {
  EkiSeen seen = sound_eki();
  seen.input.changed = seen.input.contact_changed = true;
  EXPECT_EQ(outcome_of(judged(seen, {true, 17, true}), "eki contact input"), Outcome::kWarning);
}

}  // namespace
}  // namespace cellcal::daemon::testing
