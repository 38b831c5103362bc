// Every number of a certificate is traced to rows of the journal.

#include <gtest/gtest.h>
#include <stdlib.h>
#include <time.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "daemon/certificate/certificate.h"
#include "tests/daemon/certificate/origins.h"
#include "tests/daemon/certificate/printed.h"
#include "tests/daemon/certificate/recorded.h"
#include "tests/daemon/journal/temporary_directory.h"

namespace cellcal::daemon::testing {
namespace {

using certificate::CertificateData;

/// Maximum rounding error of the last digit.
double rounding(const std::string& text) {
  const std::size_t e = text.find('e'), point = text.find('.');
  const double exponent = e == text.npos ? 0.0 : std::stod(text.substr(e + 1));
  const double decimals =
      point == text.npos ? 0.0 : static_cast<double>(std::min(e, text.size()) - point - 1);
  return 0.5 * std::pow(10.0, exponent - decimals);
}

/// Empty if the printed value equals that of its origin; otherwise the difference.
std::string complaint(const Printed& printed, const Origins& origins) {
  const std::string where = printed.from + " -> " + printed.text + ": ";
  try {
    const std::variant<double, std::string> is = origins.at(printed.from);
    if (const auto* text = std::get_if<std::string>(&is))
      return *text == printed.text ? "" : where + "it is " + *text;
    const std::string ascii = replaced(printed.text, "\xE2\x88\x92", "-");
    if (!std::regex_match(ascii, std::regex("-?[0-9]+(\\.[0-9]+)?(e[-+][0-9]+)?")))
      return where + "no number";
    // A differently fitted base differs in second order, below a micrometre.
    const double way =
        printed.from.starts_with("scope#") || printed.from.starts_with("found#") ? 1e-3 : 1e-9;
    const double value = std::get<double>(is);
    const bool same = std::abs(std::stod(ascii) - value) <= rounding(ascii) * 1.0001 + way;
    return same ? "" : where + "it is " + std::to_string(value);
  } catch (const std::exception& error) {
    return where + error.what();
  }
}

struct ACertificate : ::testing::Test {
  ACertificate() {
    ::setenv("TZ", "Europe/Berlin", 1);
    ::tzset();
  }
  ~ACertificate() override {
    ::unsetenv("TZ");
    ::tzset();
  }
};

void expect_all_traced(const Archive& archive) {
  const std::string html = to_html(make_certificate(archive, "e", kIssue));
  const Origins origins(archive);
  std::string rest;
  const auto entries = entries_of(html, rest);
  EXPECT_GT(entries.size(), 600u);
  EXPECT_EQ(rest.find_first_of("0123456789"), rest.npos)
      << "a number without origin: " << rest.substr(rest.find_first_of("0123456789"), 60);
  std::map<std::string, std::string> seen;  // each once: values over the scope take time
  for (const Printed& one : entries) {
    const auto [before, is_new] = seen.emplace(one.from, one.text);
    EXPECT_EQ(is_new ? complaint(one, origins) : "", "");
    EXPECT_EQ(before->second, one.text) << one.from;
  }
}

TEST_F(ACertificate, OfAnArmFoundAsDrawnHasEveryNumberFromTheJournalsRows) {
  expect_all_traced(recorded().first);
}

TEST_F(ACertificate, OfAnArmFoundAsCalibratedBeforeHasEveryNumberFromTheJournalsRows) {
  expect_all_traced(recorded().second);
}

TEST_F(ACertificate,
       StatesAccuracyAndRepeatabilityAfterTheTermsOfIso9283WhereThereAreTouchesForIt) {
  const CertificateData none = [] {
    const TemporaryDirectory directory;
    Journal journal(directory / "j.db");
    return make_certificate(
        make_archive(journal, record(journal, {.as_fit = true, .fit = 60}, false),
                     directory / "none"),
        "e", kIssue);
  }();
  EXPECT_EQ(to_html(none).find("Pose accuracy"), std::string::npos);
  EXPECT_TRUE(nlohmann::json::parse(to_json(none)).at("pose_sheet").is_null());
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  const std::int64_t id = record(journal, {.fit = 60, .repeats = 5}, false);
  const Archive archive = make_archive(journal, id, directory / "none");
  const CertificateData data = make_certificate(archive, "e", kIssue);
  ASSERT_EQ(data.content["pose_sheet"]["accuracy"].size(), 4u);
  ASSERT_EQ(data.content["pose_sheet"]["repeatability"].size(), 1u);
  EXPECT_EQ(data.entry("pose_sheet/repeatability/0/repeats").text, "6");
  EXPECT_NE(to_html(data).find("not a test according to it"), std::string::npos);
  EXPECT_EQ(nlohmann::json::parse(to_json(data)).at("pose_sheet").at("is_a_test_by_it"), false);
  expect_all_traced(archive);
}

TEST_F(ACertificate, LeavesOutTheCheckTouchesThatTheVerdictLeftAside) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  record(journal, {}, false);
  const std::int64_t id = record(journal, {.gross_check = true, .fit = 60, .seed = 2}, true);
  const Archive archive = make_archive(journal, id, directory / "none");
  const CertificateData data = make_certificate(archive, "e", kIssue);
  const auto count = [&](const char* set) {
    return std::ranges::count(data.content["raw_touches"], set,
                              [](const auto& row) { return row["set"]["text"]; });
  };
  EXPECT_EQ(count("left out"), 1);
  EXPECT_EQ(count("check"), 7);
  EXPECT_LT(*certificate::entry_at(figure_of(data, "say.certificate.tip.check.largest"), "as_found")
                 .value,
            2.0);
  expect_all_traced(archive);
}

TEST_F(ACertificate, ListsTheCertifiedLengthsWhoseEndsWereTouched) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  const std::int64_t id = record(journal, {.untouched = "S3", .fit = 60}, false);
  const Archive archive = make_archive(journal, id, directory / "none");
  const CertificateData data = make_certificate(archive, "e", kIssue);
  EXPECT_EQ(data.content["artefacts"].size(), 4u);
  ASSERT_EQ(data.content["lengths"].size(), 3u);
  for (const auto& length : data.content["lengths"])
    for (const auto& end : length["between"]) EXPECT_NE(end["text"], "S3");
  expect_all_traced(archive);
}

