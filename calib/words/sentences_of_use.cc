// What findings say of what the result is good for, and of what it was before.

#include <fmt/format.h>

#include "calib/words/sentences.h"

namespace cellcal::calib::sentences {

namespace {

/// From the last calibration, which `text` names, to this one.
std::string tcp_change(const Finding& f) {
  return fmt::format("{:.3f} mm mean TCP change since {}, {} (expected {:.3f} mm, ratio {:.1f})",
                     of(f, "apart"), f.text, where(f), of(f, "expected"), of(f, "ratio"));
}

/// "3.48 ± 0.09 mm"; of an earlier version, without.
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
