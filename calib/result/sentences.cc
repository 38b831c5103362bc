// Sentences of changes during a session.

#include "calib/result/sentences.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace cellcal::calib::sentences {

namespace {

/// Number of items named; the rest is counted.
constexpr std::size_t kInWords = 3;

}  // namespace

double of(const Finding& f, const char* name) { return value(f.evidence, name); }

double sigma_of(const Finding& f, const char* name) {
  const Quantity* its = find(f.evidence, name);
  return its == nullptr ? 0.0 : its->sigma;
}

bool has(const Finding& f, const char* name) { return find(f.evidence, name) != nullptr; }

bool is_set(const Finding& f, const char* name) { return has(f, name) && of(f, name) != 0.0; }

bool is_one(const Finding& f, const char* name) { return of(f, name) == 1.0; }

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

std::string reading_off(const Quantity& longer) {
  return fmt::format("{:.2f} +- {:.2f} mm too {}", std::abs(longer.value), longer.sigma,
                     longer.value < 0.0 ? "long" : "short");
}

namespace {

/// "0.52 +- 0.03 mm (+0.10, -0.50, +0.11)"
std::string shift(const std::vector<Quantity>& evidence) {
  const Quantity* by = find(evidence, "shift");
  return fmt::format("{:.2f} +- {:.2f} mm ({:+.2f}, {:+.2f}, {:+.2f})",
                     by == nullptr ? 0.0 : by->value, by == nullptr ? 0.0 : by->sigma,
                     value(evidence, "x"), value(evidence, "y"), value(evidence, "z"));
}

std::string jump_size(const FindingPart& one) {
  if (one.about.of != Subject::Of::kJoint) return shift(one.evidence);
  const Quantity* by = find(one.evidence, "turn");
  return fmt::format("{:+.3f} +- {:.3f} deg", by == nullptr ? 0.0 : by->value,
                     by == nullptr ? 0.0 : by->sigma);
}

/// "zero of A3 jumped by +0.050 +- 0.004 deg after about touch 50"
std::string jump(const FindingPart& one) {
  const std::string at = "after about " + touch_of(one.about);
  if (one.about.of == Subject::Of::kJoint)
    return fmt::format("zero of {} jumped by {} {}", one.about.name, jump_size(one), at);
  if (one.about.of == Subject::Of::kTool)
    return fmt::format("tool tip moved by {} in the flange frame {}", jump_size(one), at);
  return fmt::format("{} moved by {} {}", one.about.name, jump_size(one), at);
}

std::string one_jump(const Finding& f, const FindingPart& one) {
  const double touches = of(f, "touches");
  if (one.about.of == Subject::Of::kTool)
    return fmt::format("{} of {:.0f}. Check its fastening and calibrate again", jump(one), touches);
  // Joint with the same effect on all touches.
  const char* or_else = "";
  if (is_set(f, "first_joint"))
    or_else = " (or the arm's foot, or all targets together, turned by as much)";
  else if (is_set(f, "last_joint"))
    or_else = " (or the tool turned on the flange by as much)";
  return fmt::format(
      "{} of {:.0f}{}. Check belt, coupling and brake, master the joint and calibrate again",
      jump(one), touches, or_else);
}

/// Added if the change is significant only with the certified lengths.
const char* or_lengths(const Finding& f) {
  return is_set(f, "or_lengths")
             ? ". Or correct the certified lengths: without them the change is not significant"
             : "";
}

}  // namespace

std::string moved_target(const Finding& f) {
  return fmt::format("{} moved by {} after {}. Clamp it and calibrate again{}", f.about.name,
                     shift(f.evidence), touch_of(f.about), or_lengths(f));
}

std::string jumped(const Finding& f) {
  if (f.parts.size() == 1) return one_jump(f, f.parts.front()) + or_lengths(f);
  std::string causes;
  for (const FindingPart& one : f.parts) causes += (causes.empty() ? "" : ", or ") + jump(one);
  return fmt::format(
      "{:.0f} touches fit more than one cause: {}. Check each, then calibrate again{}",
      of(f, "touches"), causes, or_lengths(f));
}

// Sentences of an update: the change since the last calibration, or the reason for a full session.

