// Each kind of session has its own outcome, kept as a document; only calibrations are published.

#include "daemon/result/outcome.h"

#include <fmt/ranges.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "calib/model/enum_table.h"
#include "calib/words/phrase_json.h"
#include "daemon/result/outcome_json.h"

namespace cellcal::daemon {
namespace {

using calib::ChangeKind;

SessionOutcome of(auto value) { return outcome_of(SessionResult{std::move(value)}); }

calib::TcpCheck a_check(bool holds) {
  calib::TcpCheck check;
  check.holds = holds;
  check.touches = 8;
  check.shift_m = {0.8e-3, -0.5e-3, 0.3e-3};
  check.covariance_m2 = 0.025e-3 * 0.025e-3 * Eigen::Matrix3d::Identity();
  check.log_odds = holds ? -1.0 : 50.0;
  check.explanations = {{.kind = ChangeKind::kTool,
                         .name = "probe",
                         .probability = 0.99,
                         .shift_m = check.shift_m,
                         .sigma = 0.025e-3},
                        {.kind = ChangeKind::kNothing, .probability = 0.01}};
  return check;
}

calib::Calibration a_calibration(bool publish) {
  calib::Calibration one;
  one.verdict.judged = publish;
  one.after.count = 60;
  if (publish) return one;
  calib::Finding finding;
  finding.kind = calib::FindingKind::kNoGain;
  finding.severity = calib::Severity::kWithholds;
  one.verdict.findings = {finding, finding};
  return one;
}

calib::Calibration an_update(calib::UpdateOutcome outcome) {
  calib::Calibration one = a_calibration(outcome == calib::UpdateOutcome::kUpdated);
  one.update.emplace().outcome = outcome;
  one.update->explanations = a_check(false).explanations;
  return one;
}

TEST(AnOutcome, IsOfTheSessionsOwnKind) {
  EXPECT_EQ(of(a_calibration(true)).kind, OutcomeKind::kPublished);
  EXPECT_EQ(of(a_calibration(false)).kind, OutcomeKind::kWithheld);
  EXPECT_EQ(of(a_calibration(false)).withheld_by.size(), 1U) << "each finding once";
  EXPECT_EQ(of(a_check(true)).kind, OutcomeKind::kHolds);
  EXPECT_EQ(of(a_check(false)).kind, OutcomeKind::kDoesNotHold);
  EXPECT_EQ(of(Qualification{}).kind, OutcomeKind::kNotQualified);
  EXPECT_EQ(of(FoundSpheres{}).kind, OutcomeKind::kFound);
  EXPECT_EQ(of(DryRun{14}).kind, OutcomeKind::kNothingMet);
  EXPECT_EQ(of(DryRun{14}).touches, 14U);
  EXPECT_EQ(of(an_update(calib::UpdateOutcome::kUpdated)).kind, OutcomeKind::kUpdated);
  EXPECT_EQ(of(an_update(calib::UpdateOutcome::kNothingChanged)).kind,
            OutcomeKind::kNothingChanged);
  EXPECT_EQ(of(an_update(calib::UpdateOutcome::kNotResolved)).kind, OutcomeKind::kUpdateWithheld);
}

TEST(AnOutcome, IsPublishedOrWithheldOfACalibrationAlone) {
  EXPECT_EQ(published(of(a_calibration(true))), true);
  EXPECT_EQ(published(of(a_calibration(false))), false);
  EXPECT_EQ(published(of(a_check(true))), std::nullopt);
  EXPECT_EQ(published(of(Qualification{})), std::nullopt);
  EXPECT_EQ(published(of(FoundSpheres{})), std::nullopt);
  EXPECT_EQ(published(of(DryRun{})), std::nullopt);
}

std::vector<std::string> in_language(const SessionOutcome& outcome, const char* code) {
  std::vector<std::string> lines;
  for (const calib::Phrase& line : phrases(outcome))
    lines.push_back(words(line, *calib::Language::of(code)));
  return lines;
}

TEST(AnOutcome, OfACheckThatDoesNotHoldHasShiftCauseAndRemedy) {
  const SessionOutcome outcome = of(a_check(false));
  ASSERT_TRUE(outcome.tcp_shift);
  EXPECT_NEAR(outcome.tcp_shift->shift_m.norm(), 0.99e-3, 0.01e-3);
  EXPECT_NEAR(outcome.tcp_shift->u_m, 0.05e-3, 1e-9);
  EXPECT_EQ(cause_of(outcome), "tool");
  EXPECT_EQ(outcome.remedy, calib::DriftAdvice::kReMeasureTcp);
  const std::vector<std::string> lines = in_language(outcome, "en");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0], "calibration does not hold: TCP shift 0.99 ± 0.05 mm (k=2)");
  EXPECT_NE(lines[1].find("probe shifted by 0.99"), std::string::npos) << lines[1];
  EXPECT_NE(lines[1].find("Check the tool's fastening"), std::string::npos) << lines[1];
}

