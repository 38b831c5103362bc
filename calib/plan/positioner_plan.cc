#include "calib/plan/positioner_plan.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <numbers>
#include <optional>
#include <span>

#include "calib/model/long_work.h"
#include "calib/model/units.h"
#include "calib/plan/choose.h"
#include "calib/plan/surroundings.h"
#include "calib/plan/track.h"
#include "calib/plan/visit.h"

namespace cellcal::calib {

namespace {

constexpr Kinds kTouched = Kinds::kSpheresAndPlanes;
/// Each setting costs a turn of the positioner with the arm at rest. More hardly add information.
constexpr int kSettingsOfOne = 7, kSettingsOfTwo = 12;
/// Off the limits, and within one turn.
constexpr double kInsideLimitsRad = 0.05, kMostTurnRad = std::numbers::pi - kInsideLimitsRad;
/// Height of a stand on a positioner whose file does not state it.
constexpr double kStandOnTableM = 0.03;
/// Candidates per touch and sphere over all settings, at least so many at each.
constexpr int kCandidatesOverSettings = 24, kLeastAtSetting = 20;
/// Touches to a goal that candidates are made for, where more are allowed.
constexpr int kCandidatesToGoal = 100;
constexpr int kSettingExchanges = 4, kLeastOnSphere = 5;
/// Pieces of a turn with less motion of anything carried are not halved further; where the arm waits there is more room.
constexpr double kShortTurnM = 0.0005, kRoomM = 0.01;
/// Added to the levers of a turn: how far (64b) may change in a radian.
constexpr double kOffChangesM = 0.02;

/// Van der Corput's sequence.
double radical_inverse(int index, int base) {
  double result = 0.0, share = 1.0;
  for (; index > 0; index /= base) {
    share /= base;
    result += share * (index % base);
  }
  return result;
}

std::string setting_words(const Robot& robot, const std::vector<double>& setting) {
  std::string words;
  for (std::size_t j = 0; j < setting.size(); ++j)
    words += fmt::format("{}{} {:.0f} deg", j > 0 ? ", " : "", robot.positioner[j].name,
                         setting[j] * kDegPerRad);
  return words;
}

/// The robot with one error of an axis of its positioner at this size; not its scale.
Robot with_error(const Robot& robot, std::size_t axis, AxisError error, double size) {
  Robot erring = robot;
  Eigen::Isometry3d& frame = erring.positioner[axis].frame;
  const Eigen::Vector3d along = error == AxisError::kX || error == AxisError::kTurnX
                                    ? Eigen::Vector3d::UnitX()
                                    : Eigen::Vector3d::UnitY();
  if (error == AxisError::kX || error == AxisError::kY)
    frame.translate(size * along);
  else
    frame.rotate(Eigen::AngleAxisd(size, along));
  return erring;
}

/// Angles of so many axes at which places on them are taught unless stated otherwise.
std::vector<double> usually_taught(const Robot& robot, std::size_t axes) {
  std::vector<double> taught;
  for (const PositionerAxis& axis : std::span(robot.positioner).first(axes))
    taught.push_back(std::clamp(0.0, axis.min_rad, axis.max_rad));
  return taught;
}

/// Square of how far off `at_m`, base frame, may be by what an axis gives under its load at this setting.
double given_way_m2(const Robot& robot, std::size_t axis, std::span<const double> setting,
                    const std::vector<double>& taught, const Eigen::Vector3d& at_m) {
  const PositionerAxis& its = robot.positioner[axis];
  std::vector<double> before = usually_taught(robot, robot.positioner.size());
  std::ranges::copy(taught, before.begin());
  const Eigen::Vector3d more =
      carried_moment_nm(robot, setting)[axis] - carried_moment_nm(robot, before)[axis];
  const Eigen::Isometry3d stands = carried_at(robot, setting.first(axis)) * its.frame;
  const double lever_m = (at_m - stands.translation()).norm();
  const double turn_rad = std::hypot(its.bearing_sigma_rad_per_nm * more.head<2>().norm(),
                                     its.compliance_sigma_rad_per_nm * more.z());
  return std::pow(lever_m * turn_rad, 2);
}

/// How far off what as many axes as `taught` has carry at `place_m`, in the frame of the last of them, may be
/// at this setting by the axes' prior. It was taught with them at `taught`, and is known as it is seen from
/// there.
double off_by_positioner_m(const Robot& robot, std::span<const double> setting,
                           const std::vector<double>& taught, const Eigen::Vector3d& place_m) {
  const auto angles = setting.first(taught.size());
  constexpr double kSigmas = 3.0;
  const Eigen::Vector3d seen = carried_at(robot, taught) * place_m;
  const Eigen::Vector3d expected = carried_at(robot, angles) * place_m;
  double squares = 0.0;
  for (std::size_t j = 0; j < angles.size(); ++j) {
    const PositionerAxis& axis = robot.positioner[j];
    for (const auto& [error, sigma] : {std::pair(AxisError::kX, axis.place_sigma_m),
                                       std::pair(AxisError::kY, axis.place_sigma_m),
                                       std::pair(AxisError::kTurnX, axis.direction_sigma_rad),
                                       std::pair(AxisError::kTurnY, axis.direction_sigma_rad)}) {
      if (!(sigma > 0.0)) continue;
      const Robot erring = with_error(robot, j, error, sigma);
      squares +=
          (carried_at(erring, angles) * (carried_at(erring, taught).inverse() * seen) - expected)
              .squaredNorm();
    }
    std::vector<double> scaled(angles.begin(), angles.end());
    scaled[j] += axis.scale_sigma * (angles[j] - taught[j]);
    squares += (carried_at(robot, scaled) * place_m - expected).squaredNorm();
    squares += given_way_m2(robot, j, setting, taught, expected);
  }
  return kSigmas * std::sqrt(squares);  // (64b)
}

/// Box around an obstacle, in its frame; empty: its mesh is not loaded.
Eigen::AlignedBox3d box_around(const Obstacle& obstacle) {
  Eigen::Vector3d half = obstacle.size_m / 2.0;
  if (obstacle.shape == ObstacleShape::kCylinder)
    half = Eigen::Vector3d(obstacle.diameter_m, obstacle.diameter_m, obstacle.height_m) / 2.0;
  Eigen::AlignedBox3d box;
  if (obstacle.shape != ObstacleShape::kMesh) return {-half, half};
  if (obstacle.mesh)
    for (const Eigen::Vector3d& vertex : obstacle.mesh->vertices_m) box.extend(vertex);
  return box;
}

/// (64b) is convex in the place: the farthest corner bounds it.
double off_by_positioner_m(const Robot& robot, std::span<const double> setting,
                           const Obstacle& obstacle) {
  const Eigen::AlignedBox3d box = box_around(obstacle);
  if (box.isEmpty()) return 0.0;
  const std::vector<double> taught =
      usually_taught(robot, static_cast<std::size_t>(obstacle.carried_by));
  double off_m = 0.0;
  for (int corner = 0; corner < 8; ++corner) {
    const auto which = static_cast<Eigen::AlignedBox3d::CornerType>(corner);
    off_m = std::max(
        off_m, off_by_positioner_m(robot, setting, taught, obstacle.frame * box.corner(which)));
  }
  return off_m;
}

/// The candidates at one setting, of those targets that can be touched there.
struct SettingPool {
  std::vector<double> angles_rad;
  std::unique_ptr<Cell> cell;
  std::unique_ptr<Pool> pool;  ///< null: no target can be touched
  std::size_t first = 0;       ///< index of its first candidate among those of all settings
};

/// Why a target cannot be touched, by its id; empty: why the arm cannot rest.
using Refused = std::map<std::string, PlanError>;

/// `wanted`: per target; others are obstacles.
SettingPool setting_at(const Cell& cell, std::vector<double> angles_rad,
                       const std::vector<bool>& wanted, const PlanOptions& options, int per_target,
                       const JointVector& rest, Refused& refused) {
  SettingPool setting{std::move(angles_rad), nullptr, nullptr};
  setting.cell = std::make_unique<Cell>(at_setting(cell, setting.angles_rad));
  for (std::size_t t = 0; t < cell.targets.size(); ++t)
    if (!wanted[t]) setting.cell->targets[t].obstacle_only = true;
  std::vector<PlanError> why;
  setting.pool = pool_of_touchable(*setting.cell, options, per_target, kTouched, rest, why);
  for (const PlanError& error : why) refused.insert_or_assign(error.target, error);
  return setting;
}

/// All settings of a plan, and their candidates one after another.
class SettingPools {
 public:
  /// `rest`: where the arm waits.
  SettingPools(const Cell& cell, const PlanOptions& options, const JointVector& rest)
      : cell_(cell) {
    const std::vector<std::vector<double>> all = settings_of(cell.robot);
    const int most = options.goal_u95_m > 0.0 ? kCandidatesToGoal : options.fit_touches;
    const int total = std::min(most, options.fit_touches) + options.check_touches;
    const int per_target =
        std::max(kLeastAtSetting, kCandidatesOverSettings * total /
                                      static_cast<int>(cell.targets.size() * all.size()));
    Refused refused;
    for (std::size_t k = 0; k < all.size(); ++k) {
      const Part part(PlanStep::kReach,
                      kReachShare * static_cast<double>(k) / static_cast<double>(all.size()),
                      kReachShare * static_cast<double>(k + 1) / static_cast<double>(all.size()));
      add(setting_at(cell, all[k], wanted(), options, per_target, rest, refused));
    }
    if (candidates_.empty() && !refused.empty()) throw refused.begin()->second;
    for (std::size_t t = 0; t < cell.targets.size(); ++t)
      if (const auto why = refused.find(cell.targets[t].id); why != refused.end() && !is_met(t))
        throw why->second;
  }

