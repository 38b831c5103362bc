// What was read or written otherwise than it was made.

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "calib/consistency/session_order.h"
#include "calib/diagnose/data_association.h"
#include "calib/diagnose/mistakes.h"
#include "calib/diagnose/trial.h"
#include "calib/model/units.h"

namespace cellcal::calib {

namespace {

constexpr double kWholeTurnRad = 2.0 * std::numbers::pi;

/// A mistake that is the same whatever the calibration without it.
auto always(Finding finding) {
  return [=](const Calibration&) { return std::optional(finding); };
}

void radians(const Asked& asked, const Ask& ask) {
  double largest = 0.0;
  for (const Touch& touch : asked.touches)
    for (const double q : touch.joint_rad) largest = std::max(largest, std::abs(q) * kDegPerRad);
  if (largest > kWholeTurnRad) return;  // in degrees, as it was read
  std::vector<Touch> changed = asked.touches;
  for (Touch& touch : changed)
    for (double& q : touch.joint_rad) q *= kDegPerRad;
  ask({asked.cell, changed,
       always(likely(LikelyCause::kRadians, {}, {{"largest", largest, "deg"}}))});
}

void signs(const Asked& asked, const Ask& ask) {
  for (std::size_t i = 0; i < asked.cell.robot.joints.size(); ++i) {
    std::vector<Touch> changed = asked.touches;
    for (Touch& touch : changed) touch.joint_rad[i] = -touch.joint_rad[i];
    const Subject joint = about_joint(asked.cell.robot.joints[i].name);
    ask({asked.cell, changed, always(likely(LikelyCause::kAxisSign, joint)), true});
  }
}

/// An axis that lost its mastering.
void zeros(const Asked& asked, const Ask& ask) {
  constexpr double kAnyZeroRad = 0.1;
  for (std::size_t i = 0; i < asked.cell.robot.joints.size(); ++i) {
    const Joint& joint = asked.cell.robot.joints[i];
    const auto off_rad = [&](const Calibration& c) {
      const double off = correction_of(c, joint_parameter(ParameterKind::kTheta, i));
      return std::remainder(joint.sign * off, kWholeTurnRad);
    };
    Cell loose = asked.cell;
    loose.robot.joints[i].errors = {JointError::kTheta};  // or another angle takes its share
    loose.robot.joints[i].tolerance_angle_rad = kAnyZeroRad;
    const Trial trial = attempt(loose, asked.touches);
    if (!trial.found) continue;
    const double about_rad = off_rad(*trial.found);
    if (!(std::abs(about_rad) > 2.0 * joint.tolerance_angle_rad)) continue;
    std::vector<Touch> changed = asked.touches;
    for (Touch& touch : changed) touch.joint_rad[i] += about_rad;
    ask({asked.cell, changed, [&](const Calibration& c) {
           return likely(LikelyCause::kMastering, about_joint(joint.name),
                         {in_deg("add", about_rad + off_rad(c))});
         }});
  }
}

void exchanged_columns(const Asked& asked, const Ask& ask) {
  const auto& joints = asked.cell.robot.joints;
  for_each_pair(joints.size(), [&](std::size_t a, std::size_t b) {
    std::vector<Touch> changed = asked.touches;
    for (Touch& touch : changed) std::swap(touch.joint_rad[a], touch.joint_rad[b]);
    ask({asked.cell, changed,
         always(likely(LikelyCause::kExchangedColumns, {}, {},
                       {{about_joint(joints[a].name), {}}, {about_joint(joints[b].name), {}}})),
         true});
  });
}

Names as_named(const Cell& cell) {
  Names names;
  for (std::size_t t = 0; t < cell.targets.size(); ++t) names.of.push_back(t);
  return names;
}

void other_names(const Asked& asked, const Ask& ask) {
  const auto with = [&](const Names& names) {
    ask({asked.cell, names.given_to(asked.cell, asked.touches), always(names.cause(asked.cell))});
  };
  for_each_pair(asked.cell.targets.size(), [&](std::size_t a, std::size_t b) {
    Names swapped = as_named(asked.cell);
    std::swap(swapped.of[a], swapped.of[b]);
    with(swapped);
  });
  // That went round among three targets or more.
  if (const auto names = better_names(asked.cell, asked.touches); names && names->changed() > 2)
    with(*names);
}

/// Trackers and wires whose readings may be otherwise, together or each: all of a kind, and all.
std::vector<std::vector<std::string>> sets_of_readings(const Cell& cell) {
  std::vector<std::string> trackers, wires;
  for (const Target& target : cell.targets) {
    if (target.kind == TargetKind::kTracker) trackers.push_back(target.id);
    if (target.kind == TargetKind::kWire) wires.push_back(target.id);
  }
  std::vector<std::vector<std::string>> sets;
  for (const auto& all : {trackers, wires}) {
    if (!all.empty()) sets.push_back(all);
    if (all.size() > 1 && all.size() <= kMostTargets)
      for (const std::string& id : all) sets.push_back({id});
  }
  if (!trackers.empty() && !wires.empty()) {
    sets.push_back(trackers);
    sets.back().insert(sets.back().end(), wires.begin(), wires.end());
  }
  return sets;
}

/// Readings of trackers and wires in other units, or of a left-handed tracker.
void readings(const Asked& asked, const Ask& ask) {
  constexpr double kMmPerInch = 25.4;
  const Cell& cell = asked.cell;
  const auto changed = [&](const std::vector<std::string>& ids, double factor, double x_factor) {
    std::vector<Touch> touches = asked.touches;
    for (Touch& touch : touches) {
      if (std::find(ids.begin(), ids.end(), touch.target) == ids.end()) continue;
      touch.radius_m *= factor;
      for (double& m : touch.tracker_m) m *= factor;
      touch.tracker_m[0] *= x_factor;
    }
    return touches;
  };
  const auto cause = [&](LikelyCause which, const std::vector<std::string>& ids) {
    Finding finding = likely(which);
    for (const std::string& id : ids)
      finding.parts.push_back({about_target(cell.targets[cell.target_index(id)]), {}});
    return finding;
  };
  for (const auto& ids : sets_of_readings(cell)) {
    for (const double mm : {kMmPerM, 1.0 / kMmPerM, kMmPerInch}) {
      Finding finding = cause(LikelyCause::kReadingsUnit, ids);
      finding.evidence = {{"unit", mm, "mm"}};
      ask({cell, changed(ids, mm, 1.0), always(std::move(finding)), true});
    }
    if (cell.targets[cell.target_index(ids.front())].kind == TargetKind::kTracker)
      ask({cell, changed(ids, 1.0, -1.0), always(cause(LikelyCause::kReadingsHandedness, ids))});
  }
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
  const auto its = std::find_if(c.targets.begin(), c.targets.end(),
                                [&](const TargetResult& t) { return t.id == id; });
  return its == c.targets.end() ? TargetResult{} : *its;
}

/// From the given one of a target's own touches on it stands elsewhere.
void moved_at(const Asked& asked, const Target& target, const std::vector<std::size_t>& own,
              std::size_t split, const Ask& ask) {
  Hypothesis moved{asked.cell, asked.touches};
  Target later = target;
  later.id = id_after_move(asked.cell, target.id);
  later.centre_sigma_m = 0.0;  // the touches say where
  moved.cell.targets.push_back(later);
  bool passed = false;
  for (const std::size_t i : in_order(asked.touches)) {
    passed = passed || i == own[split];
    if (passed && moved.touches[i].target == target.id) moved.touches[i].target = later.id;
  }
  moved.moved = MovedTarget{};
  moved.moved->target = target.id;
  moved.moved->after_touch = asked.among[own[split - 1]];
  moved.cause = [&](const Calibration& c) {
    const double shift_m = moved_by_m(result_of(c, target.id), result_of(c, later.id));
    return likely(LikelyCause::kMoved,
                  after(about_target(target), asked.among[own[split]], asked.touches[own[split]]),
                  {in_mm("shift", shift_m)});
  };
  ask(moved);
}

/// From a quarter, the middle or three quarters of its touches on, a target stands elsewhere.
void moved(const Asked& asked, const Ask& ask) {
  constexpr int kLeastEachSide = 4;
  for (const Target& target : asked.cell.targets) {
    std::vector<std::size_t> own;
    for (const std::size_t i : in_order(asked.touches))
      if (asked.touches[i].target == target.id && asked.touches[i].set == TouchSet::kFit)
        own.push_back(i);
    for (const int quarter : {1, 2, 3}) {
      const std::size_t split = own.size() * static_cast<std::size_t>(quarter) / 4;
      if (split >= kLeastEachSide && own.size() - split >= kLeastEachSide)
        moved_at(asked, target, own, split, ask);
    }
  }
}

constexpr std::array kMistakesOfTouches = {
    Mistake{radians},     Mistake{signs},    Mistake{zeros}, Mistake{exchanged_columns},
    Mistake{other_names}, Mistake{readings}, Mistake{moved}};

}  // namespace

std::span<const Mistake> mistakes_of_touches() { return kMistakesOfTouches; }

void for_each_pair(std::size_t size, const std::function<void(std::size_t, std::size_t)>& ask) {
  std::size_t asked = 0;
  for (std::size_t a = 0; a < size; ++a)
    for (std::size_t b = a + 1; b < size && asked < kMostPairs; ++b, ++asked) ask(a, b);
}

}  // namespace cellcal::calib
