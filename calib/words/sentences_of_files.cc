// What findings say of what robot and cell file state.

#include <fmt/format.h>

#include <cmath>

#include "calib/words/sentences.h"

namespace cellcal::calib::sentences {

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