namespace {

constexpr double kUpdateCoverage = 2.0;
constexpr const char* kFullSession = "Run a full session: 'cellcal run --cell CELL'";

/// The change found, with its size.
std::string change(const Subject& about, const std::vector<Quantity>& evidence) {
  const auto quantity = [&](const char* name, const char* form) -> std::string {
    const Quantity* q = find(evidence, name);
    return q == nullptr
               ? std::string()
               : fmt::format(fmt::runtime(form), q->value, kUpdateCoverage * q->sigma, q->unit);
  };
  const std::string shift = quantity("shift", "{:.2f} +- {:.2f} {} (k=2)");
  if (about.of == Subject::Of::kTool) return fmt::format("tool shifted by {}", shift);
  if (about.of == Subject::Of::kTarget) return fmt::format("{} moved by {}", about.name, shift);
  if (about.of == Subject::Of::kJoint)
    return fmt::format("zero of {} off by {}", about.name,
                       quantity("turn", "{:+.3f} +- {:.3f} {} (k=2)"));
  if (const std::string growth = quantity("growth", "{:+.0f} +- {:.0f} {} (k=2)"); !growth.empty())
    return fmt::format("whole arm grown by {}", growth);
  if (const std::string off = quantity("off", "{:+.2f} +- {:.2f} {} (k=2)"); !off.empty())
    return fmt::format("one touch alone {} off", off);
  return "nothing changed";
}

/// Further actions required besides the update.
const char* besides(const Finding& f) {
  switch (f.about.of) {
    case Subject::Of::kTool:
      return ". Check the tool's fastening";
    case Subject::Of::kTarget:
      return ". Clamp its stand and have its certified lengths measured again";
    case Subject::Of::kJoint:
      return ". Check its mastering, belt, coupling and brake";
    default:
      return "";
  }
}

/// "probability 99.0 %, 8 touches"
std::string support(const Finding& f) {
  return fmt::format("probability {:.1f} %, {:.0f} touches", of(f, "probability"),
                     of(f, "touches"));
}

std::string accuracy(const Finding& f) {
  return fmt::format("{:.3f} mm predicted over the workspace, {:.3f} mm before the change",
                     of(f, "reached"), of(f, "before"));
}

}  // namespace

std::string updated(const Finding& f) {
  return fmt::format("{}, {} on top of {}; {}{}", change(f.about, f.evidence), support(f), f.text,
                     accuracy(f), besides(f));
}

std::string update_not_needed(const Finding& f) {
  return fmt::format("{}, {}; {} holds. Keep that calibration", change(f.about, f.evidence),
                     support(f), f.text);
}

std::string update_contradicted(const Finding& f) {
  const std::string second =
      f.parts.empty() ? std::string()
                      : "; next likely: " + change(f.parts.front().about, f.parts.front().evidence);
  return fmt::format("more than one change found ({:.0f} touches): {}{}. {}", of(f, "touches"),
                     change(f.about, f.evidence), second, kFullSession);
}

std::string update_not_resolved(const Finding& f) {
  return fmt::format("{}, {}: not resolved; {}. {}", change(f.about, f.evidence), support(f),
                     accuracy(f), kFullSession);
}

std::string update_not_found(const Finding& f) {
  return fmt::format(
      "{} not found at the place from {}. "
      "Check stand and tool; then run a full session: 'cellcal run --cell CELL --find'",
      f.parts.empty() ? "a sphere was"
                      : list(f, [](const FindingPart& one) { return one.about.name; }) +
                            (f.parts.size() == 1 ? " was" : " were"),
      f.text);
}

std::string update_too_few(const Finding& f) {
  return fmt::format("{:.0f} touches are too few. Clean tip and spheres and try again",
                     of(f, "touches"));
}

// Sentences on the use of the result, and on the previous state.

namespace {

/// From the last calibration, named by `text`, to this one.
std::string tcp_change(const Finding& f) {
  return fmt::format("{:.3f} mm mean TCP change since {}, {} (expected {:.3f} mm, ratio {:.1f})",
                     of(f, "apart"), f.text, where(f), of(f, "expected"), of(f, "ratio"));
}

/// "3.48 ± 0.09 mm"; without uncertainty from earlier versions.
std::string nominal_words(const Finding& f) {
  const double u = of(f, "nominal_u");
  return u > 0.0 ? fmt::format("{:.2f} ± {:.2f} mm", of(f, "nominal"), u)
                 : fmt::format("{:.2f} mm", of(f, "nominal"));
}

}  // namespace

