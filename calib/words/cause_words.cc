#include "calib/words/cause_words.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>
#include <vector>

#include "calib/words/sentences.h"

namespace cellcal::calib {

namespace {

using sentences::has, sentences::of;

std::string names_of(const Finding& f, const char* between) {
  std::vector<std::string> names;
  for (const FindingPart& part : f.parts) names.push_back(part.about.name);
  return fmt::format("{}", fmt::join(names, between));
}

/// A field of the robot file as it should be.
Quantity field_of(const FindingPart& part) {
  for (const Quantity& one : part.evidence)
    if (one.name != "stated") return one;
  return {};
}

/// "offset_deg of A2 0 instead of -90, sign of A4 -1 instead of 1"
std::string fields(const Finding& f) {
  std::vector<std::string> all;
  for (const FindingPart& part : f.parts)
    if (part.about.of == Subject::Of::kJoint)
      all.push_back(fmt::format("{} of {} {:.6g} instead of {:.6g}", field_of(part).name,
                                part.about.name, field_of(part).value,
                                value(part.evidence, "stated")));
  return fmt::format("{}", fmt::join(all, ", "));
}

std::string radians(const Finding& f) {
  return fmt::format(
      "no joint angle is above {:.1f} deg, and read as radians the touches make sense; give them in "
      "degrees",
      of(f, "largest"));
}

std::string mastering(const Finding& f) {
  return fmt::format(
      "with {:+.2f} deg added to all angles of {} the touches make sense; has it lost its mastering?",
      of(f, "add"), f.about.name);
}

/// Two that were swapped, found among the usual mistakes; otherwise one by one.
std::string target_names(const Finding& f) {
  if (f.parts.size() == 2 && !has(f, "mends"))
    return fmt::format("with {} swapped the touches make sense; check which is which",
                       names_of(f, " and "));
  std::string text;
  for (const FindingPart& part : f.parts)
    text += fmt::format("{} {} {} {}'s", text.empty() ? "with the touches of" : ", of",
                        part.about.name, text.empty() ? "taken for" : "for", part.about.other_end);
  return text + " all makes sense; check which is which";
}

std::string scattered_touches(const Finding& f) {
  const double others = of(f, "others");
  return fmt::format(
      "the touches of {} lie all over, no more than {:.0f} of {:.0f} together{}; check the target "
      "column, the order of the angles' columns and the robot file, and whether it was moved",
      f.about.name, of(f, "together"), of(f, "touches"),
      others > 0.0 ? fmt::format(" (and so do those of {:.0f} other target{})", others,
                                 others == 1.0 ? "" : "s")
                   : "");
}

std::string readings_unit(const Finding& f) {
  constexpr double kMetre = 1000.0;  // [mm]
  const double mm = of(f, "unit");
  return fmt::format(
      "with the readings of {} taken as {} the touches make sense; give them in millimetres",
      names_of(f, ", "),
      mm == kMetre ? "metres"
      : mm < 1.0   ? "micrometres"
                   : "inches");
}

std::string readings_handedness(const Finding& f) {
  return fmt::format(
      "with one axis of the readings of {} turned about the touches make sense; has one of the "
      "columns the wrong sign, or are two of them exchanged?",
      names_of(f, ", "));
}

std::string moved(const Finding& f) {
  return fmt::format(
      "{} seems to have moved by {:.2f} mm at about touch {}; fix it, and touch again",
      f.about.name, of(f, "shift"), f.about.touch.value_or(0) + 1);
}

std::string tool_unit(const Finding& f) {
  return fmt::format(
      "the tool is {:.3f} mm long, and read as metres the touches make sense; give it in "
      "millimetres",
      of(f, "reach"));
}

std::string tool_tip(const Finding& f) {
  return fmt::format(
      "with the tool's tip moved by about ({:.1f}, {:.1f}, {:.1f}) mm on the flange the touches make "
      "sense; is it the tool of the cell file{}?",
      of(f, "x"), of(f, "y"), of(f, "z"),
      has(f, "turn") ? ", and has the last axis its mastering" : "");
}

std::string dimension(const Finding& f) {
  const FindingPart part = f.parts.empty() ? FindingPart{} : f.parts.front();
  return fmt::format(
      "with {} of {} {:.1f} instead of {:.1f} the touches make sense; check it in the robot file{}",
      field_of(part).name, part.about.name, field_of(part).value, value(part.evidence, "stated"),
      has(f, "last") ? ", and the tool's length" : "");
}

std::string other_robot(const Finding& f) {
  const std::string stated = f.parts.empty() ? std::string() : f.parts.front().about.name;
  return fmt::format(
      "with the robot file {} ({}) the touches make sense, and not with {}; {}", f.about.name,
      f.about.other_end,
      stated == f.about.other_end ? "the cell's own of that name" : "that of " + stated,
      f.parts.size() > 1 || of(f, "differences") == 0.0
          ? fmt::format("it has {}; check these", fields(f))
          : "which arm is it?");
}

std::string gravity(const Finding& f) {
  std::string along;
  for (const char* axis : {"x", "y", "z"})
    if (of(f, axis) != 0.0) along = (of(f, axis) < 0.0 ? "-" : "+") + std::string(axis);
  return fmt::format(
      "with gravity along {} of the base the touches make sense; check how the arm is mounted, and "
      "gravity in the robot file",
      along);
}

std::string all_diameters(const Finding& f) {
  return fmt::format(
      "with diameters {:+.2f} mm off what the cell file states the touches make sense; check "
      "diameter_mm and tip_radius_mm",
      of(f, "off"));
}

std::string diameter(const Finding& f) {
  return fmt::format(
      "with the diameter of {} {:+.2f} mm off what the cell file states the touches make sense; "
      "check its diameter_mm",
      f.about.name, of(f, "off"));
}

std::string artefact_size(const Finding& f) {
  std::vector<std::string> sizes;
  bool spheres = false;
  for (const FindingPart& part : f.parts) {
    const Quantity* diameter = find(part.evidence, "measured");
    const Quantity* longer = find(part.evidence, "longer");
    spheres = spheres || diameter != nullptr;
    if (diameter != nullptr)
      sizes.push_back(fmt::format("the diameter of {} {:.2f} +- {:.2f} mm instead of {:.3f} mm",
                                  part.about.name, diameter->value, diameter->sigma,
                                  value(part.evidence, "stated")));
    else if (longer != nullptr)
      sizes.push_back(fmt::format("all readings of {} {:+.2f} +- {:.2f} mm longer",
                                  part.about.name.empty() ? "all wires" : part.about.name,
                                  longer->value, longer->sigma));
  }
  return fmt::format("with {} everything makes sense; check {}", fmt::join(sizes, ", or with "),
                     !spheres ? "where the wire reads zero"
                     : has(f, "lengths")
                         ? "diameter_mm, that it is clean, and its certified lengths"
                         : "diameter_mm, and that it is clean");
}

std::string certified_length(const Finding& f) {
  const Quantity* apart = find(f.evidence, "measured");
  return fmt::format(
      "without the certified length of {} and {} everything makes sense, and {}; check it, and "
      "whether one of them was moved since it was measured",
      f.about.name, f.about.other_end,
      apart == nullptr ? "nothing tells of it"
                       : fmt::format("they lie {:.2f} +- {:.2f} mm apart instead of {:.3f} mm",
                                     apart->value, apart->sigma, of(f, "stated")));
}

std::string exchanged_lengths(const Finding& f) {
  std::vector<std::string> lengths;
  for (const FindingPart& part : f.parts)
    lengths.push_back(part.about.name + "-" + part.about.other_end);
  return fmt::format(
      "with the certified lengths of {} exchanged the touches make sense; check which is which",
      fmt::join(lengths, " and "));
}

std::string lengths_of_target(const Finding& f) {
  return fmt::format(
      "without the {:.0f} certified lengths of {} everything makes sense; does it stand where it "
      "stood when they were measured?",
      of(f, "lengths"), f.about.name);
}

std::string stated_centre(const Finding& f) {
  if (!has(f, "off"))
    return fmt::format(
        "with {} not held where the cell file states it everything makes sense; check its "
        "centre_mm, or state a larger centre_sigma_mm",
        f.about.name);
  return fmt::format(
      "with {} {:.1f} mm from where the cell file states it the touches make sense; check its "
      "centre_mm, or state a larger centre_sigma_mm",
      f.about.name, of(f, "off"));
}

std::string all_centres(const Finding& f) {
  return fmt::format(
      "with no centre held where the cell file states it {}, or state a larger centre_sigma_mm",
      has(f, "mends") ? "everything makes sense; check centre_mm"
                      : "the touches make sense; check centre_mm (of the arm's base frame?)");
}

}  // namespace

std::string cause_words(const Finding& f) {
  if (!f.cause) return f.text;
  switch (*f.cause) {
    case LikelyCause::kRadians:
      return radians(f);
    case LikelyCause::kAxisSign:
      return fmt::format(
          "with {} turning the other way the touches make sense; check its sign in the robot file",
          f.about.name);
    case LikelyCause::kMastering:
      return mastering(f);
    case LikelyCause::kExchangedColumns:
      return fmt::format(
          "with the angles of {} exchanged the touches make sense; check the columns",
          names_of(f, " and "));
    case LikelyCause::kTargetNames:
      return target_names(f);
    case LikelyCause::kScatteredTouches:
      return scattered_touches(f);
    case LikelyCause::kReadingsUnit:
      return readings_unit(f);
    case LikelyCause::kReadingsHandedness:
      return readings_handedness(f);
    case LikelyCause::kMoved:
      return moved(f);
    case LikelyCause::kToolUnit:
      return tool_unit(f);
    case LikelyCause::kToolTip:
      return tool_tip(f);
    case LikelyCause::kDimension:
      return dimension(f);
    case LikelyCause::kOtherRobot:
      return other_robot(f);
    case LikelyCause::kAxisConvention:
      return fmt::format("with {} the touches make sense; check the robot file", fields(f));
    case LikelyCause::kGravity:
      return gravity(f);
    case LikelyCause::kAllDiameters:
      return all_diameters(f);
    case LikelyCause::kDiameter:
      return diameter(f);
    case LikelyCause::kArtefactSize:
      return artefact_size(f);
    case LikelyCause::kCertifiedLength:
      return certified_length(f);
    case LikelyCause::kExchangedLengths:
      return exchanged_lengths(f);
    case LikelyCause::kLengthsOfTarget:
      return lengths_of_target(f);
    case LikelyCause::kAllLengths:
      return "without any certified length everything makes sense; more than one of them is wrong, "
             "or several targets stand elsewhere than when they were measured";
    case LikelyCause::kStatedCentre:
      return stated_centre(f);
    case LikelyCause::kAllCentres:
      return all_centres(f);
  }
  return {};
}

}  // namespace cellcal::calib
