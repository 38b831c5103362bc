#include "calib/plan/pool.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

#include "calib/model/long_work.h"
#include "calib/plan/duration.h"
#include "calib/plan/track.h"

namespace cellcal::calib {

namespace {

constexpr std::size_t kLeastJoints = 6;

std::size_t arm_joints(const Robot& robot) { return robot.joints.size() - robot.first_turning(); }

void check_cell(const Cell& cell) {
  require_any_turn(cell.robot);
  refuse_positioner(cell.robot, "a plan touch by touch", "Plan a calibration, 'cellcal plan'");
  bool sphere = false;
  for (const Target& target : cell.targets) {
    if (target.kind != TargetKind::kSphere) continue;
    sphere = true;
    if (!target.has_centre)
      throw PlanError(
          PlanError::Kind::kCell, target.id,
          fmt::format("target {}: a plan needs its rough place. Add centre_mm to the cell file",
                      target.id));
  }
  if (!sphere)
    throw PlanError(
        PlanError::Kind::kCell,
        "the cell has no sphere to touch. Touch other targets by hand, and use 'cellcal "
        "identify' with the file");
}

std::string words_of(const Target& target) {
  return (target.kind == TargetKind::kPlane ? "plane " : "sphere ") + target.id;
}

/// Validates in the initialiser list, before any computation.
const Cell& checked(const Cell& cell) {
  check_cell(cell);
  return cell;
}

/// Those with a clear line: stand-off and clear point do not imply it.
std::vector<Candidate> searchable(std::vector<Candidate> candidates, const Clearance& clearance) {
  std::erase_if(candidates, [&](const Candidate& c) { return !clear_line(clearance, c); });
  return candidates;
}

}  // namespace

bool reaches_any_turn(const Robot& robot) { return arm_joints(robot) >= kLeastJoints; }

void require_any_turn(const Robot& robot) {
  if (reaches_any_turn(robot)) return;
  throw PlanError(
      PlanError::Kind::kCell,
      fmt::format(
          "the robot file has {} joints; touches are planned for arms of {} or more. Touch by hand, "
          "and use 'cellcal identify' with the file",
          arm_joints(robot), kLeastJoints));
}

ArmModel planning_arm(const Cell& cell) {
  require_speeds(cell.robot);
  Robot robot = cell.robot;
  for (Joint& joint : robot.joints) {
    joint.errors.clear();
    joint.compliance_sigma_rad_per_nm = 0.0;
    joint.harmonics.clear();
    if (joint.guide) joint.guide = LinearGuide{joint.guide->along};
  }
  const auto known = [](Tool tool) {
    tool.deflection_sigma = 0.0;
    tool.tcp_sigma_m.setZero();
    return tool;
  };
  std::vector<Tool> others;
  for (const Tool& tool : cell.other_tools) others.push_back(known(tool));
  return {robot, known(cell.tool), others};
}

JointVector middle_posture(const Robot& robot) {
  JointVector q;
  constexpr double kInsideRad = 0.3;  // a joint with its zero near a limit is centred
  for (const Joint& joint : robot.joints) {
    const bool inside = joint.min_rad < -kInsideRad && joint.max_rad > kInsideRad;
    q.push_back(inside && !joint.is_prismatic() ? 0.0 : (joint.min_rad + joint.max_rad) / 2.0);
  }
  const std::size_t first = robot.first_turning(), arm_joints = q.size() - first;
  const auto set = [&](std::size_t arm_joint, double rad) {
    const Joint& joint = robot.joints[first + arm_joint];
    q[first + arm_joint] = std::clamp(rad, joint.min_rad, joint.max_rad);
  };
  if (arm_joints >= 3) {
    set(1, -1.2);
    set(2, 1.6);
  }
  if (arm_joints >= 5) set(4, 1.0);
  return q;
}

JointVector resting_posture(const Robot& robot, const Clearance& clearance) {
  return resting_posture(robot, [&](const JointVector& q) { return clearance.clear(q); });
}

JointVector resting_posture(const Robot& robot,
                            const std::function<bool(const JointVector&)>& is_clear) {
  const JointVector middle = middle_posture(robot);
  const std::size_t first = robot.first_turning();
  if (is_clear(middle) || middle.size() < first + 3) return middle;
  const auto changed = [&](JointVector& q, std::size_t i, double rad) {
    constexpr double kMarginRad = 0.1;
    const Joint& joint = robot.joints[i];
    q[i] = std::clamp(q[i] + rad, joint.min_rad + kMarginRad,
                      std::max(joint.min_rad + kMarginRad, joint.max_rad - kMarginRad));
  };
  // Turned aside, lifted, folded: the smallest change first; then with the tool on another side.
  constexpr double kTurnRad[] = {0.0, 0.5, -0.5, 1.0, -1.0, 1.6, -1.6};
  constexpr double kLiftRad[] = {0.0, -0.3, 0.3, -0.6};
  constexpr double kRollRad[] = {0.0, 0.5 * std::numbers::pi, -0.5 * std::numbers::pi,
                                 std::numbers::pi};
  const bool has_wrist = middle.size() >= first + kLeastJoints;
  for (const bool bends_back : {false, true})
    for (const double roll : kRollRad) {
      if (!has_wrist && (bends_back || roll != 0.0)) continue;
      JointVector rolled = middle;
      if (bends_back) changed(rolled, first + 4, -2.0 * middle[first + 4]);
      if (roll != 0.0) changed(rolled, middle.size() - 1, roll);
      for (const double fold : kLiftRad)
        for (const double lift : kLiftRad)
          for (const double turn : kTurnRad) {
            JointVector q = rolled;
            changed(q, first, turn);
            changed(q, first + 1, lift);
            changed(q, first + 2, fold);
            if (is_clear(q)) return q;
          }
    }
  return middle;  // the caller reports the obstacle
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
  const SearchReach reach =
      search_reach(TrackOff(cell.robot), cell.targets[c.target], c.contact, options);
  touch.search_m = reach.before_m + reach.behind_m;
  touch.expected_m = reach.before_m;
  return touch;
}

Pool::Pool(const Cell& cell, const PlanOptions& options, int per_target, Kinds kinds,
           JointVector rest)
    : cell_(checked(cell)),
      arm_(planning_arm(cell)),
      clearance_(cell, arm_),
      middle_(rest.empty() ? resting_posture(cell.robot, clearance_) : std::move(rest)),
      router_(cell, arm_, clearance_, middle_, options.limit_margin_rad),
      candidates_(searchable(find_candidates(cell, arm_, clearance_, options, per_target, kinds),
                             clearance_)),
      connected_(candidates_.size(), -1),
      options_(options) {
  // Checked first: a sphere out of reach also affects all further steps.
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    const bool any = std::any_of(candidates_.begin(), candidates_.end(),
                                 [&](const Candidate& c) { return c.target == t; });
    if (!is_planned(cell.targets[t], kinds) || any) continue;
    const auto what = hindrance(cell, arm_, clearance_, options, t);
    if (!what)
      throw PlanError(
          PlanError::Kind::kOutOfReach, cell.targets[t].id,
          fmt::format("{} cannot be reached from any direction inside the joint limits. Check its "
                      "centre_mm, or move it",
                      words_of(cell.targets[t])));
    const bool by_itself = what->hit.other == words_of(cell.targets[t]);
    throw PlanError(
        PlanError::Kind::kInTheWay, cell.targets[t].id,
        fmt::format("{} cannot be touched: from direction {} {}. {}", words_of(cell.targets[t]),
                    direction_words(what->from), words(what->hit),
                    by_itself ? "Mount a longer or slimmer tool" : "Move it or the obstacle"));
  }
  if (const auto what = clearance_.hit(middle_))
    throw PlanError(PlanError::Kind::kInTheWay,
                    fmt::format("where the arm rests between touches {}. Move it", words(*what)));
  for (std::size_t t = 0; t < cell.targets.size(); ++t) {
    if (!is_planned(cell.targets[t], kinds)) continue;
    if (any_connected(t)) continue;
    try_harder(t);
    if (any_connected(t)) continue;
    const Candidate* first = &*std::find_if(candidates_.begin(), candidates_.end(),
                                            [&](const Candidate& c) { return c.target == t; });
    throw PlanError(
        PlanError::Kind::kInTheWay, cell.targets[t].id,
        fmt::format(
            "{} can be reached, but not by a clear way from the resting posture and back: on the "
            "way to its touch from direction {} {}. Move it or the obstacle",
            words_of(cell.targets[t]), direction_words(first->normal),
            words_or(clearance_.hit(middle_, first->standoff), "a joint is at its limit")));
  }
}

