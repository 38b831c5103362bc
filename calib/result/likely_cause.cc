#include "calib/result/likely_cause.h"

#include <algorithm>
#include <vector>

#include "calib/result/finding.h"
#include "calib/result/sentences.h"

namespace cellcal::calib {

namespace {

using sentences::all_parts, sentences::has, sentences::name_of, sentences::of, sentences::said;

/// Corrected value of a field of the robot file.
Quantity field_of(const FindingPart& part) {
  for (const Quantity& one : part.evidence)
    if (one.name != "stated") return one;
  return {};
}

/// "offset_deg of A2: -90 deg stated, 0 deg fits"
Phrase field(const FindingPart& part) {
  const Quantity fits = field_of(part);
  return said(fits.unit.empty() ? "say.cause.field" : "say.cause.field.unit", part,
              {{"field", fits.name}, {"fits", fits.value}, {"unit", fits.unit}});
}

/// Those of joints.
Phrase fields(const Finding& f) {
  Finding joints = f;
  std::erase_if(joints.parts,
                [](const FindingPart& part) { return part.about.of != Subject::Of::kJoint; });
  return all_parts(joints, "say.join.semicolon", field);
}

/// Two exchanged targets; for more, each with the one that its touches belong to.
Phrase target_names(const Finding& f) {
  if (f.parts.size() == 2)
    return said("say.cause.target_names", f, {{"names", all_parts(f, "say.join.and", name_of)}});
  const auto fit = [](const FindingPart& part) { return said("say.cause.fit", part); };
  return said("say.cause.target_names.several", f, {{"list", all_parts(f, "say.join.comma", fit)}});
}

Phrase scattered_touches(const Finding& f) {
  const double others = has(f, "others") ? of(f, "others") : 0.0;
  return said(others == 1.0  ? "say.cause.scattered_touches.one"
              : others > 0.0 ? "say.cause.scattered_touches.others"
                             : "say.cause.scattered_touches",
              f);
}

Phrase unit(const Finding& f, const std::string& id) {
  constexpr double kMetre = 1000.0;  // [mm]
  const double mm = of(f, "unit");
  return said(id + (mm == kMetre ? ".metres"
                    : mm < 1.0   ? ".micrometres"
                                 : ".inches"),
              f, {{"names", all_parts(f, "say.join.comma", name_of)}});
}

Phrase dimension(const Finding& f) {
  const FindingPart part = f.parts.empty() ? FindingPart{} : f.parts.front();
  return said(has(f, "last") ? "say.cause.dimension.last" : "say.cause.dimension", part,
              {{"field", field_of(part).name}, {"fits", field_of(part).value}});
}

Phrase other_robot(const Finding& f) {
  const std::string stated = f.parts.empty() ? std::string() : f.parts.front().about.name;
  const Phrase own = stated == f.about.other_end
                         ? Phrase("say.cause.other_robot.own")
                         : Phrase("say.cause.other_robot.that", {{"name", stated}});
  const Phrase different = fields(f);
  return said(different.empty() ? "say.cause.other_robot" : "say.cause.other_robot.fields", f,
              {{"stated", own}, {"fields", different}});
}

Phrase gravity(const Finding& f) {
  std::string along;
  for (const char* axis : {"x", "y", "z"})
    if (of(f, axis) != 0.0) along = (of(f, axis) < 0.0 ? "-" : "+") + std::string(axis);
  return said("say.cause.gravity", f, {{"along", along}});
}

Phrase size_of(const FindingPart& part) {
  if (find(part.evidence, "measured") != nullptr) return said("say.cause.size.diameter", part);
  const Quantity* longer = find(part.evidence, "longer");
  if (longer == nullptr) return {};
  return said(part.about.name.empty() ? "say.cause.size.all_wires" : "say.cause.size.readings",
              part, {{"by", sentences::reading_off(*longer)}});
}

Phrase sizes(const Finding& f) {
  const bool spheres = std::ranges::any_of(
      f.parts, [](const FindingPart& part) { return find(part.evidence, "measured") != nullptr; });
  return said(!spheres            ? "say.cause.artefact_size.wire"
              : has(f, "lengths") ? "say.cause.artefact_size.lengths"
                                  : "say.cause.artefact_size",
              f, {{"sizes", all_parts(f, "say.join.or", size_of)}});
}

Phrase exchanged_lengths(const Finding& f) {
  const auto ends = [](const FindingPart& part) -> Phrase {
    return part.about.name + "-" + part.about.other_end;
  };
  return said("say.cause.exchanged_lengths", f, {{"lengths", all_parts(f, "say.join.and", ends)}});
}

Phrase names(const Finding& f, const char* separator, std::string id) {
  return said(std::move(id), f, {{"names", all_parts(f, separator, name_of)}});
}

}  // namespace

Phrase sentences::cause(const Finding& f) {
  if (!f.cause) return f.text;
  const std::string id = std::string("say.cause.") + to_string(*f.cause);
  switch (*f.cause) {
    case LikelyCause::kExchangedColumns: return names(f, "say.join.and", id);
    case LikelyCause::kTargetNames: return target_names(f);
    case LikelyCause::kScatteredTouches: return scattered_touches(f);
    case LikelyCause::kReadingsUnit:
    case LikelyCause::kLengthsUnit: return unit(f, id);
    case LikelyCause::kReadingsHandedness: return names(f, "say.join.comma", id);
    case LikelyCause::kToolTip: return said(has(f, "turn") ? id + ".turn" : id, f);
    case LikelyCause::kDimension: return dimension(f);
    case LikelyCause::kOtherRobot: return other_robot(f);
    case LikelyCause::kAxisConvention: return said(id, f, {{"fields", fields(f)}});
    case LikelyCause::kGravity: return gravity(f);
    case LikelyCause::kArtefactSize: return sizes(f);
    case LikelyCause::kCertifiedLength: return said(has(f, "measured") ? id + ".measured" : id, f);
    case LikelyCause::kExchangedLengths: return exchanged_lengths(f);
    case LikelyCause::kStatedCentre: return said(has(f, "off") ? id + ".off" : id, f);
    case LikelyCause::kAllCentres: return said(has(f, "mends") ? id + ".mends" : id, f);
    case LikelyCause::kMoved:
    case LikelyCause::kRadians:
    case LikelyCause::kAxisSign:
    case LikelyCause::kMastering:
    case LikelyCause::kToolUnit:
    case LikelyCause::kAllDiameters:
    case LikelyCause::kDiameter:
    case LikelyCause::kLengthsOfTarget:
    case LikelyCause::kAllLengths: break;
  }
  return said(id, f);
}

std::string cause_words(const Finding& f) { return words(sentences::cause(f)); }

}  // namespace cellcal::calib
