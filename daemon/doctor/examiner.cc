#include "daemon/doctor/examiner.h"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "calib/files/input_file.h"
#include "calib/model/enum_table.h"
#include "calib/words/phrase_json.h"
#include "daemon/doctor/steps.h"
#include "daemon/files/atomic_file.h"

namespace cellcal::daemon {

namespace {

constexpr const char* kExaminationFormat = "cellcal.examination/1";

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace

std::size_t Examination::count(Outcome outcome) const {
  return static_cast<std::size_t>(std::count_if(
      checks.begin(), checks.end(), [&](const Finding& one) { return one.outcome == outcome; }));
}

Examiner::Examiner(Parts parts) : parts_(std::move(parts)), newest_(kept()) {}

Examiner::~Examiner() { stop(); }

Examination Examiner::kept() const try {
  if (parts_.file.empty() || !std::filesystem::exists(parts_.file)) return {};
  const auto document = nlohmann::json::parse(calib::read_file(parts_.file));
  if (document.at("format") != kExaminationFormat) throw std::runtime_error("another format");
  if (document.at("config_sha256") != parts_.config_sha256()) return {};
  Examination kept;
  kept.whole = true;
  kept.cell = document.at("cell").get<std::string>();
  kept.cell_text = document.at("cell_text").get<std::string>();
  kept.ended = document.at("ended").get<std::string>();
  for (const auto& one : document.at("checks")) kept.checks.push_back(finding_of(one));
  return kept;
} catch (const std::exception& error) {
  spdlog::warn("{}: {}. Run the doctor again", parts_.file.string(), error.what());
  return {};
}

void Examiner::keep(Examination& whole) const try {
  if (parts_.file.empty()) return;
  auto checks = nlohmann::json::array();
  for (const Finding& one : whole.checks) checks.push_back(to_json(one));
  const nlohmann::json document{
      {"format", kExaminationFormat}, {"config_sha256", parts_.config_sha256()},
      {"cell", whole.cell.string()},  {"cell_text", whole.cell_text},
      {"ended", whole.ended},         {"checks", checks}};
  // Text from devices may hold any bytes.
  write_atomically(parts_.file,
                   document.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
} catch (const std::exception& error) {
  spdlog::warn("the doctor's findings are not stored: {}", error.what());
  whole.checks.push_back({"doctor",
                          Outcome::kWarning,
                          {"say.doctor.not_stored", {{"error", calib::Phrase(error.what())}}},
                          "say.doctor.not_stored.do"});
}

void Examiner::stop() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  thread_.request_stop();
  if (thread_.joinable()) thread_.join();
}

void Examiner::begin(const std::filesystem::path& cell) {
  Examination begun;
  begun.cell = cell;
  begun.running = true;
  begun.cell_text = text_of_cell(cell);
  parts_.hold();  // at most one holds, and the previous thread has ended
  const std::lock_guard lock(mutex_);
  if (ending_) return parts_.release();
  newest_ = std::move(begun);
  thread_ = std::jthread([this, cell](const std::stop_token& stop) { examine(cell, stop); });
}

std::optional<Examiner::NotTaken> Examiner::take(const std::filesystem::path& cell,
                                                 const std::string& cell_sha256,
                                                 const std::string& config_sha256,
                                                 std::vector<Finding> checks) {
  if (!parts_.config_sha256 || parts_.config_sha256() != config_sha256)
    return NotTaken::kOtherConfig;
  Examination taken;
  taken.cell = cell;
  taken.cell_text = text_of_cell(cell);
  if (taken.cell_text.empty() || calib::sha256(taken.cell_text) != cell_sha256)
    return NotTaken::kOtherCell;
  taken.whole = true;
  taken.ended = parts_.utc_now();
  taken.checks = std::move(checks);
  const std::lock_guard lock(mutex_);
  if (newest_.running) return NotTaken::kExamining;
  keep(taken);
  newest_ = std::move(taken);
  return std::nullopt;
}

void Examiner::examine(const std::filesystem::path& cell, const std::stop_token& stop) {
  Findings findings([this](const Finding& one) {
    const std::lock_guard lock(mutex_);
    newest_.checks.push_back(one);
  });
  const auto hint = [this](const calib::Phrase& now) {
    const std::lock_guard lock(mutex_);
    newest_.hint = now;
  };
  try {
    parts_.run_checks(cell, findings, hint, stop);
  } catch (const std::exception& error) {
    findings.fail("doctor", error.what(), "say.doctor.failed.do");
  }
  Examination ended = newest();
  ended.running = false;
  ended.whole = !stop.stop_requested();
  ended.hint = {};
  ended.ended = parts_.utc_now();
  if (ended.whole) keep(ended);
  {
    const std::lock_guard lock(mutex_);
    newest_ = std::move(ended);
  }
  parts_.release();
}

Examination Examiner::newest() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

const char* to_string(Outcome outcome) {
  using enum Outcome;
  static constexpr EnumNames<Outcome> kTable{
      {{kOk, "ok"}, {kWarning, "warning"}, {kFailed, "FAILED"}, {kSkipped, "skipped"}}};
  return kTable[outcome];
}

calib::Phrase or_else(const calib::Phrase& said, const char* fallback) {
  return said.empty() ? calib::Phrase(fallback) : calib::Phrase(said);
}

nlohmann::json to_json(const Finding& finding, const calib::Language& language) {
  return {{"check", finding.check},
          {"outcome", lower(to_string(finding.outcome))},
          {"found", words(finding.found, language)},
          {"advice", words(finding.advice, language)},
          {"said",
           {{"found", calib::to_json(finding.found)}, {"advice", calib::to_json(finding.advice)}}}};
}

Finding finding_of(const nlohmann::json& value) {
  const auto name = value.at("outcome").get<std::string>();
  static constexpr auto kAll = all_values<Outcome>();
  const auto outcome =
      std::ranges::find_if(kAll, [&](Outcome one) { return lower(to_string(one)) == name; });
  if (outcome == kAll.end())
    throw std::invalid_argument("\"outcome\" must be ok, warning, failed or skipped");
  const nlohmann::json& said = value.contains("said") ? value["said"] : value;
  return {value.at("check").get<std::string>(), *outcome, calib::phrase_of(said.at("found")),
          calib::phrase_of(said.at("advice"))};
}

std::size_t Findings::count(Outcome outcome) const {
  return static_cast<std::size_t>(std::count_if(
      all_.begin(), all_.end(), [outcome](const Finding& one) { return one.outcome == outcome; }));
}

void Findings::add(Finding finding) {
  all_.push_back(std::move(finding));
  if (listener_) listener_(all_.back());
}

}  // namespace cellcal::daemon
