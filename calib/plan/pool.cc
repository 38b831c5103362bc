#include "calib/plan/pool.h"

#include <fmt/format.h>

#include <algorithm>

namespace cellcal::calib {

namespace {

void check_cell(const Cell& cell) {
  bool sphere = false;
  for (const Target& target : cell.targets) {
    if (target.kind != TargetKind::kSphere) continue;
    sphere = true;
    if (!target.has_centre)
      throw PlanError(
          fmt::format("target {}: a plan needs its rough place; state centre_mm in the "
                      "cell file",
                      target.id));
  }
  if (!sphere)
    throw PlanError(
        "the cell has no sphere to touch; touches of other targets are made by hand and identified "
        "from a file");
}

/// For the constructor: before anything is computed.
const Cell& checked(const Cell& cell) {
  check_cell(cell);
  return cell;
}

}  // namespace

ArmModel planning_arm(const Cell& cell) {
  Robot robot = cell.robot;
  for (Joint& joint : robot.joints) {
    joint.errors.clear();
    joint.compliance_sigma_rad_per_nm = 0.0;
    joint.harmonics.clear();
  }
  Tool tool = cell.tool;
  tool.deflection_sigma = 0.0;
  tool.tcp_sigma_m.setZero();
  return {robot, tool};
}

JointVector middle_posture(const Robot& robot) {
  JointVector q;
  for (const Joint& joint : robot.joints)
    q.push_back(std::clamp(0.0, joint.min_rad, joint.max_rad));
  if (q.size() >= 3) {
    q[1] = std::clamp(-1.2, robot.joints[1].min_rad, robot.joints[1].max_rad);
    q[2] = std::clamp(1.6, robot.joints[2].min_rad, robot.joints[2].max_rad);
  }
  if (q.size() >= 5) q[4] = std::clamp(1.0, robot.joints[4].min_rad, robot.joints[4].max_rad);
  return q;
}

PlannedTouch to_planned(const Cell& cell, const Candidate& c, TouchSet set,
                        const PlanOptions& options) {
  PlannedTouch touch;
  touch.target = cell.targets[c.target].id;
  touch.set = set;
  touch.normal = c.normal;
  touch.standoff = c.standoff;
  touch.end = c.end;
  touch.clear = c.clear;
  touch.search_m = options.standoff_m + options.beyond_m;
  touch.expected_m = options.standoff_m;
  return touch;
}

Pool::Pool(const Cell& cell, const PlanOptions& options, int per_sphere)
    : cell_(checked(cell)),
      arm_(planning_arm(cell)),
      clearance_(cell, arm_),
      middle_(middle_posture(cell.robot)),
      router_(cell, arm_, clearance_, middle_, options.limit_margin_rad),
      spheres_(static_cast<int>(
          std::count_if(cell.targets.begin(), cell.targets.end(),
                        [](const Target& t) { return t.kind == TargetKind::kSphere; }))),
      candidates_(find_candidates(cell, arm_, clearance_, options, per_sphere)),
      connected_(candidates_.size(), -1) {
  const auto refuse_sphere_without = [&](const char* what) {
    for (std::size_t t = 0; t < cell.targets.size(); ++t) {
      const bool any = std::any_of(candidates_.begin(), candidates_.end(),
                                   [&](const Candidate& c) { return c.target == t; });
      if (cell.targets[t].kind == TargetKind::kSphere && !any)
        throw PlanError(fmt::format("sphere {} {}", cell.targets[t].id, what));
    }
  };
  // First of all: a sphere out of reach also upsets all that follows.
  refuse_sphere_without(
      "cannot be reached from any direction inside the joint limits; check its centre_mm or move "
      "it");
  if (!clearance_.clear(middle_, kTipMarginM))
    throw PlanError("a sphere or its stand is where the arm rests between touches; move it");
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    if (cell.targets[t].kind != TargetKind::kSphere) continue;
    bool any = false;
    for (std::size_t i = 0; i < candidates_.size() && !any; ++i)
      any = candidates_[i].target == t && connected(i);
    if (!any)
      throw PlanError(fmt::format(
          "sphere {} can be reached, but no clear way leads from the resting posture to it and "
          "back; move it or what stands between",
          cell.targets[t].id));
  }
}

bool Pool::connected(std::size_t candidate) {
  signed char& known = connected_[candidate];
  if (known < 0) known = router_.connect(candidates_[candidate]) ? 1 : 0;
  return known == 1;
}

}  // namespace cellcal::calib
