// The certificate in another language: the same entries, no English text left.

#include <gtest/gtest.h>

#include <map>
#include <pugixml.hpp>
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

const calib::Language kGerman = *calib::Language::of("de");
const std::regex kEnglish(
    "\\b(the|of|and|with|touch(es)?(?!\\.)|is|are|not|from|for|session|check|cell|left|found)\\b");

/// Quoted from the cell file or the issuer, or a name.
bool is_quoted(const std::string& from) {
  static const std::regex quoted("(cell|robot)#.*|issue#.*|session#.*|number|.*/(unit|name).*");
  return std::regex_match(from, quoted);
}

/// Sessions with different certificate texts.
std::vector<CertificateData> certificates() {
  std::vector<CertificateData> all{make_certificate(recorded().first, "e", kIssue),
                                   make_certificate(recorded().second, "e", kIssue)};
  for (const Recording& what : {Recording{.lengths = false, .emulated = true},
                                Recording{.check_length = true, .fit = 60, .repeats = 5},
                                Recording{.phases = true, .as_fit = true}}) {
    const TemporaryDirectory directory;
    Journal journal(directory / "j.db");
    all.push_back(make_certificate(
        make_archive(journal, record(journal, what, false), directory / "none"), "e", kIssue));
  }
  all.back().content["decision"] = nullptr;
  all.back().content["breaks"] = "not known";
  all.back().content["raw_rows_dropped"] = certificate::Entry{"2026-04-03", "session#dropped"};
  return all;
}

/// Texts between tags, without entries.
std::set<std::string> texts(const std::string& html) {
  std::set<std::string> found;
  const std::string body =
      std::regex_replace(html.substr(html.find("<body>")),
                         std::regex("<span data-from[^>]*>[^<]*</span>|&(nbsp|deg|middot);"), "");
  const std::regex text(">([^<]*[A-Za-z]{3,}[^<]*)<");
  for (std::sregex_iterator one(body.begin(), body.end(), text), end; one != end; ++one)
    found.insert((*one)[1]);
  return found;
}

TEST(AGermanCertificate, HasNoSentenceOfTheEnglishOne) {
  for (const CertificateData& data : certificates()) {
    const std::string german = to_html(data, kGerman);
    EXPECT_NE(german.find("<html lang=\"de\">"), german.npos);
    EXPECT_EQ(german.find("say."), german.npos) << "an id without an entry";
    EXPECT_FALSE(
        std::regex_search(german.substr(german.find("<body>")), std::regex("\\{[a-z_]+\\}")));
    const std::set<std::string> english = texts(to_html(data)), words = texts(german);
    EXPECT_NEAR(static_cast<double>(words.size()), static_cast<double>(english.size()), 2.0);
    EXPECT_GT(words.size(), 60u);
    static const std::set<std::string> kSame{"normal", "Position", "Software", "SHA-"};
    for (const std::string& text : words) {
      EXPECT_FALSE(std::regex_search(text, kEnglish)) << text;
      EXPECT_FALSE(english.contains(text) && !kSame.contains(text)) << text;
    }
  }
}

TEST(AGermanCertificate, HasTheEntriesOfTheEnglishOneWithADecimalComma) {
  for (const CertificateData& data : certificates()) {
    std::string rest;
    const auto english = entries_of(to_html(data), rest),
               german = entries_of(to_html(data, kGerman), rest);
    ASSERT_EQ(german.size(), english.size());
    std::size_t commas = 0;
    for (std::size_t i = 0; i < german.size(); ++i) {
      const auto& [from, text] = german[i];
      EXPECT_EQ(from, english[i].from);
      commas += text.find(',') != text.npos ? 1 : 0;
      const bool is_number =
          english[i].text.find_first_not_of("\xE2\x88\x92-.0123456789e") == text.npos;
      if (is_number && !from.starts_with("session#")) {
        EXPECT_EQ(replaced(text, ",", "."), english[i].text) << from;
      } else if (!is_quoted(from)) {
        EXPECT_FALSE(std::regex_search(text, kEnglish)) << from << ": " << text;
      }
    }
    EXPECT_GT(commas, 100u);
    EXPECT_EQ(rest.find_first_of("0123456789"), rest.npos) << "a number without origin";
  }
}

TEST(ADigitalCertificate, SaysEachSentenceInEveryLanguage) {
  for (const CertificateData& data : certificates()) {
    pugi::xml_document document;
    const std::string text = to_dcc(data);
    ASSERT_TRUE(document.load_buffer(text.data(), text.size()));
    std::size_t pairs = 0;
    for (const auto& found : document.select_nodes("//dcc:content[@lang='en']")) {
      const pugi::xml_node english = found.node(), german = english.next_sibling();
      const std::string words = german.text().get(), before = english.text().get();
      ASSERT_STREQ(german.attribute("lang").value(), "de") << before;
      EXPECT_FALSE(std::regex_search(words, kEnglish)) << words;
      EXPECT_EQ(words.find("say."), words.npos);
      pairs += words != before ? 1 : 0;
    }
    EXPECT_GT(pairs, 30u);
    EXPECT_TRUE(document.select_node("//dcc:usedLangCodeISO639_1[.='de']"));
    EXPECT_FALSE(document.select_node("//dcc:content[not(@lang)]"));
  }
}

}  // namespace
}  // namespace cellcal::daemon::testing
