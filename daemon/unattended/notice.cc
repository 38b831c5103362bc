#include "daemon/unattended/notice.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <functional>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/model/units.h"
#include "calib/result/drift_chart.h"
#include "calib/result/finding.h"
#include "daemon/archive/drift_watch.h"
#include "daemon/files/atomic_file.h"
#include "daemon/result/outcome_json.h"
#include "daemon/tasks/options.h"
#include "page_words.h"

namespace cellcal::daemon {

namespace {

bool indicates_change(const calib::Verdict& verdict) {
  return std::any_of(
      verdict.findings.begin(), verdict.findings.end(),
      [](const calib::Finding& one) { return one.kind == calib::FindingKind::kChanged; });
}

/// Reports an unreadable part as a finding and continues.
void try_to(Notice& notice, const std::function<void()>& add) try {
  add();
} catch (const std::exception& unreadable) {
  notice.findings.emplace_back(unreadable.what());
}

/// True if the newest check ended an alarm.
bool ended_an_alarm(const calib::DriftChart& chart) {
  const std::size_t n = chart.points.size();
  return n > 1 && chart.state != calib::DriftState::kAlarms &&
         chart.points[n - 2].state == calib::DriftState::kAlarms;
}

/// Adds the state of the control chart, where it alarms or has just ceased to.
void add_drift(Notice& notice, Journal& journal) {
  const auto drift = DriftWatch(journal).look(notice.cell);
  if (!drift) return;
  const bool alarms = drift->chart.state == calib::DriftState::kAlarms;
  if (!alarms && !ended_an_alarm(drift->chart)) return;
  notice.by_chart = notice.news != News::kDrifted;
  notice.news = alarms ? News::kDrifted : News::kRecovered;
  for (const std::string& line : calib::words(drift->chart)) notice.findings.push_back(line);
}

void add_outcome(Notice& notice, const SessionOutcome& outcome) {
  notice.outcome = to_string(outcome.kind);
  notice.news = news_of(outcome.kind);
  // A calibration has findings of its own.
  if (!published(outcome)) notice.findings = words(outcome);
}

void add_figures(Notice& notice, const std::string& json) {
  const calib::Calibration result = calib::calibration_from_json(json, "the journal");
  notice.near_m = result.predicted_near_targets_m;
  notice.over_m = result.predicted_workspace_m;
  notice.findings = calib::words(result.verdict.findings);
  if (indicates_change(result.verdict))
    notice.news = News::kDrifted;
  else if (notice.outcome.empty())  // no outcome recorded
    notice.news = result.verdict.publish() ? News::kDone : News::kWithheld;
}

}  // namespace

News news_of(OutcomeKind outcome) {
  if (is_good(outcome)) return News::kDone;
  if (outcome == OutcomeKind::kDoesNotHold) return News::kDrifted;
  return outcome == OutcomeKind::kUndecided ? News::kUndecided : News::kWithheld;
}

Notice notice_of_end(std::int64_t session, const RecordEnd& end, const std::string& utc,
                     Journal& journal) {
  Notice notice;
  notice.session = session;
  notice.failure = end.why;
  notice.ended = utc;
  notice.news = end.ending == Ending::kDone      ? News::kDone
                : end.ending == Ending::kAborted ? News::kAborted
                                                 : News::kFailed;
  // The end of a damaged session is reported nevertheless, with its result as unusable.
  const News ended = notice.news;
  const News unread = ended == News::kDone ? News::kWithheld : ended;
  std::optional<SessionRecord> record;
  notice.news = unread;
  try_to(notice, [&] {
    record = journal.session(session);
    notice.news = ended;
  });
  if (!record) return notice;
  SessionKind kind = SessionKind::kCalibrate;
  try_to(notice, [&] { kind = options_from_json(record->inputs.options).kind; });
  notice.kind = to_string(kind);
  notice.touches = static_cast<std::size_t>(record->touches);
  notice.cell = record->inputs.cell_name;
  notice.started = record->started;
  if (notice.news != News::kDone) return notice;
  if (end.result) add_outcome(notice, outcome_of(*end.result));
  if (record->calibration.empty()) return notice;
  Notice read = notice;
  notice.news = unread;
  try_to(notice, [&] {
    add_figures(read, record->calibration);
    notice = read;
  });
  return notice;
}

Notice news_of(const Status& status, Journal& journal) {
  Notice notice;
  notice.session = status.session;
  notice.kind = status.kind;
  notice.touches = status.done;
  notice.failure = status.failure;
  notice.findings = status.reasons;
  notice.news = status.phase == Phase::kDone      ? News::kDone
                : status.phase == Phase::kAborted ? News::kAborted
                                                  : News::kFailed;
  try {
    const auto record = journal.session(status.session);
    if (!record) return notice;
    notice.cell = record->inputs.cell_name;
    notice.started = record->started;
    notice.ended = record->ended;
    if (notice.news != News::kDone) return notice;
    if (status.outcome) add_outcome(notice, *status.outcome);
    if (!record->calibration.empty()) add_figures(notice, record->calibration);
    if (status.kind == to_string(SessionKind::kCheck)) add_drift(notice, journal);
  } catch (const std::exception& unreadable) {
    notice.findings.emplace_back(unreadable.what());  // the remainder is reported nevertheless
  }
  return notice;
}

std::optional<Notice> news_of(const Decision& decision) {
  const bool nothing_began = decision.verb == Verb::kMissed ||
                             (decision.verb == Verb::kRefused && !decision.night.empty());
  if (!nothing_began) return std::nullopt;
  Notice notice;
  notice.news = News::kNotBegun;
  notice.entry = decision.entry;
  notice.night = decision.night;
  notice.why = words(decision);
  return notice;
}

namespace {

using nlohmann::json;

class Lines {
 public:
  explicit Lines(Language language) : language_(language) {}
  template <class... T>
  std::string words(Text which, const T&... values) const {
    return printable(fmt::format(fmt::runtime(text(language_, which)), values...));
  }
  template <class... T>
  void add(Text which, const T&... values) {
    body += words(which, values...) + "\n";
  }
  void add(const std::string& sentence) {
    if (!sentence.empty()) body += printable(sentence) + "\n";
  }

