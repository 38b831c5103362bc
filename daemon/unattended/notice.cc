#include "daemon/unattended/notice.h"

#include <algorithm>
#include <functional>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/model/units.h"
#include "calib/result/drift_chart.h"
#include "calib/result/finding_phrase.h"
#include "daemon/archive/drift_watch.h"
#include "daemon/files/atomic_file.h"
#include "daemon/result/outcome_json.h"
#include "daemon/service/kind.h"
#include "daemon/tasks/active_calibration.h"
#include "daemon/tasks/options.h"

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

void add_kind(Notice& notice, const SessionInputs& inputs) {
  const SessionOptions options = options_from_json(inputs.options);
  notice.kind = to_string(options.kind);
  notice.update = options.update;
  notice.anew = anew(options, inputs);
}

/// True if the newest check ended an alarm.
bool ended_an_alarm(const calib::DriftChart& chart) {
  const std::size_t n = chart.points.size();
  return n > 1 && chart.state != calib::DriftState::kAlarms &&
         chart.points[n - 2].state == calib::DriftState::kAlarms;
}

/// True for a check of another calibration than that in use: whatever it finds, the cell need not have changed.
bool is_of_another(Journal& journal, const SessionRecord& check) try {
  const std::int64_t against = options_from_json(check.inputs.options).against;
  if (against == 0) return false;
  const auto used = in_use(journal, check.inputs.cell_name);
  return used && used->session != against;
} catch (const std::exception&) {
  return false;  // not known: it is reported
}

/// Adds the state of the control chart, where it alarms or has just ceased to.
void add_drift(Notice& notice, Journal& journal) {
  const auto drift = DriftWatch(journal).evaluate(notice.cell);
  if (!drift) return;
  const bool alarms = drift->chart.state == calib::DriftState::kAlarms;
  if (!alarms && !ended_an_alarm(drift->chart)) return;
  notice.by_chart = notice.news != News::kDrifted;
  notice.news = alarms ? News::kDrifted : News::kRecovered;
  notice.advice = drift->chart.advice;
  for (calib::Phrase& line : calib::phrases(drift->chart))
    notice.findings.push_back(std::move(line));
}

void add_outcome(Notice& notice, const SessionOutcome& outcome, bool of_another) {
  notice.outcome = to_string(outcome.kind);
  notice.news = of_another ? News::kDone : news_of(outcome.kind);
  // A calibration has findings of its own.
  if (published(outcome)) return;
  notice.advice = outcome.remedy;
  notice.findings = phrases(outcome);
}

void add_figures(Notice& notice, const std::string& json) {
  const calib::Calibration result = calib::calibration_from_json(json, "the journal");
  notice.near_m = result.predicted_near_targets_m;
  notice.over_m = result.predicted_workspace_m;
  notice.findings.clear();
  for (const calib::Finding& finding : result.verdict.findings)
    notice.findings.push_back(calib::phrase(finding));
  if (indicates_change(result.verdict))
    notice.news = News::kDrifted;
  else if (notice.outcome.empty())  // no outcome recorded
    notice.news = result.verdict.publish() ? News::kDone : News::kWithheld;
}

Notice interrupted(std::int64_t session, Journal& journal) {
  Notice notice;
  notice.news = News::kInterrupted;
  notice.session = session;
  try_to(notice, [&] {
    const auto record = journal.session(session);
    if (!record) return;
    notice.touches = static_cast<std::size_t>(record->touches);
    notice.cell = record->inputs.cell_name;
    notice.started = record->started;
    add_kind(notice, record->inputs);
  });
  return notice;
}

using nlohmann::json;

using calib::Phrase;

class Lines {
 public:
  explicit Lines(const calib::Language& language) : language_(language) {}

  std::string words(const Phrase& phrase) const {
    return printable(calib::words(phrase, language_));
  }
  void add(const Phrase& phrase) { body += words(phrase) + "\n"; }
  /// Adds it if there is such an id.
  void add_if_known(const std::string& id, const std::vector<calib::PhraseValue>& values) {
    if (calib::sentence_of(id)) add({id, values});
  }

  std::string body;

 private:
  calib::Language language_;
};

void add_what_to_do(Lines& lines, const Notice& notice) {
  const Phrase then = notice.anew.empty()
                          ? Phrase("say.notice.then.resume")
                          : Phrase("say.notice.then.anew", {{"command", notice.anew}});
  if (notice.news == News::kDrifted && notice.advice != calib::DriftAdvice::kNone)
    return lines.add(std::string("checks.advice.") + to_string(notice.advice));
  const bool given_up = notice.news == News::kFailed || notice.news == News::kAborted;
  if (!given_up || !notice.failure)
    return lines.add_if_known(std::string("say.notice.do.") + to_string(notice.news),
                              {{"then", then}, {"cell", shell_word(notice.cell)}});
  lines.add_if_known(std::string("failure.") + to_string(notice.failure->kind), {});
  lines.add_if_known(std::string("do.") + to_string(notice.failure->kind), {{"then", then}});
}

