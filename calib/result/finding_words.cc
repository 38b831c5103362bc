#include "calib/result/finding_words.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>

namespace cellcal::calib {

namespace {

/// So many of several are named; of the others how many they are.
constexpr std::size_t kInWords = 3;

double of(const Finding& f, const char* name) { return value(f.evidence, name); }
double sigma_of(const Finding& f, const char* name) {
  const Quantity* its = find(f.evidence, name);
  return its == nullptr ? 0.0 : its->sigma;
}
bool has(const Finding& f, const char* name) { return find(f.evidence, name) != nullptr; }
bool is_set(const Finding& f, const char* name) { return has(f, name) && of(f, name) != 0.0; }
bool is_one(const Finding& f, const char* name) { return of(f, name) == 1.0; }

/// "touch 12 (line 14)", counted from 1.
std::string touch_of(const Subject& subject) {
  Touch touch;
  touch.line = subject.line;
  return touch_words(subject.touch.value_or(0), touch);
}

std::string length_of(const Finding& f) { return f.about.name + "-" + f.about.other_end; }

const char* where(const Finding& f) {
  return is_set(f, "workspace") ? "over the workspace" : "near the targets";
}

std::string list(const Finding& f, const std::function<std::string(const FindingPart&)>& one) {
  std::string text;
  for (std::size_t k = 0; k < std::min(kInWords, f.parts.size()); ++k)
    text += (k == 0 ? "" : ", ") + one(f.parts[k]);
  if (f.parts.size() > kInWords) text += fmt::format(", and {} more", f.parts.size() - kInWords);
  return text;
}

/// What to do about a target whose touches do not fit.
const char* again(const Finding& f) {
  switch (f.about.target_kind.value_or(TargetKind::kSphere)) {
    case TargetKind::kSphere:
    case TargetKind::kPlane:
      return "Clean it and touch it again";
    case TargetKind::kWire:
      return "Check that it runs free and measure again";
    case TargetKind::kPoint:
      return "Check that the tip seats in it and touch it again";
    case TargetKind::kTracker:
      return "Check the line of sight and the reflector, and measure again";
  }
  return "";
}

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

std::string lies_on(const Subject& touch) {
  return touch.other_end.empty() ? std::string()
                                 : fmt::format("{} of {} lies on {}: correct its target",
                                               touch_of(touch), touch.name, touch.other_end);
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

std::string certified_length(const Finding& f) {
  const double others = of(f, "others");
  return fmt::format(
      "{:.3f} mm stated, {:.3f} +- {:.3f} mm measured ({:.0f} sigma){}. Measure it again, or check "
      "that neither target was moved",
      of(f, "certified"), of(f, "measured"), sigma_of(f, "measured"), of(f, "apart"),
      others > 0.0 ? fmt::format("; {:.0f} more contradicted, by less", others) : "");
}

std::string certified_twice(const Finding& f) {
  return fmt::format(
      "{:.3f} mm stated, and {:.3f} mm; both cannot be right. Leave the wrong one out",
      of(f, "certified"), of(f, "certified_again"));
}

std::string artefact_size(const Finding& f) {
  if (has(f, "longer"))
    return fmt::format(
        "readings {:+.2f} +- {:.2f} mm longer than stated ({:.0f} sigma). Check where the wire reads "
        "zero",
        of(f, "longer"), sigma_of(f, "longer"), of(f, "apart"));
  return fmt::format(
      "{:.3f} mm stated, {:.2f} +- {:.2f} mm measured ({:.0f} sigma). Check diameter_mm, and that it "
      "is clean",
      of(f, "stated"), of(f, "measured"), sigma_of(f, "measured"), of(f, "apart"));
}

std::string stated_centre(const Finding& f) {
  return list(f,
              [](const FindingPart& one) {
                return fmt::format(
                    "{} {:.1f} mm from where the cell file has it ({:.0f} times "
                    "centre_sigma_mm)",
                    one.about.name, value(one.evidence, "off"), value(one.evidence, "apart"));
              }) +
         ". Check centre_mm, in the arm's base frame";
}

std::string exchanged_centres(const Finding& f) {
  const std::string a = f.parts.empty() ? "" : f.parts.front().about.name;
  const std::string b = f.parts.empty() ? "" : f.parts.back().about.name;
  return fmt::format(
      "{} was touched where the cell file has {}, and {} where it has {}. Exchange their centre_mm, "
      "or the ids of their touches",
      a, b, b, a);
}

std::string negative_compliance(const Finding& f) {
  return fmt::format(
      "{} is negative by {:.0f} sigma, as if the load pushed up. Check gravity and base in robot and "
      "cell file",
      f.about.name, of(f, "below_zero"));
}

std::string arm_scale(const Finding& f) {
  return fmt::format(
      "all lengths of the arm together {:+.2f} % off the drawing, {:.0f} times what their tolerances "
      "leave open. Check what holds the scale: certified lengths, readings of trackers and wires, "
      "diameters",
      of(f, "off"), of(f, "apart"));
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

std::string scale_by_lengths(const Finding& f) {
  const bool one = is_one(f, "lengths");
  return fmt::format(
      "{:.0f} certified length{} the scale, touched at both ends{}", of(f, "lengths"),
      one ? " holds" : "s hold",
      has(f, "unseen")
          ? fmt::format("; an error that all of them share would be noticed from {:.2f} % on",
                        of(f, "unseen"))
          : "");
}

std::string scale_by_readings(const Finding& f) {
  return f.about.target_kind == TargetKind::kTracker
             ? "the places that " + f.about.name + " measured hold the scale"
             : "the lengths of " + f.about.name + " hold the scale";
}

std::string scale_by_nothing(const Finding& f) {
  const bool loose = is_set(f, "loose_targets");
  return fmt::format(
      "{}, so only the {} the scale; the result claims nothing away from the targets. {}",
      !is_set(f, "lengths") ? "no certified length was touched"
      : loose && !is_set(f, "lengths_with_held_ends")
          ? "no certified length has ends that the touches hold"
          : "the certified lengths are not certain enough (all together worse than 0.5 mm per "
            "metre)",
      is_set(f, "spheres") ? "size of the spheres holds" : "tolerances of the arm hold",
      loose ? "Touch each target from more sides"
      : is_set(f, "centres")
          ? "Touch two targets at a certified distance"
          : "Add two targets with centres at a certified distance (spheres, points), or readings "
            "of a tracker or a long wire");
}

std::string unchecked_readings(const Finding& f) {
  return fmt::format(
      "an error of these readings below {:.2f} % would not be noticed, and all lengths of the arm "
      "would be wrong in proportion. Certify a length between touched targets",
      of(f, "unseen"));
}

std::string unchecked_lengths(const Finding& f) {
  return fmt::format(
      "an error below {:.1f} mm of the certified length {}, the best checked of {:.0f}, would not be "
      "noticed. Make more touches of each target",
      of(f, "unseen"), length_of(f), of(f, "lengths"));
}

std::string unchecked_length(const Finding& f) {
  return fmt::format(
      "an error below {:.1f} mm of the certified length {} ({:.3f} mm) would not be noticed, and all "
      "lengths of the arm would be wrong in proportion. Certify a second length between touched "
      "targets, or have this one measured again",
      of(f, "unseen"), length_of(f), of(f, "certified"));
}

std::string required(const Finding& f) {
  return fmt::format(
      "{:.2f} mm predicted {}, {:.2f} mm {}. Make more touches in postures more unlike, or state a "
      "larger required_mm",
      of(f, "predicted"), where(f), of(f, "required"),
      is_set(f, "required_is_stated") ? "required by the cell file (required_mm)"
                                      : "allowed where the cell file states no required_mm");
}

std::string no_gain(const Finding& f) {
  return fmt::format(
      "{:.2f} mm predicted {}, {:.2f} mm with the nominal arm ({:.0f} %, at most {:.0f} % is a "
      "gain). Make more touches in postures more unlike",
      of(f, "predicted"), where(f), of(f, "nominal"), of(f, "of_nominal"),
      of(f, "most_of_nominal"));
}

std::string gain(const Finding& f) {
  return fmt::format(
      "{:.2f} mm predicted {}, {:.2f} mm with the nominal arm ({:.0f} %); {:.2f} mm {}",
      of(f, "predicted"), where(f), of(f, "nominal"), of(f, "of_nominal"), of(f, "required"),
      is_set(f, "required_is_stated") ? "required" : "allowed (required_mm not stated)");
}

/// How far this calibration is from the last one, which `text` names.
std::string apart(const Finding& f) {
  return fmt::format("{:.3f} mm between the tips of this calibration and of {}, in the mean {}",
                     of(f, "apart"), f.text, where(f));
}

std::string changed(const Finding& f) {
  return fmt::format(
      "{}, {:.1f} times what both together predict. If the arm was hit, repaired or mastered, or "
      "its tool changed, accept the change (--accept-change); if not, look for what is loose",
      apart(f), of(f, "ratio"));
}

std::string change_accepted(const Finding& f) {
  return fmt::format("{}, {:.1f} times what both together predict; accepted", apart(f),
                     of(f, "ratio"));
}

std::string unchanged(const Finding& f) {
  return fmt::format("{}; both together predict {:.3f} mm", apart(f), of(f, "expected"));
}

std::string not_compared(const Finding& f) {
  return fmt::format(
      "not compared with {}, which is of another nominal arm or tool, or one of both predicts no "
      "error here",
      f.text);
}

/// "0.52 +- 0.03 mm (+0.10, -0.50, +0.11)"
std::string shift(const std::vector<Quantity>& evidence) {
  const Quantity* by = find(evidence, "shift");
  return fmt::format("{:.2f} +- {:.2f} mm ({:+.2f}, {:+.2f}, {:+.2f})",
                     by == nullptr ? 0.0 : by->value, by == nullptr ? 0.0 : by->sigma,
                     value(evidence, "x"), value(evidence, "y"), value(evidence, "z"));
}

std::string moved_target(const Finding& f) {
  return fmt::format("{} moved by {} after {}. Clamp it, and repeat from there{}", f.about.name,
                     shift(f.evidence), touch_of(f.about),
                     is_set(f, "or_lengths") ? ", or mend the lengths" : "");
}

std::string jump_size(const FindingPart& one) {
  if (one.about.of != Subject::Of::kJoint) return shift(one.evidence);
  const Quantity* by = find(one.evidence, "turn");
  return fmt::format("{:+.3f} +- {:.3f} deg", by == nullptr ? 0.0 : by->value,
                     by == nullptr ? 0.0 : by->sigma);
}

std::string jumped_subject(const FindingPart& one) {
  if (one.about.of == Subject::Of::kJoint) return one.about.name + "'s zero";
  if (one.about.of == Subject::Of::kTool) return "the tool's tip on the flange";
  return one.about.name;
}

std::string one_jump(const Finding& f, const FindingPart& one) {
  const double touches = of(f, "touches");
  if (one.about.of == Subject::Of::kTool)
    return fmt::format(
        "its tip seems to have moved by {} on the flange after about {} (of {:.0f}). Check its "
        "fastening and calibrate again",
        jump_size(one), touch_of(one.about), touches);
  // The same to all touches as that joint.
  const char* or_else = "";
  if (is_set(f, "first_joint"))
    or_else = " (or the arm's foot, or all targets together, turned by as much)";
  else if (is_set(f, "last_joint"))
    or_else = " (or the tool turned on the flange by as much)";
  return fmt::format(
      "the zero of {} seems to have jumped by {} after about {} (of {:.0f}){}. Look for a slipping "
      "belt, coupling or brake, master the joint and calibrate again",
      one.about.name, jump_size(one), touch_of(one.about), touches, or_else);
}

std::string jumped(const Finding& f) {
  std::string text;
  if (f.parts.size() == 1) {
    text = one_jump(f, f.parts.front());
  } else {
    for (const FindingPart& one : f.parts)
      text += fmt::format("{}{} by {} after about {}", text.empty() ? "" : ", or ",
                          jumped_subject(one), jump_size(one), touch_of(one.about));
    text = fmt::format(
        "the touches ({:.0f}) do not tell for certain which: {}. Check these and calibrate again",
        of(f, "touches"), text);
  }
  return text + (is_set(f, "or_lengths")
                     ? "; or mend the certified lengths, without which nothing jumped"
                     : "");
}

/// What the sentence is about.
std::string opening(const Finding& f) {
  switch (f.kind) {
    case FindingKind::kTouchScatter:
      return "touch scatter (chi^2)";
    case FindingKind::kDuplicateTouches:
      return "duplicate touches";
    case FindingKind::kManyOutliers:
    case FindingKind::kOutliersOfTarget:
      return "outliers";
    case FindingKind::kCheckTouches:
      return "check touches";
    case FindingKind::kGrossCheckTouches:
      return "gross check touches";
    case FindingKind::kNoCheckTouches:
      return "no check touches";
    case FindingKind::kUnseenPlace:
      return "unseen place";
    case FindingKind::kUnseenNotJudged:
      return "not judged";
    case FindingKind::kTemperature:
      return "temperature";
    case FindingKind::kModelError:
    case FindingKind::kStillWithModelError:
      return "model error";
    case FindingKind::kTooFewTouches:
      return "too few touches";
    case FindingKind::kRank:
      return "undetermined geometry";
    case FindingKind::kTooFewDirections:
    case FindingKind::kAllLeftOut:
      return "too few directions";
    case FindingKind::kNotTouched:
      return "not touched";
    case FindingKind::kCertifiedLength:
    case FindingKind::kCertifiedTwice:
      return "certified length " + length_of(f);
    case FindingKind::kArtefactSize:
      if (has(f, "longer")) return f.about.name.empty() ? "all wires" : "wire " + f.about.name;
      return "diameter of " + f.about.name;
    case FindingKind::kStatedCentre:
    case FindingKind::kExchangedCentres:
      return "stated centre";
    case FindingKind::kNegativeCompliance:
      return "negative compliance";
    case FindingKind::kArmScale:
      return "scale";
    case FindingKind::kOffNominal:
      return f.withholds() ? "far from the drawing" : "beyond tolerance";
    case FindingKind::kEffectiveRadius:
      return f.withholds() ? "effective radius" : "radius offset";
    case FindingKind::kScaleByLengths:
    case FindingKind::kScaleByReadings:
    case FindingKind::kScaleByNothing:
      return "scope";
    case FindingKind::kUncheckedReadings:
    case FindingKind::kUncheckedLengths:
    case FindingKind::kUncheckedLength:
      return "unchecked scale";
    case FindingKind::kRequired:
      return "required accuracy";
    case FindingKind::kNoGain:
      return "gain too small";
    case FindingKind::kGain:
      return "accuracy";
    case FindingKind::kChanged:
      return "changed since the last one";
    case FindingKind::kChangeAccepted:
    case FindingKind::kUnchanged:
    case FindingKind::kNotCompared:
      return "since the last one";
    case FindingKind::kNotIdentified:
      return "not identified";
    case FindingKind::kLikelyCause:
      return "likely cause";
    case FindingKind::kMovedTarget:
      return is_set(f, "or_lengths")
                 ? "moved target, or wrong certified lengths (without them nothing moved)"
                 : "moved target";
    case FindingKind::kJumped:
      if (f.parts.size() != 1) return "something moved in the middle of the session";
      return f.parts.front().about.of == Subject::Of::kTool ? "knocked tool" : "slipped joint";
    case FindingKind::kReferenceMethod:
    case FindingKind::kRecorded:
      return {};
  }
  return {};
}

}  // namespace

std::string sentence(const Finding& f) {
  switch (f.kind) {
    case FindingKind::kTouchScatter:
      return touch_scatter(f);
    case FindingKind::kDuplicateTouches:
      return duplicate_touches(f);
    case FindingKind::kManyOutliers:
      return many_outliers(f);
    case FindingKind::kOutliersOfTarget:
      return outliers_of_target(f);
    case FindingKind::kCheckTouches:
      return check_touches(f);
    case FindingKind::kGrossCheckTouches:
      return gross_check_touches(f);
    case FindingKind::kNoCheckTouches:
      return "the residuals are of the fit itself";
    case FindingKind::kUnseenPlace:
      return unseen_place(f);
    case FindingKind::kUnseenNotJudged:
      return fmt::format("{}, which has no fit touch: {}", f.about.name, f.text);
    case FindingKind::kTemperature:
      return temperature(f);
    case FindingKind::kModelError:
      return model_error(f);
    case FindingKind::kTooFewTouches:
      return too_few_touches(f);
    case FindingKind::kRank:
      return rank(f);
    case FindingKind::kTooFewDirections:
      return too_few_directions(f);
    case FindingKind::kAllLeftOut:
      return "all touches of " + f.about.name + " were left out. " + again(f);
    case FindingKind::kNotTouched:
      return not_touched(f);
    case FindingKind::kCertifiedLength:
      return certified_length(f);
    case FindingKind::kCertifiedTwice:
      return certified_twice(f);
    case FindingKind::kArtefactSize:
      return artefact_size(f);
    case FindingKind::kStatedCentre:
      return stated_centre(f);
    case FindingKind::kExchangedCentres:
      return exchanged_centres(f);
    case FindingKind::kNegativeCompliance:
      return negative_compliance(f);
    case FindingKind::kArmScale:
      return arm_scale(f);
    case FindingKind::kOffNominal:
      return off_nominal(f);
    case FindingKind::kEffectiveRadius:
      return effective_radius(f);
    case FindingKind::kScaleByLengths:
      return scale_by_lengths(f);
    case FindingKind::kScaleByReadings:
      return scale_by_readings(f);
    case FindingKind::kScaleByNothing:
      return scale_by_nothing(f);
    case FindingKind::kUncheckedReadings:
      return unchecked_readings(f);
    case FindingKind::kUncheckedLengths:
      return unchecked_lengths(f);
    case FindingKind::kUncheckedLength:
      return unchecked_length(f);
    case FindingKind::kRequired:
      return required(f);
    case FindingKind::kNoGain:
      return no_gain(f);
    case FindingKind::kGain:
      return gain(f);
    case FindingKind::kChanged:
      return changed(f);
    case FindingKind::kChangeAccepted:
      return change_accepted(f);
    case FindingKind::kUnchanged:
      return unchanged(f);
    case FindingKind::kNotCompared:
      return not_compared(f);
    case FindingKind::kMovedTarget:
      return moved_target(f);
    case FindingKind::kJumped:
      return jumped(f);
    case FindingKind::kStillWithModelError:
      return "with it estimated, too, there is " + f.text;
    case FindingKind::kReferenceMethod:
      return "reference method, for comparison only";
    case FindingKind::kNotIdentified:
    case FindingKind::kLikelyCause:
    case FindingKind::kRecorded:
      return f.text;
  }
  return {};
}

std::string words(const Finding& f) {
  const std::string about = opening(f);
  return about.empty() ? sentence(f) : about + ": " + sentence(f);
}

std::vector<std::string> words(const std::vector<Finding>& findings) {
  std::vector<std::string> all;
  for (const Finding& one : findings) all.push_back(words(one));
  return all;
}

}  // namespace cellcal::calib
