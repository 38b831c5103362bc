// What robot and cell file state, and is not so.

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "calib/consistency/lengths.h"
#include "calib/diagnose/axis_convention.h"
#include "calib/diagnose/dimensions.h"
#include "calib/diagnose/mistakes.h"
#include "calib/diagnose/trial.h"
#include "calib/diagnose/wrong_measure.h"
#include "calib/model/units.h"
#include "calib/problem/target_place.h"

namespace cellcal::calib {

namespace {

/// So much nearer to the touches than stated another drawing or tool has to bring the nominal arm.
constexpr double kNearerByFile = 1.0 / 3.0;
/// So many fields of a robot file are named one by one.
constexpr std::size_t kFewDifferences = 6;
constexpr double kAnyToolM = 0.3, kAnyRadiusM = 0.01;

bool is_nearer(const Asked& asked, double off_m) {
  return off_m < kNearerByFile * asked.nominal_off_m;
}

void tool_in_metres(const Asked& asked, const Ask& ask) {
  constexpr double kTinyM = 5e-3;
  const double reach_m = asked.cell.tool.tcp.translation().norm();
  if (!(reach_m > 0.0 && reach_m < kTinyM)) return;
  Cell larger = asked.cell;
  larger.tool.tcp.translation() *= kMmPerM;
  if (larger.tool.length_m < kTinyM) larger.tool.length_m *= kMmPerM;
  if (larger.tool.com_m.norm() < kTinyM) larger.tool.com_m *= kMmPerM;
  ask({larger, asked.touches, [&](const Calibration&) {
         return likely(LikelyCause::kToolUnit, {}, {in_mm("reach", reach_m)});
       }});
}

/// Whether turning the tool about the last axis, the flange's z, moves its tip so.
bool is_turn(const Tool& tool, const Eigen::Vector3d& off_m) {
  constexpr double kLike = 0.2;
  const Eigen::Vector2d tip = tool.tcp.translation().head<2>();
  const Eigen::Vector2d turned = tip + off_m.head<2>();
  return std::abs(turned.norm() - tip.norm()) < kLike * off_m.norm() &&
         std::abs(off_m.z()) < kLike * off_m.norm();
}

/// With the tool's tip about there, from where it is stated.
void tool_at(const Asked& asked, const Eigen::Vector3d& brought, const Ask& ask) {
  const Tool& tool = asked.cell.tool;
  Cell changed = asked.cell;
  changed.tool.tcp.translation() += brought;
  if (tool.length_m == tool.tcp.translation().norm())  // as long as it reaches
    changed.tool.length_m = changed.tool.tcp.translation().norm();
  changed.tool.tcp_sigma_m.setConstant(kAnyToolM);
  ask({changed, asked.touches, [&](const Calibration& c) {
         Eigen::Vector3d off = brought * kMmPerM;
         for (int axis = 0; axis < 3; ++axis)
           off[axis] += correction_of(c, tool_parameter(ParameterKind::kTcp, 0, axis)) * kMmPerM;
         Finding finding =
             likely(LikelyCause::kToolTip, {},
                    {{"x", off.x(), "mm"}, {"y", off.y(), "mm"}, {"z", off.z(), "mm"}});
         if (is_turn(tool, off / kMmPerM)) finding.evidence.push_back({"turn", 1.0, ""});
         return finding;
       }});
}

void other_tool(const Asked& asked, const Ask& ask) {
  Cell nearest = asked.cell;
  if (!is_nearer(asked, bring_tool_nearest(nearest, asked.touches))) {
    tool_at(asked, Eigen::Vector3d::Zero(), ask);
    return;
  }
  const Eigen::Vector3d brought =
      nearest.tool.tcp.translation() - asked.cell.tool.tcp.translation();
  tool_at(asked, brought, ask);
  // A tip beyond the spheres' middles fits their far sides nearly as well.
  for (const Target& target : asked.cell.targets) {
    if (target.kind != TargetKind::kSphere) continue;
    for (const double side : {-1.0, 1.0})
      tool_at(asked, brought + side * target.diameter_m * Eigen::Vector3d::UnitZ(), ask);
    break;
  }
}

/// A length that is not what the robot file says, by about so much.
void dimension_off(const Asked& asked, const Dimension& dimension, double add_m, const Ask& ask) {
  constexpr double kAnyLengthM = 0.05;
  const auto& joints = asked.cell.robot.joints;
  const bool is_d = dimension.of == Dimension::Of::kD;
  const auto off_m = [&](const Calibration& c) {
    return correction_of(
        c, joint_parameter(is_d ? ParameterKind::kD : ParameterKind::kA, dimension.joint));
  };
  Cell changed = asked.cell;
  double& value = dimension.in(changed);
  const double stated_m = value;
  value += add_m;
  Cell loose = changed;
  loose.robot.joints[dimension.joint].tolerance_length_m = kAnyLengthM;
  const Trial trial = attempt(loose, asked.touches);
  if (!trial.found) return;
  value += off_m(*trial.found);
  const double about_m = value;
  ask({changed, asked.touches, [&](const Calibration& c) {
         Finding finding = likely(LikelyCause::kDimension);
         finding.parts = {
             {about_joint(joints[dimension.joint].name),
              {in_mm(is_d ? "d_mm" : "a_mm", about_m + off_m(c)), in_mm("stated", stated_m)}}};
         if (dimension.joint + 1 == joints.size()) finding.evidence = {{"last", 1.0, ""}};
         return finding;
       }});
}

void dimensions(const Asked& asked, const Ask& ask) {
  constexpr std::size_t kMost = 4;
  using Found = std::pair<Dimension, Nearest>;
  std::vector<Found> found;
  for (const Dimension& dimension : dimensions_of(asked.cell.robot))
    found.emplace_back(dimension, nearest(asked.cell, asked.touches, dimension));
  std::stable_sort(found.begin(), found.end(),
                   [](const Found& a, const Found& b) { return a.second.off_m < b.second.off_m; });
  for (std::size_t k = 0; k < std::min(kMost, found.size()); ++k) {
    if (!is_nearer(asked, found[k].second.off_m)) return;
    dimension_off(asked, found[k].first, found[k].second.add_m, ask);
  }
}

void other_robot(const Asked& asked, const Ask& ask) {
  constexpr std::size_t kMost = 3;
  const Robot& stated = asked.cell.robot;
  const auto arms = other_arms(asked.cell, asked.touches, asked.other_robots);
  for (std::size_t k = 0; k < std::min(kMost, arms.size()); ++k) {
    const Robot& robot = arms[k].cell.robot;
    if (!is_nearer(asked, arms[k].off_m)) return;
    ask({arms[k].cell, asked.touches, [&](const Calibration&) {
           const std::vector<FindingPart> differ = differences(stated, robot);
           Finding finding = likely(LikelyCause::kOtherRobot, about_robot(arms[k].file, robot.name),
                                    {{"differences", static_cast<double>(differ.size()), ""}},
                                    {{about_robot(stated.name, {}), {}}});
           if (differ.size() <= kFewDifferences)
             finding.parts.insert(finding.parts.end(), differ.begin(), differ.end());
           return finding;
         }});
  }
}

void axis_convention(const Asked& asked, const Ask& ask) {
  constexpr std::size_t kMost = 3;
  const std::vector<OtherDrawing> drawings = other_drawings(asked.cell, asked.touches);
  for (std::size_t k = 0; k < std::min(kMost, drawings.size()); ++k) {
    if (!is_nearer(asked, drawings[k].off_m)) return;
    Hypothesis other{asked.cell, asked.touches};
    other.cell.robot = drawings[k].robot;
    other.cause = [&](const Calibration&) {
      return likely(LikelyCause::kAxisConvention, {}, {},
                    differences(asked.cell.robot, drawings[k].robot));
    };
    other.changes = static_cast<std::size_t>(drawings[k].changes);
    ask(other);
  }
}

void diameters(const Asked& asked, const Ask& ask) {
  const auto& targets = asked.cell.targets;
  Cell changed = asked.cell;
  changed.radius_offset_sigma_m = kAnyRadiusM;
  ask({changed, asked.touches, [](const Calibration& c) {
         const double rho_m = correction_of(c, tool_parameter(ParameterKind::kEffectiveRadius, 0));
         return likely(LikelyCause::kAllDiameters, {}, {in_mm("off", 2.0 * rho_m)});
       }});
  for (std::size_t t = 0; t < targets.size(); ++t) {
    if (targets[t].kind != TargetKind::kSphere) continue;
    changed = asked.cell;
    changed.targets[t].diameter_sigma_m = 2.0 * kAnyRadiusM;
    ask({changed, asked.touches, [&](const Calibration& c) {
           const double radius_m = correction_of(c, target_parameter(ParameterKind::kRadius, t));
           return likely(LikelyCause::kDiameter, about_target(targets[t]),
                         {in_mm("off", 2.0 * radius_m)});
         }});
  }
}

void lengths(const Asked& asked, const Ask& ask) {
  const auto& lengths = asked.cell.lengths;
  for (std::size_t k = 0; k < std::min(kMostPairs, lengths.size()); ++k) {
    const auto same = [&](const CertifiedLength& l) { return same_ends(l, lengths[k]); };
    const auto here = lengths.begin() + static_cast<std::ptrdiff_t>(k);
    if (std::any_of(lengths.begin(), here, same)) continue;
    ask({silenced(asked.cell, same), asked.touches,
         [&](const Calibration& c) { return without_length(lengths[k], c); }});
  }
  for_each_pair(lengths.size(), [&](std::size_t a, std::size_t b) {
    Cell changed = asked.cell;
    std::swap(changed.lengths[a].length_m, changed.lengths[b].length_m);
    ask({changed, asked.touches, [&](const Calibration&) {
           return likely(LikelyCause::kExchangedLengths, {}, {},
                         {{about_length(lengths[a].from, lengths[a].to), {}},
                          {about_length(lengths[b].from, lengths[b].to), {}}});
         }});
  });
}

/// An arm that hangs or stands otherwise than its file says.
void gravity(const Asked& asked, const Ask& ask) {
  constexpr double kEarth = 9.81;
  const Eigen::Vector3d& stated = asked.cell.robot.gravity_m_s2;
  const double g = stated.norm() > 0.0 ? stated.norm() : kEarth;
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      Cell changed = asked.cell;
      const Eigen::Vector3d along = sign * g * Eigen::Vector3d::Unit(axis);
      changed.robot.gravity_m_s2 = along;
      if ((along - stated).norm() < 0.1 * g) continue;
      ask({changed, asked.touches, [&](const Calibration& c) -> std::optional<Finding> {
             // The other way round joints and tool would give against their load.
             if (has(c.verdict.findings, FindingKind::kNegativeCompliance)) return {};
             return likely(
                 LikelyCause::kGravity, {},
                 {{"x", along.x(), "m/s^2"}, {"y", along.y(), "m/s^2"}, {"z", along.z(), "m/s^2"}});
           }});
    }
}

void centres(const Asked& asked, const Ask& ask) {
  Hypothesis none{asked.cell, asked.touches,
                  [](const Calibration&) { return likely(LikelyCause::kAllCentres); }};
  std::size_t held = 0;
  for (std::size_t t = 0; t < asked.cell.targets.size(); ++t) {
    const Target& target = asked.cell.targets[t];
    if (!centre_is_held(target)) continue;
    none.cell.targets[t].centre_sigma_m = 0.0;
    if (++held > kMostTargets) continue;
    Cell changed = asked.cell;
    changed.targets[t].centre_sigma_m = 0.0;  // where to begin, no more
    ask({changed, asked.touches, [&](const Calibration& c) {
           Eigen::Vector3d centre_m = Eigen::Vector3d::Zero();
           for (const TargetResult& one : c.targets)
             if (one.id == target.id) centre_m = one.centre_m;
           return likely(LikelyCause::kStatedCentre, about_target(target),
                         {in_mm("off", (centre_m - target.centre_m).norm())});
         }});
  }
  none.changes = held;
  if (held > 1) ask(none);
}

constexpr std::array kMistakesOfFiles = {
    Mistake{tool_in_metres}, Mistake{other_tool},      Mistake{dimensions},
    Mistake{other_robot},    Mistake{axis_convention}, Mistake{diameters},
    Mistake{lengths},        Mistake{gravity},         Mistake{centres}};

}  // namespace

std::span<const Mistake> mistakes_of_files() { return kMistakesOfFiles; }

}  // namespace cellcal::calib
