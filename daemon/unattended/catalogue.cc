#include "daemon/unattended/catalogue.h"

#include <array>
#include <nlohmann/json.hpp>

#include "page_words.h"

namespace cellcal::daemon {

namespace {

struct Words {
  Text which;
  const char* english;
  const char* german;
};

// clang-format off
constexpr std::array<Words, kTexts> kWords{{
{Text::kDone,       "Session {}: done",                           "Sitzung {}: fertig"},
{Text::kWithheld,   "Session {}: result withheld",                "Sitzung {}: Ergebnis zurückgehalten"},
{Text::kDrifted,    "Session {}: the cell has changed",            "Sitzung {}: Die Zelle hat sich verändert"},
{Text::kUndecided,  "Session {}: check undecided",                 "Sitzung {}: Prüfung unentschieden"},
{Text::kRecovered,  "Session {}: the drift alarm is over",         "Sitzung {}: Der Driftalarm ist beendet"},
{Text::kFailed,     "Session {}: failed",                         "Sitzung {}: fehlgeschlagen"},
{Text::kAborted,    "Session {}: aborted",                        "Sitzung {}: abgebrochen"},
{Text::kNotBegun,   "Schedule '{}': not begun in the night of {}", "Zeitplan '{}': in der Nacht vom {} nicht begonnen"},
{Text::kDoWithheld, "Do not use this result. Read the findings, correct their cause, calibrate again.",
                    "Dieses Ergebnis nicht verwenden. Befunde lesen, ihre Ursache beheben, neu kalibrieren."},
{Text::kDoDrifted,  "Check tool, base and mastering. If the arm was repaired or mastered: 'cellcal run --accept-change'.",
                    "Werkzeug, Sockel und Justage prüfen. Wurde der Arm repariert oder justiert: 'cellcal run --accept-change'."},
{Text::kDoUndecided, "Clean tip and spheres and check again: 'cellcal check'.",
                    "Spitze und Kugeln reinigen und erneut prüfen: 'cellcal check'."},
{Text::kDoAborted,  "Stopped by a person. Inspect the cell, then: 'cellcal run --resume'.",
                    "Von einer Person angehalten. Die Zelle prüfen, dann: 'cellcal run --resume'."},
{Text::kDoNotBegun, "See 'cellcal schedule'.",                    "Siehe 'cellcal schedule'."},
{Text::kCell,       "Cell: {}",                                   "Zelle: {}"},
{Text::kKind,       "Kind: {}",                                   "Art: {}"},
{Text::kTouches,    "Touches: {}",                                "Antastungen: {}"},
{Text::kTime,       "From {} to {} (UTC)",                        "Von {} bis {} (UTC)"},
{Text::kErrorNear,  "Predicted mean error near the targets: {:.3f} mm",
                    "Vorhergesagter mittlerer Fehler nahe den Zielen: {:.3f} mm"},
{Text::kErrorOver,  "Predicted mean error over the workspace: {:.3f} mm",
                    "Vorhergesagter mittlerer Fehler im Arbeitsraum: {:.3f} mm"},
{Text::kFinding,    "Finding: {}",                                "Befund (englisch): {}"},
{Text::kEvidence,   "Evidence: {}",                               "Beleg (englisch): {}"},
{Text::kReport,     "Report: 'cellcal report {}'",                "Bericht: 'cellcal report {}'"},
{Text::kSender,     "cellcal on {}",                              "cellcal auf {}"},
}};
// clang-format on

std::string in_page(Language language, const std::string& key) {
  static const auto kEnglish = nlohmann::json::parse(kPageEnglish),
                    kGerman = nlohmann::json::parse(kPageGerman);
  return (language == Language::kGerman ? kGerman : kEnglish).value(key, "");
}

}  // namespace

const char* text(Language language, Text which) {
  for (const Words& one : kWords) {
    if (one.which == which) return language == Language::kGerman ? one.german : one.english;
  }
  return "";
}

std::string what_happened(Language language, FailureKind kind) {
  return in_page(language, std::string("failure.") + to_string(kind));
}

std::string what_to_do(Language language, FailureKind kind) {
  return in_page(language, std::string("do.") + to_string(kind));
}

}  // namespace cellcal::daemon
