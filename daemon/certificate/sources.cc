#include "daemon/certificate/sources.h"

#include <fmt/format.h>
#include <time.h>

#include <cmath>

#include "calib/files/calibration_json.h"
#include "calib/files/input_file.h"
#include "calib/files/toml.h"
#include "calib/model/iso_time.h"
#include "daemon/files/atomic_file.h"
#include "daemon/journal/rows.h"
#include "daemon/report/say.h"
#include "daemon/tasks/options.h"
#include "daemon/tasks/planned_round.h"

namespace cellcal::daemon::certificate {

namespace {

using nlohmann::json;

std::vector<Change> changes_in(const std::string& lines, const std::string& from) {
  std::vector<Change> changes;
  for (const RowEntry& entry : parse_lines(lines, from).entries)
    if (entry.table == "change" && !entry.names.empty()) {
      const std::string before = text_of(entry, "from_phase");
      changes.push_back({entry.row, text_of(entry, "time"), before, text_of(entry, "event"),
                         phase_of(before), phase_of(text_of(entry, "to_phase"))});
    }
  return changes;
}

/// Results stored by an unfinished session, e.g. in the phase reporting, are not used.
void refuse_unless_done(const SessionRecord& record, const std::string& from) {
  if (record.state == RecordState::kDone) return;
  throw Refused(Refused::Why::kNotDone,
                fmt::format("{}: the session is {}{}, not done: no certificate. Choose a "
                            "published session: 'cellcal history'",
                            from, to_string(record.state),
                            record.failure.empty() ? "" : " (" + printable(record.failure) + ")"));
}

/// May be of an unsupported version; the nominal arm is used instead.
std::optional<calib::Calibration> earlier_of(const std::optional<Compared>& compared) {
  if (!compared) return std::nullopt;
  try {
    return calib::calibration_from_json(compared->calibration, compared->words);
  } catch (const calib::FileError&) {
    return std::nullopt;
  }
}

}  // namespace

const json* Sources::at(const std::string& from) const {
  const json& whole = from.starts_with("cell#")    ? cell_json
                      : from.starts_with("robot#") ? robot_json
                                                   : calibration_json;
  const json::json_pointer where(from.substr(from.find('#') + 1));
  return whole.contains(where) ? &whole.at(where) : nullptr;
}

Entry Sources::text(const std::string& from) const {
  const json* found = at(from);
  if (found == nullptr) return {"", from};
  if (found->is_string()) return {found->get<std::string>(), from};
  if (found->is_number_integer()) return {found->dump(), from, found->get<double>()};
  return {"", from};
}

Entry Sources::number(const std::string& from, const std::string& unit, int decimals) const {
  const json* found = at(from);
  if (found == nullptr || !found->is_number()) return {"", from};
  return figure(found->get<double>(), unit, decimals, from);
}

Entry Sources::expanded(const std::string& from, const std::string& unit, int decimals) const {
  const Entry sigma = number(from, unit, decimals);
  if (!sigma.value) return {"", "k*" + from};
  return figure(kCoverage * *sigma.value, unit, decimals, "k*" + from);
}

std::size_t Sources::size(const std::string& from) const {
  const json* found = at(from);
  return found != nullptr && found->is_array() ? found->size() : 0;
}

std::vector<bool> outliers_of(const Sources& s) {
  std::vector<bool> outlier(s.touches.size());
  const auto leave_out = [&](std::size_t touch) {
    if (touch < outlier.size()) outlier[touch] = true;
  };
  for (const calib::Outlier& one : s.calibration.outliers) leave_out(one.touch);
  for (const calib::TouchResidual& one : s.calibration.residuals)
    if (one.outlier) leave_out(one.touch);
  // A file contains no residuals of single touches; outliers among the check touches are listed in a finding.
  for (const calib::Finding& finding : s.calibration.verdict.findings) {
    if (finding.kind != calib::FindingKind::kGrossCheckTouches) continue;
    for (const calib::FindingPart& part : finding.parts)
      if (part.about.touch) leave_out(*part.about.touch);
  }
  return outlier;
}

Sources read_sources(const Archive& archive, const std::string& from) {
  const ScratchDirectory scratch;
  Journal journal(scratch.path() / "journal.db");
  const auto [session, is_new] = import_archive(
      journal, archive, from, [&](std::int64_t) { return scratch.path() / "results"; });
  const auto record = journal.session(session);
  if (!record) throw ArchiveError(from + ": contains no session");
  if (record->calibration.empty())
    throw Refused(Refused::Why::kNoCalibration,
                  from + ": has no calibration. Choose a published session: 'cellcal history'");
  refuse_unless_done(*record, from);
  Sources all;
  all.record = *record;
  all.touches = journal.touches(session);
  all.compared = journal.compared(session);
  if (const auto file = archive.find("compared.json"); !all.compared && file != archive.end())
    all.compared = compared_from_json(file->second);
  all.changes = changes_in(archive.at("rows.jsonl"), from);
  all.rows_sha256 = calib::sha256(archive.at("rows.jsonl"));
  all.calibration = calib::calibration_from_json(record->calibration, from + ": calibration");
  all.earlier = earlier_of(all.compared);
  (void)cell_of(record->inputs);  // content that cannot be interpreted is not printed
  all.calibration_json = json::parse(record->calibration);
  all.cell_json = calib::toml_to_json(record->inputs.cell_text);
  all.robot_json = calib::toml_to_json(record->inputs.robot_text);
  // number in the recording journal, not in the one that imported it
  all.record.id = record->origin ? record->origin->session : session;
  return all;
}

void to_json(nlohmann::ordered_json& json, const Entry& entry) {
  json = {{"text", entry.text}, {"from", entry.from}};
  if (entry.value) json["value"] = *entry.value;
  if (!entry.unit.empty()) json["unit"] = entry.unit;
}

void from_json(const nlohmann::ordered_json& json, Entry& entry) {
  entry = {json.at("text"), json.at("from"), {}, json.value("unit", "")};
  if (const auto value = json.find("value"); value != json.end())
    entry.value = value->get<double>();
}

Entry entry_at(const nlohmann::ordered_json& content, const std::string& path) {
  return content.at(nlohmann::ordered_json::json_pointer("/" + path)).get<Entry>();
}

calib::Phrase CertificateData::phrase(const std::string& words) const {
  const auto known = phrases.find(words);
  return known == phrases.end() || known->second.empty() ? words : known->second;
}

std::string CertificateData::said(const calib::Phrase& phrase) {
  std::string words = calib::words(phrase);
  phrases[words] = phrase;
  return words;
}

Entry figure(double value, const std::string& unit, int decimals, const std::string& from) {
  if (!std::isfinite(value)) return {"", from};
  return {report::fixed(value, decimals), from, value, unit};
}

Entry raw_figure(double value, const std::string& unit, int decimals, const std::string& from) {
  if (!std::isfinite(value)) return {"", from};
  return {report::ascii_fixed(value, decimals), from, value, unit};
}

Entry local(const Entry& utc) { return {local_words(utc.text), "local(" + utc.from + ")"}; }

std::string local_words(const std::string& iso) {
  const auto seconds = calib::seconds_of(iso);
  if (!seconds) return {};
  const auto time = static_cast<time_t>(std::floor(*seconds));
  struct tm fields {};
  ::tzset();
  if (::localtime_r(&time, &fields) == nullptr) return {};
  char text[64];
  const std::size_t length = ::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S %Z (UTC%z)", &fields);
  return {text, length};
}

}  // namespace cellcal::daemon::certificate
