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

using ordered = nlohmann::ordered_json;

ordered subject_to_json(const Subject& subject) {
  ordered out = {{"of", to_string(subject.of)}};
  if (!subject.name.empty()) out["name"] = subject.name;
  if (!subject.other_end.empty()) out["other"] = subject.other_end;
  if (subject.target_kind) out["target_kind"] = to_string(*subject.target_kind);
  if (subject.touch) out["touch"] = *subject.touch;
  if (subject.line > 0) out["line"] = subject.line;
  return out;
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

Subject subject_from_json(const Cell& cell, const JsonReader& item) {
  Subject subject;
  const auto of = subject_of(item.at("of").text());
  if (!of) item.at("of").fail("is not a subject");
  subject.of = *of;
  if (item.has("name")) subject.name = item.at("name").text();
  if (subject.of == Subject::Of::kParameter) subject.parameter = parameter_key(cell, subject.name);
  if (item.has("other")) subject.other_end = item.at("other").text();
  if (item.has("target_kind")) {
    subject.target_kind = target_kind(item.at("target_kind").text());
    if (!subject.target_kind) item.at("target_kind").fail("is not a kind of target");
  }
  if (item.has("touch")) subject.touch = item.at("touch").whole();
  if (item.has("line")) subject.line = static_cast<int>(item.at("line").whole());
  return subject;
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
  if (finding.kind == FindingKind::kUnseenNotJudged) return words(sentences::why_not_judged(finding));
  return finding.still.empty() ? finding.text : words(finding.still.front());
}

/// The sentence is generated from values instead of read.
bool is_known(const Finding& finding) {
  return finding.cause || !finding.still.empty() ||
         (finding.kind == FindingKind::kUnseenNotJudged && !finding.evidence.empty());
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
  const auto known = severity(item.at("severity").text());
  if (!known) item.at("severity").fail("must be \"withholds\", \"warns\" or \"informs\"");
  finding.severity = *known;
  const auto kind = finding_kind(item.at("kind").text());
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
  if (item.has("cause")) finding.cause = likely_cause(item.at("cause").text());
  if (item.has("still"))
    for (const JsonReader& one : item.at("still").items())
      finding.still.push_back(finding_from_json(cell, one));
  if (item.has("text") && !is_known(finding)) finding.text = item.at("text").text();
  return finding;
}

nlohmann::ordered_json outlier_to_json(const Outlier& o) {
  nlohmann::ordered_json out = {{"touch", o.touch},
                                {"residual_mm", o.residual_m * kMmPerM},
                                {"reason", words(o)},
                                {"leverage", o.leverage},
                                {"kind", to_string(o.kind)}};
  if (o.kind == OutlierKind::kRecorded) return out;
  out["target"] = o.target;
  out["target_kind"] = to_string(o.target_kind);
  out["sigmas"] = o.sigmas;
  if (o.kind == OutlierKind::kOnAnotherTarget) out["lies_on"] = o.lies_on;
  return out;
}

Outlier outlier_from_json(const JsonReader& item) {
  Outlier o{item.at("touch").whole(), item.at("residual_mm").number() / kMmPerM};
  if (item.has("leverage")) o.leverage = item.at("leverage").not_negative();
  const auto kind = item.has("kind") ? outlier_kind(item.at("kind").text()) : std::nullopt;
  if (kind.value_or(OutlierKind::kRecorded) == OutlierKind::kRecorded) {
    o.text = item.at("reason").text();
    return o;
  }
  o.kind = *kind;
  o.target = item.at("target").text();
  const auto known = target_kind(item.at("target_kind").text());
  if (!known) item.at("target_kind").fail("is not a kind of target");
  o.target_kind = *known;
  o.sigmas = item.at("sigmas").not_negative();
  if (o.kind == OutlierKind::kOnAnotherTarget) o.lies_on = item.at("lies_on").text();
  return o;
}

namespace {

ParameterKey named(const Cell& cell, const std::string& name, const JsonReader& item) {
  if (const auto key = parameter_key(cell, name)) return *key;
  item.fail(
      "\"" + shown(name) +
      "\" is not a parameter of the robot and cell in this file (they are named as A1.theta or "
      "S1.x); was a joint or target renamed by hand? Identify again from the touches");
}

}  // namespace

ParameterKey parameter_from_json(const Cell& cell, const JsonReader& item) {
  return named(cell, item.text(), item);
}

ordered unidentifiable_to_json(const Cell& cell, const UnidentifiableDirection& d) {
  ordered direction = ordered::object();
  for (const auto& [key, share] : d.direction) direction[parameter_name(cell, key)] = share;
  ordered out = {
      {"words", words(cell, d)}, {"direction", std::move(direction)}, {"kind", to_string(d.kind)}};
  if (d.kind == UnidentifiableKind::kRecorded) return out;
  out["parameters"] = ordered::array();
  for (const ParameterKey& key : d.parameters)
    out["parameters"].push_back(parameter_name(cell, key));
  if (d.more_parameters > 0) out["more_parameters"] = d.more_parameters;
  if (d.more_as_weak > 0) out["more_as_weak"] = d.more_as_weak;
  return out;
}

UnidentifiableDirection unidentifiable_from_json(const Cell& cell, const JsonReader& item) {
  UnidentifiableDirection d;
  const JsonReader direction = item.at("direction");
  for (const auto& entry : direction.object().items())
    d.direction.emplace_back(named(cell, entry.key(), direction),
                             direction.at(entry.key().c_str()).number());
  const auto kind = item.has("kind") ? unidentifiable_kind(item.at("kind").text()) : std::nullopt;
  if (kind.value_or(UnidentifiableKind::kRecorded) == UnidentifiableKind::kRecorded) {
    d.text = item.at("words").text();
    return d;
  }
  d.kind = *kind;
  for (const JsonReader& one : item.at("parameters").items())
    d.parameters.push_back(parameter_from_json(cell, one));
  if (item.has("more_parameters")) d.more_parameters = item.at("more_parameters").whole();
  if (item.has("more_as_weak")) d.more_as_weak = item.at("more_as_weak").whole();
  return d;
}

}  // namespace cellcal::calib
