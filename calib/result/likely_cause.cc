#include "calib/result/likely_cause.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <string>
#include <vector>

#include "calib/model/enum_table.h"
#include "calib/result/finding.h"
#include "calib/result/sentences.h"

namespace cellcal::calib {

namespace {

constexpr EnumNames<LikelyCause> kCauses{{{LikelyCause::kRadians, "radians"},
                                          {LikelyCause::kAxisSign, "axis_sign"},
                                          {LikelyCause::kMastering, "mastering"},
                                          {LikelyCause::kExchangedColumns, "exchanged_columns"},
                                          {LikelyCause::kTargetNames, "target_names"},
                                          {LikelyCause::kScatteredTouches, "scattered_touches"},
                                          {LikelyCause::kReadingsUnit, "readings_unit"},
                                          {LikelyCause::kReadingsHandedness, "readings_handedness"},
                                          {LikelyCause::kMoved, "moved"},
                                          {LikelyCause::kToolUnit, "tool_unit"},
                                          {LikelyCause::kToolTip, "tool_tip"},
                                          {LikelyCause::kDimension, "dimension"},
                                          {LikelyCause::kOtherRobot, "other_robot"},
                                          {LikelyCause::kAxisConvention, "axis_convention"},
                                          {LikelyCause::kGravity, "gravity"},
                                          {LikelyCause::kAllDiameters, "all_diameters"},
                                          {LikelyCause::kDiameter, "diameter"},
                                          {LikelyCause::kArtefactSize, "artefact_size"},
                                          {LikelyCause::kCertifiedLength, "certified_length"},
                                          {LikelyCause::kExchangedLengths, "exchanged_lengths"},
                                          {LikelyCause::kLengthsOfTarget, "lengths_of_target"},
                                          {LikelyCause::kAllLengths, "all_lengths"},
                                          {LikelyCause::kStatedCentre, "stated_centre"},
                                          {LikelyCause::kAllCentres, "all_centres"}}};

}  // namespace

const char* to_string(LikelyCause cause) { return kCauses[cause]; }
std::optional<LikelyCause> likely_cause(const std::string& name) { return kCauses.key_of(name); }

namespace {

using sentences::has, sentences::of;

std::string names_of(const Finding& f, const char* between) {
  std::vector<std::string> names;
  for (const FindingPart& part : f.parts) names.push_back(part.about.name);
  return fmt::format("{}", fmt::join(names, between));
}

/// Corrected value of a field of the robot file.
Quantity field_of(const FindingPart& part) {
  for (const Quantity& one : part.evidence)
    if (one.name != "stated") return one;
  return {};
}

/// "offset_deg of A2: -90 deg stated, 0 deg fits; sign of A4: 1 stated, -1 fits"
std::string fields(const Finding& f) {
  std::vector<std::string> all;
  for (const FindingPart& part : f.parts) {
    if (part.about.of != Subject::Of::kJoint) continue;
    const Quantity fits = field_of(part);
    const std::string unit = fits.unit.empty() ? "" : " " + fits.unit;
    all.push_back(fmt::format("{} of {}: {:.6g}{} stated, {:.6g}{} fits", fits.name,
                              part.about.name, value(part.evidence, "stated"), unit, fits.value,
                              unit));
  }
  return fmt::format("{}", fmt::join(all, "; "));
}

std::string radians(const Finding& f) {
  return fmt::format(
      "largest joint angle {:.1f} deg: the angles are in radians. Give them in degrees",
      of(f, "largest"));
}

std::string mastering(const Finding& f) {
  return fmt::format("zero of {} off by {:+.2f} deg (true minus read angle). Check its mastering",
                     f.about.name, of(f, "add"));
}

/// Two exchanged targets; for more, each with the one that its touches belong to.
std::string target_names(const Finding& f) {
  if (f.parts.size() == 2)
    return fmt::format("touches of {} are exchanged. Correct their target names",
                       names_of(f, " and "));
  std::vector<std::string> fit;
  for (const FindingPart& part : f.parts)
    fit.push_back(fmt::format("touches of {} fit {}", part.about.name, part.about.other_end));
  return fmt::format("{}. Correct their target names", fmt::join(fit, ", "));
}

std::string scattered_touches(const Finding& f) {
  const double others = of(f, "others");
  return fmt::format(
      "{}: at most {:.0f} of {:.0f} touches agree on one place{}. Check in this order: "
      "target column, order of the angle columns, robot file, whether {} was moved",
      f.about.name, of(f, "together"), of(f, "touches"),
      others > 0.0
          ? fmt::format(" ({:.0f} more target{} likewise)", others, others == 1.0 ? "" : "s")
          : "",
      f.about.name);
}

std::string readings_unit(const Finding& f) {
  constexpr double kMetre = 1000.0;  // [mm]
  const double mm = of(f, "unit");
  return fmt::format("readings of {} are in {}. Give them in millimetres", names_of(f, ", "),
                     mm == kMetre ? "metres"
                     : mm < 1.0   ? "micrometres"
                                  : "inches");
}

std::string readings_handedness(const Finding& f) {
  return fmt::format(
      "readings of {} are left-handed. Check the columns for a wrong sign or an exchange",
      names_of(f, ", "));
}

std::string moved(const Finding& f) {
  return fmt::format("{} moved by {:.2f} mm at about touch {}. Clamp it and calibrate again",
                     f.about.name, of(f, "shift"), f.about.touch.value_or(0) + 1);
}

std::string tool_unit(const Finding& f) {
  return fmt::format("tool length {:.3f} mm: given in metres. Give it in millimetres",
                     of(f, "reach"));
}

std::string tool_tip(const Finding& f) {
  return fmt::format(
      "tool tip off by about ({:.1f}, {:.1f}, {:.1f}) mm in the flange frame. "
      "Compare the tool with the cell file{}",
      of(f, "x"), of(f, "y"), of(f, "z"),
      has(f, "turn") ? ", and check the mastering of the last axis" : "");
}

std::string dimension(const Finding& f) {
  const FindingPart part = f.parts.empty() ? FindingPart{} : f.parts.front();
  return fmt::format("{} of {}: {:.1f} mm stated, {:.1f} mm fits. Check the robot file{}",
                     field_of(part).name, part.about.name, value(part.evidence, "stated"),
                     field_of(part).value, has(f, "last") ? " and the tool's length" : "");
}

std::string other_robot(const Finding& f) {
  const std::string stated = f.parts.empty() ? std::string() : f.parts.front().about.name;
  const std::string different = fields(f);
  return fmt::format(
      "robot file {} ({}) fits the touches, {} does not{}. Check the type plate of the arm",
      f.about.name, f.about.other_end,
      stated == f.about.other_end ? "the cell's own of that name" : "that of " + stated,
      different.empty() ? "" : " (" + different + ")");
}

std::string gravity(const Finding& f) {
  std::string along;
  for (const char* axis : {"x", "y", "z"})
    if (of(f, axis) != 0.0) along = (of(f, axis) < 0.0 ? "-" : "+") + std::string(axis);
  return fmt::format(
      "gravity acts along {} of the base. "
      "Check how the arm is mounted, and gravity in the robot file",
      along);
}

std::string all_diameters(const Finding& f) {
  return fmt::format("all diameters: {:+.2f} mm from stated. Check diameter_mm and tip_radius_mm",
                     of(f, "off"));
}

std::string diameter(const Finding& f) {
  return fmt::format("diameter of {}: {:+.2f} mm from stated. Check diameter_mm", f.about.name,
                     of(f, "off"));
}

std::string artefact_size(const Finding& f) {
  std::vector<std::string> sizes;
  bool spheres = false;
  for (const FindingPart& part : f.parts) {
    const Quantity* diameter = find(part.evidence, "measured");
    const Quantity* longer = find(part.evidence, "longer");
    spheres = spheres || diameter != nullptr;
    if (diameter != nullptr)
      sizes.push_back(fmt::format("diameter of {}: {:.3f} mm stated, {:.2f} +- {:.2f} mm measured",
                                  part.about.name, value(part.evidence, "stated"), diameter->value,
                                  diameter->sigma));
    else if (longer != nullptr)
      sizes.push_back(fmt::format("readings of {}: {}",
                                  part.about.name.empty() ? "all wires" : part.about.name,
                                  sentences::reading_off(*longer)));
  }
  return fmt::format("{}. Check {}", fmt::join(sizes, ", or "),
                     !spheres ? "where the wire reads zero"
                     : has(f, "lengths")
                         ? "diameter_mm and the certified lengths, and clean the sphere"
                         : "diameter_mm, and clean the sphere");
}

std::string certified_length(const Finding& f) {
  const Quantity* measured = find(f.evidence, "measured");
  return fmt::format(
      "certified length {}: {:.3f} mm stated, {}. "
      "Measure it again, or check that neither target was moved",
      sentences::length_of(f), of(f, "stated"),
      measured == nullptr
          ? "contradicted by all other data"
          : fmt::format("{:.2f} +- {:.2f} mm measured", measured->value, measured->sigma));
}

std::string exchanged_lengths(const Finding& f) {
  std::vector<std::string> lengths;
  for (const FindingPart& part : f.parts)
    lengths.push_back(part.about.name + "-" + part.about.other_end);
  return fmt::format("certified lengths {} are exchanged. Check which is which",
                     fmt::join(lengths, " and "));
}

std::string lengths_of_target(const Finding& f) {
  return fmt::format(
      "all {:.0f} certified lengths of {} contradict the touches. "
      "Measure them again, or put {} back where it stood",
      of(f, "lengths"), f.about.name, f.about.name);
}

std::string stated_centre(const Finding& f) {
  return fmt::format("centre of {}: {}. Check centre_mm, or state a larger centre_sigma_mm",
                     f.about.name,
                     has(f, "off") ? fmt::format("{:.1f} mm from stated", of(f, "off"))
                                   : std::string("contradicted by all other data"));
}

std::string all_centres(const Finding& f) {
  return fmt::format(
      "stated centres do not fit the touches. Check centre_mm{}, or state a larger centre_sigma_mm",
      has(f, "mends") ? "" : ", which may be in another frame than the arm's base");
}

}  // namespace

std::string cause_words(const Finding& f) {
  if (!f.cause) return f.text;
  switch (*f.cause) {
    case LikelyCause::kRadians:
      return radians(f);
    case LikelyCause::kAxisSign:
      return fmt::format("{} turns the other way. Check its sign in the robot file", f.about.name);
    case LikelyCause::kMastering:
      return mastering(f);
    case LikelyCause::kExchangedColumns:
      return fmt::format("angles of {} are exchanged. Check the columns", names_of(f, " and "));
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
      return fmt::format("{}. Check the robot file", fields(f));
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
      return "more than one certified length contradicts the touches. "
             "Measure them again, and check that no target was moved";
    case LikelyCause::kStatedCentre:
      return stated_centre(f);
    case LikelyCause::kAllCentres:
      return all_centres(f);
  }
  return {};
}

}  // namespace cellcal::calib
