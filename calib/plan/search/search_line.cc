#include "calib/plan/search/search_line.h"

#include <cmath>

#include "calib/model/inverse.h"

namespace cellcal::calib {

namespace {

using Eigen::Vector3d;

constexpr double kShaftBowM = 2.0 * kMostBowM;
constexpr double kLargestRad = 0.35;  ///< of a joint along a line: more is a jump

}  // namespace

Vector3d shaft_in_tool(const Tool& tool) {
  return tool.tcp.linear().transpose() * tool.tcp.translation().normalized();
}

std::optional<JointVector> LineLeader::posture(const LineToLead& line, double outside_m,
                                               const Vector3d& beside,
                                               const JointVector& near) const {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = line.orientation;
  pose.translation() = line.aim_m + outside_m * line.normal + beside;
  return inverse(arm_, pose, near, margin_rad_);
}

Vector3d LineLeader::on_move(const JointVector& from, const JointVector& to, double share,
                             double behind_tip_m) const {
  JointVector q(from.size());
  for (std::size_t i = 0; i < q.size(); ++i) q[i] = from[i] + share * (to[i] - from[i]);
  return arm_.nominal_tcp(q) * Vector3d(-behind_tip_m * shaft_in_tool(tool_));
}

Vector3d LineLeader::bow_m(const JointVector& from, const JointVector& to) const {
  const Vector3d a = on_move(from, to, 0.0, 0.0), b = on_move(from, to, 1.0, 0.0);
  const Vector3d off = on_move(from, to, 0.5, 0.0) - a, along = (b - a).normalized();
  return off - off.dot(along) * along;
}

bool LineLeader::keeps_to(const LineToLead& line, const LedSearch& led) const {
  for (std::size_t i = 0; i < led.end.size(); ++i)
    if (std::abs(led.end[i] - led.clear[i]) > kLargestRad) return false;
  const double behind_m = tool_.slim_length_m;
  const Vector3d shaft = led.from - behind_m * (line.orientation * shaft_in_tool(tool_));
  const auto off_m = [&](double share, double behind_tip_m, const Vector3d& begin) {
    const Vector3d off = on_move(led.standoff, led.end, share, behind_tip_m) - begin;
    return (off - off.dot(line.normal) * line.normal).norm();
  };
  for (const double share : {0.0, 0.25, 0.5, 0.75, 1.0})
    if (off_m(share, 0.0, led.from) > kMostBowM || off_m(share, behind_m, shaft) > kShaftBowM)
      return false;
  return true;
}

std::optional<LedSearch> LineLeader::lead(const LineToLead& line, const LineEnds& ends) const {
  LedSearch led;
  led.from = line.aim_m + ends.standoff_m * line.normal;
  led.to = line.aim_m + ends.end_m * line.normal;
  Vector3d beside = Vector3d::Zero();
  for (const bool corrected : {false, true}) {
    const auto clear = posture(line, ends.clear_m, beside, line.near);
    if (!clear) return std::nullopt;
    const auto standoff = posture(line, ends.standoff_m, beside, *clear);
    if (!standoff) return std::nullopt;
    const auto end = posture(line, ends.end_m, beside, *standoff);
    if (!end) return std::nullopt;
    led.clear = *clear;
    led.standoff = *standoff;
    led.end = *end;
    if (!corrected) beside = -bow_m(*standoff, *end) / 2.0;
    if (beside.norm() > kMostBowM) return std::nullopt;
  }
  return keeps_to(line, led) ? std::optional(led) : std::nullopt;
}

}  // namespace cellcal::calib