TEST(AnOutcome, OfACheckAfterASphereMovedNamesItAndNoShiftOfTheTcp) {
  calib::TcpCheck check = a_check(false);
  check.explanations[0].kind = ChangeKind::kSphere;
  check.explanations[0].name = "S3";
  check.explanations[0].amount = 0.9e-3;
  const SessionOutcome outcome = of(check);
  EXPECT_FALSE(outcome.tcp_shift);
  const std::vector<std::string> lines = in_language(outcome, "en");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_EQ(lines[0],
            "calibration does not hold: S3 moved by at least 0.90 mm (k=2) along its touches");
  EXPECT_TRUE(lines[1].starts_with("Clamp the stand of S3")) << lines[1];
  const std::string written = outcome_to_json(outcome);
  EXPECT_NE(written.find("\"at_least\":0.9"), std::string::npos) << written;
  EXPECT_EQ(outcome_to_json(*outcome_from_json(written)), written);
}

TEST(AnOutcome, OfACheckWithTouchesThatGaveNoContactPointIsUndecidedUnlessTheOthersAlarm) {
  calib::TcpCheck check = a_check(true);
  check.holds = false;
  check.unsteady = {{2, "S1"}, {3, "S1"}};
  EXPECT_EQ(of(check).kind, OutcomeKind::kUndecided);
  EXPECT_EQ(of(check).unsteady, std::vector<std::string>{"S1"});
  EXPECT_EQ(of(check).remedy, calib::DriftAdvice::kCheckAgain);
  EXPECT_EQ(cause_of(of(check)), "") << "nothing is said to have changed";
  check.log_odds = 50.0;
  EXPECT_EQ(of(check).kind, OutcomeKind::kDoesNotHold);
  calib::TcpCheck nothing_met;
  nothing_met.not_found = {{0, "S2", 0.012}};
  EXPECT_EQ(of(nothing_met).kind, OutcomeKind::kDoesNotHold);
  EXPECT_EQ(of(nothing_met).remedy, calib::DriftAdvice::kRecalibrate);
}

/// All touches were made and alarm of nothing; one of two mastered zeros is off by four sigma.
SessionResult mastered_wrong() {
  calib::TcpCheck check = a_check(true);
  check.holds = check.zeros_hold = false;
  return {check, {{"A2", 4e-4, 1e-4}, {"A3", 1e-4, 1e-4}}};
}

TEST(AnOutcome, OfAMasteredZeroThatIsOffDoesNotHoldAndNamesIt) {
  const SessionOutcome outcome = outcome_of(mastered_wrong());
  EXPECT_EQ(outcome.kind, OutcomeKind::kDoesNotHold);
  EXPECT_FALSE(outcome.change) << "the touches found none";
  const std::vector<std::string> lines = in_language(outcome, "en");
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_NE(lines[1].find("zero of A2 +0.0229 ± 0.0115 deg (k=2)"), std::string::npos) << lines[1];
  EXPECT_NE(lines[1].find("Master it again"), std::string::npos) << lines[1];
}