  const std::vector<Candidate>& candidates() const { return candidates_; }
  const std::vector<SettingPool>& all() const { return settings_; }
  std::size_t setting_of(std::size_t candidate) const {
    std::size_t k = settings_.size();
    while (settings_[--k].first > candidate) continue;
    return k;
  }
  bool connected(std::size_t candidate) const {
    const SettingPool& setting = settings_[setting_of(candidate)];
    return setting.pool->connected(candidate - setting.first);
  }
  /// With its ways from and to the resting posture, once it is connected.
  Candidate with_ways(std::size_t candidate) const {
    const SettingPool& setting = settings_[setting_of(candidate)];
    return setting.pool->candidates()[candidate - setting.first];
  }

 private:
  bool is_met(std::size_t target) const {
    return std::ranges::any_of(candidates_,
                               [target](const Candidate& c) { return c.target == target; });
  }
  /// Targets on the floor are touched at one setting.
  std::vector<bool> wanted() const {
    std::vector<bool> all;
    for (std::size_t t = 0; t < cell_.targets.size(); ++t)
      all.push_back(cell_.targets[t].carried_by > 0 || !is_met(t));
    return all;
  }
  void add(SettingPool setting) {
    if (setting.pool == nullptr) return;
    setting.first = candidates_.size();
    for (Candidate candidate : setting.pool->candidates()) {
      candidate.positioner_rad = setting.angles_rad;
      candidates_.push_back(std::move(candidate));
    }
    settings_.push_back(std::move(setting));
  }

