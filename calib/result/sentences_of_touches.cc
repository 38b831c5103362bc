// Sentences on the touches, their noise and their distribution.

#include <fmt/format.h>

#include <cmath>

#include "calib/result/sentences.h"

namespace cellcal::calib::sentences {

namespace {

std::string lies_on(const Subject& touch) {
  return touch.other_end.empty() ? std::string()
                                 : fmt::format("{} of {} lies on {}: correct its target",
                                               touch_of(touch), touch.name, touch.other_end);
}

/// For a target whose place its check touches do not determine.
const char* placement_remedy(TargetKind kind) {
  switch (kind) {
    case TargetKind::kPlane:
      return "Touch it farther apart in two directions, or add its normal to the cell file, "
             "pointing to the side of the tool";
    case TargetKind::kTracker:
      return "Measure at three places or more that are not in a line";
    case TargetKind::kSphere:
    case TargetKind::kWire:
    case TargetKind::kPoint:
      break;
  }
  return "Touch it from more sides, or add centre_mm to the cell file";
}

}  // namespace

std::string why_not_judged(const Finding& f) {
  if (!has(f, "touches")) return f.text;  // from a file with text only
  const bool one = is_one(f, "touches");
  if (is_set(f, "no_place"))
    return fmt::format("{:.0f} check {} not determine its place. {}", of(f, "touches"),
                       one ? "touch does" : "touches do",
                       placement_remedy(f.about.target_kind.value_or(TargetKind::kSphere)));
  if (is_set(f, "unusable")) return "a reading is not a number. Leave it out";
  if (is_set(f, "other_normal"))
    return "normal of the touched plane far off the stated one. Check its normal in the cell file";
  return fmt::format(
      "{:.0f} check {} its place and little more; touch it more often, or make some of them fit "
      "touches",
      of(f, "touches"), one ? "touch holds" : "touches hold");
}

std::string touch_scatter(const Finding& f) {
  return fmt::format(
      "{:.3f} mm, {:.3f} mm stated by {}; chi^2/dof {:.1f}. State the measured repeatability in "
      "sigma_mm, not the residual of the fit: touch five places four times each to measure it",
      of(f, "scatter"), of(f, "stated"),
      is_set(f, "repeats") ? "repeated touches and sigma_mm" : "sigma_mm in the cell file",
      of(f, "ratio") * of(f, "ratio"));
}

std::string unchecked_touch(const Finding& f) {
  return fmt::format(
      "errors below {:.1f} mm of {} of {} are not detectable, and would shift the TCP by up to "
      "{:.2f} mm (predicted error {:.2f} mm). Calibrate with more touches",
      of(f, "unseen"), touch_of(f.about), f.about.name, of(f, "shift"), of(f, "predicted"));
}

std::string duplicate_touches(const Finding& f) {
  const std::string which =
      f.parts.size() < 2
          ? std::string()
          : fmt::format(" ({} is {})", touch_of(f.parts[0].about), touch_of(f.parts[1].about));
  return fmt::format(
      "{:.0f} of {:.0f} touches equal others to the last digit{}; a file may have been pasted twice. "
      "Leave them out",
      of(f, "duplicates"), of(f, "touches"), which);
}

std::string many_outliers(const Finding& f) {
  return fmt::format(
      "{:.0f} of {:.0f} fit touches are outliers (limit {:.0f} %). "
      "Look for what they have in common in the list of outliers",
      of(f, "outliers"), of(f, "touches"), of(f, "allowed"));
}

std::string outliers_of_target(const Finding& f) {
  return fmt::format(
      "{:.0f} of {:.0f} fit touches of {} are outliers; the others are too few to determine its "
      "place. {}",
      of(f, "outliers"), of(f, "touches"), f.about.name, again(f));
}

std::string check_touches(const Finding& f) {
  const std::string text =
      fmt::format("{:.3f} mm rms at held-out touches, {:.1f} times the predicted error",
                  of(f, "rms"), of(f, "ratio"));
  if (!f.parts.empty())
    return text + ". " + list(f, [](const FindingPart& one) { return lies_on(one.about); });
  return text + ". Calibrate again with more touches in more varied postures";
}

std::string gross_check_touches(const Finding& f) {
  return list(f,
              [](const FindingPart& one) {
                return fmt::format(
                    "{} of {} {:.2f} mm off{}", touch_of(one.about), one.about.name,
                    value(one.evidence, "off"),
                    one.about.other_end.empty()
                        ? ""
                        : " (lies on " + one.about.other_end + ": correct its target)");
              }) +
         ". Left out of the verdict";
}

std::string no_check_touches(const Finding&) {
  return "accuracy not verified. Add --check 10 to 'cellcal run' or 'cellcal plan'";
}

std::string unseen_not_judged(const Finding& f) {
  return fmt::format("{}, which has no fit touch: {}", f.about.name, why_not_judged(f));
}

std::string all_left_out(const Finding& f) {
  return "all touches of " + f.about.name + " were left out. " + again(f);
}

std::string unseen_place(const Finding& f) {
  return fmt::format(
      "{:.3f} mm rms at {:.0f} check touches of {} about its fitted place "
      "({:.1f} degrees of freedom); it has no fit touch",
      of(f, "rms"), of(f, "touches"), f.about.name, of(f, "degrees_of_freedom"));
}

std::string temperature(const Finding& f) {
  // Steel and aluminium grow by 12 and 23 um per metre and kelvin.
  return fmt::format(
      "{:.1f} to {:.1f} degrees C at {:.0f} of {:.0f} touches. No model corrects for it; 10 K make "
      "0.1 to 0.2 mm per metre",
      of(f, "coldest"), of(f, "hottest"), of(f, "stated"), of(f, "touches"));
}

std::string model_error(const Finding& f) {
  const bool repeats = has(f, "repeats");
  if (!is_set(f, "estimated"))
    return fmt::format(
        "{:.3f} mm in every bound: touch scatter {:.3f} mm, {}. {}", of(f, "sigma"),
        of(f, "scatter"),
        repeats ? fmt::format("repeated touches {:.3f} mm", of(f, "repeats"))
                : std::string("no repeated touches"),
        repeats ? "More touches do not reduce it"
                : "Touch five places four times each: the scatter of repeated touches is noise and "
                  "is left out of the bounds");
  return fmt::format(
      "{:.3f} mm (1 sigma per direction) in every bound, touch noise {:.3f} mm{}{}. "
      "More touches do not reduce it{}",
      of(f, "sigma"), of(f, "noise"), repeats ? " (repeated touches)" : "",
      has(f, "reach")
          ? fmt::format(", correlation length {:.0f} deg of the main axes", of(f, "reach"))
          : std::string(),
      repeats ? std::string()
              : fmt::format(". Touch five places four times each, and state the measured "
                            "repeatability in sigma_mm ({:.3f} mm stated)",
                            of(f, "stated")));
}

std::string too_few_touches(const Finding& f) {
  return fmt::format(
      "the cell works, {:.0f} of {:.0f} touches {}. Now calibrate with {:.0f} touches and {:.0f} to "
      "check",
      has(f, "met") ? of(f, "met") : of(f, "touches"), of(f, "touches"),
      has(f, "met") ? fmt::format("within {:.1f} mm of their stated targets", of(f, "farthest"))
                    : "made",
      of(f, "usual_touches"), of(f, "usual_checks"));
}

std::string rank(const Finding& f) {
  return fmt::format(
      "{:.0f} of {:.0f} directions of the geometry are determined better than by their tolerances. "
      "Make more touches in more varied postures",
      of(f, "determined"), of(f, "directions"));
}

std::string too_few_directions(const Finding& f) {
  const auto made = [&](const char* one, const char* several) {
    return fmt::format("{}: {:.0f} {}", f.about.name, of(f, "touches"),
                       is_one(f, "touches") ? one : several);
  };
  switch (f.about.target_kind.value_or(TargetKind::kSphere)) {
    case TargetKind::kPlane:
      return made("touch", "touches") +
             " too near each other or in a line. Touch it farther apart in two directions";
    case TargetKind::kTracker:
      return made("reading", "readings") +
             " too near each other or in a line. Measure farther apart";
    case TargetKind::kWire:
      return made("reading", "readings") + " from too few directions. Measure from more sides";
    case TargetKind::kSphere:
    case TargetKind::kPoint:
      break;
  }
  return made("touch", "touches") + " from too few directions. Touch it from more sides";
}

std::string not_touched(const Finding& f) {
  const double idle = of(f, "idle_lengths");
  std::string names;
  for (const FindingPart& part : f.parts) names += (names.empty() ? "" : ", ") + part.about.name;
  return names + " of the cell file" +
         (idle > 0.0 ? fmt::format("; {:.0f} certified length{} there {} unused", idle,
                                   idle == 1.0 ? "" : "s", idle == 1.0 ? "is" : "are")
                     : "");
}

// Sentences on the statements of robot and cell file.

std::string certified_length(const Finding& f) {
  const double others = of(f, "others");
  return fmt::format(
      "{:.3f} mm stated, {:.3f} +- {:.3f} mm measured ({:.0f} sigma){}. Measure it again, or check "
      "that neither target was moved",
      of(f, "certified"), of(f, "measured"), sigma_of(f, "measured"), of(f, "apart"),
      others > 0.0 ? fmt::format("; {:.0f} more contradicted, by less", others) : "");
}

std::string certified_twice(const Finding& f) {
  return fmt::format("{:.3f} mm and {:.3f} mm stated, one of them is wrong. Leave it out",
                     of(f, "certified"), of(f, "certified_again"));
}

std::string artefact_size(const Finding& f) {
  if (has(f, "longer"))
    return fmt::format("readings {} ({:.0f} sigma). Check where the wire reads zero",
                       reading_off(*find(f.evidence, "longer")), of(f, "apart"));
  return fmt::format(
      "{:.3f} mm stated, {:.2f} +- {:.2f} mm measured ({:.0f} sigma). "
      "Check diameter_mm, and clean it",
      of(f, "stated"), of(f, "measured"), sigma_of(f, "measured"), of(f, "apart"));
}

std::string stated_centre(const Finding& f) {
  return list(f,
              [](const FindingPart& one) {
                return fmt::format("{} {:.1f} mm from stated ({:.0f} times centre_sigma_mm)",
                                   one.about.name, value(one.evidence, "off"),
                                   value(one.evidence, "apart"));
              }) +
         ". Check centre_mm, in the arm's base frame";
}

std::string exchanged_centres(const Finding& f) {
  const std::string a = f.parts.empty() ? "" : f.parts.front().about.name;
  const std::string b = f.parts.empty() ? "" : f.parts.back().about.name;
  return fmt::format(
      "{} and {} are exchanged: each was touched at the stated centre of the other. "
      "Exchange their centre_mm, or the target names of their touches",
      a, b);
}

std::string negative_compliance(const Finding& f) {
  return fmt::format(
      "{} is negative by {:.0f} sigma, as if the load pushed up. Check gravity and base in robot and "
      "cell file",
      f.about.name, of(f, "below_zero"));
}

std::string arm_scale(const Finding& f) {
  return fmt::format(
      "all lengths of the arm {:+.2f} % from nominal, {:.0f} times the tolerance of {:.2f} %. "
      "Check what holds the scale: certified lengths, readings of trackers and wires, diameters",
      of(f, "off"), of(f, "apart"), sigma_of(f, "off"));
}

std::string off_nominal(const Finding& f) {
  std::string text = list(f, [](const FindingPart& one) {
    const Quantity* off = find(one.evidence, "off");
    return fmt::format("{} off by {:.3g} {} ({:.0f} tolerances)", one.about.name,
                       off == nullptr ? 0.0 : off->value, off == nullptr ? "" : off->unit,
                       value(one.evidence, "tolerances"));
  });
  text += f.withholds() ? ". Check robot file and tool, and whether the arm is mastered"
                        : ". Check robot file and tool";
  return text + (is_set(f, "may_be_so") ? "; if all are right, state a larger tolerance" : "");
}

std::string effective_radius(const Finding& f) {
  const double off_mm = of(f, "off");
  return fmt::format(
      "{:+.2f} mm off ({:.1f} times radius_offset_sigma_mm), as if all diameters were {:.1f} mm {} "
      "than stated. Check diameter_mm and tip_radius_mm",
      off_mm, of(f, "apart"), 2.0 * std::abs(off_mm), off_mm > 0.0 ? "larger" : "smaller");
}

}  // namespace cellcal::calib::sentences
