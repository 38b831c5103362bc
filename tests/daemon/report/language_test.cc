// The report in another language: no English text is left, and numbers have a decimal comma.

#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <string>

#include "tests/daemon/report/fixture.h"
#include "tests/daemon/report/html_checker.h"

namespace cellcal::daemon::report::testing {
namespace {

std::string without(std::string html, const char* pattern) {
  return std::regex_replace(html, std::regex(pattern), " ");
}

/// Texts between tags, without style sheet and quotations from files.
std::set<std::string> texts(const std::string& html) {
  const std::size_t begin = html.find("<main>");
  const std::string body =
      without(without(html.substr(begin), "<code[^>]*>[^<]*</code>"), "touches\\.csv");
  std::set<std::string> found;
  const std::regex text(">([^<]*[^<[:space:]][^<]*)<");
  for (std::sregex_iterator one(body.begin(), body.end(), text), end; one != end; ++one)
    found.insert((*one)[1]);
  return found;
}

std::size_t words_in(const std::string& text) {
  const std::regex word("[A-Za-z]{2,}");
  return static_cast<std::size_t>(
      std::distance(std::sregex_iterator(text.begin(), text.end(), word), std::sregex_iterator()));
}

std::string report_in(ReportInput input, const char* language) {
  input.language = *calib::Language::of(language);
  input.notes.clear();                       // the operator's own words
  input.calibration.cell.robot.source = "";  // the file's own words
  return html_report(input);
}

std::vector<ReportInput> sessions() {
  std::vector<ReportInput> all{made_up_session(),
                               made_up_session({.spheres = 1, .certified_lengths = false}),
                               made_up_session({.check = 0, .outliers = 0}), ReportInput{}};
  all[1].calibration.verdict.workspace = false;
  return all;
}

TEST(GermanReport, HasNoSentenceInCommonWithTheEnglishOne) {
  for (const ReportInput& session : sessions()) {
    const std::set<std::string> english = texts(report_in(session, "en"));
    for (const std::string& text : texts(report_in(session, "de"))) {
      if (words_in(text) >= 4) {
        EXPECT_FALSE(english.contains(text)) << text;
      }
      static const std::regex left("\\b(the|of|and|with|touch(es)?|is|are|not|from|for)\\b");
      EXPECT_FALSE(std::regex_search(text, left)) << text;
    }
  }
}

TEST(GermanReport, IsSoundAndSaysItsLanguage) {
  for (const ReportInput& session : sessions()) {
    const std::string html = report_in(session, "de");
    EXPECT_EQ(joined(complaints(html)), "");
    EXPECT_TRUE(says(html, "<html lang=\"de\">"));
    EXPECT_EQ(html.find("say."), std::string::npos) << "an id without an entry";
    EXPECT_EQ(std::regex_search(html, std::regex("\\{[a-z_]+(:[^}]*)?\\}")), false)
        << "a value is missing";
  }
  EXPECT_FALSE(says(report_in(made_up_session(), "en"), "say."));
}

TEST(GermanReport, HasADecimalCommaButForTheRawTouches) {
  const std::string html = report_in(made_up_session(), "de");
  const std::size_t raw = html.find("<table class=\"numbers raw\">");
  ASSERT_NE(raw, std::string::npos);
  const std::regex point("(^|[^0-9.])[0-9]+\\.[0-9]+([^0-9.]|$)"), comma("[0-9],[0-9]");
  std::size_t commas = 0;
  for (const std::string& text : texts(html.substr(0, raw) + "</main>")) {
    if (text.find("0.1.0") != std::string::npos) continue;  // version
    EXPECT_FALSE(std::regex_search(text, point)) << text;
    commas += std::regex_search(text, comma) ? 1 : 0;
  }
  EXPECT_GT(commas, 100u);
  EXPECT_TRUE(std::regex_search(html.substr(raw), std::regex("<td>-?[0-9]+\\.[0-9]{5}</td>")));
}

}  // namespace
}  // namespace cellcal::daemon::report::testing