  const Cell& cell_;
  std::vector<SettingPool> settings_;
  std::vector<Candidate> candidates_;
};

/// The fit touches, to a goal as many as it takes. Throws PlanError if too few are reachable.
Choice choose_at_settings(const Cell& cell, const PlanOptions& options, int targets,
                          const SettingPools& settings) {
  ChooseOptions how;
  how.criterion = options.criterion;
  how.region = options.region;
  how.exchanges = kSettingExchanges;
  how.seed = options.seed;
  how.possible = [&](std::size_t i) { return settings.connected(i); };
  Choice choice;
  const auto choose_of = [&](int count) {
    how.count = count;
    how.least_per_target =
        std::min(std::max(kLeastOnSphere, count / (2 * targets)), count / targets);
    choice = choose(cell, settings.candidates(), how);
    if (static_cast<int>(choice.picked.size()) < count)
      throw PlanError(
          PlanError::Kind::kTooFew,
          fmt::format(
              "only {} of {} touches can be reached by a clear way. Move the targets nearer "
              "to the middle of the workspace, or plan fewer touches",
              choice.picked.size(), count));
  };
  choose_to_goal(options, targets, choose_of, choice);
  return choice;
}

/// The settings with touches, each next one near the last.
std::vector<std::size_t> order_of(const SettingPools& settings,
                                  const std::vector<std::vector<ToVisit>>& todo) {
  std::vector<std::size_t> used;
  for (std::size_t k = 0; k < todo.size(); ++k)
    if (!todo[k].empty()) used.push_back(k);
  const auto count = static_cast<Eigen::Index>(used.size());
  const auto apart = [&](std::size_t a, std::size_t b) {
    double farthest_rad = 0.0;
    for (std::size_t j = 0; j < settings.all()[a].angles_rad.size(); ++j)
      farthest_rad = std::max(farthest_rad, std::abs(settings.all()[a].angles_rad[j] -
                                                     settings.all()[b].angles_rad[j]));
    return farthest_rad;
  };
  Eigen::MatrixXd cost(count, count);
  Eigen::VectorXd from_start(count);
  for (Eigen::Index a = 0; a < count; ++a) {
    from_start[a] = apart(0, used[static_cast<std::size_t>(a)]);
    for (Eigen::Index b = 0; b < count; ++b)
      cost(a, b) = apart(used[static_cast<std::size_t>(a)], used[static_cast<std::size_t>(b)]);
  }
  std::vector<std::size_t> order;
  for (const std::size_t k : short_order(cost, from_start)) order.push_back(used[k]);
  return order;
}

/// One visit after another, from `start` and back to it each time.
Plan visits_in_turn(const Cell& cell, const PlanOptions& options, const SettingPools& settings,
                    std::vector<std::vector<ToVisit>> todo, const JointVector& start) {
  Plan plan;
  plan.start = start;
  const std::vector<double>* last = nullptr;
  for (const std::size_t k : order_of(settings, todo)) {
    const SettingPool& setting = settings.all()[k];
    if (const auto what = setting.pool->clearance().hit(start))
      throw PlanError(PlanError::Kind::kArmStands,
                      fmt::format("with the positioner at {} the arm is too close to something to "
                                  "start: {}. Jog it free",
                                  setting_words(cell.robot, setting.angles_rad), words(*what)));
    if (last != nullptr) require_clear_turn(cell, *last, setting.angles_rad, start);
    Plan part = visit(*setting.cell, options, setting.pool->clearance(), setting.pool->router(),
                      std::move(todo[k]), start);
    if (part.home.empty())
      throw PlanError(PlanError::Kind::kInTheWay, part.touches.back().target,
                      fmt::format("{}: no clear way back to where the arm waits while the "
                                  "positioner turns. Start the plan elsewhere",
                                  part.touches.back().target));
    if (last != nullptr) {
      part.touches.front().wait = std::move(plan.home);
      part.touches.front().wait_rad = *last;
    }
    for (PlannedTouch& touch : part.touches) {
      touch.positioner_rad = setting.angles_rad;
      plan.touches.push_back(std::move(touch));
    }
    plan.home = std::move(part.home);
    last = &setting.angles_rad;
  }
  return plan;
}

/// Balls around what is carried, in the frame of its last axis: a target with its stand, an obstacle's corners.
using Balls = std::vector<std::pair<Eigen::Vector3d, double>>;

Balls balls_around(const Target& target) {
  if (!target.has_centre) return {};
  const double height_m = target.stand_height_m > 0.0 ? target.stand_height_m : kStandOnTableM;
  return {{target.centre_m,
           height_m + std::max({target.stand_diameter_m, target.diameter_m, target.extent_m})}};
}

Balls balls_around(const Obstacle& obstacle) {
  Balls corners;
  const Eigen::AlignedBox3d box = box_around(obstacle);
  for (int corner = 0; corner < 8 && !box.isEmpty(); ++corner)
    corners.emplace_back(
        obstacle.frame * box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)), 0.0);
  return corners;
}

