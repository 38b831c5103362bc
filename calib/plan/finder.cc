#include "calib/plan/finder.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <span>
#include <utility>

#include "calib/model/inverse.h"
#include "calib/model/long_work.h"
#include "calib/model/units.h"
#include "calib/plan/centre_particles.h"
#include "calib/plan/pool.h"
#include "calib/plan/positioner_plan.h"
#include "calib/plan/search_line.h"
#include "calib/plan/track.h"

namespace cellcal::calib {

bool must_find(const Cell& cell) {
  return std::ranges::any_of(cell.targets, [](const Target& target) {
    return target.kind == TargetKind::kSphere && !target.has_centre;
  });
}

double found_sigma_m(double arm_sigma_m) { return 1.25 * arm_sigma_m; }

double most_centre_sigma_m(double radius_m) {
  constexpr double kMostPassed = 0.02;
  return radius_m / std::sqrt(-2.0 * std::log(kMostPassed));
}

namespace {

using Eigen::Vector3d;

/// Typical number of touches to find a sphere (tests/experiments, finding).
constexpr int kTypicalHits = 7;
constexpr int kMostLines = 600;
/// Minimum hit probability of a line, in increasing effort: a line below it is used only if no other
/// is feasible. The wider the particles spread, the fewer of them a single line meets, and the fewer
/// lines avoid them: lines with lower thresholds are tried before a sphere is given up, with the
/// effort doubled each time. For a sphere that is small relative to the spread, thresholds scale
/// accordingly.
constexpr double kLeastShare[] = {0.03, 0.02, 0.01, 0.005};
constexpr int kEfforts = std::size(kLeastShare);

constexpr double kStandoffM = 0.014, kClearM = 0.022;  ///< outside of all particles and kWrongM
constexpr int kPerAim = 60;
/// Lateral aims around the mean, while the lateral position is uncertain: this many per radius of
/// the spread (2 sigma), of which a single line excludes little.
constexpr double kMoreAims = 8.0;
constexpr double kOpen = 0.5;            ///< of the radius
constexpr std::size_t kEvaluated = 600;  ///< particles that a line is evaluated on
/// Before the first contact: an inclined shaft comes close to what the tip passes.
constexpr double kMostTiltRad = 0.35;
constexpr double kUsualStandM = 0.030;
/// Diameter of an unstated stand at the sphere, relative to the sphere's diameter.
constexpr double kStandShare = 0.5;
constexpr int kShortenings = 8;
constexpr double kShorter = 0.2;  ///< of the remaining line, per step
constexpr double kNearer = 0.8;   ///< of a linear unit's range, per step
/// Share of the radius: a sphere at this distance from the line is met.
constexpr double kMetShare = 0.9;

struct Line {
  Candidate candidate;
  Vector3d aim;
  SearchDepth depth;
  double share = 0.0;  ///< share of particles met; an upper bound until the search is known
  double gain = 1.0;   ///< once it was met: expected variance reduction over share
  std::optional<LedSearch> led{};
  double score() const { return share * gain; }
};

std::vector<double> known_setting(const Robot& robot, std::vector<double> positioner_rad) {
  if (positioner_rad.empty()) return settings_of(robot).front();
  if (positioner_rad.size() != robot.positioner.size())
    throw PlanError(PlanError::Kind::kRequest, "the angles of the positioner's axes are not known");
  return positioner_rad;
}

}  // namespace

struct Finder::Impl {
  Cell stated;
  std::vector<double> positioner_rad;
  Cell cell;  ///< as located, in the base frame
  PlanOptions options;
  ArmModel arm;
  TrackOff unit;
  double arm_sigma_m;
  std::vector<Sought> sought;
  std::optional<PlannedTouch> planned;
  JointVector planned_from;       ///< a different start needs a different path
  std::optional<Candidate> last;  ///< the arm is at its clear point
  Vector3d line_from = Vector3d::Zero(), line_to = Vector3d::Zero();

