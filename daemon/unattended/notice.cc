#include "daemon/unattended/notice.h"

#include <algorithm>
#include <filesystem>
#include <functional>

#include "calib/files/calibration_json.h"
#include "calib/result/drift_chart.h"
#include "calib/result/finding.h"
#include "daemon/archive/drift_watch.h"
#include "daemon/result/outcome.h"
#include "daemon/result/outcome_json.h"
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

}  // namespace cellcal::daemon
