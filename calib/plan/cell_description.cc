// Plausibility of the described arm and tool: payload, column, tip, and the arm at rest.

#include <algorithm>
#include <cmath>
#include <optional>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "calib/model/units.h"
#include "calib/plan/bodies.h"
#include "calib/plan/candidates.h"
#include "calib/plan/cell_check.h"
#include "calib/plan/clearance.h"
#include "calib/plan/pool.h"
#include "calib/plan/surroundings.h"

namespace cellcal::calib {

namespace {

using Eigen::Vector3d;

/// Arms may carry more than their rated payload close to the flange.
constexpr double kOverloaded = 1.5;
/// Above the payload of any articulated robot (KR 1000 titan, FANUC M-2000: 2300 kg).
constexpr double kAnyPayloadKg = 2500.0;
/// Shares of the column's radius and height within which an object is inside the column.
constexpr double kInColumn = 0.5, kAboveBase = 0.3;
/// Clearance of the tool from its sphere during a touch (clearance.h).
constexpr double kTouchMarginM = 0.005;
/// A tip at less than this share of its distance along the flange's axis points across it.
constexpr double kAcross = 0.1;
constexpr double kShortToolM = 0.05;
constexpr int kTried = 20;
constexpr std::size_t kMostMistakes = 3;

/// The arm without obstacles except the floor.
Cell alone(const Cell& cell) {
  Cell bare = cell;
  bare.targets.clear();
  bare.lengths.clear();
  bare.obstacles.clear();
  return bare;
}

std::optional<Hit> hit_at_rest(const Cell& cell) {
  const Cell bare = alone(cell);
  const ArmModel arm = planning_arm(bare);
  const Clearance clearance(bare, arm);
  return clearance.hit(resting_posture(bare.robot, clearance));
}

/// True if each target with a stated place can be touched, ignoring obstacles.
bool reaches_all(const Cell& cell) {
  const Cell bare = alone(cell);
  const ArmModel arm = planning_arm(bare);
  for (const Target& target : cell.targets) {
    if (!is_planned(target, Kinds::kSpheresAndPlanes) || !target.has_centre) continue;
    Cell one = bare;
    one.targets = {target};
    if (find_candidates(one, arm, Clearance(bare, arm), {}, kTried, Kinds::kSpheresAndPlanes)
            .empty())
      return false;
  }
  return true;
}

bool explains(const Cell& cell) { return !hit_at_rest(cell) && reaches_all(cell); }

/// Each single change of the description that makes the arm rest clear and reach all targets: signs, tool along
/// Z, offsets.
std::vector<DescriptionMistake> explain(const Cell& cell) {
  using What = DescriptionMistake::Kind;
  std::vector<DescriptionMistake> all;
  Cell other = cell;
  for (Joint& joint : other.robot.joints) {
    if (joint.is_prismatic()) continue;
    joint.sign = -joint.sign;
    if (explains(other))
      all.push_back({.kind = What::kSign, .joint = joint.name, .sign = joint.sign});
    joint.sign = -joint.sign;
  }
  other.tool.tcp.translation() = cell.tool.tcp.translation().norm() * Vector3d::UnitZ();
  if (explains(other))
    all.push_back({.kind = What::kToolAxis, .tcp_m = other.tool.tcp.translation()});
  other.tool = cell.tool;
  for (Joint& joint : other.robot.joints) {
    if (joint.is_prismatic()) continue;
    const double stated = joint.offset_rad;
    for (const double turn : {std::numbers::pi, std::numbers::pi / 2, -std::numbers::pi / 2}) {
      joint.offset_rad = std::remainder(stated + turn, 2.0 * std::numbers::pi);
      if (explains(other))
        all.push_back({.kind = What::kOffset,
                       .joint = joint.name,
                       .offset_deg = joint.offset_rad * kDegPerRad});
    }
    joint.offset_rad = stated;
  }
  return all;
}

}  // namespace

double rated_payload_kg(const Robot& robot) {
  static const std::regex kModel(R"(\b(?:KR|iiwa) ?(\d{1,4})(?:-\d)?(?: L(\d{1,4}))?\b)");
  std::smatch found;
  if (!std::regex_search(robot.name, found, kModel)) return 0.0;
  return std::stod(found[2].matched ? found[2].str() : found[1].str());
}

void examine_load(const Cell& cell, std::vector<CellFault>& faults) {
  const double rated_kg = rated_payload_kg(cell.robot);
  const double limit_kg = rated_kg > 0.0 ? rated_kg : kAnyPayloadKg;
  double kg = cell.tool.mass_kg;
  for (const Tool& tool : cell.other_tools) kg += tool.mass_kg;
  if (kg <= limit_kg) return;
  CellFault fault{CellFaultKind::kToolTooHeavy, rated_kg <= 0.0 || kg > kOverloaded * rated_kg};
  fault.kg = kg;
  fault.limit_kg = limit_kg;
  faults.push_back(fault);
}

void examine_column(const Cell& cell, std::vector<CellFault>& faults) {
  // A linear unit's column moves, and keeps clear of everything.
  if (cell.robot.joints.size() < 3 || cell.obstacles.empty() || cell.robot.first_turning() > 0)
    return;
  const ArmModel arm = planning_arm(cell);
  ArmChain chain;
  arm.walk(arm.prepare(JointVector(cell.robot.joints.size(), 0.0)), arm.errors(nullptr), chain);
  const Vector3d foot = chain.link[0].z_origin, axis = chain.link[0].z;
  const double height = (chain.link[1].z_origin - foot).dot(axis);
  const Segment column{foot + kAboveBase * height * axis, foot + height * axis};
  const double stated = cell.robot.joints[0].radius_m;
  const double limit = kInColumn * (stated > 0.0 ? stated : assumed_radius_m(cell.robot));
  Cell obstacles = alone(cell);
  obstacles.obstacles = cell.obstacles;
  obstacles.floor_m.reset();
  const Surroundings things(obstacles);
  for (std::size_t i = 0; i < things.size(); ++i) {
    const double gap = things.distance_m(i, column, 2.0 * limit);
    if (gap < limit)
      faults.push_back({CellFaultKind::kInColumn, true, {things.words(i)}, gap, limit});
  }
}

void examine_tool(const Cell& cell, std::vector<CellFault>& faults) {
  const Tool& tool = cell.tool;
  const Vector3d tip = tool.tcp.translation();
  const double beside = tip.head<2>().norm();
  if (tip.norm() > kShortToolM && std::abs(tip.z()) < kAcross * tip.norm())
    faults.push_back({CellFaultKind::kToolAcross, false, {}, tip.z(), beside});
  const double clear_m = PlanOptions{}.clear_m;
  if (tool.tip_radius_m > clear_m)
    faults.push_back({CellFaultKind::kLargeBall, false, {}, tool.tip_radius_m, clear_m});
  // The default slim end is used if none is stated.
  const bool stated = tool.slim_radius_m != Tool{}.slim_radius_m;
  if (stated && tool.tip_radius_m > 0.0 && tool.tip_radius_m < tool.slim_radius_m)
    faults.push_back(
        {CellFaultKind::kShankTouchesFirst, false, {}, tool.tip_radius_m, tool.slim_radius_m});
  const bool has_shaft = tip.norm() > tool.slim_length_m;
  const double needed = tool.radius_m + kTouchMarginM - tool.tip_radius_m;
  if (has_shaft && tool.slim_length_m < needed)
    faults.push_back({CellFaultKind::kShaftTouchesFirst, true, {}, tool.slim_length_m, needed});
}

void examine_description(const Cell& cell, std::vector<CellFault>& faults) {
  const auto out_of_reach = [](const CellFault& fault) {
    return fault.kind == CellFaultKind::kOutOfReach;
  };
  if (std::any_of(faults.begin(), faults.end(),
                  [&](const CellFault& fault) { return fault.refused && !out_of_reach(fault); }))
    return;
  const auto stated = std::count_if(cell.targets.begin(), cell.targets.end(), [](auto& target) {
    return is_planned(target, Kinds::kSpheresAndPlanes) && target.has_centre;
  });
  const auto missed = std::count_if(faults.begin(), faults.end(), out_of_reach);
  const bool reaches_none = missed > 1 && missed == stated;
  const std::optional<Hit> hit = hit_at_rest(cell);
  if (!hit && !reaches_none) return;
  CellFault fault{CellFaultKind::kDescription, true};
  if (hit) fault.ids = {words(*hit)};
  fault.mistakes = explain(cell);
  if (!hit && fault.mistakes.empty()) return;
  if (fault.mistakes.size() > kMostMistakes) {
    fault.more = fault.mistakes.size() - kMostMistakes;
    fault.mistakes.resize(kMostMistakes);
  }
  if (!fault.mistakes.empty()) std::erase_if(faults, out_of_reach);
  faults.push_back(fault);
}

}  // namespace cellcal::calib