/// Per axis of the positioner, how far anything carried moves at most in a radian of it [m]: the axes in between
/// stretched out.
std::vector<double> levers_m(const Cell& cell) {
  std::vector<double> levers(cell.robot.positioner.size(), 0.0);
  const auto note = [&](const auto& carried) {
    for (const auto& [place_m, about_m] : balls_around(carried)) {
      double off_axis_m = place_m.template head<2>().norm() + about_m;
      double beyond_m = place_m.norm() + about_m;
      for (auto j = static_cast<std::size_t>(carried.carried_by); j-- > 0;) {
        levers[j] = std::max(levers[j], off_axis_m + kOffChangesM);
        off_axis_m = beyond_m += cell.robot.positioner[j].frame.translation().norm();
      }
    }
  };
  for (const Target& target : cell.targets) note(target);
  for (const Obstacle& obstacle : cell.obstacles) note(obstacle);
  return levers;
}

/// Settings about a middle: those on the way from one end to the other, or all in the box between.
struct Sweep {
  std::vector<double> middle_rad, half_rad;
  bool box = false;
};

struct MetOnSweep {
  std::vector<double> at_rad;
  Hit hit;
};

/// The arm at rest, and all that the positioner carries on its turns.
class Sweeps {
 public:
  explicit Sweeps(const Cell& cell)
      : cell_(cell),
        arm_(planning_arm(at_setting(cell, zero(cell.robot)))),
        lever_m_(levers_m(cell)) {}