  Impl(const Cell& file, const PlanOptions& how, bool all, const std::vector<Touch>& made,
       std::vector<double> setting)
      : stated(file),
        positioner_rad(std::move(setting)),
        cell(at_setting(stated, positioner_rad)),
        options(how),
        arm(planning_arm(cell)),
        unit(cell.robot),
        arm_sigma_m(calib::arm_sigma_m(cell)) {
    for (std::size_t t = 0; t < cell.targets.size(); ++t) {
      const Target& target = cell.targets[t];
      if (target.kind != TargetKind::kSphere || (target.has_centre && !all)) continue;
      if (!target.has_centre && !target.has_box)
        throw PlanError(
            PlanError::Kind::kCell, target.id,
            fmt::format("target {}: its place is unknown. Add centre_mm, or search_low_mm and "
                        "search_high_mm, to the cell file",
                        target.id));
      const double radius = target.diameter_m / 2.0 + cell.tool.tip_radius_m;
      const Eigen::Isometry3d carrier = carried_at(stated.robot, carriers(t, positioner_rad));
      sought.push_back({t, radius, carrier,
                        CentreParticles(stated.targets[t], radius, arm_sigma_m, options.seed,
                                        carrier, target.off_m)});
    }
    for (const Touch& touch : made)
      if (Sought* one = find(touch.target)) take(*one, std::nullopt, touch);
    locate();
  }

  /// Angles of the axes that carry a target.
  std::span<const double> carriers(std::size_t target, const std::vector<double>& angles) const {
    return std::span(angles).first(static_cast<std::size_t>(stated.targets[target].carried_by));
  }

  /// The nominal tip of a touch, as its target is carried now.
  Vector3d tip_of(const Sought& one, const Touch& touch) const {
    const Eigen::Isometry3d carrier =
        carried_at(stated.robot, carrier_rad(touch, stated.targets[one.target]));
    return one.carrier * (carrier.inverse() * arm.nominal_tcp(touch.joint_rad).translation());
  }

  Sought* find(const std::string& id) {
    for (Sought& one : sought)
      if (cell.targets[one.target].id == id && !one.found) return &one;
    return nullptr;
  }
  Sought* current() {
    for (Sought& one : sought)
      if (!one.found) return &one;
    return nullptr;
  }

  Cell located() const {
    Cell all = stated;
    for (const Sought& one : sought) {
      Target& target = all.targets[one.target];
      target.has_centre = true;
      target.centre_m = one.carrier.inverse() * (one.found ? one.centre_m : one.particles.mean());
      if (one.found) target.centre_sigma_m = 0.0;  // determined by touches that count themselves
      const auto seen = carriers(one.target, one.found ? one.seen_rad : positioner_rad);
      target.taught_rad.assign(seen.begin(), seen.end());
    }
    return all;
  }

  void locate() {
    cell = at_setting(located(), positioner_rad);
    // Their particles have it.
    for (const Sought& one : sought)
      if (!one.found) cell.targets[one.target].off_m = 0.0;
  }

  void take(Sought& one, const std::optional<Vector3d>& from, const Touch& touch) {
    const Vector3d tip = tip_of(one, touch);
    one.seen_rad = touch.positioner_rad;
    one.touched(from.value_or(tip), tip, stated.targets[one.target]);
    locate();
  }

  static void swell(Target& target, const Ball& ball) {
    target.centre_m = ball.centre_m;
    const double wider = 2.0 * ball.beyond_m;
    if (target.stand_diameter_m <= 0.0)
      target.stand_diameter_m = std::min(kUsualStandM, target.diameter_m);
    target.stand_diameter_m += wider;
    target.diameter_m += wider;
  }

  /// The spheres as another Finder without this knowledge assumes them.
  Cell as_stated() const {
    Cell result = cell;
    for (const Sought& one : sought)
      swell(result.targets[one.target], ball_of_prior(one.particles));
    result.lengths.clear();
    return result;
  }

  /// All spheres enlarged to contain all their possible places.
  Cell swollen(std::optional<std::size_t> without) const {
    Cell result = cell;
    for (const Sought& one : sought)
      if (!one.found) swell(result.targets[one.target], one.ball);
    if (without)
      result.targets.erase(result.targets.begin() + static_cast<std::ptrdiff_t>(*without));
    result.lengths.clear();
    return result;
  }

  SearchStand stand_of(const Target& target) const {
    const double thick = target.stand_diameter_m > 0.0
                             ? target.stand_diameter_m
                             : std::min(kUsualStandM, kStandShare * target.diameter_m);
    if (!target.has_stand) return {Vector3d::UnitZ(), 0.0};
    return {stand_up(cell.robot, target), thick / 2.0};
  }

