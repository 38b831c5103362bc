#include "daemon/result/outcome_json.h"

#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/model/units.h"
#include "calib/words/phrase_json.h"

namespace cellcal::daemon {

namespace {

using calib::kMmPerM;
using calib::kMsPerS;
using nlohmann::json;

constexpr double kCoverage = 2.0;  // U(k=2)

json mm(const Eigen::Vector3d& m) { return {m.x() * kMmPerM, m.y() * kMmPerM, m.z() * kMmPerM}; }

Eigen::Vector3d metres(const json& list) {
  return Eigen::Vector3d(list.at(0).get<double>(), list.at(1).get<double>(),
                         list.at(2).get<double>()) /
         kMmPerM;
}

struct Unit {
  const char* name;
  double per_si;
};

Unit unit_of(calib::ChangeKind kind) {
  switch (kind) {
    case calib::ChangeKind::kJoint: return {"deg", calib::kDegPerRad};
    case calib::ChangeKind::kGrowth: return {"ppm", 1e6};
    case calib::ChangeKind::kNothing:
    case calib::ChangeKind::kTool:
    case calib::ChangeKind::kSphere:
    case calib::ChangeKind::kTouch:
    case calib::ChangeKind::kPositioner: break;
  }
  return {"mm", kMmPerM};
}

json to_json(const calib::Explanation& one) {
  const Unit unit = unit_of(one.kind);
  const bool shifted = is_shift(one.kind);
  const bool turned = one.kind == calib::ChangeKind::kPositioner;
  const double at_least = shifted && !turned ? kMmPerM * one.amount : 0.0;
  return {{"kind", to_string(one.kind)},
          {"name", one.name},
          {"probability", one.probability},
          {"touch", one.kind == calib::ChangeKind::kTouch ? json(one.touch + 1) : json()},
          {"shift_mm", shifted ? mm(one.shift_m) : json()},
          {"value", unit.per_si * (shifted ? one.shift_m.norm() : one.amount)},
          {"u", kCoverage * unit.per_si * one.sigma},
          {"at_least", at_least > 0.0 ? json(at_least) : json()},
          {"unit", unit.name}};
}

calib::Explanation explanation_of(const json& value) {
  calib::Explanation one;
  one.kind = by_own_name<calib::ChangeKind>(value.at("kind").get<std::string>()).value();
  const Unit unit = unit_of(one.kind);
  one.name = value.at("name").get<std::string>();
  one.probability = value.at("probability").get<double>();
  if (value.at("touch").is_number()) one.touch = value["touch"].get<std::size_t>() - 1;
  one.sigma = value.at("u").get<double>() / (kCoverage * unit.per_si);
  if (is_shift(one.kind)) {
    one.shift_m = metres(value.at("shift_mm"));
    if (value.contains("at_least") && value["at_least"].is_number())
      one.amount = value["at_least"].get<double>() / kMmPerM;
  } else {
    one.amount = value.at("value").get<double>() / unit.per_si;
  }
  return one;
}

json to_json(const FoundSphere& one) {
  json value{{"target", one.target},
             {"centre_mm", mm(one.centre_m)},
             {"u_mm", kMmPerM * one.u_m},
             {"touches", one.touches},
             {"moved_mm", one.moved_m ? json(kMmPerM * *one.moved_m) : json()}};
  if (one.on.empty()) return value;
  value["on"] = one.on;
  value["taught_deg"] = json::array();
  for (const double rad : one.taught_rad) value["taught_deg"].push_back(rad * calib::kDegPerRad);
  return value;
}

FoundSphere sphere_of(const json& value) {
  FoundSphere one;
  one.target = value.at("target").get<std::string>();
  one.centre_m = metres(value.at("centre_mm"));
  one.u_m = value.at("u_mm").get<double>() / kMmPerM;
  one.touches = value.at("touches").get<int>();
  if (value.at("moved_mm").is_number()) one.moved_m = value["moved_mm"].get<double>() / kMmPerM;
  one.on = value.value("on", "");
  for (const double deg : value.value("taught_deg", std::vector<double>()))
    one.taught_rad.push_back(deg * calib::kRadPerDeg);
  return one;
}

json to_json(const calib::MasteredZero& one) {
  return {{"joint", one.joint},
          {"error_deg", one.error_rad * calib::kDegPerRad},
          {"u_deg", one.u_rad() * calib::kDegPerRad}};
}

template <class T>
json names_of(const std::vector<T>& list) {
  json names = json::array();
  for (const T& one : list) names.emplace_back(to_string(one));
  return names;
}

json document_of(const SessionOutcome& outcome) {
  json value{{"format", "cellcal.outcome/1"},
             {"kind", to_string(outcome.kind)},
             {"touches", outcome.touches},
             {"tcp_shift_mm", nullptr},
             {"change", outcome.change ? to_json(*outcome.change) : json()},
             {"not_found", outcome.not_found},
             {"unsteady", outcome.unsteady},
             {"zeros", json::array()},
             {"remedy", to_string(outcome.remedy)},
             {"spheres", json::array()},
             {"not_as_stated", names_of(outcome.not_as_stated)},
             {"contacts", json::array()},
             {"withheld_by", names_of(outcome.withheld_by)},
             {"update", outcome.update ? json(to_string(*outcome.update)) : json()}};
  if (outcome.tcp_shift)
    value["tcp_shift_mm"] = {{"xyz", mm(outcome.tcp_shift->shift_m)},
                             {"length", kMmPerM * outcome.tcp_shift->shift_m.norm()},
                             {"u_length", kMmPerM * outcome.tcp_shift->u_m}};
  for (const FoundSphere& one : outcome.spheres) value["spheres"].push_back(to_json(one));
  for (const calib::MasteredZero& one : outcome.zeros) value["zeros"].push_back(to_json(one));
  for (const calib::Phrase& one : outcome.contacts)
    value["contacts"].push_back(calib::to_json(one));
  return value;
}

SessionOutcome outcome_in(const json& value) {
  SessionOutcome outcome;
  outcome.kind = outcome_kind(value.at("kind").get<std::string>()).value();
  outcome.touches = value.at("touches").get<std::size_t>();
  if (const json& shift = value.at("tcp_shift_mm"); shift.is_object())
    outcome.tcp_shift = {metres(shift.at("xyz")), shift.at("u_length").get<double>() / kMmPerM};
  if (value.at("change").is_object()) outcome.change = explanation_of(value["change"]);
  value.at("not_found").get_to(outcome.not_found);
  value.at("unsteady").get_to(outcome.unsteady);
  for (const json& one : value.value("zeros", json::array()))
    outcome.zeros.push_back({one.at("joint").get<std::string>(),
                             one.at("error_deg").get<double>() * calib::kRadPerDeg,
                             0.5 * one.at("u_deg").get<double>() * calib::kRadPerDeg});
  outcome.remedy = by_own_name<calib::DriftAdvice>(value.at("remedy").get<std::string>()).value();
  for (const json& one : value.at("spheres")) outcome.spheres.push_back(sphere_of(one));
  for (const json& one : value.at("not_as_stated"))
    outcome.not_as_stated.push_back(qualification_finding(one.get<std::string>()).value());
  for (const json& one : value.value("contacts", json::array()))
    outcome.contacts.push_back(calib::phrase_of(one));
  for (const json& one : value.at("withheld_by"))
    outcome.withheld_by.push_back(by_own_name<calib::FindingKind>(one.get<std::string>()).value());
  if (value.at("update").is_string())
    outcome.update = by_own_name<calib::UpdateOutcome>(value["update"].get<std::string>()).value();
  return outcome;
}

json figure(const std::optional<Figure>& figure, double factor) {
  if (!figure) return nullptr;
  return {{"value", factor * figure->value}, {"sigma", factor * figure->sigma}};
}

/// `words` in English, and `said` for other languages.
void add_lines(const std::vector<calib::Phrase>& lines, json& value) {
  value["words"] = value["said"] = json::array();
  for (const calib::Phrase& line : lines) {
    value["words"].push_back(calib::words(line));
    value["said"].push_back(calib::to_json(line));
  }
}

std::string document_of_qualification(const Qualification& q) {
  json value{{"format", "cellcal.qualification/1"},
             {"target", q.target},
             {"touches", q.touches},
             {"places", q.places},
             {"touch_noise_mm", figure(q.noise_m, kMmPerM)},
             {"touch_noise_dof", q.noise_dof},
             {"latch_delay_ms", nullptr},
             {"overtravel", json::array()},
             {"overtravel_limit_mm", kMmPerM * kOvertravelLimitM},
             {"reaction_worst_ms", kMsPerS * q.reaction_worst_s},
             {"bounces_worst", q.bounces_worst},
             {"radius_offset_mm", figure(q.radius_offset_m, kMmPerM)},
             {"stated",
              {{"touch_sigma_mm", kMmPerM * q.stated.touch_sigma_m},
               {"latch_delay_ms", kMsPerS * q.stated.delay_s},
               {"latch_delay_sigma_ms", kMsPerS * q.stated.delay_sigma_s},
               {"radius_offset_sigma_mm", kMmPerM * q.stated.radius_offset_sigma_m}}},
             {"passed", q.passed()},
             {"findings", json::array()}};
  add_lines(phrases(q), value);
  if (q.delay)
    value["latch_delay_ms"] = {{"value", kMsPerS * q.delay->delay_s},
                               {"sigma", kMsPerS * q.delay->sigma_s}};
  for (const Overtravel& o : q.overtravel)
    value["overtravel"].push_back({{"speed_mm_s", kMmPerM * o.speed_m_s},
                                   {"searches", o.searches},
                                   {"median_mm", kMmPerM * o.median_m},
                                   {"worst_mm", kMmPerM * o.worst_m}});
  for (const QualificationFinding finding : q.findings)
    value["findings"].push_back(to_string(finding));
  return value.dump(2) + "\n";
}

std::string document_of_found(const FoundSpheres& found) {
  json value{{"format", "cellcal.found/1"}, {"spheres", json::array()}};
  std::vector<calib::Phrase> lines;
  for (const FoundSphere& one : found.spheres) {
    value["spheres"].push_back(to_json(one));
    lines.push_back(phrase(one));
  }
  add_lines(lines, value);
  return value.dump(2) + "\n";
}

/// The zeros follow the verdict in the words.
std::string document_of_check(const SessionResult& result, const calib::TcpCheck& check) {
  const std::string document = calib::check_to_json(check);
  if (result.mastered.empty()) return document + "\n";
  auto json = nlohmann::ordered_json::parse(document);
  auto mastered = nlohmann::ordered_json::array(), words = mastered, said = mastered;
  for (const calib::MasteredZero& one : result.mastered) {
    mastered.emplace_back(to_json(one));
    mastered.back()["holds"] = one.holds();
    words.push_back(calib::words(phrase(one)));
    said.emplace_back(calib::to_json(phrase(one)));
  }
  const auto insert = [&](const char* key, const nlohmann::ordered_json& lines) {
    json[key].insert(json[key].begin() + 1, lines.begin(), lines.end());
  };
  insert("words", words);
  insert("said", said);
  json["mastered"] = std::move(mastered);
  return json.dump(1) + "\n";
}

}  // namespace

std::string document_of(const SessionResult& result) {
  if (const auto* check = std::get_if<calib::TcpCheck>(&result.of))
    return document_of_check(result, *check);
  if (const auto* q = std::get_if<Qualification>(&result.of)) return document_of_qualification(*q);
  if (const auto* found = std::get_if<FoundSpheres>(&result.of)) return document_of_found(*found);
  return {};
}

std::string outcome_to_json(const SessionOutcome& outcome) { return document_of(outcome).dump(); }

std::optional<SessionOutcome> outcome_from_json(const std::string& text) try {
  if (text.empty()) return std::nullopt;
  return outcome_in(json::parse(text));
} catch (const json::exception&) {
  return std::nullopt;
} catch (const std::bad_optional_access&) {  // a name of a later version
  return std::nullopt;
} catch (const std::invalid_argument&) {  // no phrase
  return std::nullopt;
}

json outcome_with_words(const std::optional<SessionOutcome>& outcome,
                        const calib::Language& language) {
  if (!outcome) return nullptr;
  json value = document_of(*outcome);
  const std::string cause = cause_of(*outcome);
  value["good"] = is_good(outcome->kind);
  value["cause"] = cause.empty() ? json() : json(cause);
  value["words"] = json::array();
  for (const calib::Phrase& line : phrases(*outcome))
    value["words"].push_back(calib::words(line, language));
  return value;
}

}  // namespace cellcal::daemon
