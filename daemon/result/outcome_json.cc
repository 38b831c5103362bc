#include "daemon/result/outcome_json.h"

#include <nlohmann/json.hpp>

#include "calib/files/calibration_json.h"
#include "calib/files/json_fields.h"
#include "calib/model/units.h"
#include "calib/words/phrase_json.h"

namespace cellcal::daemon {

namespace {

using calib::kMmPerM;
using calib::kMsPerS;
using nlohmann::json;

using calib::JsonReader;
using calib::fields::Field, calib::fields::Json, calib::fields::Table, calib::fields::Value;
using calib::fields::field, calib::fields::for_readers, calib::fields::list, calib::fields::named,
    calib::fields::null_unless, calib::fields::nullable, calib::fields::number,
    calib::fields::object, calib::fields::optional, calib::fields::text, calib::fields::vector,
    calib::fields::where, calib::fields::whole;

constexpr double kCoverage = 2.0;  // U(k=2)

Value<double> degrees() {
  return {[](const double& rad) { return rad * calib::kDegPerRad; },
          [](const JsonReader& r) { return r.number() * calib::kRadPerDeg; }};
}

/// Throws std::invalid_argument where it is none.
Value<calib::Phrase> phrase_value() {
  return {[](const calib::Phrase& one) -> Json { return calib::to_json(one); },
          [](const JsonReader& r) { return calib::phrase_of(r.value()); }};
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

/// Amount and uncertainty in the unit of the kind; the amount of a shift is its least one.
Table<calib::Explanation> change_fields() {
  using E = calib::Explanation;
  const auto of_touch = [](const E& one) { return one.kind == calib::ChangeKind::kTouch; };
  const auto shifted = [](const E& one) { return is_shift(one.kind); };
  const auto known_partly = [](const E& one) {
    return is_shift(one.kind) && one.kind != calib::ChangeKind::kPositioner && one.amount > 0.0;
  };
  const Value<std::size_t> from_one{[](const std::size_t& touch) { return touch + 1; },
                                    [](const JsonReader& r) { return r.whole() - 1; }};
  return {
      field("kind", &E::kind, named<calib::ChangeKind>()),
      field("name", &E::name, text()),
      field("probability", &E::probability, number()),
      null_unless<E>(of_touch, field("touch", &E::touch, from_one)),
      null_unless<E>(shifted, field("shift_mm", &E::shift_m, vector(kMmPerM))),
      {"value",
       [](const E& one) -> Json {
         return unit_of(one.kind).per_si * (is_shift(one.kind) ? one.shift_m.norm() : one.amount);
       },
       [](const JsonReader& r, E& one) {
         if (!is_shift(one.kind)) one.amount = r.number() / unit_of(one.kind).per_si;
       }},
      {"u", [](const E& one) -> Json { return kCoverage * unit_of(one.kind).per_si * one.sigma; },
       [](const JsonReader& r, E& one) {
         one.sigma = r.number() / (kCoverage * unit_of(one.kind).per_si);
       }},
      optional(null_unless<E>(known_partly, field("at_least", &E::amount, number(kMmPerM)))),
      for_readers<E>("unit", [](const E& one) -> Json { return unit_of(one.kind).name; })};
}

Table<FoundSphere> sphere_fields() {
  using S = FoundSphere;
  const auto carried = [](const S& one) { return !one.on.empty(); };
  return {field("target", &S::target, text()),
          field("centre_mm", &S::centre_m, vector(kMmPerM)),
          field("u_mm", &S::u_m, number(kMmPerM)),
          field("touches", &S::touches, whole<int>()),
          nullable("moved_mm", &S::moved_m, number(kMmPerM)),
          where<S>(carried, field("on", &S::on, text())),
          where<S>(carried, field("taught_deg", &S::taught_rad, list(degrees())))};
}

Table<calib::MasteredZero> zero_fields() {
  using Z = calib::MasteredZero;
  return {field("error_deg", &Z::error_rad, degrees()), field("joint", &Z::joint, text()),
          Field<Z>{"u_deg", [](const Z& one) { return degrees().to(one.u_rad()); },
                   [](const JsonReader& r, Z& one) { one.sigma_rad = 0.5 * degrees().from(r); }}};
}

Table<TcpShift> tcp_shift_fields() {
  using T = TcpShift;
  return {
      field("xyz", &T::shift_m, vector(kMmPerM)),
      for_readers<T>("length", [](const T& one) -> Json { return kMmPerM * one.shift_m.norm(); }),
      field("u_length", &T::u_m, number(kMmPerM))};
}

const Table<SessionOutcome>& outcome_fields() {
  using O = SessionOutcome;
  static const Table<O> kAll{
      for_readers<O>("format", [](const O&) -> Json { return "cellcal.outcome/1"; }),
      field("kind", &O::kind, named<OutcomeKind>()),
      field("touches", &O::touches, whole<std::size_t>()),
      nullable("tcp_shift_mm", &O::tcp_shift, object(tcp_shift_fields())),
      nullable("change", &O::change, object(change_fields())),
      field("not_found", &O::not_found, list(text())),
      field("unsteady", &O::unsteady, list(text())),
      optional(field("zeros", &O::zeros, list(object(zero_fields())))),
      field("remedy", &O::remedy, named<calib::DriftAdvice>()),
      field("spheres", &O::spheres, list(object(sphere_fields()))),
      field("not_as_stated", &O::not_as_stated, list(named<QualificationFinding, '-'>())),
      optional(field("contacts", &O::contacts, list(phrase_value()))),
      field("withheld_by", &O::withheld_by, list(named<calib::FindingKind>())),
      nullable("update", &O::update, named<calib::UpdateOutcome>())};
  return kAll;
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
    value["spheres"].emplace_back(to_json(sphere_fields(), one));
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
    mastered.push_back(to_json(zero_fields(), one));
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

std::string outcome_to_json(const SessionOutcome& outcome) {
  return json(to_json(outcome_fields(), outcome)).dump();
}

std::optional<SessionOutcome> outcome_from_json(const std::string& text) try {
  const json document = json::parse(text, nullptr, false);
  SessionOutcome outcome;
  from_json(outcome_fields(), JsonReader(document, "outcome"), outcome);
  return outcome;
} catch (const calib::FileError&) {  // also a name of a later version
  return std::nullopt;
} catch (const std::invalid_argument&) {  // no phrase
  return std::nullopt;
}

json outcome_with_words(const std::optional<SessionOutcome>& outcome,
                        const calib::Language& language) {
  if (!outcome) return nullptr;
  json value = to_json(outcome_fields(), *outcome);
  const std::string cause = cause_of(*outcome);
  value["good"] = is_good(outcome->kind);
  value["cause"] = cause.empty() ? json() : json(cause);
  value["words"] = json::array();
  for (const calib::Phrase& line : phrases(*outcome))
    value["words"].push_back(calib::words(line, language));
  return value;
}

}  // namespace cellcal::daemon
