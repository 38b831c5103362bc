// What was read or written otherwise than it was made.

#include <algorithm>
#include <cmath>
#include <string>

#include "calib/consistency/session_order.h"
#include "calib/diagnose/data_association.h"
#include "calib/diagnose/mistakes.h"
#include "calib/diagnose/trial.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

/// Trackers and wires whose readings may be otherwise, together or each: all of a kind, and all.
std::vector<std::vector<std::string>> sets_of_readings(const Cell& cell) {
  std::vector<std::vector<std::string>> sets;
  std::vector<std::string> all, of_kind;
  for (const TargetKind kind : {TargetKind::kTracker, TargetKind::kWire}) {
    of_kind.clear();
    for (const Target& target : cell.targets)
      if (target.kind == kind) of_kind.push_back(target.id);
    all.insert(all.end(), of_kind.begin(), of_kind.end());
    if (!of_kind.empty()) sets.push_back(of_kind);
    if (of_kind.size() > 1 && of_kind.size() <= kMostTargets)
      for (const std::string& id : of_kind) sets.push_back({id});
  }
  if (!of_kind.empty() && all.size() > of_kind.size()) sets.push_back(all);
  return sets;
}

void ask_for_names(const Asked& asked, const Names& names) {
  asked.ask(
      {asked.cell, names.given_to(asked.cell, asked.touches), always(names.cause(asked.cell))});
}

/// What was touched is elsewhere on a plane or before a tracker each time; how they stand is not.
double moved_by_m(const TargetResult& before, const TargetResult& after) {
  if (before.kind == TargetKind::kPlane)
    return std::abs(after.normal.dot(before.centre_m) - after.distance_m);
  if (before.kind == TargetKind::kTracker)
    return (after.frame * (before.frame.inverse() * before.centre_m) - before.centre_m).norm();
  return (after.centre_m - before.centre_m).norm();
}

TargetResult result_of(const Calibration& c, const std::string& id) {
  const auto its = std::ranges::find(c.targets, id, &TargetResult::id);
  return its == c.targets.end() ? TargetResult{} : *its;
}

}  // namespace

void Asked::with_cell(const std::function<void(Cell&)>& change, FindingOf cause) const {
  Hypothesis without{cell, touches, std::move(cause)};
  change(without.cell);
  ask(without);
}

void Asked::with_touches(const std::function<void(Touch&)>& change, FindingOf cause,
                         bool no_farther) const {
  Hypothesis without{cell, touches, std::move(cause), no_farther};
  for (Touch& touch : without.touches) change(touch);
  ask(without);
}

void for_each_pair(std::size_t size, const std::function<void(std::size_t, std::size_t)>& ask) {
  std::size_t asked = 0;
  for (std::size_t a = 0; a < size; ++a)
    for (std::size_t b = a + 1; b < size && asked < kMostPairs; ++b, ++asked) ask(a, b);
}

