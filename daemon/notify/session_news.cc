#include "daemon/notify/session_news.h"

#include <algorithm>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/syntax/input_file.h"
#include "calib/words/drift_words.h"
#include "calib/words/finding_words.h"
#include "daemon/drift/drift_watch.h"
#include "daemon/tasks/recorded/options.h"

namespace cellcal::daemon {

namespace {

bool tells_of_change(const calib::Verdict& verdict) {
  return std::any_of(
      verdict.findings.begin(), verdict.findings.end(),
      [](const calib::Finding& one) { return one.kind == calib::FindingKind::kChanged; });
}

/// What cannot be read is told beside the rest.
void try_to(Notice& notice, const std::function<void()>& add) try {
  add();
} catch (const std::exception& unreadable) {
  notice.findings.emplace_back(unreadable.what());
}

/// What the control chart says, where it alarms.
void add_drift(Notice& notice, Journal& journal, const std::filesystem::path& results) {
  DriftWatch watch(journal, [folder = results.parent_path()](std::int64_t session) {
    return folder / std::to_string(session);
  });
  const auto drift = watch.look(notice.cell);
  if (!drift || drift->chart.state != calib::DriftState::kAlarms) return;
  notice.by_chart = notice.news == News::kDone;
  notice.news = News::kDrifted;
  for (const std::string& line : calib::words(drift->chart)) notice.findings.push_back(line);
}

/// Whether the calibration held, and what the check says of it.
void add_check(Notice& notice, const std::filesystem::path& results) {
  const auto check = nlohmann::json::parse(calib::read_file(results / "check.json"));
  if (!check.at("holds").get<bool>()) notice.news = News::kDrifted;
  notice.findings.clear();
  for (const auto& one : check.at("words")) notice.findings.push_back(one.get<std::string>());
}

calib::Calibration add_result(Notice& notice, const std::string& json) {
  calib::Calibration result = calib::calibration_from_json(json, "the journal");
  notice.near_m = result.predicted_near_targets_m;
  notice.over_m = result.predicted_workspace_m;
  notice.news = news_of(result.verdict);
  return result;
}

}  // namespace

News news_of(const calib::Verdict& verdict) {
  if (tells_of_change(verdict)) return News::kDrifted;
  return verdict.publish ? News::kDone : News::kWithheld;
}

Notice news_of_end(std::int64_t session, const RecordEnd& end, const std::string& utc,
                   const std::filesystem::path& results_dir, Journal& journal) {
  Notice notice;
  notice.session = session;
  notice.failure = end.why;
  notice.ended = utc;
  notice.news = end.ending == Ending::kDone      ? News::kDone
                : end.ending == Ending::kAborted ? News::kAborted
                                                 : News::kFailed;
  // A session that is damaged has its end told of all the same, and what cannot be read may not be used.
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
  if (kind == SessionKind::kCheck) {
    try_to(notice, [&] { add_check(notice, results_dir); });
  } else if (!record->calibration.empty()) {
    notice.news = unread;
    try_to(notice, [&] {
      notice.findings = calib::words(add_result(notice, record->calibration).verdict.findings);
    });
  }
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
    if (status.kind == to_string(SessionKind::kCheck)) {
      try_to(notice, [&] { add_check(notice, status.results_dir); });
      add_drift(notice, journal, status.results_dir);
    } else {
      if (!record->calibration.empty()) add_result(notice, record->calibration);
    }
  } catch (const std::exception& unreadable) {
    notice.findings.emplace_back(unreadable.what());  // the rest is told all the same
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