TEST_F(ACertificate, TracesTheScaleToWhatTheVerdictFound) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  const std::int64_t id = record(journal, {.check_length = true, .fit = 60}, false);
  CertificateData data =
      make_certificate(make_archive(journal, id, directory / "none"), "e", kIssue);
  EXPECT_EQ(data.scale, calib::ScaleBy::kLengths);
  const auto has_scale = [&](const char* words) {
    return to_html(data).find(words) != std::string::npos;
  };
  EXPECT_TRUE(has_scale("The certified lengths hold the scale"));
  const std::string html = to_html(data);
  const std::size_t at = html.find("The certified lengths hold the scale");
  const std::string sentence = html.substr(at, html.find("</p>", at) - at);
  EXPECT_NE(sentence.find("FITTED-1"), std::string::npos) << sentence;
  EXPECT_EQ(sentence.find("CHECKED-2"), std::string::npos) << sentence;
  data.scale = calib::ScaleBy::kReadings;
  EXPECT_TRUE(has_scale("Readings of an instrument hold the scale"));
  data.scale = calib::ScaleBy::kNothing;
  EXPECT_TRUE(has_scale("it is not traced"));
}

TEST_F(ACertificate, StatesTheDeviationOfALengthThatWasNotFittedBesideItsUncertainty) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  const std::int64_t id = record(journal, {.check_length = true, .fit = 60}, false);
  const Archive archive = make_archive(journal, id, directory / "none");
  const CertificateData data = make_certificate(archive, "e", kIssue);
  ASSERT_EQ(data.content["length_checks"].size(), 1u);
  EXPECT_LT(std::abs(*data.entry("length_checks/0/deviation").value),
            2.0 * *data.entry("length_checks/0/deviation_expanded").value);
  EXPECT_NE(to_html(data).find("Check of the scale"), std::string::npos);
  expect_all_traced(archive);
}

