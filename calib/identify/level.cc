#include "calib/identify/level.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace cellcal::calib {

namespace {

constexpr double kRadPerArcsec = std::numbers::pi / 180.0 / 3600.0;
/// Gears of industrial arms are published with 10 to 60 arcsec per revolution; the low end, since
/// the evidence may raise it.
constexpr double kUsualTransmissionRad = 10.0 * kRadPerArcsec;

bool gives(const Cell& cell) {
  return std::any_of(cell.robot.joints.begin(), cell.robot.joints.end(),
                     [](const Joint& j) { return j.compliance_sigma_rad_per_nm > 0.0; });
}

double largest_transmission_rad(const Cell& cell) {
  double largest = 0.0;
  for (const Joint& joint : cell.robot.joints)
    largest = std::max(largest, joint.harmonic_sigma_rad);
  return largest;
}

}  // namespace

Cell at_level(const Cell& cell, const ModelLevel& level) {
  Cell result = cell;
  const bool named = largest_transmission_rad(cell) > 0.0;
  for (Joint& joint : result.robot.joints) {
    if (!level.compliance) joint.compliance_sigma_rad_per_nm = 0.0;
    if (!named) {
      joint.harmonics = {1, 2};
      joint.gear_ratio = 1.0;
      joint.harmonic_sigma_rad = kUsualTransmissionRad;
    }
    joint.harmonic_sigma_rad *= level.transmission;
  }
  return result;
}

std::string words(const Cell& cell, const ModelLevel& level) {
  std::string text = "geometry";
  if (cell.tool.deflection_sigma > 0.0) text += ", tool bending";
  if (level.compliance && gives(cell)) text += ", joint compliance";
  if (level.transmission > 0.0)
    text += fmt::format(", transmission {:.0f} arcsec",
                        largest_transmission_rad(at_level(cell, level)) / kRadPerArcsec);
  if (level.ripple_rad > 0.0)
    text += fmt::format(", ripple {:.0f} arcsec", level.ripple_rad / kRadPerArcsec);
  return text;
}

}  // namespace cellcal::calib
