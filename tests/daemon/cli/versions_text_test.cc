// Output of 'cellcal versions' and 'cellcal compare' for any answer.

#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "daemon/cli/actions.h"
#include "daemon/cli/progress.h"

namespace cellcal::daemon {
namespace {

using nlohmann::json;

json version_of(std::int64_t session, bool active) {
  return {{"session", session},   {"ended", "2026-11-20T10:00:00.000Z"},
          {"scope", "workspace"}, {"predicted_mm", 0.0812},
          {"u95_mm", nullptr},    {"active", active},
          {"activated", nullptr}, {"trouble", nullptr}};
}

json comparison_of(const std::vector<std::string>& not_compared) {
  return {{"before", 7},
          {"after", 9},
          {"comparable", true},
          {"scope", "near targets"},
          {"poses", 1000},
          {"mean_mm", 0.1},
          {"max_mm", 0.25},
          {"expected_mm", 0.08},
          {"moved", json::array()},
          {"only_before", json::array()},
          {"only_after", {"S5.x", "S5.y"}},
          {"not_compared", not_compared}};
}

/// In German, as by the environment.
template <class Make>
std::string german(const Make& make) {
  ::setenv("LC_ALL", "de_DE.UTF-8", 1);
  std::string text = make();
  ::unsetenv("LC_ALL");
  return text;
}

TEST(TheVersions, AreATableWithTheOneInUseInTheReadersLanguage) {
  json damaged = version_of(8, false);
  damaged["scope"] = damaged["predicted_mm"] = nullptr;
  damaged["trouble"] = "calibration: cut off";
  json active = version_of(7, true);
  active["activated"] = {
      {"time", "2026-11-21T08:00:00.000Z"}, {"who", "anna"}, {"reason", "torch"}};
  const json list{damaged, active};
  EXPECT_EQ(versions_text(list),
            " session  published (UTC)      scope         predicted mm   u95 mm\n"
            "       8  2026-11-20T10:00:00  damaged                  -        -\n"
            "          calibration: cut off\n"
            "       7  2026-11-20T10:00:00  workspace            0.081        -  in use, activated "
            "2026-11-21T08:00:00 by anna: torch\n");
  const std::string words = german([&] { return versions_text(list); });
  EXPECT_NE(words.find("       7  2026-11-20T10:00:00  Arbeitsraum          0,081        -  in "
                       "Gebrauch, aktiviert 2026-11-21T08:00:00 von anna: torch\n"),
            std::string::npos)
      << words;
  EXPECT_NE(words.find("  beschädigt               -        -\n"), std::string::npos) << words;
  EXPECT_EQ(versions_text(json::array()), "no calibration was published\n");
}

TEST(TheComparison, NamesWhatTheFrameDecidesAndClaimsNothingOfIt) {
  EXPECT_EQ(
      comparison_text(comparison_of({})),
      "0.100 mm mean, 0.250 mm largest distance of the tips over 1000 poses (near targets), a "
      "motion of the base taken out\n"
      "0.080 mm: mean distance by the predicted errors of both\n"
      "only session 9 has: S5.x, S5.y\n"
      "no parameter moved beyond U (k=2)\n");
  const json framed = comparison_of({"tool.x", "tool.y"});
  const std::string words = comparison_text(framed);
  EXPECT_NE(words.find("not compared, since the choice of the frame decides them: tool.x, tool.y\n"
                       "no other parameter moved beyond U (k=2)\n"),
            std::string::npos)
      << words;
  const std::string in_german = german([&] { return comparison_text(framed); });
  EXPECT_NE(
      in_german.find("nicht verglichen, weil die Wahl des Bezugssystems sie bestimmt: tool.x, "
                     "tool.y\nkein anderer Parameter"),
      std::string::npos)
      << in_german;
  EXPECT_EQ(in_german.find("session"), std::string::npos) << in_german;
}

TEST(TheComparison, IsATableOfWhatMovedAndCutsListsOfAnotherModelsParameters) {
  json all = comparison_of({});
  all["moved"] = {{{"name", "A2.theta"},
                   {"unit", "deg"},
                   {"before", 0.01},
                   {"after", -0.02},
                   {"difference", -0.03},
                   {"expanded", 0.004}}};
  all["only_before"] = std::vector<std::string>(10, "p");
  const std::string words = comparison_text(all);
  EXPECT_NE(words.find("only session 7 has: p, p, p, p, p, p, p, p and 2 more\n"),
            std::string::npos)
      << words;
  EXPECT_NE(
      words.find(
          "\nmoved                     before           after    difference       U (k=2)  unit\n"
          "A2.theta                    0.01           -0.02         -0.03         0.004  deg\n"),
      std::string::npos)
      << words;
  EXPECT_NE(german([&] { return comparison_text(all); }).find("          -0,02         -0,03"),
            std::string::npos);
  EXPECT_EQ(comparison_text({{"comparable", false}, {"before", 1}, {"after", 2}}),
            "sessions 1 and 2 cannot be compared: different nominal arm or tool\n");
}

TEST(TheTimes, AreInTheReadersLanguageUnlessALaterDaemonNamesThem) {
  const std::vector<ActivityRow> rows{{"fast search", "search speed, approach", 5, 10.0, 4.0},
                                      {"polishing", "cloth", 1, 1.0, 1.0}};
  EXPECT_EQ(
      german([&] { return times_words(4, rows); }),
      "Zeit                   s/Antast. Anzahl Mittel s   max. s gesamt s Anteil  hängt ab von\n"
      "schnelle Suche             2,500      5    2,000    4,000     10,0   91 %  "
      "Suchgeschwindigkeit, Anfahrt\n"
      "polishing                  0,250      1    1,000    1,000      1,0    9 %  cloth\n"
      "gesamt                     2,750      4                       11,0\n");
}

}  // namespace
}  // namespace cellcal::daemon