TEST_F(ACertificate, HasAnUncertaintyBudgetWhoseSquaresAddUpToTheStandardUncertainty) {
  const CertificateData data = make_certificate(recorded().first, "e", kIssue);
  const auto& lines = data.content["uncertainty_budget"]["lines"];
  ASSERT_GT(lines.size(), 4u);
  double squares = 0.0;
  for (const auto& one : lines) {
    const double contribution = one["contribution"]["value"];
    squares += std::pow(contribution, 2);
    if (one["sigma"]["text"] == "") continue;
    EXPECT_NEAR(one["sigma"]["value"].get<double>() * one["sensitivity"]["value"].get<double>(),
                contribution, 1e-9)
        << one["source"];
  }
  const double standard = *data.entry("uncertainty_budget/standard").value;
  EXPECT_NEAR(std::sqrt(squares), standard, 1e-6);
  EXPECT_NEAR(2.0 * standard, *data.entry("uncertainty_budget/expanded").value, 1e-9);
}

TEST_F(ACertificate, OfAnArmWithoutCertifiedLengthsClaimsNothingBeyondTheTargets) {
  const TemporaryDirectory directory;
  Journal journal(directory / "j.db");
  const std::int64_t id = record(journal, {.lengths = false, .emulated = true}, false);
  const Archive archive = make_archive(journal, id, directory / "none");
  expect_all_traced(archive);
  const CertificateData data = make_certificate(archive, "e", kIssue);
  EXPECT_TRUE(data.entry("number").text.starts_with("emulated-")) << data.entry("number").text;
  const std::string html = to_html(data);
  EXPECT_LT(html.find("no real robot was touched"), html.find("<h2>")) << "on its face";
  EXPECT_EQ(nlohmann::json::parse(to_json(data)).at("emulated").at("text"), "emulated cell");
  EXPECT_NE(html.find("Scope: near the targets."), html.npos);
  EXPECT_NE(html.find("the scale of the arm is not traced"), html.npos);
  EXPECT_EQ(html.find("hold the scale;"), html.npos);
}

TEST_F(ACertificate, AsDataHasTheEntriesOfTheDocument) {
  const CertificateData data = make_certificate(recorded().first, "e", kIssue);
  std::string rest;
  std::set<std::pair<std::string, std::string>> printed;
  for (const Printed& one : entries_of(to_html(data), rest))
    if (!one.from.starts_with("method#") && !one.from.starts_with("unit("))
      printed.emplace(one.from, one.text);
  std::set<std::pair<std::string, std::string>> traced;
  const std::function<void(const nlohmann::json&)> walk = [&](const nlohmann::json& value) {
    if (value.is_object() && value.contains("from") && value.contains("text")) {
      if (value["text"] != "") traced.emplace(value["from"], value["text"]);
      return;
    }
    if (value.is_structured())
      for (const auto& one : value) walk(one);
  };
  const nlohmann::json json = nlohmann::json::parse(to_json(data));
  EXPECT_EQ(json.at("format"), "cellcal.certificate/1");
  EXPECT_TRUE(json.at("emulated").is_null()) << "of a real one";
  walk(json);
  EXPECT_TRUE(std::includes(traced.begin(), traced.end(), printed.begin(), printed.end()));
  EXPECT_LE(traced.size(), printed.size() + 2);  // two values of the resumption are not printed
}

TEST(ANumber, ThatIsNotItsOriginsIsFound) {
  const Origins origins(recorded().first);
  EXPECT_EQ(complaint({"cell#/length/0/mm", "700.2860"}, origins), "");
  EXPECT_NE(complaint({"cell#/length/0/mm", "700.2861"}, origins), "");
  EXPECT_NE(complaint({"cell#/length/99/mm", "700.2860"}, origins), "");
  EXPECT_EQ(complaint({"k*cell#/length/0/sigma_mm", "0.0100"}, origins), "");
  EXPECT_NE(complaint({"cell#/identity/robot_serial", "4712"}, origins), "");
  EXPECT_NE(complaint({"method#nothing", "2"}, origins), "");
}

}  // namespace
}  // namespace cellcal::daemon::testing