  /// Largest standard deviation of the particles relative to the radius that a line meets.
  static double openness(const Sought& one) {
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(one.particles.covariance(),
                                                                Eigen::EigenvaluesOnly);
    return std::sqrt(solver.eigenvalues()[2]) / one.radius_m;
  }

  static double least_share(const Sought& one, int effort) {
    return kLeastShare[effort] / std::max(1.0, std::pow(openness(one), 2));
  }

  /// The arm with its linear unit about where it is opposite to the sphere, and where its own prior moves the tip
  /// by less than the error of the nominal arm.
  ArmModel near_it(const Sought& one) const {
    if (!unit.any()) return arm;
    Robot robot = arm.robot();
    Joint& track = robot.joints[0];
    const TrackOff::Place place = unit.place(one.particles.mean());
    const double most_m = std::hypot(unit.off_m(place, place.opposite_m), 3.0 * arm_sigma_m);
    double half_m = track.max_rad - track.min_rad;
    while (unit.off_m(place, place.opposite_m + half_m) > most_m) half_m *= kNearer;
    track.min_rad = std::max(track.min_rad, place.opposite_m - half_m);
    track.max_rad = std::min(track.max_rad, place.opposite_m + half_m);
    return {robot, arm.tool()};
  }

  /// `effort`: 0, increased if the lines of less effort fail. Lines that meet at least the share `least` of the
  /// particles.
  std::vector<Line> lines(Sought& one, int effort, double least) const {
    const Vector3d middle = one.particles.mean();
    const auto& all = one.particles.places();
    std::vector<Vector3d> some;
    const std::size_t step = std::max<std::size_t>(1, all.size() / kEvaluated);
    for (std::size_t k = 0; k < all.size(); k += step) some.push_back(all[k]);
    std::vector<Vector3d> aims{middle};
    const unsigned seed = options.seed + static_cast<unsigned>(one.lines + effort * kMostLines);
    Random random(seed);
    const double open = 2.0 * openness(one);
    if (open > kOpen)
      for (int k = 0; k < static_cast<int>(kMoreAims * std::max(1.0, open)) * (1 + effort); ++k)
        aims.push_back(some[random.below(some.size())]);
    const Vector3d in_tool = shaft_in_tool(cell.tool);
    const SearchStand stand = stand_of(cell.targets[one.target]);
    const ArmModel near = near_it(one);
    std::vector<Line> result;
    for (const Vector3d& aim : aims) {
      poll_cancelled();
      Cell alone = cell;
      alone.targets = {cell.targets[one.target]};
      Target& target = alone.targets.front();
      target.centre_m = aim;
      PlanOptions how = options;
      how.standoff_m = how.beyond_m = how.clear_m = 1e-3;  // search() determines where lines begin
      how.seed = seed;
      for (Candidate& c :
           find_candidates(alone, near, Clearance::blind(), how, kPerAim << effort)) {
        const Vector3d shaft = c.orientation * in_tool;
        if (one.tips.empty() && shaft.dot(-c.normal) < std::cos(kMostTiltRad)) continue;
        Line line;
        line.depth = search_depth({aim, c.normal, shaft}, some,
                                  cell.targets[one.target].diameter_m / 2.0, stand, cell.tool);
        if (line.depth.share < least) continue;
        line.share = line.depth.share;
        if (!one.tips.empty())
          line.gain = expected_reduction_m2(line.depth, some, arm_sigma_m) / line.share;
        line.depth.met_m.clear();
        line.aim = aim;
        c.target = one.target;
        line.candidate = std::move(c);
        result.push_back(std::move(line));
      }
    }
    return result;
  }

  /// Distance from the aim, along the normal, at which the line leaves a ball that contains the
  /// aim.
  static double leaves_m(const Line& line, const Vector3d& centre_m, double radius_m) {
    const Vector3d off = line.aim - centre_m;
    const double along = off.dot(line.candidate.normal);
    return -along +
           std::sqrt(std::max(0.0, radius_m * radius_m - off.squaredNorm() + along * along));
  }

