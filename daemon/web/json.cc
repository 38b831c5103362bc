#include "daemon/web/json.h"

#include <cmath>

#include "calib/model/units.h"

namespace cellcal::daemon::web {

using nlohmann::json;

namespace {

/// A nanometre and a ten-millionth of a degree: nobody sees less, and it travels in half the bytes.
constexpr double kDigits = 1e6;

double rounded(double value) { return std::round(value * kDigits) / kDigits; }

}  // namespace

json number(double value, double factor) {
  if (!std::isfinite(value * factor)) return nullptr;
  return rounded(value * factor);
}

json mm(const Eigen::Vector3d& point_m) {
  json list = json::array();
  for (const double value : point_m) list.push_back(number(value, calib::kMmPerM));
  return list;
}

json frame(const Eigen::Isometry3d& frame) {
  json list = json::array();
  for (int row = 0; row < 3; ++row) {
    // Directions count for metres: they stay as they are.
    for (int column = 0; column < 3; ++column) list.push_back(frame.linear()(row, column));
    list.push_back(number(frame.translation()[row], calib::kMmPerM));
  }
  return list;
}

json degrees(const calib::JointVector& joint_rad) {
  json list = json::array();
  for (const double value : joint_rad) list.push_back(number(value, calib::kDegPerRad));
  return list;
}

std::string dump(const json& value) {
  return value.dump(-1, ' ', false, json::error_handler_t::replace);
}

}  // namespace cellcal::daemon::web
