// Output of 'cellcal history --drift' for any answer.

#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>

#include "daemon/cli/actions.h"

namespace cellcal::daemon {
namespace {

using nlohmann::json;

json chart_of(int checks) {
  json points = json::array();
  for (int k = 0; k < checks; ++k)
    points.push_back({{"session", 10 + k},
                      {"time_s", 1.78e9 + k * 28800.0},
                      {"temperature_c", k == 0 ? json(21.5) : json()},
                      {"left_out", k == 2 ? json("undecided") : json()},
                      {"off_mm", k == 2 ? json() : json{0.01 * k, -0.002, 0.0}},
                      {"share", 0.05 * k},
                      {"state", k > 20 ? "alarms" : "in_control"}});
  return {{"calibration", 7},
          {"calibrated", "2026-05-28T20:26:40.000Z"},
          {"state", "alarms"},
          {"words", {"creep of 0.1 mm/month"}},
          {"points", points}};
}

TEST(AnUpdate, IsNamedWithWhatItStandsOnAndWhatChanged) {
  calib::UpdateOrigin update;
  update.outcome = calib::UpdateOutcome::kUpdated;
  update.stands_on = "session 12 of 2026-11-20";
  update.touches = 9;
  update.explanations.emplace_back().kind = calib::ChangeKind::kNothing;
  EXPECT_EQ(words(update_phrase(update)),
            "an update of session 12 of 2026-11-20, 9 touches: nothing changed");
  update.outcome = calib::UpdateOutcome::kNothingChanged;
  EXPECT_EQ(words(update_phrase(update)), "no update of session 12 of 2026-11-20, 9 touches");
  EXPECT_EQ(words(update_phrase(update), calib::Language::of("de").value()),
            "keine Aktualisierung von Sitzung 12 vom 2026-11-20, 9 Antastungen");
}

TEST(TheDrift, IsSentencesAPlotAndTheNewestChecks) {
  const std::string text = drift_text(chart_of(30));
  EXPECT_EQ(text.find("checks of the calibration of session 7 (2026-05-28"), 0U) << text;
  EXPECT_NE(text.find("creep of 0.1 mm/month\n"), std::string::npos);
  EXPECT_NE(text.find(" alarm |-----"), std::string::npos) << text;
  EXPECT_NE(text.find("    39 2026-06-07      -   +0.290   -0.002   +0.000     145  ALARM\n"),
            std::string::npos)
      << text;
  EXPECT_EQ(text.find("    12 2026"), std::string::npos) << "the newest twelve";
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = text.find('\n', from);
    EXPECT_LE(end - from, 100U);
    from = end + 1;
  }
}

TEST(TheDrift, NamesTheChangesOfTheCellBelowTheChecks) {
  json chart = chart_of(3);
  chart["events"] = json::array(
      {{{"time_s", 1.78e9}, {"words", "update of session 12"}}, 3, {{"time_s", "soon"}}});
  EXPECT_NE(drift_text(chart).find("\nchanges of the cell:\n2026-05-28  update of session 12\n"),
            std::string::npos)
      << drift_text(chart);
}

TEST(TheDrift, OfFewChecksNamesThoseThatAreLeftOut) {
  const std::string text = drift_text(chart_of(3));
  EXPECT_NE(text.find("   21.5   +0.000"), std::string::npos) << text;
  EXPECT_NE(text.find("left out: undecided"), std::string::npos) << text;
  EXPECT_NE(text.find("  in control\n"), std::string::npos) << text;
  json odd = chart_of(2);
  odd["points"][0]["state"] = "too_few";
  odd["points"][1]["left_out"] = "not_the_tool";
  const std::string words = drift_text(odd);
  EXPECT_NE(words.find("  too few to judge\n"), std::string::npos) << words;
  EXPECT_NE(words.find(", left out: not the tool\n"), std::string::npos) << words;
  EXPECT_NE(drift_text(chart_of(1)).find("10 2026-05-28"), std::string::npos);
  EXPECT_EQ(drift_text(json()).find("no published calibration"), 0U);
}

TEST(TheDrift, IsInTheLanguageOfTheEnvironment) {
  ::setenv("LC_ALL", "de_DE.UTF-8", 1);
  const std::string text = drift_text(chart_of(30));
  ::unsetenv("LC_ALL");
  EXPECT_EQ(text.find("Prüfungen der Kalibrierung aus Sitzung 7 (2026-05-28"), 0U) << text;
  EXPECT_NE(text.find("\n Prüf. beendet    Grad C     x mm"), std::string::npos) << text;
  EXPECT_NE(text.find(" Alarm |-----"), std::string::npos) << text;
  EXPECT_EQ(text.find("check"), std::string::npos) << text;
}

TEST(TheDrift, TakesAnAnswerOfAnotherDaemonForWhatItIs) {
  for (const char* odd :
       {R"({})", R"({"points": [1, null, {}, {"time_s": "x", "off_mm": [1, "x"]}]})",
        R"({"words": [1], "points": {"a": 1}})",
        R"({"points": [{"time_s": 1e300, "share": -1e300}, {"time_s": -1e300, "share": 1e300}]})"})
    EXPECT_NE(drift_text(json::parse(odd)), "") << odd;
}

TEST(TheDrift, EndsWithWhatTheControllerAcknowledgedAndWhyItDidNot) {
  EXPECT_EQ(acknowledged_text(json()), "");
  EXPECT_EQ(
      acknowledged_text({{"value", 1}, {"told", "holds"}, {"told_at", "2026-11-23T12:00:00Z"}}),
      "CELLCAL_ADVICE on the controller: 1 (holds), since 2026-11-23T12:00:00Z\n");
  EXPECT_EQ(acknowledged_text({{"value", nullptr}, {"told", nullptr}, {"trouble", "no answer"}}),
            "CELLCAL_ADVICE not confirmed: no answer\n");
  for (const json& odd : {json("x"), json::array({1}), json{{"value", 1e300}, {"trouble", 3}}})
    EXPECT_EQ(acknowledged_text(odd), "");
}

}  // namespace
}  // namespace cellcal::daemon