TEST(AnOutcome, IsReadBackAsItWasWritten) {
  FoundSpheres found{{{"S1", {1.2, -0.1, 0.3}, 5e-3, 9, 2.5e-3},
                      {"S2", {0.9, 0.4, 0.2}, 5e-3, 7, {}},
                      {"T1", {0.22, 0.0, 0.1}, 5e-3, 6, {}, "E2", {0.5, -1.0}}}};
  Qualification qualification;
  qualification.findings = {QualificationFinding::kDelayNotAsStated};
  qualification.delay = ContactDelay{.delay_s = 2.67e-3, .sigma_s = 0.27e-3};
  calib::TcpCheck joint = a_check(false);
  joint.explanations.front() = {
      .kind = ChangeKind::kJoint, .name = "A2", .amount = 4e-4, .sigma = 1e-5};
  calib::TcpCheck touch = a_check(false);
  touch.explanations.front() = {
      .kind = ChangeKind::kTouch, .name = "S3", .touch = 4, .amount = 3e-4};
  for (const SessionOutcome& one :
       {of(a_calibration(true)), of(a_calibration(false)), of(a_check(true)), of(a_check(false)),
        outcome_of(mastered_wrong()), of(joint), of(touch), of(qualification), of(found),
        of(DryRun{14}), of(an_update(calib::UpdateOutcome::kUpdated)),
        of(an_update(calib::UpdateOutcome::kNothingChanged)),
        of(an_update(calib::UpdateOutcome::kContradicted))}) {
    const std::string text = outcome_to_json(one);
    const auto read = outcome_from_json(text);
    ASSERT_TRUE(read) << text;
    EXPECT_EQ(outcome_with_words(read), outcome_with_words(one)) << text;
    EXPECT_EQ(read->kind, one.kind);
    EXPECT_EQ(phrases(*read), phrases(one));
    const auto english = in_language(one, "en"), german = in_language(one, "de");
    for (std::size_t i = 0; i < english.size(); ++i) {
      EXPECT_NE(german[i], english[i]);
      EXPECT_EQ((german[i] + english[i]).find("say."), std::string::npos) << german[i];
    }
  }
}

TEST(AnOutcome, OfAQualificationHasItsFiguresAndTheValuesToSet) {
  Qualification qualification;
  qualification.target = "S2";
  qualification.touches = 18;
  qualification.noise_m = Figure{0.02e-3, 0.004e-3};
  qualification.delay = ContactDelay{.delay_s = 2.67e-3, .sigma_s = 0.27e-3};
  const auto all = [](const Qualification& q) {
    return fmt::format("{}", fmt::join(in_language(of(q), "en"), "\n"));
  };
  const std::string passed = all(qualification);
  EXPECT_TRUE(passed.starts_with("contacts qualified: 18 touches\n")) << passed;
  EXPECT_NE(passed.find("0.020 ± 0.008 mm (k=2), 1 sigma"), std::string::npos) << passed;
  EXPECT_NE(passed.find("2.67 ± 0.54 ms"), std::string::npos) << passed;
  EXPECT_EQ(passed.find("Set delay_ms"), std::string::npos) << passed;
  EXPECT_EQ(passed.find("result:"), std::string::npos) << "stated once";
  qualification.findings = {QualificationFinding::kDelayNotAsStated};
  const std::string failed = all(qualification);
  EXPECT_NE(failed.find("Set delay_ms = 2.67 and delay_sigma_ms = 0.27"), std::string::npos)
      << failed;
}

TEST(AFoundSphere, IsStatedInTheCellFilesKeysOnAPositionerWithAxisAndAngles) {
  FoundSphere sphere{"T1", {0.22, 0.0, 0.1}, 5e-3, 6, {}};
  EXPECT_EQ(words(phrase(sphere)),
            "T1: centre_mm = [220.00, 0.00, 100.00]  # ± 5 mm (k=2), 6 touches");
  sphere.on = "E2";
  sphere.taught_rad = {0.5, -1.0};
  EXPECT_EQ(
      words(phrase(sphere)),
      "T1: centre_mm = [220.00, 0.00, 100.00], on = \"E2\", taught_deg = [28.65, -57.30]  # ± 5 mm "
      "(k=2), 6 touches");
}

