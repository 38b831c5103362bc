#include "daemon/doctor/finding.h"

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "calib/model/enum_table.h"

namespace cellcal::daemon {

namespace {

std::string lower(std::string text) {
  for (char& c : text) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  return text;
}

}  // namespace

const char* to_string(Outcome outcome) {
  using enum Outcome;
  static constexpr EnumNames<Outcome> kTable{
      {{kOk, "ok"}, {kWarning, "warning"}, {kFailed, "FAILED"}, {kSkipped, "skipped"}}};
  return kTable[outcome];
}

nlohmann::json to_json(const Finding& finding) {
  return {{"check", finding.check},
          {"outcome", lower(to_string(finding.outcome))},
          {"found", finding.found},
          {"advice", finding.advice}};
}

Finding finding_of(const nlohmann::json& value) {
  const auto name = value.at("outcome").get<std::string>();
  const auto outcome = std::ranges::find_if(
      kDoctorOutcomes, [&](Outcome one) { return lower(to_string(one)) == name; });
  if (outcome == kDoctorOutcomes.end())
    throw std::invalid_argument("\"outcome\" must be ok, warning, failed or skipped");
  return {value.at("check").get<std::string>(), *outcome, value.at("found").get<std::string>(),
          value.at("advice").get<std::string>()};
}

void Findings::ok(const std::string& check, const std::string& found) {
  add({check, Outcome::kOk, found, ""});
}

void Findings::warn(const std::string& check, const std::string& found, const std::string& advice) {
  add({check, Outcome::kWarning, found, advice});
}

void Findings::fail(const std::string& check, const std::string& found, const std::string& advice) {
  add({check, Outcome::kFailed, found, advice});
}

void Findings::skip(const std::string& check, const std::string& why) {
  add({check, Outcome::kSkipped, why, ""});
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
