#include "calib/plan/accuracy_region.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>

#include "calib/estimate/region.h"
#include "calib/model/error.h"
#include "calib/model/inverse.h"
#include "calib/model/linear.h"
#include "calib/model/units.h"
#include "calib/plan/track.h"

namespace cellcal::calib {

namespace {

constexpr unsigned kSeed = 7;
constexpr double kLargestMm = 1e5;

Eigen::Vector3d parse_corner(std::string_view& text, bool last) {
  Eigen::Vector3d corner;
  for (int k = 0; k < 3; ++k) {
    double mm = 0.0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), mm);
    const bool is_number = error == std::errc{} && std::isfinite(mm) && std::abs(mm) <= kLargestMm;
    if (is_number) text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    const bool more = !(last && k == 2);
    if (!is_number || more != text.starts_with(','))
      throw PlanError(PlanError::Kind::kRequest,
                      "region box: needs six numbers in mm, X,Y,Z,X,Y,Z, two opposite corners");
    corner[k] = mm / kMmPerM;
    if (more) text.remove_prefix(1);
  }
  return corner;
}

/// Tips uniformly in the box, with orientations of postures of the workspace.
std::vector<JointVector> in_box(const AccuracyRegion& region, const ArmModel& arm, double margin,
                                int count) {
  constexpr int kAttempts = 20, kLeast = 10;
  const Configurations configurations(arm, margin);
  const auto held = workspace_poses(arm, count, kSeed);
  Random random(kSeed);
  std::vector<JointVector> postures;
  for (int k = 0; k < kAttempts * count && static_cast<int>(postures.size()) < count; ++k) {
    if (held.empty()) break;
    Eigen::Isometry3d pose = arm.nominal_tcp(held[random.below(held.size())]);
    for (int axis = 0; axis < 3; ++axis)
      pose.translation()[axis] = random.uniform(region.low_m[axis], region.high_m[axis]);
    auto ways =
        configurations.reach(pose, track_position_m(arm, pose.translation(), margin, random));
    if (!ways.empty()) postures.push_back(std::move(ways[random.below(ways.size())]));
  }
  if (static_cast<int>(postures.size()) < kLeast)
    throw PlanError(
        PlanError::Kind::kRequest,
        "region box: the arm reaches almost nothing of it inside its joint limits. Give the "
        "corners in mm in the base frame");
  return postures;
}

}  // namespace

AccuracyRegion parse_accuracy_region(std::string_view text) {
  if (text == "workspace") return {};
  if (text == "targets") return {.kind = AccuracyRegion::Kind::kTargets};
  if (text == "tcp") return {.kind = AccuracyRegion::Kind::kTool};
  if (!text.starts_with("box:"))
    throw PlanError(
        PlanError::Kind::kRequest,
        fmt::format("unknown region \"{}\". Use workspace, targets, tcp or box:X,Y,Z,X,Y,Z (mm)",
                    text));
  text.remove_prefix(4);
  const Eigen::Vector3d a = parse_corner(text, false), b = parse_corner(text, true);
  if (!text.empty())
    throw PlanError(PlanError::Kind::kRequest, "region box: more than six numbers");
  return {AccuracyRegion::Kind::kBox, a.cwiseMin(b), a.cwiseMax(b)};
}

std::vector<JointVector> accuracy_region_postures(const AccuracyRegion& region, const ArmModel& arm,
                                                  const std::vector<JointVector>& touches,
                                                  const std::vector<Eigen::Vector3d>& centres_m,
                                                  double limit_margin_rad, int count) {
  switch (region.kind) {
    case AccuracyRegion::Kind::kBox: return in_box(region, arm, limit_margin_rad, count);
    case AccuracyRegion::Kind::kTargets:
    case AccuracyRegion::Kind::kTool: return local_poses(arm, touches, centres_m, count, kSeed);
    case AccuracyRegion::Kind::kPostures: return region.postures;
    case AccuracyRegion::Kind::kWorkspace: break;
  }
  return workspace_poses(arm, count, kSeed);
}

}  // namespace cellcal::calib
