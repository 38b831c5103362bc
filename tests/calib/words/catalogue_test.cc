// The catalogues against each other and against the programs that use them.

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "calib/words/phrase.h"

namespace cellcal::calib {
namespace {

using Catalogue = std::map<std::string, std::string>;
const std::filesystem::path kSource = CELLCAL_SOURCE;

std::string content(const std::filesystem::path& file) {
  std::ifstream stream(file);
  return {std::istreambuf_iterator<char>(stream), {}};
}

Catalogue catalogue(const std::string& language) {
  return nlohmann::json::parse(content(kSource / "daemon/web/src/words" / (language + ".json")));
}

std::set<std::string> matches(const std::string& text, const char* pattern) {
  const std::regex regex(pattern);
  std::set<std::string> found;
  for (std::sregex_iterator one(text.begin(), text.end(), regex), end; one != end; ++one)
    found.insert((*one)[1]);
  return found;
}

/// "say.x" in quotes, in all compiled files; "say.x." begins ids that end with the name of a value.
std::set<std::string> said_in_programs() {
  std::set<std::string> all;
  for (const char* module : {"calib", "daemon", "drivers"})
    for (const auto& entry : std::filesystem::recursive_directory_iterator(kSource / module))
      if (const auto kind = entry.path().extension(); kind == ".cc" || kind == ".h")
        all.merge(matches(content(entry.path()), R"re("(say\.[A-Za-z0-9_.-]+)")re"));
  return all;
}

bool begins_one_of(const std::string& id, const std::set<std::string>& said) {
  return said.contains(id) || std::ranges::any_of(said, [&](const std::string& one) {
           return one.ends_with('.') && id.starts_with(one);
         });
}

TEST(TheCatalogues, HaveTheSameIdsAndPlacesInEachLanguage) {
  const Catalogue english = catalogue("en");
  EXPECT_GT(Language::codes().size(), 1u);
  for (const std::string& language : Language::codes()) {
    const Catalogue other = catalogue(language);
    EXPECT_EQ(other.size(), english.size()) << language;
    for (const auto& [id, sentence] : english) {
      ASSERT_TRUE(other.contains(id)) << language << ": " << id;
      EXPECT_NE(other.at(id), "") << language << ": " << id;
      EXPECT_EQ(matches(other.at(id), R"(\{([^}]*)\})"), matches(sentence, R"(\{([^}]*)\})"))
          << language << ": " << id;
    }
  }
}

TEST(TheCatalogues, AreThoseThatProgramsContain) {
  for (const std::string& language : Language::codes())
    for (const auto& [id, sentence] : catalogue(language))
      EXPECT_EQ(sentence_of(id, *Language::of(language)), sentence) << id;
}

/// Actions are imperatives, and a standard uncertainty follows a ±.
TEST(TheCatalogues, HaveNoQuestionAndOneSignOfUncertainty) {
  for (const std::string& language : Language::codes())
    for (const auto& [id, sentence] : catalogue(language))
      for (const char* wrong : {"?", "+-", "+/-"})
        EXPECT_EQ(sentence.find(wrong), std::string::npos)
            << language << " " << id << ": " << sentence;
}

/// A U after a ± is one of k = 2, or a bound for 95 %.
TEST(TheCatalogues, StateTheCoverageOfEveryExpandedUncertainty) {
  const std::regex expanded(R"(±\s*\{(u|u_[a-z]+|[a-z]+_u)[:}])"), coverage("k ?= ?2|95 %");
  for (const std::string& language : Language::codes())
    for (const auto& [id, sentence] : catalogue(language)) {
      const bool is_part = id == "say.cli.delay.ms";  // of a sentence that states it
      EXPECT_TRUE(is_part || !std::regex_search(sentence, expanded) ||
                  std::regex_search(sentence, coverage))
          << language << " " << id << ": " << sentence;
    }
}

TEST(EveryIdOfAProgram, HasASentence) {
  const Catalogue english = catalogue("en");
  const std::set<std::string> said = said_in_programs();
  EXPECT_GT(said.size(), 200u);
  for (const std::string& id : said) EXPECT_TRUE(id.ends_with('.') || english.contains(id)) << id;
}

TEST(EverySentenceOfPrograms, IsUsed) {
  const std::set<std::string> said = said_in_programs();
  for (const auto& [id, sentence] : catalogue("en"))
    EXPECT_TRUE(!id.starts_with("say.") || begins_one_of(id, said)) << id;
}

}  // namespace
}  // namespace cellcal::calib