TEST(ADocument, HasItsSentencesInEnglishAndAsPhrases) {
  SessionResult check{a_check(false)};
  check.mastered = {{"A2", 5e-4, 5e-5}, {"A3", 0.0, 5e-5}};
  for (const SessionResult& result :
       {check, SessionResult{Qualification{}},
        SessionResult{FoundSpheres{{{"S1", {1.2, -0.1, 0.3}, 5e-3, 9, {}}}}}}) {
    const auto document = nlohmann::json::parse(document_of(result));
    ASSERT_EQ(document.at("said").size(), document.at("words").size());
    EXPECT_FALSE(document.at("said").empty());
    for (std::size_t i = 0; i < document.at("said").size(); ++i)
      EXPECT_EQ(words(calib::phrase_of(document["said"][i])), document["words"][i]);
  }
  const auto document = nlohmann::json::parse(document_of(check));
  EXPECT_NE(document["words"][1].get<std::string>().find("zero of A2"), std::string::npos);
  EXPECT_NE(document["words"][2].get<std::string>().find("zero of A3"), std::string::npos);
}

TEST(AnOutcome, ThatIsWithheldNamesItsReasonsInWords) {
  SessionOutcome outcome = of(a_calibration(false));
  outcome.withheld_by = {calib::FindingKind::kTooFewTouches, calib::FindingKind::kRank};
  EXPECT_EQ(in_language(outcome, "en").front(), "calibration withheld: too few touches, rank");
  const auto expect_words = [](const SessionOutcome& one) {
    for (const std::string& code : calib::Language::codes())
      for (const std::string& line : in_language(one, code.c_str()))
        EXPECT_FALSE(std::regex_search(line, std::regex(R"((say|finding)\.[a-z_])"))) << line;
  };
  for (const calib::FindingKind kind : all_values<calib::FindingKind>()) {
    outcome.withheld_by = {kind};
    expect_words(outcome);
  }
  for (const QualificationFinding kind : all_values<QualificationFinding>()) {
    Qualification qualification;
    qualification.findings = {kind};
    expect_words(of(qualification));
  }
  for (const calib::UpdateOutcome kind : all_values<calib::UpdateOutcome>())
    expect_words(of(an_update(kind)));
}

TEST(EveryKind, OfOutcomeFindingAndCauseHasANameInEveryLanguage) {
  for (const std::string& code : calib::Language::codes()) {
    const calib::Language language = *calib::Language::of(code);
    const auto expect = [&](const std::string& id) {
      EXPECT_TRUE(calib::sentence_of(id, language)) << code << ": " << id;
    };
    for (const OutcomeKind kind : kOutcomeKinds)
      expect(std::string("say.session.") + to_string(kind));
    for (const calib::FindingKind kind : all_values<calib::FindingKind>())
      expect(std::string("finding.") + to_string(kind));
    for (const calib::ChangeKind kind : all_values<calib::ChangeKind>())
      expect(std::string("say.change.") + to_string(kind));
    for (const calib::UpdateOutcome kind : all_values<calib::UpdateOutcome>())
      expect(std::string("say.update.") + to_string(kind));
    for (const QualificationFinding kind : all_values<QualificationFinding>()) {
      expect(std::string("say.contacts.") + to_string(kind));
      expect(std::string("say.qualify.") + to_string(kind));
    }
  }
}

TEST(AnOutcome, OfATextThatIsNoneIsNothing) {
  for (const char* text :
       {"", "{", "[]", "null", "3", R"({"kind": "holds"})", R"({"kind": "later"})"})
    EXPECT_FALSE(outcome_from_json(text)) << text;
  auto wrong = nlohmann::json::parse(outcome_to_json(of(DryRun{14})));
  wrong["contacts"] = {3};
  EXPECT_FALSE(outcome_from_json(wrong.dump()));
  EXPECT_TRUE(outcome_with_words(std::nullopt).is_null());
}

TEST(AnOutcome, HasANameOfItsOwnForEachKind) {
  std::set<std::string> names;
  for (const OutcomeKind kind : kOutcomeKinds) {
    EXPECT_EQ(by_own_name<OutcomeKind>(to_string(kind)), kind);
    names.insert(to_string(kind));
  }
  EXPECT_EQ(names.size(), kOutcomeKinds.size());
}

}  // namespace
}  // namespace cellcal::daemon
