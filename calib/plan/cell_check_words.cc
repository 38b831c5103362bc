// Sentences of cell file faults: the number first, then the remedy.

#include <fmt/format.h>

#include <cmath>

#include "calib/plan/cell_check.h"

namespace cellcal::calib {

namespace {

using Kind = CellFaultKind;

double mm(double metres) { return metres * 1e3; }

std::string length_words(const CellFault& f) {
  return fmt::format(
      "certified length {}-{}: {:.3f} mm stated, {:.1f} +- {:.1f} mm between the stated centres "
      "({:.0f} sigma)",
      f.ids[0], f.ids[1], mm(f.a_m), mm(f.b_m), mm(f.sigma_m), std::abs(f.a_m - f.b_m) / f.sigma_m);
}

std::string words_of(const DescriptionMistake& mistake) {
  switch (mistake.kind) {
    case DescriptionMistake::Kind::kSign:
      return fmt::format("sign = {} of {}", mistake.sign, mistake.joint);
    case DescriptionMistake::Kind::kOffset:
      return fmt::format("offset_deg = {:.0f} of {}", mistake.offset_deg, mistake.joint);
    case DescriptionMistake::Kind::kToolAxis:
      break;
  }
  return fmt::format("xyz_mm = [{:g}, {:g}, {:g}] of [tool]", mm(mistake.tcp_m.x()),
                     mm(mistake.tcp_m.y()), mm(mistake.tcp_m.z()));
}

std::string mistake_words(const CellFault& f) {
  if (f.mistakes.empty())
    return "No arm can rest like that: correct robot file, [tool] and floor_mm";
  std::string all;
  for (const DescriptionMistake& one : f.mistakes)
    all += (all.empty() ? "" : ", or ") + words_of(one);
  if (f.more > 0) all += fmt::format(", or {} more", f.more);
  return "Likely mistake in the robot file or [tool]: " + all + " would fit";
}

}  // namespace

std::string found_words(const CellFault& f) {
  switch (f.kind) {
    case Kind::kLength:
    case Kind::kSurfaces:
    case Kind::kDecimalPoint:
      return length_words(f);
    case Kind::kCentresExchanged:
      return fmt::format(
          "the centres of {} and {} are exchanged: the other way round they fit all "
          "certified lengths",
          f.ids[0], f.ids[1]);
    case Kind::kCentre:
      return fmt::format(
          "centre of {}: up to {:.1f} mm off certified lengths that end there ({:.0f} "
          "sigma), and all others fit",
          f.ids[0], mm(f.a_m), f.a_m / f.sigma_m);
    case Kind::kLengthTooShort:
      return fmt::format("certified length {}-{}: {:.3f} mm, less than the {:.1f} mm of both radii",
                         f.ids[0], f.ids[1], mm(f.a_m), mm(f.b_m));
    case Kind::kTriangle:
      return fmt::format(
          "certified length {0}-{1}: {3:.3f} mm, longer than {0}-{2} and {2}-{1} "
          "together ({4:.3f} mm)",
          f.ids[0], f.ids[1], f.ids[2], mm(f.a_m), mm(f.b_m));
    case Kind::kOverlap:
      return fmt::format("spheres {} and {}: {:.1f} mm between centres, {:.1f} mm of both radii",
                         f.ids[0], f.ids[1], mm(f.a_m), mm(f.b_m));
    case Kind::kInside:
      return fmt::format("sphere {}: {:.1f} mm deep in {}", f.ids[0], mm(f.a_m), f.ids[1]);
    case Kind::kOutOfReach:
      return fmt::format(
          "target {}: {:.0f} mm from the base's origin, and no posture inside the "
          "joint limits touches it",
          f.ids[0], mm(f.a_m));
    case Kind::kCentreInMetres:
      return fmt::format("target {}: {:.3f} mm from the base's origin", f.ids[0], mm(f.a_m));
    case Kind::kToolInMetres:
      return fmt::format("tool: the tip lies {:.3f} mm from the flange", mm(f.a_m));
    case Kind::kDiameterInMetres:
      return fmt::format("sphere {}: {:.4f} mm of diameter", f.ids[0], mm(f.a_m));
    case Kind::kTouchSigma:
      return fmt::format("touch: sigma_mm = {:g}", mm(f.a_m));
    case Kind::kToolTooHeavy:
      return fmt::format("tool: {:g} kg, limit {:g} kg (rated payload of the robot)", f.kg,
                         f.limit_kg);
    case Kind::kInColumn:
      return fmt::format(
          "{}: {:.0f} mm from the robot's axis A1, limit {:.0f} mm: the column is there", f.ids[0],
          mm(f.a_m), mm(f.b_m));
    case Kind::kLargeBall:
      return fmt::format(
          "tool: a ball of {:.1f} mm radius at the tip, limit {:.1f} mm (clearance of a plan)",
          mm(f.a_m), mm(f.b_m));
    case Kind::kShaftTouchesFirst:
      return fmt::format(
          "tool: {:.1f} mm from tip to shaft, at least {:.1f} mm needed: the shaft meets a sphere before the tip",
          mm(f.a_m), mm(f.b_m));
    case Kind::kShankTouchesFirst:
      return fmt::format(
          "tool: a ball of {:.1f} mm radius on a slim end of {:.1f} mm radius: the side meets a sphere before the ball",
          mm(f.a_m), mm(f.b_m));
    case Kind::kToolAcross:
      return fmt::format(
          "tool: the tip lies {:.0f} mm along the flange's Z axis and {:.0f} mm across it",
          mm(f.a_m), mm(f.b_m));
    case Kind::kDescription:
      return f.ids.empty() ? "arm: no posture inside the joint limits touches any target"
                           : fmt::format("arm: in every resting posture {}", f.ids[0]);
    case Kind::kGoal:
      return fmt::format(
          "required_mm = {:.3f}, a goal of {:.3f} mm leads to a mean error of about {:.3f} mm",
          mm(f.a_m), mm(f.b_m), mm(f.c_m));
    case Kind::kRequired:
      return fmt::format("required_mm = {:.3f}, the plan reaches {:.3f} mm", mm(f.a_m), mm(f.b_m));
  }
  return {};
}

std::string advice_words(const CellFault& f) {
  switch (f.kind) {
    case Kind::kLength:
      return "Compare the certificate and both centre_mm, in the robot's base frame";
    case Kind::kSurfaces:
      return "The difference is both radii: a certified length lies between centres, not surfaces";
    case Kind::kDecimalPoint:
      return fmt::format("Look at the decimal point: {:.3f} mm would fit", mm(f.c_m));
    case Kind::kCentresExchanged:
      return "Exchange their centre_mm, or their ids";
    case Kind::kCentre:
      return "Measure its centre_mm again, in the robot's base frame";
    case Kind::kLengthTooShort:
      return "A certified length lies between centres; look at unit and decimal point";
    case Kind::kTriangle:
      return "One of the three is wrong: compare the certificate";
    case Kind::kOverlap:
      return "Correct one centre_mm";
    case Kind::kInside:
      return "Correct its centre_mm, or place and size of what it is in";
    case Kind::kOutOfReach:
      return "Correct its centre_mm, place it nearer, or look at robot and [tool]";
    case Kind::kCentreInMetres:
      return "centre_mm may be in metres. State it in millimetres, in the robot's base frame";
    case Kind::kToolInMetres:
      return "xyz_mm of [tool] may be in metres. State it in millimetres";
    case Kind::kDiameterInMetres:
      return "diameter_mm may be in metres. State it in millimetres";
    case Kind::kTouchSigma:
      return "sigma_mm may be in another unit. State it in millimetres; 0.03 is usual";
    case Kind::kToolTooHeavy:
      return "Correct mass_kg of [tool] (kilograms), or use the file of the robot that carries it";
    case Kind::kInColumn:
      return "Correct its place and size, in the robot's base frame. A pedestal ends at the base";
    case Kind::kLargeBall:
      return "tip_radius_mm is the radius, not the diameter. Correct it, or use a smaller ball";
    case Kind::kShaftTouchesFirst:
      return "Correct tip_length_mm and radius_mm of [tool], or use a longer tip";
    case Kind::kShankTouchesFirst:
      return "Correct tip_radius_mm and tip_diameter_mm of [tool], or use a thinner shank";
    case Kind::kToolAcross:
      return "Compare xyz_mm of [tool] with the pendant's tool data: most tools point along Z";
    case Kind::kDescription:
      return mistake_words(f);
    case Kind::kGoal:
      return fmt::format("Ask for a goal of {:.3f} mm, or state a larger required_mm",
                         mm(f.a_m * f.b_m / f.c_m));
    case Kind::kRequired:
      return "Make more touches in more varied postures, or state a larger required_mm";
  }
  return {};
}

std::string words(const CellFault& fault) {
  return found_words(fault) + ". " + advice_words(fault);
}

}  // namespace cellcal::calib
