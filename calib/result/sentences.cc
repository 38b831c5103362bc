// Sentences on the use of the result, on changes during a session and on updates.

#include "calib/result/sentences.h"

#include <algorithm>
#include <cmath>

#include "calib/result/finding_phrase.h"

namespace cellcal::calib::sentences {

namespace {

/// Number of items named; the rest is counted.
constexpr std::size_t kInWords = 3;

std::vector<PhraseValue> values_of(const Subject& about, const std::vector<Quantity>& evidence,
                                   std::vector<PhraseValue> values) {
  values.emplace_back("name", about.name);
  values.emplace_back("other", about.other_end);
  if (about.touch) values.emplace_back("touch", touch_of(about, evidence));
  for (const Quantity& one : evidence) {
    values.emplace_back(one.name, one.value);
    values.emplace_back(one.name + "_sigma", one.sigma);
  }
  return values;
}

}  // namespace

double of(const Finding& f, const char* name) { return value(f.evidence, name); }

bool has(const Finding& f, const char* name) { return find(f.evidence, name) != nullptr; }

bool is_set(const Finding& f, const char* name) { return has(f, name) && of(f, name) != 0.0; }

bool is_one(const Finding& f, const char* name) { return of(f, name) == 1.0; }

Phrase said(std::string id, const Finding& f, std::vector<PhraseValue> more) {
  more.emplace_back("text", calibration_phrase(f.text));
  return {std::move(id), values_of(f.about, f.evidence, std::move(more))};
}

Phrase said(std::string id, const FindingPart& part, std::vector<PhraseValue> more) {
  return {std::move(id), values_of(part.about, part.evidence, std::move(more))};
}

Phrase touch_of(const Subject& subject, const std::vector<Quantity>& evidence) {
  const Quantity* rank = find(evidence, "rank");
  const bool in_file = subject.line > 0;
  const char* id = rank != nullptr ? in_file ? "say.touch.in_time.line" : "say.touch.in_time"
                   : in_file       ? "say.touch.line"
                                   : "say.touch";
  return {id,
          {{"n", subject.touch.value_or(0) + 1},
           {"line", subject.line},
           {"rank", rank != nullptr ? rank->value : 0.0}}};
}

Phrase all_parts(const Finding& f, const char* separator,
                 const std::function<Phrase(const FindingPart&)>& one) {
  Phrase all;
  for (const FindingPart& part : f.parts) all = joined(separator, all, one(part));
  return all;
}

Phrase list(const Finding& f, const std::function<Phrase(const FindingPart&)>& one) {
  Finding first = f;
  if (f.parts.size() <= kInWords) return all_parts(f, "say.join.comma", one);
  first.parts.resize(kInWords);
  return {"say.finding.and_more",
          {{"list", all_parts(first, "say.join.comma", one)}, {"n", f.parts.size() - kInWords}}};
}

Phrase name_of(const FindingPart& part) { return part.about.name; }

Phrase reading_off(const Quantity& longer) {
  return {longer.value < 0.0 ? "say.finding.too_long" : "say.finding.too_short",
          {{"mm", std::abs(longer.value)}, {"sigma", longer.sigma}}};
}

namespace {

/// "0.52 +- 0.03 mm (+0.10, -0.50, +0.11)"
Phrase shift(const FindingPart& part) { return said("say.finding.shift", part); }

Phrase jump_size(const FindingPart& one) {
  return one.about.of == Subject::Of::kJoint ? said("say.finding.turn", one) : shift(one);
}

/// "zero of A3 jumped by +0.050 +- 0.004 deg after about touch 50"
Phrase jump(const FindingPart& one) {
  const char* id = one.about.of == Subject::Of::kJoint  ? "say.finding.jump.joint"
                   : one.about.of == Subject::Of::kTool ? "say.finding.jump.tool"
                                                        : "say.finding.jump.target";
  return said(id, one, {{"by", jump_size(one)}, {"at", touch_of(one.about, one.evidence)}});
}

Phrase one_jump(const Finding& f, const FindingPart& one) {
  // A joint with the same effect on all touches.
  const char* id = one.about.of == Subject::Of::kTool ? "say.finding.jumped.tool"
                   : is_set(f, "first_joint")         ? "say.finding.jumped.first_joint"
                   : is_set(f, "last_joint")          ? "say.finding.jumped.last_joint"
                                                      : "say.finding.jumped.joint";
  return said(id, f, {{"jump", jump(one)}});
}

/// Added if the change is significant only with the certified lengths.
Phrase or_lengths(const Finding& f, Phrase sentence) {
  if (!is_set(f, "or_lengths")) return sentence;
  return {"say.finding.or_lengths", {{"sentence", std::move(sentence)}}};
}

}  // namespace

Phrase moved_target(const Finding& f) {
  // Its touches show the move of the tracker against the robot's foot.
  const char* id = f.about.target_kind == TargetKind::kTracker ? "say.finding.moved_target.tracker"
                                                               : "say.finding.moved_target";
  return or_lengths(
      f,
      said(id, f, {{"by", shift({f.about, f.evidence})}, {"at", touch_of(f.about, f.evidence)}}));
}

Phrase jumped(const Finding& f) {
  if (f.parts.size() == 1) return or_lengths(f, one_jump(f, f.parts.front()));
  return or_lengths(
      f, said("say.finding.jumped.several", f, {{"causes", all_parts(f, "say.join.or", jump)}}));
}

// Updates: the change since the last calibration, or the reason for a full session.

namespace {

constexpr double kUpdateCoverage = 2.0;

/// The change found, with its size.
Phrase change(const FindingPart& part) {
  using enum Subject::Of;
  const auto sized = [&](const char* id, const char* name) -> Phrase {
    const Quantity* q = find(part.evidence, name);
    if (q == nullptr) return {id, {{"name", part.about.name}}};
    return {id,
            {{"name", part.about.name},
             {"by", q->value},
             {"u", kUpdateCoverage * q->sigma},
             {"unit", q->unit}}};
  };
  if (part.about.of == kTool) return sized("say.finding.change.tool", "shift");
  if (part.about.of == kTarget) return sized("say.finding.change.target", "shift");
  if (part.about.of == kJoint) return sized("say.finding.change.joint", "turn");
  if (part.about.of == kPositioner) return sized("say.finding.change.positioner", "shift");
  if (find(part.evidence, "growth") != nullptr) return sized("say.finding.change.growth", "growth");
  if (find(part.evidence, "off") != nullptr) return sized("say.finding.change.touch", "off");
  return "say.finding.change.nothing";
}

Phrase change(const Finding& f) { return change({f.about, f.evidence}); }

}  // namespace

Phrase updated(const Finding& f) {
  using enum Subject::Of;
  const char* id = f.about.of == kTool         ? "say.finding.updated.tool"
                   : f.about.of == kTarget     ? "say.finding.updated.target"
                   : f.about.of == kJoint      ? "say.finding.updated.joint"
                   : f.about.of == kPositioner ? "say.finding.updated.positioner"
                                               : "say.finding.updated";
  return said(id, f, {{"change", change(f)}});
}

Phrase update_not_needed(const Finding& f) {
  return said("say.finding.update_not_needed", f, {{"change", change(f)}});
}

Phrase update_contradicted(const Finding& f) {
  if (f.parts.empty()) return said("say.finding.update_contradicted", f, {{"change", change(f)}});
  return said("say.finding.update_contradicted.second", f,
              {{"change", change(f)}, {"second", change(f.parts.front())}});
}

Phrase update_not_resolved(const Finding& f) {
  return said(is_set(f, "on_positioner") ? "say.finding.update_not_resolved.positioner"
                                         : "say.finding.update_not_resolved",
              f, {{"change", change(f)}});
}

Phrase update_not_found(const Finding& f) {
  const char* id = f.parts.empty()       ? "say.finding.update_not_found.unnamed"
                   : f.parts.size() == 1 ? "say.finding.update_not_found.one"
                                         : "say.finding.update_not_found";
  return said(id, f, {{"names", list(f, name_of)}});
}

// Use of the result, and the previous state.

namespace {

Phrase where(const Finding& f) {
  return is_set(f, "workspace") ? "say.finding.over_workspace" : "say.finding.near_targets";
}

/// From the last calibration, named by `text`, to this one.
Phrase tcp_change(const Finding& f) {
  return said("say.finding.tcp_change", f, {{"where", where(f)}});
}

/// "3.48 ± 0.09 mm"; without uncertainty from earlier versions.
Phrase nominal(const Finding& f) {
  return said(of(f, "nominal_u") > 0.0 ? "say.finding.nominal.u" : "say.finding.nominal", f);
}

}  // namespace

Phrase scale_by_lengths(const Finding& f) {
  const Phrase held = said(
      is_one(f, "lengths") ? "say.finding.scale_by_lengths.one" : "say.finding.scale_by_lengths",
      f);
  return has(f, "unseen")
             ? joined("say.join.semicolon", held, said("say.finding.scale_by_lengths.unseen", f))
             : held;
}

Phrase scale_by_readings(const Finding& f) {
  return said(f.about.target_kind == TargetKind::kTracker ? "say.finding.scale_by_readings.tracker"
                                                          : "say.finding.scale_by_readings",
              f);
}

Phrase scale_by_nothing(const Finding& f) {
  const bool loose = is_set(f, "loose_targets");
  const Phrase why = !is_set(f, "lengths") ? "say.finding.scale_by_nothing.untouched"
                     : loose && !is_set(f, "lengths_with_held_ends")
                         ? "say.finding.scale_by_nothing.loose"
                         : "say.finding.scale_by_nothing.uncertain";
  const Phrase remedy = loose                  ? "say.finding.scale_by_nothing.do.sides"
                        : is_set(f, "centres") ? "say.finding.scale_by_nothing.do.touch"
                                               : "say.finding.scale_by_nothing.do.add";
  return said(is_set(f, "spheres") ? "say.finding.scale_by_nothing.spheres"
                                   : "say.finding.scale_by_nothing.tolerances",
              f, {{"why", why}, {"do", remedy}});
}

Phrase required(const Finding& f) {
  return said(is_set(f, "required_is_stated") ? "say.finding.required.stated"
                                              : "say.finding.required.allowed",
              f, {{"where", where(f)}});
}

Phrase no_gain(const Finding& f) {
  return said("say.finding.no_gain", f, {{"where", where(f)}, {"nominal_mm", nominal(f)}});
}

Phrase gain(const Finding& f) {
  return said(
      is_set(f, "required_is_stated") ? "say.finding.gain.stated" : "say.finding.gain.allowed", f,
      {{"where", where(f)}, {"nominal_mm", nominal(f)}});
}

Phrase changed(const Finding& f) {
  return said("say.finding.changed", f, {{"change", tcp_change(f)}});
}

Phrase change_accepted(const Finding& f) {
  return said("say.finding.change_accepted", f, {{"change", tcp_change(f)}});
}

Phrase unchanged(const Finding& f) { return tcp_change(f); }

}  // namespace cellcal::calib::sentences