  /// Anything in the way of the arm at one of these settings; pieces of less motion than `least_m` [m] count as met
  /// where they are not certainly clear.
  std::optional<MetOnSweep> met(const Sweep& sweep, double least_m, const JointVector& rest) const {
    poll_cancelled();
    double moves_m = 0.0;
    std::size_t widest = 0;
    for (std::size_t j = 0; j < lever_m_.size(); ++j) {
      moves_m += std::abs(sweep.half_rad[j]) * lever_m_[j];
      if (std::abs(sweep.half_rad[j]) * lever_m_[j] >
          std::abs(sweep.half_rad[widest]) * lever_m_[widest])
        widest = j;
    }
    const auto hit = Clearance(widened(sweep.middle_rad, moves_m), arm_).hit(rest);
    if (!hit) return std::nullopt;
    if (moves_m <= least_m) return MetOnSweep{sweep.middle_rad, *hit};
    Sweep first = sweep, second = sweep;
    for (std::size_t j = 0; j < lever_m_.size(); ++j) {
      if (sweep.box && j != widest) continue;
      first.half_rad[j] = second.half_rad[j] = sweep.half_rad[j] / 2.0;
      first.middle_rad[j] -= sweep.half_rad[j] / 2.0;
      second.middle_rad[j] += sweep.half_rad[j] / 2.0;
    }
    if (auto before = met(first, least_m, rest)) return before;
    return met(second, least_m, rest);
  }

 private:
  static std::vector<double> zero(const Robot& robot) {
    return std::vector<double>(robot.positioner.size(), 0.0);
  }

