#include "calib/files/parts/finding_json.h"

#include <string>
#include <vector>

#include "calib/model/target_kind.h"
#include "calib/words/cause_words.h"
#include "calib/words/finding_words.h"
#include "calib/words/sentences.h"

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
  if (!of) item.at("of").fail("is no subject");
  subject.of = *of;
  if (item.has("name")) subject.name = item.at("name").text();
  if (subject.of == Subject::Of::kParameter) subject.parameter = parameter_key(cell, subject.name);
  if (item.has("other")) subject.other_end = item.at("other").text();
  if (item.has("target_kind")) {
    subject.target_kind = target_kind(item.at("target_kind").text());
    if (!subject.target_kind) item.at("target_kind").fail("is no kind of target");
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

/// As files had it before they had causes, what is still found and why a target is not judged as
/// values.
std::string passed_on(const Finding& finding) {
  if (finding.cause) return cause_words(finding);
  if (finding.kind == FindingKind::kUnseenNotJudged) return sentences::why_not_judged(finding);
  return finding.still.empty() ? finding.text : words(finding.still.front());
}

/// Its text is made of values, and said anew.
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

}  // namespace cellcal::calib