std::string scale_by_lengths(const Finding& f) {
  const bool one = is_one(f, "lengths");
  return fmt::format(
      "{:.0f} certified length{} the scale, touched at both ends{}", of(f, "lengths"),
      one ? " holds" : "s hold",
      has(f, "unseen")
          ? fmt::format("; an error common to all is detectable above {:.2f} %", of(f, "unseen"))
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
      "{}: only the {} the scale, and the result is valid near the targets only. {}",
      !is_set(f, "lengths") ? "no certified length was touched"
      : loose && !is_set(f, "lengths_with_held_ends")
          ? "the touches do not determine both ends of any certified length"
          : "scale uncertainty of all certified lengths together above 0.5 mm per metre",
      is_set(f, "spheres") ? "size of the spheres holds" : "tolerances of the arm hold",
      loose ? "Touch each target from more sides"
      : is_set(f, "centres")
          ? "Touch two targets at a certified distance"
          : "Add two targets with centres at a certified distance (spheres, points), or readings "
            "of a tracker or a long wire");
}

std::string scope_of_touches(const Finding& f) {
  return fmt::format(
      "{:.2f} mm predicted over the workspace, above the limit; the result is valid near the touched "
      "places only ({:.2f} mm). Touch over more of the workspace to extend it",
      of(f, "workspace_predicted"), of(f, "predicted"));
}

std::string unchecked_readings(const Finding& f) {
  return fmt::format(
      "errors below {:.2f} % of these readings are not detectable, and scale all lengths of the "
      "arm. Certify a length between touched targets",
      of(f, "unseen"));
}

std::string unchecked_lengths(const Finding& f) {
  return fmt::format(
      "errors below {:.1f} mm of certified length {}, the best checked of {:.0f}, are not "
      "detectable. Make more touches of each target",
      of(f, "unseen"), length_of(f), of(f, "lengths"));
}

std::string unchecked_length(const Finding& f) {
  return fmt::format(
      "errors below {:.1f} mm of certified length {} ({:.3f} mm) are not detectable, and scale all "
      "lengths of the arm. Certify a second length between touched targets, or have this one "
      "measured again",
      of(f, "unseen"), length_of(f), of(f, "certified"));
}

std::string required(const Finding& f) {
  return fmt::format(
      "{:.2f} mm predicted {}, {:.2f} mm {}. "
      "Make more touches in more varied postures, or state a larger required_mm",
      of(f, "predicted"), where(f), of(f, "required"),
      is_set(f, "required_is_stated") ? "required by the cell file (required_mm)"
                                      : "allowed (required_mm not stated)");
}

std::string no_gain(const Finding& f) {
  return fmt::format(
      "{:.2f} mm predicted {}, {} with the nominal arm ({:.0f} %, limit {:.0f} %). "
      "Make more touches in more varied postures",
      of(f, "predicted"), where(f), nominal_words(f), of(f, "of_nominal"),
      of(f, "most_of_nominal"));
}

std::string controller_model(const Finding& f) {
  return fmt::format(
      "{:.2f} mm from the robot file at {}, over {:.0f} postures with $TOOL and $BASE estimated: "
      "another robot type, or absolute accuracy is active ($ABS_ACCUR). Compare the type plate with "
      "the robot file. The calibration holds for joint angles; 'cellcal correct' refuses programs",
      of(f, "difference"), f.text, of(f, "postures"));
}

std::string gain(const Finding& f) {
  return fmt::format(
      "{:.2f} mm predicted {}, {} with the nominal arm ({:.0f} %); {:.2f} mm {}",
      of(f, "predicted"), where(f), nominal_words(f), of(f, "of_nominal"), of(f, "required"),
      is_set(f, "required_is_stated") ? "required" : "allowed (required_mm not stated)");
}

std::string changed(const Finding& f) {
  return fmt::format(
      "{}. If the arm was hit, repaired or mastered, or its tool changed, accept the change "
      "(--accept-change). Otherwise look for what is loose",
      tcp_change(f));
}

std::string change_accepted(const Finding& f) { return tcp_change(f) + "; change accepted"; }

std::string unchanged(const Finding& f) { return tcp_change(f); }

std::string not_compared(const Finding& f) {
  return fmt::format(
      "{} has another nominal arm or tool, or one of the two calibrations predicts no error here",
      f.text);
}

}  // namespace cellcal::calib::sentences