  /// Share of the particles that the tip meets on its way.
  static double met_share(const Sought& one, const Vector3d& from, const Vector3d& to) {
    const auto& places = one.particles.places();
    const auto met = std::count_if(places.begin(), places.end(), [&](const Vector3d& place) {
      return CentreParticles::distance_m(place, from, to) < kMetShare * one.radius_m;
    });
    return static_cast<double>(met) / static_cast<double>(places.size());
  }

  /// Completes the search if it is feasible and clear; the line's score is then what it meets. Ends
  /// earlier if the arm cannot reach the line's end.
  bool search(Line& line, const Sought& one, const Clearance& clearance,
              const Clearance& others) const {
    Candidate& c = line.candidate;
    const Ball& ball = one.ball;
    const double outside = one.radius_m + ball.beyond_m;
    const LineLeader leader(arm, cell.tool, options.limit_margin_rad);
    const LineToLead wanted{line.aim, c.normal, c.orientation, c.contact};
    const double before_m = unit.widened_m(kStandoffM, ball.centre_m, c.contact);
    const double clear_m = kClearM + (before_m - kStandoffM);
    LineEnds ends{leaves_m(line, ball.centre_m, outside + clear_m),
                  leaves_m(line, ball.centre_m, outside + before_m), line.depth.end_m};
    std::optional<LedSearch> led;
    for (int k = 0; k <= kShortenings; ++k) {
      if ((led = leader.lead(wanted, ends))) break;
      ends.end_m += kShorter * (ends.standoff_m - ends.end_m);
    }
    if (!led) return false;
    if (ends.end_m > line.depth.end_m)
      line.share = std::min(line.share, met_share(one, led->from, led->to));
    if (!clearance.clear(led->standoff) || !clearance.clear(led->clear) ||
        !others.clear(led->clear, led->end))
      return false;
    c.standoff = led->standoff;
    c.end = led->end;
    c.clear = led->clear;
    led->expected_m = std::min(ends.standoff_m - ends.end_m, ends.standoff_m - one.radius_m);
    line.led = std::move(led);
    return true;
  }

  /// Straight away from the sphere's possible places, or from contact: back along the approach, or
  /// in a direction in which neither tip nor shaft comes closer to any of its places.
  std::optional<JointVector> way_out(const Sought& one, const JointVector& from,
                                     const Clearance& clearance, const Clearance& others) const {
    const Eigen::Isometry3d here = arm.nominal_tcp(from);
    const Vector3d tip = here.translation();
    const Vector3d shaft = here.linear() * shaft_in_tool(cell.tool);
    const Vector3d flange = tip - cell.tool.tcp.translation().norm() * shaft;
    // Clearly outwards from every place, for tip and flange; and not down along its stand.
    constexpr double kOutwards = 0.2;  // cosine
    const SearchStand stand = stand_of(cell.targets[one.target]);
    const auto leads_away = [&](const Vector3d& direction) {
      if (stand.radius_m > 0.0 && direction.dot(stand.up) < 0.0) return false;
      return std::all_of(one.particles.places().begin(), one.particles.places().end(),
                         [&](const Vector3d& place) {
                           const Vector3d to_tip = tip - place, to_flange = flange - place;
                           return to_tip.dot(direction) >= kOutwards * to_tip.norm() &&
                                  to_flange.dot(direction) >= 0.0;
                         });
    };
    std::vector<Vector3d> directions;
    if (last && last->target == one.target) {  // on its line: reverse of the approach
      const Vector3d off = tip - arm.nominal_tcp(last->clear).translation();
      if ((off - off.dot(last->normal) * last->normal).norm() <= 2.0 * kMostBowM)
        directions.push_back(last->normal);
    }
    for (const Vector3d& direction :
         {Vector3d((tip - one.particles.mean()).stableNormalized()), Vector3d(-shaft)})
      if (leads_away(direction)) directions.push_back(direction);
    const LineLeader leader(arm, cell.tool, options.limit_margin_rad);
    constexpr double kFirstM = 0.02, kLastM = 0.2;
    for (const Vector3d& direction : directions)
      for (double further = kFirstM; further < kLastM; further *= 2.0) {
        Eigen::Isometry3d pose = here;
        pose.translation() = tip + further * direction;
        auto q = inverse(arm, pose, from, options.limit_margin_rad);
        if (q && leader.bow_m(from, *q).norm() <= kMostBowM && clearance.clear(*q) &&
            others.clear(from, *q))
          return q;
      }
    return std::nullopt;
  }

