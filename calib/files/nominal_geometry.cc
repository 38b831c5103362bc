#include "calib/files/nominal_geometry.h"

#include <fmt/format.h>

#include <algorithm>

#include "calib/model/units.h"
#include "calib/syntax/input_file.h"

namespace cellcal::calib {

namespace {

/// Without a minus before what rounds to nothing.
std::string fixed(double value, int decimals) {
  std::string text = fmt::format("{:.{}f}", value, decimals);
  if (text.find_first_not_of("-0.") == std::string::npos && text.front() == '-') text.erase(0, 1);
  return text + ' ';
}

std::string drawn_mm(double m) { return fixed(m * kMmPerM, 6); }
std::string nine_decimals(double value) { return fixed(value, 9); }
std::string deg(double rad) { return nine_decimals(rad * kDegPerRad); }

std::string frame(const Eigen::Isometry3d& f) {
  std::string text =
      drawn_mm(f.translation().x()) + drawn_mm(f.translation().y()) + drawn_mm(f.translation().z());
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column) text += nine_decimals(f.linear()(row, column));
  return text + '\n';
}

}  // namespace

std::string nominal_geometry_sha256(const Robot& robot) {
  std::string text = frame(robot.base_fixed);
  for (const Joint& j : robot.joints) {
    text += fmt::format("{} {} ", j.name, j.sign);
    text +=
        deg(j.offset_rad) + drawn_mm(j.d_m) + drawn_mm(j.a_m) + deg(j.alpha_rad) + deg(j.beta_rad);
    std::vector<JointError> errors = j.errors;
    std::sort(errors.begin(), errors.end());
    for (const JointError error : errors) text += fmt::format("{} ", static_cast<int>(error));
    text += '\n';
  }
  return sha256(text + frame(robot.flange_fixed));
}

}  // namespace cellcal::calib