  /// The cell at a setting, with margins from all that is carried wider by this: hypot(margin, off).
  Cell widened(const std::vector<double>& setting, double by_m) const {
    Cell here = at_setting(cell_, setting);
    const auto widen = [by_m](auto& thing, const auto& carried) {
      if (carried.carried_by == 0) return;
      const double keeps_m = std::hypot(kBodyMarginM, thing.off_m);
      thing.off_m = std::sqrt(thing.off_m * thing.off_m + (2.0 * keeps_m + by_m) * by_m);
    };
    for (std::size_t t = 0; t < here.targets.size(); ++t) widen(here.targets[t], cell_.targets[t]);
    for (std::size_t i = 0; i < here.obstacles.size(); ++i)
      widen(here.obstacles[i], cell_.obstacles[i]);
    return here;
  }

  const Cell& cell_;
  ArmModel arm_;
  std::vector<double> lever_m_;
};

}  // namespace

void require_clear_turn(const Cell& cell, const std::vector<double>& from,
                        const std::vector<double>& to, const JointVector& rest) {
  Sweep sweep{from, to};
  for (std::size_t j = 0; j < from.size(); ++j) {
    sweep.middle_rad[j] = (from[j] + to[j]) / 2.0;
    sweep.half_rad[j] = (to[j] - from[j]) / 2.0;
  }
  if (const auto met = Sweeps(cell).met(sweep, kShortTurnM, rest))
    throw PlanError(PlanError::Kind::kInTheWay,
                    fmt::format("while the positioner passes {} the waiting arm is in the way: {}. "
                                "Let the plan start elsewhere, or narrow the axes' limits",
                                setting_words(cell.robot, met->at_rad), words(met->hit)));
}

bool stands_at(const std::vector<double>& angles, const std::vector<double>& setting) {
  // Beyond what the controller's program leaves an external axis at, 0.1 deg.
  constexpr double kStandsRad = 0.0021;
  return std::ranges::equal(angles, setting,
                            [](double a, double b) { return std::abs(a - b) <= kStandsRad; });
}

std::vector<double> resting_at(const Robot& robot, const std::vector<double>& angles) {
  std::vector<double> within = angles;
  for (std::size_t j = 0; j < std::min(within.size(), robot.positioner.size()); ++j)
    within[j] = std::clamp(within[j], robot.positioner[j].min_rad, robot.positioner[j].max_rad);
  return stands_at(within, angles) ? within : angles;
}

Cell at_setting(const Cell& cell, const std::vector<double>& positioner_rad) {
  Cell still = cell;
  const std::vector<double> zero(positioner_rad.size(), 0.0);
  const auto of = [](const std::vector<double>& angles, int axes) {
    return std::span(angles).first(static_cast<std::size_t>(axes));
  };
  for (Target& target : still.targets) {
    if (target.carried_by == 0) continue;
    const std::span<const double> angles = of(positioner_rad, target.carried_by);
    const Eigen::Isometry3d place = carried_at(cell.robot, angles);
    // Upright with all axes at 0.
    target.stand_up = place.linear() *
                      carried_at(cell.robot, of(zero, target.carried_by)).linear().transpose() *
                      up_of(cell.robot);
    if (!(target.stand_height_m > 0.0)) target.stand_height_m = kStandOnTableM;
    if (target.taught_rad.empty()) target.taught_rad = usually_taught(cell.robot, angles.size());
    // For a sphere to be located, the centre of its search box.
    if (!target.has_centre) target.centre_m = (target.low_m + target.high_m) / 2.0;
    target.off_m =
        off_by_positioner_m(cell.robot, positioner_rad, target.taught_rad, target.centre_m);
    target.centre_m = place * target.centre_m;
    target.carried_by = 0;
  }
  for (Obstacle& obstacle : still.obstacles) {
    if (obstacle.carried_by == 0) continue;
    const std::span<const double> angles = of(positioner_rad, obstacle.carried_by);
    obstacle.off_m = off_by_positioner_m(cell.robot, positioner_rad, obstacle);
    obstacle.frame = carried_at(cell.robot, angles) * obstacle.frame;
    obstacle.carried_by = 0;
  }
  still.robot.positioner.clear();
  return still;
}