void add_session(Lines& lines, const Notice& notice) {
  if (notice.session == 0) return;
  lines.body += "\n";
  lines.add({"say.notice.cell", {{"cell", notice.cell}}});
  const std::string kind = notice.update ? "update" : notice.kind;
  lines.add(
      {"say.notice.kind", {{"kind", lines.words("kind." + (kind.empty() ? "unknown" : kind))}}});
  lines.add({"say.notice.touches", {{"touches", notice.touches}}});
  if (!notice.ended.empty())
    lines.add({"say.notice.time", {{"begin", notice.started}, {"end", notice.ended}}});
  if (notice.near_m) lines.add({"say.notice.near", {{"mm", *notice.near_m * calib::kMmPerM}}});
  if (notice.over_m) lines.add({"say.notice.over", {{"mm", *notice.over_m * calib::kMmPerM}}});
  for (const calib::Phrase& one : notice.findings)
    lines.add({"say.notice.finding", {{"words", one}}});
  const bool ended = notice.news == News::kDone || notice.news == News::kWithheld ||
                     notice.news == News::kDrifted || notice.news == News::kUndecided ||
                     notice.news == News::kRecovered;
  // Sessions of other kinds have no report.
  if (ended && notice.kind == to_string(SessionKind::kCalibrate))
    lines.add({"say.notice.report", {{"session", notice.session}}});
}

template <class T>
json or_null(const std::optional<T>& value, double scale) {
  return value ? json(*value * scale) : json(nullptr);
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
  notice.kind = to_string(SessionKind::kCalibrate);
  try_to(notice, [&] { add_kind(notice, record->inputs); });
  notice.touches = static_cast<std::size_t>(record->touches);
  notice.cell = record->inputs.cell_name;
  notice.started = record->started;
  if (notice.news != News::kDone) return notice;
  if (end.result) add_outcome(notice, outcome_of(*end.result), is_of_another(journal, *record));
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
  notice.anew = status.anew;
  notice.touches = status.done;
  notice.failure = status.failure;
  notice.findings.assign(status.reasons.begin(), status.reasons.end());
  notice.news = status.phase == Phase::kDone      ? News::kDone
                : status.phase == Phase::kAborted ? News::kAborted
                                                  : News::kFailed;
  try {
    const auto record = journal.session(status.session);
    if (!record) return notice;
    notice.cell = record->inputs.cell_name;
    notice.started = record->started;
    notice.ended = record->ended;
    if (const auto options = options_in(record->inputs)) notice.update = options->update;
    if (notice.news != News::kDone) return notice;
    const bool of_another = is_of_another(journal, *record);
    if (status.outcome) add_outcome(notice, *status.outcome, of_another);
    if (!record->calibration.empty()) add_figures(notice, record->calibration);
    if (status.kind == to_string(SessionKind::kCheck) && !of_another) add_drift(notice, journal);
  } catch (const std::exception& unreadable) {
    notice.findings.emplace_back(unreadable.what());  // the remainder is reported nevertheless
  }
  return notice;
}

std::optional<Notice> news_of(const Decision& decision, Journal& journal) {
  if (decision.verb == Verb::kHeld && decision.why == Why::kInterruptedBefore)
    return interrupted(decision.session, journal);
  const bool nothing_began =
      decision.verb == Verb::kMissed || (decision.verb == Verb::kRefused && !decision.day.empty());
  if (!nothing_began) return std::nullopt;
  Notice notice;
  notice.news = News::kNotBegun;
  notice.entry = decision.entry;
  notice.day = decision.day;
  notice.why = phrase(decision);
  return notice;
}

Message compose(const Notice& notice, const calib::Language& language, const std::string& host) {
  Lines lines(language);
  const std::string subject =
      lines.words({std::string("say.notice.") + to_string(notice.news),
                   {{"session", notice.session}, {"entry", notice.entry}, {"night", notice.day}}});
  lines.add(subject);
  add_what_to_do(lines, notice);
  add_session(lines, notice);
  if (notice.failure) lines.add({"say.notice.evidence", {{"words", phrase(*notice.failure)}}});
  if (!notice.why.empty()) lines.add({"say.notice.evidence", {{"words", notice.why}}});
  lines.body += "\n";
  lines.add({"say.notice.sender", {{"host", host}}});
  json findings = json::array();
  for (const calib::Phrase& one : notice.findings) findings.push_back(calib::words(one));
  const json failure = notice.failure ? json{{"kind", to_string(notice.failure->kind)},
                                             {"detail", calib::words(notice.failure->detail)}}
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
                   {"findings", std::move(findings)},
                   {"predicted_near_targets_mm", or_null(notice.near_m, calib::kMmPerM)},
                   {"predicted_workspace_mm", or_null(notice.over_m, calib::kMmPerM)},
                   {"entry", notice.entry},
                   {"night", notice.day},
                   {"why", printable(calib::words(notice.why))},
                   {"subject", subject},
                   {"text", lines.body}};
  return {subject, lines.body, value.dump(-1, ' ', false, json::error_handler_t::replace)};
}

}  // namespace cellcal::daemon
