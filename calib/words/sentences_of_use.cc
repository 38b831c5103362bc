// What findings say of what the result is good for, and of what it was before.

#include <fmt/format.h>

#include "calib/words/sentences.h"

namespace cellcal::calib::sentences {

namespace {

/// How far this calibration is from the last one, which `text` names.
std::string apart(const Finding& f) {
  return fmt::format("{:.3f} mm between the tips of this calibration and of {}, in the mean {}",
                     of(f, "apart"), f.text, where(f));
}

}  // namespace

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

}  // namespace cellcal::calib::sentences