std::unique_ptr<Pool> pool_of_touchable(Cell& cell, const PlanOptions& options, int per_target,
                                        Kinds kinds, const JointVector& rest,
                                        std::vector<PlanError>& refused) {
  const auto is_left = [kinds](const Target& target) { return is_planned(target, kinds); };
  while (std::ranges::any_of(cell.targets, is_left)) {
    try {
      return std::make_unique<Pool>(cell, options, per_target, kinds, rest);
    } catch (const PlanError& error) {
      using enum PlanError::Kind;
      if (error.kind != kOutOfReach && error.kind != kInTheWay) throw;
      refused.push_back(error);
      if (error.target.empty()) break;
      cell.targets[cell.target_index(error.target)].obstacle_only = true;
    }
  }
  return nullptr;
}

JointVector waiting_posture(const Cell& cell) {
  Sweep all{{}, {}, true};
  for (const PositionerAxis& axis : cell.robot.positioner) {
    const double range_rad = std::min(axis.max_rad - axis.min_rad, 2.0 * std::numbers::pi);
    all.half_rad.push_back(range_rad / 2.0);
    all.middle_rad.push_back(axis.min_rad + range_rad / 2.0);
  }
  const Sweeps sweeps(cell);
  return resting_posture(cell.robot,
                         [&](const JointVector& rest) { return !sweeps.met(all, kRoomM, rest); });
}

std::vector<std::vector<double>> settings_of(const Robot& robot) {
  const bool two = robot.positioner.size() > 1;
  std::vector<std::vector<double>> settings;
  for (int k = 0; k < (two ? kSettingsOfTwo : kSettingsOfOne); ++k) {
    std::vector<double> angles;
    for (std::size_t j = 0; j < robot.positioner.size(); ++j) {
      const PositionerAxis& axis = robot.positioner[j];
      const double margin = std::min(kInsideLimitsRad, (axis.max_rad - axis.min_rad) / 4.0);
      const double low = std::clamp(-kMostTurnRad, axis.min_rad + margin, axis.max_rad - margin);
      const double high = std::clamp(kMostTurnRad, low, axis.max_rad - margin);
      angles.push_back(k == 0 ? std::clamp(0.0, low, high)
                              : low + (high - low) * radical_inverse(k, j == 0 ? 2 : 3));
    }
    settings.push_back(std::move(angles));
  }
  return settings;
}

Plan make_positioner_plan(const Cell& cell, const PlanOptions& stated, const JointVector& from) {
  const PlanOptions options = with_tolerances(stated, cell);
  const auto targets = static_cast<int>(std::ranges::count_if(
      cell.targets, [](const Target& target) { return is_planned(target, kTouched); }));
  if (options.fit_touches < 1 || options.check_touches < 0)
    throw PlanError(PlanError::Kind::kRequest, "a plan needs at least one fit touch");
  const JointVector start = from.empty() ? waiting_posture(cell) : from;
  const SettingPools settings(cell, options, start);
  if (settings.candidates().empty())
    throw PlanError(PlanError::Kind::kTooFew,
                    "no touch can be reached at any setting of the positioner. Check the targets' "
                    "centre_mm, which are in the frame of their axis, and the limits");
  std::optional<Part> part(std::in_place, PlanStep::kChoose, kReachShare, kRefinedShare);
  const Choice choice = choose_at_settings(cell, options, targets, settings);
  part.emplace(PlanStep::kWays, kRefinedShare, 1.0);
  std::vector<std::vector<ToVisit>> todo(settings.all().size());
  for (const Picked& one :
       with_check_touches(cell, settings.candidates(), choice.picked, settings.candidates().size(),
                          targets, options, [&](std::size_t i) { return settings.connected(i); }))
    todo[settings.setting_of(one.candidate)].push_back(
        {settings.with_ways(one.candidate), one.set});
  Plan plan = visits_in_turn(cell, options, settings, std::move(todo), start);
  foresee(choice, options, plan);
  for (const Target& target : cell.targets)
    if (!is_planned(target, kTouched)) plan.left_out.push_back(target.id);
  return plan;
}

}  // namespace cellcal::calib