namespace mistakes {

void radians(const Asked& asked) {
  double largest = 0.0;
  for (const Touch& touch : asked.touches)
    for (const double q : touch.joint_rad) largest = std::max(largest, std::abs(q) * kDegPerRad);
  if (largest > kRadPerTurn) return;  // in degrees, as it was read
  asked.with_touches(
      [](Touch& touch) {
        for (double& q : touch.joint_rad) q *= kDegPerRad;
      },
      always(likely(LikelyCause::kRadians, {}, {{"largest", largest, "deg"}})));
}

void axis_signs(const Asked& asked) {
  const auto& joints = asked.cell.robot.joints;
  for (std::size_t i = 0; i < joints.size(); ++i)
    asked.with_touches([i](Touch& touch) { touch.joint_rad[i] = -touch.joint_rad[i]; },
                       always(likely(LikelyCause::kAxisSign, about_joint(joints[i].name))), true);
}

/// An axis that lost its mastering.
void mastering(const Asked& asked) {
  constexpr double kAnyZeroRad = 0.1;
  for (std::size_t i = 0; i < asked.cell.robot.joints.size(); ++i) {
    const Joint& joint = asked.cell.robot.joints[i];
    const auto off_rad = [&](const Calibration& c) {
      const double off = correction_of(c, joint_parameter(ParameterKind::kTheta, i));
      return std::remainder(joint.sign * off, kRadPerTurn);
    };
    Cell loose = asked.cell;
    loose.robot.joints[i].errors = {JointError::kTheta};  // or another angle takes its share
    loose.robot.joints[i].tolerance_angle_rad = kAnyZeroRad;
    const Trial trial = fit_hypothesis(loose, asked.touches);
    if (!trial.found) continue;
    const double about_rad = off_rad(*trial.found);
    if (!(std::abs(about_rad) > 2.0 * joint.tolerance_angle_rad)) continue;
    asked.with_touches([&](Touch& touch) { touch.joint_rad[i] += about_rad; },
                       [&](const Calibration& c) {
                         return likely(LikelyCause::kMastering, about_joint(joint.name),
                                       {in_deg("add", about_rad + off_rad(c))});
                       });
  }
}

void exchanged_columns(const Asked& asked) {
  const auto& joints = asked.cell.robot.joints;
  for_each_pair(joints.size(), [&](std::size_t a, std::size_t b) {
    asked.with_touches(
        [=](Touch& touch) { std::swap(touch.joint_rad[a], touch.joint_rad[b]); },
        always(likely(LikelyCause::kExchangedColumns, {}, {},
                      {{about_joint(joints[a].name), {}}, {about_joint(joints[b].name), {}}})),
        true);
  });
}

void target_names(const Asked& asked) {
  for_each_pair(asked.cell.targets.size(), [&](std::size_t a, std::size_t b) {
    Names names(asked.cell);
    std::swap(names.of[a], names.of[b]);
    ask_for_names(asked, names);
  });
  // That went round among three targets or more.
  if (const auto names = better_names(asked.cell, asked.touches); names && names->changed() > 2)
    ask_for_names(asked, *names);
}

void names_by_lengths(const Asked& asked) {
  if (const auto names = better_names(asked.cell, asked.touches)) ask_for_names(asked, *names);
}

/// Of trackers and wires in other units, or of a left-handed tracker.
void readings(const Asked& asked) {
  constexpr double kMmPerInch = 25.4;
  const Cell& cell = asked.cell;
  for (const auto& ids : sets_of_readings(cell)) {
    std::vector<FindingPart> of;
    for (const std::string& id : ids)
      of.push_back({about_target(cell.targets[cell.target_index(id)]), {}});
    const auto ask = [&](double factor, double x_factor, const Finding& finding, bool no_farther) {
      asked.with_touches(
          [&](Touch& touch) {
            if (std::ranges::find(ids, touch.target) == ids.end()) return;
            touch.radius_m *= factor;
            for (double& m : touch.tracker_m) m *= factor;
            touch.tracker_m[0] *= x_factor;
          },
          always(finding), no_farther);
    };
    for (const double mm : {kMmPerM, 1.0 / kMmPerM, kMmPerInch})
      ask(mm, 1.0, likely(LikelyCause::kReadingsUnit, {}, {{"unit", mm, "mm"}}, of), true);
    if (cell.targets[cell.target_index(ids.front())].kind == TargetKind::kTracker)
      ask(1.0, -1.0, likely(LikelyCause::kReadingsHandedness, {}, {}, of), false);
  }
}

/// From a quarter, the middle or three quarters of its touches on, a target stands elsewhere.
void moved(const Asked& asked) {
  constexpr std::size_t kLeast = 4;  // on either side
  const std::vector<std::size_t> order = in_order(asked.touches);
  for (const Target& target : asked.cell.targets) {
    std::vector<std::size_t> own;
    for (const std::size_t i : order)
      if (asked.touches[i].target == target.id && asked.touches[i].set == TouchSet::kFit)
        own.push_back(i);
    for (const std::size_t quarter : {1, 2, 3}) {
      const std::size_t split = own.size() * quarter / 4;
      if (split < kLeast || own.size() - split < kLeast) continue;
      const TwoPlaces two = as_two(asked.cell, asked.touches, target.id, own[split - 1]);
      Hypothesis moved{two.cell, two.touches};
      moved.moved = MovedTarget{target.id, asked.among[own[split - 1]]};
      moved.cause = [&](const Calibration& c) {
        const std::size_t first = own[split];
        const double shift_m = moved_by_m(result_of(c, target.id), result_of(c, two.later));
        return likely(LikelyCause::kMoved,
                      after(about_target(target), asked.among[first], asked.touches[first]),
                      {in_mm("shift", shift_m)});
      };
      asked.ask(moved);
    }
  }
}

}  // namespace mistakes

}  // namespace cellcal::calib
