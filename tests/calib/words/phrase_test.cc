#include "calib/words/phrase.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "calib/words/phrase_json.h"

namespace cellcal::calib {
namespace {

using nlohmann::json;

const Language kGerman = Language::of("de").value();
const Phrase kOpen("say.doctor.circuit.between", {{"volts", 2.5}, {"open", 4.0}});

TEST(APhrase, HasItsValuesInTheFormAndWithTheDecimalMarkOfTheLanguage) {
  EXPECT_EQ(words(kOpen), "2.50 V, neither open (above 4.0 V) nor in contact");
  EXPECT_EQ(words(kOpen, kGerman), "2,50 V, weder offen (über 4,0 V) noch in Kontakt");
}

TEST(APhrase, OfAValueAndItsLimitHasTheDecimalsInWhichTheyDiffer) {
  const auto seen = [](double mm, double goal, const Language& language = {}) {
    return words({"say.cli.progress.u95", {{"mm", mm}, {"goal", goal}}}, language);
  };
  EXPECT_EQ(seen(0.1063, 0.10632), "u95 0.10630 mm (goal 0.10632 mm)");
  EXPECT_EQ(seen(0.1063, 0.10632, kGerman), "u95 0,10630 mm (Ziel 0,10632 mm)");
  EXPECT_EQ(seen(0.1, 0.2), "u95 0.100 mm (goal 0.200 mm)");
  EXPECT_EQ(seen(0.1, 0.1), "u95 0.100 mm (goal 0.100 mm)");
  EXPECT_EQ(seen(0.1, 0.1 + 1e-15), seen(0.1, 0.1)) << "rounding of the computer";
  EXPECT_EQ(words({"say.cli.progress.u95", {{"mm", 0.1}}}), "u95 0.100 mm (goal {goal:.3f!mm} mm)");
  EXPECT_EQ(words({"{a:!} {b:.!a} {c:x!c}", {{"a", 1.0}, {"b", 2.0}, {"c", "text"}}}), "1 2 text");
  // "limit ±3": on either side of zero.
  EXPECT_EQ(decimals_apart(-3.00004, 3.0, 4), 5);
  EXPECT_EQ(decimals_apart(5.0, -5.0, 2), 2);
}

TEST(APhrase, HasNoZeroWithASign) {
  const auto seen = [](double log) {
    return words({"say.check.explanation", {{"percent", -0.01}, {"log", log}, {"what", "x"}}});
  };
  EXPECT_EQ(seen(-0.04), "  0.0 %  log likelihood     +0.0  x");
  EXPECT_EQ(seen(-0.06), "  0.0 %  log likelihood     -0.1  x");
}

TEST(APhrase, ThatNoCatalogueHasStandsForItself) {
  EXPECT_EQ(words(Phrase("KSS29002 {fault}"), kGerman), "KSS29002 {fault}");
  EXPECT_FALSE(sentence_of("KSS29002 {fault}"));
  EXPECT_TRUE(Phrase().empty());
}

TEST(APhrase, MayContainPhrases) {
  const Phrase both = joined("say.join.semicolon", kOpen, "1.5 V");
  EXPECT_EQ(words(both, kGerman), "2,50 V, weder offen (über 4,0 V) noch in Kontakt; 1.5 V");
  EXPECT_EQ(joined("say.join.semicolon", {}, kOpen), kOpen);
  EXPECT_EQ(joined("say.join.semicolon", kOpen, {}), kOpen);
}

TEST(APhrase, ShowsWhatItLacksAndNeverFails) {
  EXPECT_EQ(words({"say.notice.time", {{"begin", "22:00"}}}), "From 22:00 to {end} (UTC)");
  EXPECT_EQ(words({"say.doctor.config.good", {{"crc", 0.5}}}), "accepted, CRC 0.5");
  EXPECT_EQ(words({"{open", {{"a", 1}}}), "{open");
}

TEST(ALanguage, IsKnownByItsCatalogueAlone) {
  EXPECT_EQ(Language().code(), "en");
  EXPECT_EQ(Language::of("de_AT.UTF-8").value().code(), "de");
  EXPECT_FALSE(Language::of("tlh"));
  EXPECT_FALSE(Language::of(""));
}

TEST(APhraseInJson, ComesBackAsItWas) {
  for (const Phrase& one : {Phrase(), Phrase("text"), kOpen, joined("say.join.comma", kOpen, "b"),
                            Phrase("say.notice.report", {{"session", 7}})})
    EXPECT_EQ(phrase_of(json::parse(to_json(one).dump())), one) << to_json(one);
  const Phrase none("say.doctor.circuit.open",
                    {{"volts", std::numeric_limits<double>::quiet_NaN()}});
  EXPECT_EQ(words(phrase_of(json::parse(to_json(none).dump()))), words(none));
}

TEST(APhraseInJson, OfAnotherFormOrTooDeepIsRefused) {
  for (const char* wrong : {"null", "1", "[]", "{}", R"({"id": "a"})", R"({"id": 1, "values": {}})",
                            R"({"id": "a", "values": []})", R"({"id": "a", "values": {"b": null}})",
                            R"({"id": "a", "values": {}, "more": 1})"})
    EXPECT_THROW(phrase_of(json::parse(wrong)), std::invalid_argument) << wrong;
  json deep = "a";
  for (int i = 0; i < kMostNested; ++i) deep = {{"id", "a"}, {"values", {{"b", deep}}}};
  EXPECT_NO_THROW(phrase_of(deep));
  EXPECT_THROW(phrase_of(json{{"id", "a"}, {"values", {{"b", deep}}}}), std::invalid_argument);
}

}  // namespace
}  // namespace cellcal::calib
