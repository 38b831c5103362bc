#include <string>
#include <vector>

#include "calib/files/result_fields.h"
#include "calib/files/text.h"
#include "calib/model/robot.h"
#include "calib/model/units.h"
#include "calib/result/finding.h"
#include "calib/result/likely_cause.h"
#include "calib/result/sentences.h"

namespace cellcal::calib {

namespace {

using fields::Field, fields::Json, fields::Table, fields::Value, fields::field, fields::list,
    fields::maybe, fields::not_negative, fields::number, fields::only_of, fields::optional,
    fields::text, fields::where, fields::whole;
using ordered = Json;

Value<TargetKind> kind_of_target() { return fields::named<TargetKind>("is not a kind of target"); }

Table<Subject> subject_fields(const Cell* cell) {
  using S = Subject;
  const auto read_name = [cell](const JsonReader& r, S& subject) {
    subject.name = r.text();
    if (subject.of == S::Of::kParameter) subject.parameter = parameter_key(*cell, subject.name);
  };
  return {
      field("of", &S::of, fields::named<S::Of>("is not a subject")),
      where<S>([](const S& one) { return !one.name.empty(); },
               {"name", [](const S& one) { return one.name; }, read_name}),
      where<S>([](const S& one) { return !one.other_end.empty(); },
               field("other", &S::other_end, text())),
      maybe("target_kind", &S::target_kind, kind_of_target()),
      maybe("touch", &S::touch, whole<std::size_t>()),
      where<S>([](const S& one) { return one.line > 0; }, field("line", &S::line, whole<int>()))};
}

ordered subject_to_json(const Subject& subject) {
  return fields::to_json(subject_fields(nullptr), subject);
}

Subject subject_from_json(const Cell& cell, const JsonReader& item) {
  Subject subject;
  fields::from_json(subject_fields(&cell), item, subject);
  return subject;
}

ordered evidence_to_json(const std::vector<Quantity>& evidence) {
  ordered out = ordered::object();
  for (const Quantity& one : evidence) {
    ordered& quantity = out[one.name] = {{"value", one.value}};
    if (!one.unit.empty()) quantity["unit"] = one.unit;
    if (one.sigma != 0.0) quantity["sigma"] = one.sigma;
  }
  return out;
}

std::vector<Quantity> evidence_from_json(const JsonReader& item) {
  std::vector<Quantity> evidence;
  for (const auto& [name, value] : item.object().items()) {
    const JsonReader one = item.at(name.c_str());
    Quantity quantity{name, one.at("value").number(), "", 0.0};
    if (one.has("unit")) quantity.unit = one.at("unit").text();
    if (one.has("sigma")) quantity.sigma = one.at("sigma").not_negative();
    evidence.push_back(std::move(quantity));
  }
  return evidence;
}

/// Text as in files of versions without causes, remaining findings and reasons as values.
std::string passed_on(const Finding& finding) {
  if (finding.cause) return cause_words(finding);
  if (finding.kind == FindingKind::kUnseenNotJudged)
    return words(sentences::why_not_judged(finding));
  return finding.still.empty() ? finding.text : words(finding.still.front());
}

/// The sentence is generated from values instead of read.
bool is_known(const Finding& finding) {
  return finding.cause || !finding.still.empty() ||
         (finding.kind == FindingKind::kUnseenNotJudged && !finding.evidence.empty());
}

ParameterKey named(const Cell& cell, const std::string& name, const JsonReader& item) {
  if (const auto key = parameter_key(cell, name)) return *key;
  item.fail(
      "\"" + shown(name) +
      "\" is not a parameter of the robot and cell in this file (they are named as A1.theta or "
      "S1.x). A joint or target may have been renamed by hand. Identify again from the touches");
}

}  // namespace

ordered finding_to_json(const Finding& finding) {
  ordered out = {{"kind", to_string(finding.kind)},
                 {"severity", to_string(finding.severity)},
                 {"about", subject_to_json(finding.about)},
                 {"evidence", evidence_to_json(finding.evidence)}};
  for (const FindingPart& part : finding.parts)
    out["parts"].push_back(
        {{"about", subject_to_json(part.about)}, {"evidence", evidence_to_json(part.evidence)}});
  if (finding.cause) out["cause"] = to_string(*finding.cause);
  for (const Finding& one : finding.still) out["still"].push_back(finding_to_json(one));
  if (const std::string text = passed_on(finding); !text.empty()) out["text"] = text;
  out["words"] = words(finding);
  return out;
}

Finding finding_from_json(const Cell& cell, const JsonReader& item) {
  Finding finding;
  const auto known = by_own_name<Severity>(item.at("severity").text());
  if (!known) item.at("severity").fail("must be \"withholds\", \"warns\" or \"informs\"");
  finding.severity = *known;
  const auto kind = by_own_name<FindingKind>(item.at("kind").text());
  if (!kind) {
    finding.text = item.at("words").text();
    return finding;
  }
  finding.kind = *kind;
  finding.about = subject_from_json(cell, item.at("about"));
  finding.evidence = evidence_from_json(item.at("evidence"));
  if (item.has("parts"))
    for (const JsonReader& part : item.at("parts").items())
      finding.parts.push_back(
          {subject_from_json(cell, part.at("about")), evidence_from_json(part.at("evidence"))});
  if (item.has("cause")) finding.cause = by_own_name<LikelyCause>(item.at("cause").text());
  if (item.has("still"))
    for (const JsonReader& one : item.at("still").items())
      finding.still.push_back(finding_from_json(cell, one));
  if (item.has("text") && !is_known(finding)) finding.text = item.at("text").text();
  return finding;
}

Table<Outlier> outlier_fields() {
  using O = Outlier;
  const auto known = [](const O& o) { return o.kind != OutlierKind::kRecorded; };
  const auto on_another = [](const O& o) { return o.kind == OutlierKind::kOnAnotherTarget; };
  const auto read_kind = [=](const JsonReader& r, O& o) {
    o.kind = by_own_name<OutlierKind>(r.text()).value_or(OutlierKind::kRecorded);
    if (known(o)) o.text.clear();
  };
  return {field("touch", &O::touch, whole<std::size_t>()),
          field("residual_mm", &O::residual_m, number(kMmPerM)),
          {"reason", [](const O& o) { return words(o); },
           [](const JsonReader& r, O& o) { o.text = r.text(); }},
          optional(field("leverage", &O::leverage, not_negative())),
          optional(Field<O>{"kind", [](const O& o) { return to_string(o.kind); }, read_kind}),
          only_of<O>(known, field("target", &O::target, text())),
          only_of<O>(known, field("target_kind", &O::target_kind, kind_of_target())),
          only_of<O>(known, field("sigmas", &O::sigmas, not_negative())),
          only_of<O>(on_another, field("lies_on", &O::lies_on, text()))};
}

ParameterKey parameter_from_json(const Cell& cell, const JsonReader& item) {
  return named(cell, item.text(), item);
}

Table<UnidentifiableDirection> unidentifiable_fields(const Cell& cell) {
  using D = UnidentifiableDirection;
  const auto known = [](const D& d) { return d.kind != UnidentifiableKind::kRecorded; };
  const auto write_direction = [&cell](const D& d) {
    ordered direction = ordered::object();
    for (const auto& [key, share] : d.direction) direction[parameter_name(cell, key)] = share;
    return direction;
  };
  const auto read_direction = [&cell](const JsonReader& r, D& d) {
    for (const auto& entry : r.object().items())
      d.direction.emplace_back(named(cell, entry.key(), r), r.at(entry.key().c_str()).number());
  };
  const auto read_kind = [=](const JsonReader& r, D& d) {
    d.kind = by_own_name<UnidentifiableKind>(r.text()).value_or(UnidentifiableKind::kRecorded);
    if (known(d)) d.text.clear();
  };
  const Value<ParameterKey> parameter{
      [&cell](const ParameterKey& key) { return parameter_name(cell, key); },
      [&cell](const JsonReader& r) { return parameter_from_json(cell, r); }};
  return {{"words", [&cell](const D& d) { return words(cell, d); },
           [](const JsonReader& r, D& d) { d.text = r.text(); }},
          {"direction", write_direction, read_direction},
          optional(Field<D>{"kind", [](const D& d) { return to_string(d.kind); }, read_kind}),
          only_of<D>(known, field("parameters", &D::parameters, list(parameter))),
          where<D>([](const D& d) { return d.more_parameters > 0; },
                   field("more_parameters", &D::more_parameters, whole<std::size_t>())),
          where<D>([](const D& d) { return d.more_as_weak > 0; },
                   field("more_as_weak", &D::more_as_weak, whole<std::size_t>()))};
}

}  // namespace cellcal::calib