  PlannedTouch taken(Sought& one, Line line, std::vector<JointVector> way) {
    const LedSearch& led = *line.led;
    PlannedTouch touch;
    touch.target = cell.targets[one.target].id;
    touch.normal = line.candidate.normal;
    touch.transit = std::move(way);
    touch.standoff = led.standoff;
    touch.end = led.end;
    touch.clear = led.clear;
    touch.search_m = (led.to - led.from).norm();
    touch.expected_m = led.expected_m;
    touch.may_miss = true;
    touch.positioner_rad = positioner_rad;
    line_from = led.from;
    line_to = led.to;
    ++one.lines;
    last = std::move(line.candidate);
    return touch;
  }

  std::optional<PlannedTouch> offer(Sought& one, const JointVector& from) {
    const std::string& id = cell.targets[one.target].id;
    const auto not_found = [&](const std::string& why, const std::string& advice) {
      return PlanError(
          PlanError::Kind::kNotFound, id,
          fmt::format("sphere {} was not found after {} searches and {} touches: {}. {}", id,
                      one.lines, one.tips.size(), why, advice));
    };
    const std::string check_place =
        one.tips.empty()
            ? "Check where the cell file says it is (centre_mm and centre_sigma_mm, or "
              "search_low_mm and search_high_mm) and its diameter"
            : advice_after_touches(arm_sigma_m);
    if (one.particles.empty())
      throw not_found(one.tips.empty() ? "it is in none of the places searched"
                                       : "no sphere of its diameter agrees with what was met",
                      check_place);
    if (one.lines >= kMostLines)
      throw not_found(fmt::format("the limit is {} searches", kMostLines), check_place);
    const Cell around = swollen(std::nullopt), rest = swollen(one.target);
    const Clearance clearance(around, arm), others(rest, arm);
    const JointVector resting = resting_posture(cell.robot, clearance);
    Router router(around, arm, clearance, resting, options.limit_margin_rad);
    JointVector at = from;
    std::vector<JointVector> out;
    if (!clearance.clear(from)) {
      const auto outside = way_out(one, from, clearance, others);
      if (!outside)
        throw PlanError(PlanError::Kind::kArmStands, id,
                        fmt::format("the arm is where sphere {} may be. Jog it well away", id));
      out.push_back(*outside);
      at = *outside;
    }
    if (last) router.connect(*last);  // the obstacles are known better by now
    bool any = false;
    for (int effort = 0; effort < kEfforts; ++effort) {
      if (effort > 0) router.mark_hard(one.target);
      const double least = least_share(one, effort);
      std::vector<Line> possible = lines(one, effort, least);
      const auto worse = [](const Line& a, const Line& b) { return a.score() < b.score(); };
      std::make_heap(possible.begin(), possible.end(), worse);
      while (!possible.empty()) {
        poll_cancelled();
        std::pop_heap(possible.begin(), possible.end(), worse);
        Line line = std::move(possible.back());
        possible.pop_back();
        if (!line.led) {  // the actual share may be lower, and another line better
          if (!search(line, one, clearance, others) || line.share < least) continue;
          possible.push_back(std::move(line));
          std::push_heap(possible.begin(), possible.end(), worse);
          continue;
        }
        any = true;
        if (!router.connect(line.candidate)) continue;
        const auto way = router.to_standoff(at, last ? &*last : nullptr, line.candidate);
        if (!way) continue;
        out.insert(out.end(), way->begin(), way->end());
        return taken(one, std::move(line), std::move(out));
      }
    }
    const std::string room = fmt::format(
        "It may be anywhere within {:.0f} mm: measure its place better, or give the arm more room "
        "around it",
        one.particles.reach_m(one.particles.mean()) * 1e3);
    throw not_found(
        any ? "no clear way to another search from the arm's position"
            : fmt::format("no search inside the joint limits and clear of all else meets {:g} % or "
                          "more of the places where it may be",
                          100.0 * least_share(one, kEfforts - 1)),
        room);
  }
};

Finder::Finder(const Cell& cell, const PlanOptions& options, bool all,
               const std::vector<Touch>& made, std::vector<double> positioner_rad)
    : impl_((require_any_turn(cell.robot),
             make_hidden<Impl>(cell, options, all, made,
                               known_setting(cell.robot, std::move(positioner_rad))))) {}

std::optional<std::size_t> Finder::seeking() const {
  const Sought* one = impl_->current();
  return one == nullptr ? std::nullopt : std::optional(one->target);
}

double Finder::centre_sigma_m(std::size_t target) const {
  const auto one = std::ranges::find(impl_->sought, target, &Sought::target);
  const double least_m = found_sigma_m(impl_->arm_sigma_m);
  return one == impl_->sought.end() ? least_m : std::max(least_m, one->sigma_m);
}

bool Finder::done() const { return impl_->current() == nullptr; }

std::optional<PlannedTouch> Finder::next(const JointVector& from) {
  Impl& me = *impl_;
  Sought* one = me.current();
  if (one == nullptr) return std::nullopt;
  if (!me.planned || me.planned_from != from) {
    me.planned = me.offer(*one, from);
    me.planned_from = from;
  }
  return me.planned;
}

void Finder::touched(const Touch& touch) {
  impl_->planned.reset();
  if (Sought* one = impl_->find(touch.target)) impl_->take(*one, impl_->line_from, touch);
}

void Finder::missed() {
  impl_->planned.reset();
  if (Sought* one = impl_->current()) {
    one->particles.miss(impl_->line_from, impl_->line_to);
    one->shrink_ball();
  }
  impl_->locate();
}

void Finder::failed() { impl_->planned.reset(); }

bool Finder::leads_out(const JointVector& from) const {
  const Sought* one = impl_->current();
  if (one == nullptr) return false;
  const Cell around = impl_->swollen(std::nullopt), rest = impl_->swollen(one->target);
  const Clearance clearance(around, impl_->arm), others(rest, impl_->arm);
  if (clearance.clear(from)) return false;  // in contact with another object
  return impl_->way_out(*one, from, clearance, others).has_value();
}

bool Finder::is_clear_at(const JointVector& at) const {
  const Cell around = impl_->swollen(std::nullopt);
  return Clearance(around, impl_->arm).clear(at);
}

bool Finder::is_clear_except_sought(const JointVector& from,
                                    const std::vector<JointVector>& way) const {
  Cell others = impl_->cell;
  std::erase_if(others.targets, [&](const Target& target) { return impl_->find(target.id); });
  others.lengths.clear();
  const Clearance clearance(others, impl_->arm);
  const JointVector* last = &from;
  for (const JointVector& next : way) {
    if (!clearance.clear(*last, next)) return false;
    last = &next;
  }
  return true;
}

std::vector<JointVector> Finder::way_home(const JointVector& from) const {
  const Impl& me = *impl_;
  if (!me.last || !is_at(me.last->clear, from)) return {};
  const Cell around = me.swollen(std::nullopt), stated = me.as_stated();
  const Clearance clearance(around, me.arm);
  const JointVector rest = resting_posture(me.cell.robot, Clearance(stated, me.arm));
  const Router router(around, me.arm, clearance, rest, me.options.limit_margin_rad);
  Candidate leaving = *me.last;
  if (!router.connect(leaving)) leaving.to_rest.clear();
  return router.away(leaving, rest).value_or(std::vector<JointVector>{});
}

int Finder::touches_left() const {
  int left = 0;
  for (const Sought& one : impl_->sought)
    if (!one.found) left += std::max(1, kTypicalHits - static_cast<int>(one.tips.size()));
  return left;
}

const Cell& Finder::here() const { return impl_->cell; }

Cell Finder::located() const { return impl_->located(); }

const std::vector<double>& Finder::positioner_rad() const { return impl_->positioner_rad; }

Phrase Finder::stage() const {
  const Sought* one = impl_->current();
  if (one == nullptr) return {};
  const double spread = std::sqrt(one->particles.covariance().trace());
  return {"say.stage.finding",
          {{"target", impl_->cell.targets[one->target].id},
           {"touches", one->tips.size()},
           {"mm", 2.0 * spread * kMmPerM}}};
}

}  // namespace cellcal::calib