  std::string body;

 private:
  Language language_;
};

Text headline(News news) {
  using enum News;
  static constexpr EnumTable<News, Text> kTable{{{kDone, Text::kDone},
                                                 {kWithheld, Text::kWithheld},
                                                 {kDrifted, Text::kDrifted},
                                                 {kUndecided, Text::kUndecided},
                                                 {kRecovered, Text::kRecovered},
                                                 {kFailed, Text::kFailed},
                                                 {kAborted, Text::kAborted},
                                                 {kNotBegun, Text::kNotBegun}}};
  return kTable[news];
}

void add_what_to_do(Lines& lines, const Notice& notice, Language language) {
  switch (notice.news) {
    case News::kDone:
    case News::kRecovered:
      return;
    case News::kWithheld:
      return lines.add(Text::kDoWithheld);
    case News::kDrifted:
      return lines.add(Text::kDoDrifted);
    case News::kUndecided:
      return lines.add(Text::kDoUndecided);
    case News::kAborted:
      return lines.add(Text::kDoAborted);
    case News::kNotBegun:
      return lines.add(Text::kDoNotBegun);
    case News::kFailed:
      break;
  }
  if (!notice.failure) return;
  lines.add(what_happened(language, notice.failure->kind));
  lines.add(what_to_do(language, notice.failure->kind));
}

void add_session(Lines& lines, const Notice& notice) {
  if (notice.session == 0) return;
  lines.body += "\n";
  lines.add(Text::kCell, notice.cell);
  lines.add(Text::kKind, notice.kind);
  lines.add(Text::kTouches, notice.touches);
  lines.add(Text::kTime, notice.started, notice.ended);
  if (notice.near_m) lines.add(Text::kErrorNear, *notice.near_m * calib::kMmPerM);
  if (notice.over_m) lines.add(Text::kErrorOver, *notice.over_m * calib::kMmPerM);
  for (const std::string& one : notice.findings) lines.add(Text::kFinding, one);
  const bool ended = notice.news == News::kDone || notice.news == News::kWithheld ||
                     notice.news == News::kDrifted || notice.news == News::kUndecided ||
                     notice.news == News::kRecovered;
  // Sessions of other kinds have no report.
  if (ended && notice.kind == to_string(SessionKind::kCalibrate))
    lines.add(Text::kReport, notice.session);
}

template <class T>
json or_null(const std::optional<T>& value, double scale) {
  return value ? json(*value * scale) : json(nullptr);
}

}  // namespace

const char* to_string(News news) {
  using enum News;
  static constexpr EnumNames<News> kTable{{{kDone, "done"},
                                           {kWithheld, "withheld"},
                                           {kDrifted, "drifted"},
                                           {kUndecided, "undecided"},
                                           {kRecovered, "recovered"},
                                           {kFailed, "failed"},
                                           {kAborted, "aborted"},
                                           {kNotBegun, "not-begun"}}};
  return kTable[news];
}

Message compose(const Notice& notice, Language language, const std::string& host) {
  Lines lines(language);
  const Text head = headline(notice.news);
  const std::string subject = notice.news == News::kNotBegun
                                  ? lines.words(head, notice.entry, notice.night)
                                  : lines.words(head, notice.session);
  lines.add(subject);
  add_what_to_do(lines, notice, language);
  add_session(lines, notice);
  if (notice.failure) lines.add(Text::kEvidence, describe(*notice.failure));
  if (!notice.why.empty()) lines.add(Text::kEvidence, notice.why);
  lines.body += "\n";
  lines.add(Text::kSender, host);
  const json failure = notice.failure ? json{{"kind", to_string(notice.failure->kind)},
                                             {"detail", notice.failure->detail}}
                                      : json(nullptr);
  const json value{{"format", "cellcal.notice/1"},
                   {"news", to_string(notice.news)},
                   {"host", host},
                   {"version", calib::software_version()},
                   {"session", notice.session},
                   {"kind", notice.kind},
                   {"cell", notice.cell},
                   {"started", notice.started},
                   {"ended", notice.ended},
                   {"touches", notice.touches},
                   {"outcome", notice.outcome.empty() ? json(nullptr) : json(notice.outcome)},
                   {"failure", failure},
                   {"findings", notice.findings},
                   {"predicted_near_targets_mm", or_null(notice.near_m, calib::kMmPerM)},
                   {"predicted_workspace_mm", or_null(notice.over_m, calib::kMmPerM)},
                   {"entry", notice.entry},
                   {"night", notice.night},
                   {"why", notice.why},
                   {"subject", subject},
                   {"text", lines.body}};
  return {subject, lines.body, value.dump(-1, ' ', false, json::error_handler_t::replace)};
}

namespace {

struct Phrase {
  Text which;
  const char* english;
  const char* german;
};

// clang-format off
constexpr std::array<Phrase, kTexts> kWords{{
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
  for (const Phrase& one : kWords) {
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
