// What findings say of the touches, their noise and where they are.

#include <fmt/format.h>

#include "calib/words/sentences.h"

namespace cellcal::calib::sentences {

namespace {

std::string lies_on(const Subject& touch) {
  return touch.other_end.empty() ? std::string()
                                 : fmt::format("{} of {} lies on {}: correct its target",
                                               touch_of(touch), touch.name, touch.other_end);
}

}  // namespace

std::string touch_scatter(const Finding& f) {
  return fmt::format(
      "{:.3f} mm, {:.1f} times the {:.3f} mm that {}. State what the instrument repeats to, not "
      "what the fit leaves; five places touched four times each measure it",
      of(f, "scatter"), of(f, "ratio"), of(f, "stated"),
      is_set(f, "repeats") ? "repeated touches and the cell file state"
                           : "the cell file states (sigma_mm)");
}

std::string duplicate_touches(const Finding& f) {
  const std::string which =
      f.parts.size() < 2
          ? std::string()
          : fmt::format(" ({} is {})", touch_of(f.parts[0].about), touch_of(f.parts[1].about));
  return fmt::format(
      "{:.0f} of {:.0f} touches repeat others to the last digit{}, as in a file that was pasted "
      "twice. Leave them out",
      of(f, "duplicates"), of(f, "touches"), which);
}

std::string many_outliers(const Finding& f) {
  return fmt::format(
      "{:.0f} of {:.0f} fit touches do not fit their target, at most {:.0f} % may. Look at the list "
      "of outliers for what they have in common",
      of(f, "outliers"), of(f, "touches"), of(f, "allowed"));
}

std::string outliers_of_target(const Finding& f) {
  return fmt::format(
      "{:.0f} of {:.0f} fit touches of {} do not fit it, and the others are too few to hold its "
      "place. {}",
      of(f, "outliers"), of(f, "touches"), f.about.name, again(f));
}

std::string check_touches(const Finding& f) {
  std::string text = fmt::format(
      "{:.3f} mm rms at held-out touches, {:.1f} times what the calibration predicts "
      "for them",
      of(f, "rms"), of(f, "ratio"));
  if (!f.parts.empty())
    return text + ". " + list(f, [](const FindingPart& one) { return lies_on(one.about); });
  return text + ". Touch again, more and in postures more unlike";
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
         "; judged without";
}

std::string no_check_touches(const Finding&) { return "the residuals are of the fit itself"; }

std::string unseen_not_judged(const Finding& f) {
  return fmt::format("{}, which has no fit touch: {}", f.about.name, f.text);
}

std::string all_left_out(const Finding& f) {
  return "all touches of " + f.about.name + " were left out. " + again(f);
}

std::string unseen_place(const Finding& f) {
  return fmt::format(
      "{:.3f} mm rms at {:.0f} check touches of {}, which has no fit touch, about the place that "
      "fits them ({:.1f} degrees of freedom)",
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
        "{:.3f} mm in every bound: touches scatter by {:.3f} mm, and {}. {}", of(f, "sigma"),
        of(f, "scatter"),
        repeats ? fmt::format("repeated ones by {:.3f} mm", of(f, "repeats"))
                : std::string("no repeats show that it is noise"),
        repeats ? "More touches do not reduce it"
                : "Touch five places four times each: what repeats scatter is noise, and leaves "
                  "the bounds");
  return fmt::format(
      "{:.3f} mm (1 sigma, each direction) beside a touch noise of {:.3f} mm{}{}. It is in every "
      "bound; more touches do not reduce it{}",
      of(f, "sigma"), of(f, "noise"), repeats ? " (repeats)" : "",
      has(f, "reach") ? fmt::format(", alike over {:.0f} deg of the main axes", of(f, "reach"))
                      : std::string(),
      repeats ? std::string()
              : fmt::format(". Touch five places four times each to measure the noise, and state "
                            "in sigma_mm ({:.3f}) what the instrument repeats to, not what the fit "
                            "leaves",
                            of(f, "stated")));
}

std::string too_few_touches(const Finding& f) {
  return fmt::format(
      "the cell works, {:.0f} of {:.0f} touches {}. Now calibrate with {:.0f} touches and {:.0f} to "
      "check",
      has(f, "met") ? of(f, "met") : of(f, "touches"), of(f, "touches"),
      has(f, "met") ? fmt::format("within {:.1f} mm of where the cell file has their targets",
                                  of(f, "farthest"))
                    : "made",
      of(f, "usual_touches"), of(f, "usual_checks"));
}

std::string rank(const Finding& f) {
  return fmt::format(
      "the touches determine {:.0f} of {:.0f} directions of the geometry better than the tolerances "
      "do. Make more, in postures more unlike",
      of(f, "determined"), of(f, "directions"));
}

std::string too_few_directions(const Finding& f) {
  const std::string times =
      fmt::format("{:.0f} time{}", of(f, "touches"), is_one(f, "touches") ? "" : "s");
  switch (f.about.target_kind.value_or(TargetKind::kSphere)) {
    case TargetKind::kPlane:
      return fmt::format(
          "{} was touched {} at places too near each other or in a line. Touch it farther apart in "
          "two directions",
          f.about.name, times);
    case TargetKind::kTracker:
      return fmt::format(
          "{} was read {} at places too near each other or in a line. Measure farther apart",
          f.about.name, times);
    case TargetKind::kWire:
      return fmt::format("{} was pulled {} in directions too much alike. Measure from more sides",
                         f.about.name, times);
    case TargetKind::kSphere:
    case TargetKind::kPoint:
      break;
  }
  return fmt::format("{} was touched {} in directions too much alike. Touch it from more sides",
                     f.about.name, times);
}

std::string not_touched(const Finding& f) {
  const double idle = of(f, "idle_lengths");
  std::string names;
  for (const FindingPart& part : f.parts) names += (names.empty() ? "" : ", ") + part.about.name;
  return names + " of the cell file" +
         (idle > 0.0 ? fmt::format("; {:.0f} certified length{} there and hold{} nothing", idle,
                                   idle == 1.0 ? " ends" : "s end", idle == 1.0 ? "s" : "")
                     : "");
}

}  // namespace cellcal::calib::sentences