bool Pool::any_connected(std::size_t target) {
  for (std::size_t i = 0; i < candidates_.size(); ++i)
    if (candidates_[i].target == target && connected(i)) return true;
  return false;
}

bool Pool::try_harder(std::size_t target) {
  router_.mark_hard(target);
  bool any = false;
  for (std::size_t i = 0; i < candidates_.size(); ++i)
    if (candidates_[i].target == target && connected_[i] == 0) {
      connected_[i] = -1;
      any = true;
    }
  return any;
}

bool Pool::connected(std::size_t candidate) {
  poll_cancelled();
  signed char& known = connected_[candidate];
  if (known < 0) known = router_.connect(candidates_[candidate]) ? 1 : 0;
  return known == 1;
}

void Pool::vary(const std::vector<std::size_t>& like, int count, double by_rad, Random& random) {
  const int each = count / std::max<int>(1, static_cast<int>(like.size()));
  for (const std::size_t k : like) {
    poll_cancelled();
    // A copy: the candidates grow meanwhile.
    const Candidate one = candidates_[k];
    for (Candidate& c : searchable(
             calib::vary(cell_, arm_, clearance_, options_, one, each, by_rad, random), clearance_))
      candidates_.push_back(std::move(c));
    connected_.resize(candidates_.size(), -1);
  }
}

std::vector<std::size_t> Pool::forget(std::size_t first, std::vector<std::size_t> kept) {
  std::vector<std::size_t> order;
  for (const std::size_t k : kept)
    if (k >= first) order.push_back(k);
  std::sort(order.begin(), order.end());
  std::size_t next = first;
  for (const std::size_t k : order) {  // never moves to a later position
    if (k != next) {
      candidates_[next] = std::move(candidates_[k]);
      connected_[next] = connected_[k];
    }
    std::replace(kept.begin(), kept.end(), k, next++);
  }
  candidates_.resize(next);
  connected_.resize(next);
  return kept;
}

}  // namespace cellcal::calib
