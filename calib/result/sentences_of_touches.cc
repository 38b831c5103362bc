// Sentences on the touches, their noise and their distribution, and on the statements of the files.

#include <cmath>

#include "calib/model/enum_table.h"
#include "calib/result/sentences.h"

namespace cellcal::calib::sentences {

namespace {

TargetKind target_kind(const Finding& f) {
  return f.about.target_kind.value_or(TargetKind::kSphere);
}

Phrase lies_on(const FindingPart& part) {
  return part.about.other_end.empty() ? Phrase() : said("say.finding.lies_on", part);
}

/// For a target whose place its check touches do not determine.
Phrase placement_remedy(TargetKind kind) {
  return kind == TargetKind::kPlane     ? "say.finding.no_place.do.plane"
         : kind == TargetKind::kTracker ? "say.finding.no_place.do.tracker"
                                        : "say.finding.no_place.do";
}

/// Remedy for a target whose touches do not fit.
Phrase again(const Finding& f) {
  using enum TargetKind;
  static constexpr EnumNames<TargetKind> kTable{{{kSphere, "say.finding.again"},
                                                 {kWire, "say.finding.again.wire"},
                                                 {kPlane, "say.finding.again"},
                                                 {kPoint, "say.finding.again.point"},
                                                 {kTracker, "say.finding.again.tracker"}}};
  return kTable[target_kind(f)];
}

}  // namespace

Phrase why_not_judged(const Finding& f) {
  if (!has(f, "touches")) return f.text;  // from a file with text only
  const bool one = is_one(f, "touches");
  if (is_set(f, "no_place"))
    return said(one ? "say.finding.no_place.one" : "say.finding.no_place", f,
                {{"do", placement_remedy(target_kind(f))}});
  if (is_set(f, "unusable")) return "say.finding.unusable";
  if (is_set(f, "other_normal")) return "say.finding.other_normal";
  return said(one ? "say.finding.little_more.one" : "say.finding.little_more", f);
}

Phrase touch_scatter(const Finding& f) {
  const double ratio = of(f, "ratio");
  return said(
      is_set(f, "repeats") ? "say.finding.touch_scatter.repeats" : "say.finding.touch_scatter", f,
      {{"chi2", ratio * ratio}});
}

Phrase duplicate_touches(const Finding& f) {
  if (f.parts.size() < 2) return said("say.finding.duplicate_touches", f);
  return said("say.finding.duplicate_touches.pair", f,
              {{"one", touch_of(f.parts[0].about)}, {"same", touch_of(f.parts[1].about)}});
}

Phrase scope_of_touches(const Finding& f) {
  if (f.parts.empty()) return said("say.finding.scope_of_touches", f);
  return said("say.finding.scope_of_touches.still", f, {{"list", list(f, name_of)}});
}

Phrase outliers_of_target(const Finding& f) {
  return said("say.finding.outliers_of_target", f, {{"again", again(f)}});
}

Phrase check_touches(const Finding& f) {
  if (f.parts.empty()) return said("say.finding.check_touches", f);
  return said("say.finding.check_touches.other", f, {{"list", list(f, lies_on)}});
}

Phrase gross_check_touches(const Finding& f) {
  const auto off = [](const FindingPart& one) {
    return said(one.about.other_end.empty() ? "say.finding.gross" : "say.finding.gross.other", one);
  };
  return said("say.finding.gross_check_touches", f, {{"list", list(f, off)}});
}

Phrase unseen_not_judged(const Finding& f) {
  return said("say.finding.unseen_not_judged", f, {{"why", why_not_judged(f)}});
}

Phrase all_left_out(const Finding& f) {
  return said("say.finding.all_left_out", f, {{"again", again(f)}});
}

Phrase model_error(const Finding& f) {
  const bool repeats = has(f, "repeats");
  if (!is_set(f, "estimated"))
    return said(
        repeats ? "say.finding.model_error.scatter.repeats" : "say.finding.model_error.scatter", f);
  Phrase noise = said(repeats ? "say.finding.noise.repeats" : "say.finding.noise", f);
  if (has(f, "reach"))
    noise = joined("say.join.comma", noise, said("say.finding.model_error.reach", f));
  return said(repeats ? "say.finding.model_error.repeats" : "say.finding.model_error.estimated", f,
              {{"beside", noise}});
}

Phrase too_few_touches(const Finding& f) {
  return said(has(f, "met") ? "say.finding.too_few_touches.met" : "say.finding.too_few_touches", f);
}

Phrase too_few_directions(const Finding& f) {
  using enum TargetKind;
  static constexpr EnumNames<TargetKind> kTable{{{kSphere, "sphere"},
                                                 {kWire, "wire"},
                                                 {kPlane, "plane"},
                                                 {kPoint, "sphere"},
                                                 {kTracker, "tracker"}}};
  const std::string id = std::string("say.finding.too_few_directions.") + kTable[target_kind(f)];
  return said(is_one(f, "touches") ? id + ".one" : id, f);
}

Phrase not_touched(const Finding& f) {
  const double idle = has(f, "idle_lengths") ? of(f, "idle_lengths") : 0.0;
  const char* id = idle == 1.0  ? "say.finding.not_touched.idle.one"
                   : idle > 0.0 ? "say.finding.not_touched.idle"
                                : "say.finding.not_touched";
  return said(id, f, {{"names", all_parts(f, "say.join.comma", name_of)}});
}

Phrase certified_length(const Finding& f) {
  return said(of(f, "others") > 0.0 ? "say.finding.certified_length.others"
                                    : "say.finding.certified_length",
              f);
}

Phrase artefact_size(const Finding& f) {
  const Quantity* longer = find(f.evidence, "longer");
  if (longer == nullptr) return said("say.finding.artefact_size", f);
  return said("say.finding.artefact_size.readings", f, {{"by", reading_off(*longer)}});
}

Phrase stated_centre(const Finding& f) {
  const auto off = [](const FindingPart& one) { return said("say.finding.centre_off", one); };
  return said("say.finding.stated_centre", f, {{"list", list(f, off)}});
}

Phrase exchanged_centres(const Finding& f) {
  const FindingPart none;
  return said("say.finding.exchanged_centres", f,
              {{"a", name_of(f.parts.empty() ? none : f.parts.front())},
               {"b", name_of(f.parts.empty() ? none : f.parts.back())}});
}

Phrase off_nominal(const Finding& f) {
  const auto off = [](const FindingPart& one) {
    const Quantity* by = find(one.evidence, "off");
    return said("say.finding.off_by", one, {{"unit", by == nullptr ? "" : by->unit}});
  };
  std::string id = "say.finding.off_nominal";
  if (f.withholds()) id += ".mastered";
  if (is_set(f, "may_be_so")) id += ".or_tolerance";
  return said(id, f, {{"list", list(f, off)}});
}

Phrase effective_radius(const Finding& f) {
  const double off_mm = of(f, "off");
  return said(
      off_mm > 0.0 ? "say.finding.effective_radius.larger" : "say.finding.effective_radius.smaller",
      f, {{"diameters", 2.0 * std::abs(off_mm)}});
}

}  // namespace cellcal::calib::sentences
